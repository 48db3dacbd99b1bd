"""
Times of a day that a clock does not show: true solar time, standard time, and times of the sun.

``sunrise+1h`` and ``sunset-90min`` are of the sun's upper rim, as in almanacs (-0.833 degrees);
``altitude:10`` is when its middle passes that height, rising as a start and sinking as an end.
"""

import datetime as dt
import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal
from zoneinfo import ZoneInfo

import numpy as np

from umbra.errors import InputError
from umbra.sun.clock import parse_duration
from umbra.sun.local_time import find_instant
from umbra.sun.position import Daylight, find_daylight, find_sun
from umbra.sun.site import Site

__all__ = ["CLOCKS", "Clock", "DayClock", "find_solar_time", "is_of_the_sun"]

Clock = Literal["local", "standard", "solar"]
CLOCKS = {"local": "local clock", "standard": "standard time", "solar": "true solar time"}
"""The clocks in words."""
_EVENT = re.compile(r"(sunrise|sunset)\s*(?:([+-])\s*(\S.*))?|altitude\s*:\s*(-?\d+(?:\.\d+)?)")
_STEP = dt.timedelta(minutes=4)  # at which the sun's height is looked at
_UTC = ZoneInfo("UTC")


def is_of_the_sun(time: object) -> bool:
    """Return whether a time is one of the sun, such as ``sunrise+1h``; it is then well written."""
    return isinstance(time, str) and _EVENT.fullmatch(time.strip().lower()) is not None


def find_solar_time(site: Site, instant: dt.datetime) -> float:
    """
    Return the true solar time at a site: the sun's hour angle and 12 h.

    Parameters
    ----------
    site : Site
    instant : datetime.datetime
        With its offset.

    Returns
    -------
    hours : float
        In [0, 24) [h].
    """
    path = find_sun(site, [instant.astimezone(dt.UTC)], refraction="none")
    azimuth, altitude, latitude = (
        math.radians(angle) for angle in (path.azimuth[0] - 180.0, path.altitude[0], site.latitude)
    )
    # [Meeus, Astronomical Algorithms, ch. 13]: hour angle from the horizon's coordinates.
    away = math.cos(azimuth) * math.sin(latitude) + math.tan(altitude) * math.cos(latitude)
    return (12.0 + math.degrees(math.atan2(math.sin(azimuth), away)) / 15.0) % 24.0


@dataclass(frozen=True)
class DayClock:
    """
    Reader of the times of a day at a site.

    Parameters
    ----------
    site : Site
    clock : {'local', 'standard', 'solar'}
        The local clock; the same without daylight saving time; true solar time.
    """

    site: Site
    clock: Clock = "local"

    def find(self, day: dt.date, time: str | dt.time, what: str) -> dt.datetime:
        """
        Find the instant [UTC] of a time of a day.

        Parameters
        ----------
        day : datetime.date
        time : str or datetime.time
            ``HH:MM`` by the clock, ``sunrise+1h``, ``sunset-1h`` or ``altitude:10``.
        what : {'start', 'end'}
            Which of the two it is; an altitude is passed upward at the start.

        Raises
        ------
        InputError
            If there is no such time on the day.
        """
        text = str(time).strip().lower()
        if event := _EVENT.fullmatch(text):
            if event[4] is not None:
                return self._find_altitude(day, float(event[4]), what)
            return self._find_event(day, event[1], event[2], event[3])
        zone = ZoneInfo(self.site.zone)
        if self.clock == "local":
            return find_instant(day, time, zone, what)
        plain = find_instant(day, time, _UTC, what)  # the same digits, by no zone
        if self.clock == "standard":
            noon = dt.datetime.combine(day, dt.time(12), zone)
            offset = (noon.utcoffset() or dt.timedelta()) - (noon.dst() or dt.timedelta())
            return plain - offset
        return _find_solar(self.site, plain)

    def _find_event(
        self, day: dt.date, event: str, sign: str | None, past: str | None
    ) -> dt.datetime:
        light = _find_daylight(self.site, day)
        when = light.rises if event == "sunrise" else light.sets
        if when is None:
            msg = f"there is no {event} on {day}: {light}; give a clock time, or other dates"
            raise InputError(msg, date=day)
        shift = dt.timedelta()
        if past is not None:
            shift = parse_duration(past, f"time past {event}", "")
        return when.astimezone(dt.UTC) + (-shift if sign == "-" else shift)

    def _find_altitude(self, day: dt.date, altitude: float, what: str) -> dt.datetime:
        """Find when the sun's middle passes an apparent altitude, rising as a start."""
        zone = ZoneInfo(self.site.zone)
        low = find_instant(day, "00:00", zone, "start")
        high = find_instant(day, "24:00", zone, "end")
        count = (high - low) // _STEP + 1
        times = [low + k * _STEP for k in range(count)]
        above = find_sun(self.site, times).altitude >= altitude
        which = np.flatnonzero(above)
        if (
            not len(which)
            or (what == "end" and which[-1] + 1 >= count)
            or (what == "start" and which[0] == 0)
        ):
            never = "does not reach" if not len(which) else "is always above"
            msg = f"the sun {never} {altitude:g}° on {day}; give a clock time, or other dates"
            raise InputError(msg, date=day)
        k = int(which[0]) if what == "start" else int(which[-1])
        below, up = (times[k - 1], times[k]) if what == "start" else (times[k + 1], times[k])
        while abs(up - below) > dt.timedelta(milliseconds=100):
            middle = below + (up - below) / 2
            is_above = find_sun(self.site, [middle]).altitude[0] >= altitude
            below, up = (below, middle) if is_above else (middle, up)
        return up.replace(microsecond=up.microsecond // 1000 * 1000)


@lru_cache(maxsize=1024)
def _find_daylight(site: Site, day: dt.date) -> Daylight:
    return find_daylight(site, day)


def _find_solar(site: Site, plain: dt.datetime) -> dt.datetime:
    """Find the instant at which true solar time shows the digits of ``plain``."""
    if abs(site.latitude) >= 90:
        msg = "there is no solar time at a pole; give clock='standard'"
        raise InputError(msg, option="clock")
    midnight = plain.replace(hour=0, minute=0, second=0, microsecond=0)
    wanted = (plain - midnight).total_seconds() / 3600
    found = plain - dt.timedelta(hours=site.longitude / 15.0)
    for _ in range(4):  # the equation of time changes by half a minute a day
        off = (find_solar_time(site, found) - wanted + 12.0) % 24.0 - 12.0
        found -= dt.timedelta(hours=off)
    return found
