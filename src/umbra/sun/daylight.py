"""The sun of a date: sunrise and sunset as almanacs tell them, and its light at a clock time."""

import datetime as dt
from dataclasses import dataclass
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene import Light, directional_light
from umbra.sun.local_time import find_instant, parse_date
from umbra.sun.position import find_sun
from umbra.sun.site import Site, find_zone

__all__ = ["Daylight", "find_daylight", "sun_light"]

RIM = -0.26667
"""Altitude of the sun's centre when its upper rim is on the horizon [degrees]."""
_LOOK = 300_000_000  # between the instants at which the sun is looked for [us]
_CLOSE = 1_000_000  # to which sunrise and sunset are solved [us]


@dataclass(frozen=True)
class Daylight:
    """When the sun is above the horizon on a date."""

    rises: dt.datetime | None  # local, as sets; None where the sun does not rise or set that day
    sets: dt.datetime | None
    is_up: bool  # whether it is up when the date begins

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


def sun_light(site: Site, date: str | dt.date, time: str | dt.time) -> Light:
    """
    Make the light of the sun at a clock time.

    Parameters
    ----------
    site : Site
    date : str or datetime.date
        Local date, ``"2026-03-21"``.
    time : str or datetime.time
        Local clock time, ``"15:00"``.

    Returns
    -------
    light : Light
        A direction toward the apparent sun, in the model's axes.

    Raises
    ------
    InputError
        If the date or the time is not written so, the clock skips the time, or the sun is
        below the horizon then.

    Examples
    --------
    >>> light = umbra.sun_light(umbra.find_site(scene), "2026-03-21", "15:00")
    """
    day = parse_date(date)
    path = find_sun(site, [find_instant(day, time, find_zone(site.zone), "time")])
    if not path.is_up[0]:
        msg = (
            f"the sun is {-path.altitude[0]:.1f}° below the horizon on {day} at {time} "
            f"({site.zone}); choose another time"
        )
        raise InputError(msg, altitude=float(path.altitude[0]))
    return directional_light(path.direction[0])
