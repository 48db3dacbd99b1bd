"""Sunrise and sunset of a date on the local clock, as almanacs tell them."""

import datetime as dt
from dataclasses import dataclass
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

from umbra.sun.local_time import find_instant
from umbra.sun.position import find_sun
from umbra.sun.site import Site

__all__ = ["Daylight", "find_daylight"]

RIM = -0.26667
"""Altitude of the sun's centre when its upper rim is on the horizon [degrees]."""
_LOOK = 300_000_000  # between the instants at which the sun is looked for [us]
_CLOSE = 1_000_000  # to which sunrise and sunset are solved [us]


@dataclass(frozen=True)
class Daylight:
    """
    When the sun is above the horizon on a date.

    Parameters
    ----------
    rises, sets : datetime.datetime, optional
        Local; None where the sun does not rise or set on that date.
    is_up : bool
        Whether it is up when the date begins.
    """

    rises: dt.datetime | None
    sets: dt.datetime | None
    is_up: bool

    def __str__(self) -> str:
        """Say when it rises and sets: "sunrise 06:05, sunset 18:14"."""
        told = [
            f"{name} {_round_to_minute(when):%H:%M}"
            for name, when in (("sunrise", self.rises), ("sunset", self.sets))
            if when is not None
        ]
        if told:
            return ", ".join(told)
        return "the sun does not set" if self.is_up else "the sun does not rise"


def find_daylight(site: Site, day: dt.date) -> Daylight:
    """
    Find when the sun rises and sets on a local date, to a second.

    Its upper rim is then seen on a level horizon through standard air, as in almanacs.
    Shadows are cast while its centre is up, some two minutes less on each side.

    Parameters
    ----------
    site : Site
    day : datetime.date

    Returns
    -------
    daylight : Daylight
    """
    zone = ZoneInfo(site.zone)

    def is_up(times: NDArray[np.int64]) -> NDArray[np.bool_]:
        return find_sun(site, times.view("datetime64[us]")).altitude > RIM

    start = dt.datetime.combine(day, dt.time(), zone).astimezone(dt.UTC)
    end = find_instant(day, "24:00", zone, "end")
    first, last = (round(when.timestamp() * 1e6) for when in (start, end))
    times = np.arange(first, last + _LOOK, _LOOK)
    up = is_up(times)
    change = np.flatnonzero(up[1:] != up[:-1])
    low, high = times[change], times[change + 1]
    while len(change) and (high - low).max() > _CLOSE:
        middle = (low + high) // 2
        is_low = is_up(middle) == up[change]
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)

    def find_first(rising: bool) -> dt.datetime | None:
        some = np.flatnonzero((up[change] != rising) & (low < last))
        if not len(some):
            return None
        when = int(low[some[0 if rising else -1]])
        return dt.datetime.fromtimestamp(when / 1e6, dt.UTC).astimezone(zone)

    return Daylight(find_first(rising=True), find_first(rising=False), bool(up[0]))


def _round_to_minute(when: dt.datetime) -> dt.datetime:
    return (when + dt.timedelta(seconds=30)).replace(second=0, microsecond=0)
