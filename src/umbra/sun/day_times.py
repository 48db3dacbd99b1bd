"""
Times of a day that a clock does not show: true solar time, standard time, and times of the sun.

``sunrise+1h`` and ``sunset-90min`` are of the sun's upper rim, as in almanacs (-0.833 degrees);
``altitude:10`` is when its middle passes that height, rising as a start and sinking as an end.
``morning``, ``noon``, ``afternoon`` and ``evening`` are parts of the day from sunrise to sunset.
"""

import datetime as dt
import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal
from zoneinfo import ZoneInfo

import numpy as np

from umbra.errors import InputError, check_type
from umbra.scene import Light, directional_light
from umbra.sun.clock import parse_duration
from umbra.sun.date_words import name_date
from umbra.sun.local_time import find_instant, parse_date
from umbra.sun.position import Daylight, find_daylight, find_sun
from umbra.sun.site import Site
from umbra.sun.zones import find_zone

__all__ = [
    "CLOCKS", "TIMES_OF_DAY", "Clock", "DayClock", "find_solar_time", "is_of_the_sun",
    "show_on_clock", "sun_light",
]  # fmt: skip

Clock = Literal["local", "standard", "solar"]
CLOCKS = {"local": "local clock", "standard": "standard time", "solar": "true solar time"}
"""The clocks in words."""
TIMES_OF_DAY = {"morning": -1 / 2, "noon": 0.0, "afternoon": 1 / 2, "evening": 5 / 6}
"""By name: how far from noon by the sun towards sunset, or towards sunrise where negative."""
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
            ``HH:MM`` by the clock, ``sunrise+1h``, ``sunset-1h``, ``altitude:10``, or one of
            ``TIMES_OF_DAY``.
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
        if text in TIMES_OF_DAY:
            return self._find_time_of_day(day, text)
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

    def _find_time_of_day(self, day: dt.date, name: str) -> dt.datetime:
        light = _find_daylight(self.site, day)
        if light.rises is None and light.sets is None and not light.is_up:
            msg = f"there is no {name} on {day}: {light}; give other dates"
            raise InputError(msg, date=day)
        noon = _find_solar(self.site, dt.datetime.combine(day, dt.time(12), dt.UTC))
        share = TIMES_OF_DAY[name]
        end = light.rises if share < 0 else light.sets
        half = dt.timedelta(hours=12)  # from noon to midnight, where the sun stays up till then
        if end is not None:
            half = min(abs(end.astimezone(dt.UTC) - noon), half)
        return noon + share * half

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
    instant = plain - dt.timedelta(hours=site.longitude / 15.0)
    for _ in range(4):  # the equation of time changes by half a minute a day
        off = (find_solar_time(site, instant) - wanted + 12.0) % 24.0 - 12.0
        instant -= dt.timedelta(hours=off)
    return instant


def _find_moment(site: Site, day: dt.date, time: str | dt.time, what: str) -> dt.datetime:
    """Find the instant of a time by the local clock, of the sun, or of the day."""
    if str(time).strip().lower() in TIMES_OF_DAY or is_of_the_sun(time):
        return DayClock(site).find(day, time, "start")
    return find_instant(day, time, find_zone(site.zone), what)


def show_on_clock(site: Site, day: dt.date, time: str) -> str:
    """Return a time of a day as the local clock shows it, ``HH:MM``, to the nearest minute."""
    if not (time.strip().lower() in TIMES_OF_DAY or is_of_the_sun(time)):
        return time
    when = _find_moment(site, day, time, "time") + dt.timedelta(seconds=30)
    return f"{when.astimezone(find_zone(site.zone)):%H:%M}"


def sun_light(site: Site, date: str | dt.date, time: str | dt.time | None = None) -> Light:
    """
    Make the light of the sun at a time of a day.

    Parameters
    ----------
    site : Site
    date : str or datetime.date
        Local date, ``"2026-03-21"``; without ``time`` with it, ``"2026-03-21T15:00"``.
    time : str or datetime.time, optional
        Local clock time, ``"15:00"``, or of the sun: ``"sunset-1h"``, ``"morning"``; see
        `DayClock.find`.

    Returns
    -------
    light : Light
        A direction toward the apparent sun, in the model's axes.

    Raises
    ------
    InputError
        If the date or the time is missing or not written so, the clock skips the time, or the
        sun is below the horizon then.

    Examples
    --------
    >>> light = umbra.sun_light(umbra.find_site(scene), "2026-03-21", "15:00")
    """
    check_type("site", site, Site)
    if time is None:
        date, _, time = str(date).strip().replace(" ", "T").partition("T")
        if not time:
            msg = "the sun needs a clock time; give time='15:00' or a date as 2026-03-21T15:00"
            raise InputError(msg, option="time")
    day = parse_date(date)
    path = find_sun(site, [_find_moment(site, day, time, "time")])
    if not path.is_up[0]:
        msg = (
            f"the sun is {-path.altitude[0]:.1f}° below the horizon on {name_date(day)} at {time} "
            f"({site.zone}); choose another time, or for a night lamps without a date"
        )
        raise InputError(msg, altitude=float(path.altitude[0]))
    return directional_light(path.direction[0])
