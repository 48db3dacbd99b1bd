"""The sun of a view, by date and clock at a site or by azimuth and altitude."""

import datetime as dt
import itertools
import math
from dataclasses import dataclass, replace
from functools import lru_cache
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import Horizon
from umbra.scene import Light, directional_light
from umbra.sun import Site, SunPath, find_daylight, find_sun

__all__ = [
    "DAY",
    "ProfilePeriod",
    "Sun",
    "Suns",
    "find_daily_suns",
    "find_day",
    "tell_daylight_hours",
]

DAY = 24 * 60
"""Minutes of a day's clock."""
_PATH_STEP = 5  # [min] between points of a day's path
_LOWEST = 0.05  # [degrees]; below, shadows are endless
_WINDS = [
    "N",
    "NNE",
    "NE",
    "ENE",
    "E",
    "ESE",
    "SE",
    "SSE",
    "S",
    "SSW",
    "SW",
    "WSW",
    "W",
    "WNW",
    "NW",
    "NNW",
]


@dataclass(frozen=True)
class Sun:
    """
    Adjustable sun.

    Parameters
    ----------
    shines : bool
        Whether the sun is switched on.
    site : Site, optional
        Site of the model.
    date : datetime.date
        Date at the site.
    minutes : float
        Site's clock time since midnight, in [0, 1440).
    azimuth, altitude : float
        Position without a site or with ``by_clock`` off [degrees].
    by_clock : bool
        Whether date and clock determine the position.
    color : (float, float, float)
        Linear RGB.
    bend : float
        Of its light, see `Light`.
    land : Horizon, optional
        Land far away, which hides the sun.
    """

    shines: bool = True
    site: Site | None = None
    date: dt.date = dt.date(2026, 3, 21)
    minutes: float = 15 * 60.0
    azimuth: float = 225.0
    altitude: float = 45.0
    by_clock: bool = True
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    bend: float = 1.0
    land: Horizon | None = None

    @property
    def has_clock(self) -> bool:
        """Whether the clock determines the position."""
        return self.by_clock and self.site is not None

    def place(self) -> tuple[float, float]:
        """Return azimuth, clockwise from true north, and altitude [degrees]."""
        if not self.has_clock:
            return self.azimuth, self.altitude
        path = find_sun(self.site, [self.when()])  # type: ignore[arg-type]
        return float(path.azimuth[0]), float(path.altitude[0])

    def tell_place(self) -> str:
        """Tell where it stands, in the words of the live page."""
        azimuth, altitude = self.place()
        if altitude <= 0:
            return f"the sun is {-altitude:.1f}° below the horizon"
        wind = _WINDS[round(azimuth / (360 / len(_WINDS))) % len(_WINDS)]
        behind = ", behind the land" if self.is_behind_land else ""
        return f"sun {altitude:.1f}° high in the {wind} ({azimuth:.1f}°){behind}"

    def direction(self) -> NDArray[np.float64]:
        """Return the unit vector toward the sun in the model's axes, (3,) float64."""
        azimuth, altitude = self.place()
        turn, up = np.radians([azimuth + self.true_north, altitude])
        return np.array([np.sin(turn) * np.cos(up), np.cos(turn) * np.cos(up), np.sin(up)])

    @property
    def is_up(self) -> bool:
        """Whether it is switched on and above a level horizon, before the land or behind it."""
        return self.shines and self.place()[1] >= _LOWEST

    @property
    def is_behind_land(self) -> bool:
        """Whether the land hides it."""
        if self.land is None:
            return False
        return bool(self.land.covers(self.direction()[None], self.true_north)[0])

    @property
    def true_north(self) -> float:
        """Azimuth of true north in the model's plan [degrees]."""
        return 0.0 if self.site is None else self.site.true_north

    def light(self) -> Light | None:
        """Return the sun's light; None at night, behind the land or if switched off."""
        if not self.is_up or self.is_behind_land:
            return None
        return replace(directional_light(self.direction(), color=self.color), bend=self.bend)

    def when(self) -> dt.datetime:
        """Return the time in the site's zone; of an ambiguous clock time, the first."""
        return _find_moment(self.site, self.date, self.minutes)

    def clock(self) -> str:
        """Return the clock time as HH:MM."""
        whole = int(self.minutes + 0.5) % DAY
        return f"{whole // 60:02}:{whole % 60:02}"

    def pass_time(self, minutes: float) -> "Sun":
        """Advance time, wrapping at midnight to the same day."""
        if self.has_clock:
            return replace(self, minutes=(self.minutes + minutes) % DAY)
        return replace(self, azimuth=(self.azimuth + minutes / 4) % 360.0)

    def play(self, minutes: float) -> "Sun":
        """Advance time, skipping from sunset to sunrise."""
        later = self.pass_time(minutes)
        if not later.has_clock or later.place()[1] > 0:
            return later
        times, path = find_day(self.site, self.date)
        return replace(later, minutes=float(times[path.is_up][0])) if path.is_up.any() else later

    def point_at(self, direction: NDArray[np.float64]) -> "Sun":
        """Move to a direction (3,), at least a degree above the horizon; leaves the clock."""
        unit = direction / np.linalg.norm(direction)
        azimuth = float(np.degrees(np.arctan2(unit[0], unit[1])) - self.true_north) % 360.0
        altitude = float(np.degrees(np.arcsin(np.clip(unit[2], -1.0, 1.0))))
        return replace(self, azimuth=azimuth, altitude=max(altitude, 1.0), by_clock=False)


@dataclass(frozen=True)
class ProfilePeriod:
    """Period of the day: start, end and step, in minutes of the site's clock."""

    start: float = 9 * 60.0
    end: float = 17 * 60.0
    every: float = 60.0

    def __post_init__(self) -> None:
        if not (0 <= self.start < self.end <= DAY and 1 <= self.every <= DAY):
            msg = (
                f"a period from {self.start:g} to {self.end:g} min by {self.every:g} is none; "
                "it begins before it ends, between 0 and 1440, by steps of 1 or more"
            )
            raise InputError(msg)


@dataclass(frozen=True, eq=False)
class Suns:
    """The suns of a period above the horizon, and above the land."""

    directions: NDArray[np.float64]
    """(n, 3): toward each, in the model's axes, at the middle of its step."""
    hours: NDArray[np.float64]
    """(n,): how long each step is."""
    step: float
    """From one to the next [h]."""
    behind_land: float = 0.0
    """How long the sun is up behind the land, whose shadow is everywhere [h]."""

    @property
    def total(self) -> float:
        """How long the sun is up [h]."""
        return float(self.hours.sum()) + self.behind_land


@lru_cache(maxsize=8)
def find_daily_suns(
    site: Site, date: dt.date, period: ProfilePeriod, land: Horizon | None = None
) -> Suns:
    """Find the suns at the midpoints of a period's steps, as in a study."""
    begin, end = (
        _find_moment(site, date, mark).astimezone(dt.UTC) for mark in (period.start, period.end)
    )
    count = math.ceil((end - begin) / dt.timedelta(minutes=period.every))
    moments = [begin + k * dt.timedelta(minutes=period.every) for k in range(count)] + [end]
    lengths = [after - before for before, after in itertools.pairwise(moments)]
    middles = [start + length / 2 for start, length in zip(moments, lengths, strict=False)]
    path = find_sun(site, middles)
    hours = np.array([length.total_seconds() / 3600 for length in lengths])
    suns, hours = path.direction[path.is_up], hours[path.is_up]
    if land is None:
        return Suns(suns, hours, period.every / 60)
    hidden = land.covers(suns, site.true_north)
    return Suns(suns[~hidden], hours[~hidden], period.every / 60, float(hours[hidden].sum()))


@lru_cache(maxsize=32)
def find_day(site: Site, date: dt.date) -> tuple[NDArray[np.float64], SunPath]:
    """Find the sun's path over a day: clock minutes since midnight (n,), and the path."""
    minutes = np.arange(0, DAY, _PATH_STEP, dtype=np.float64)
    return minutes, find_sun(site, [_find_moment(site, date, float(m)) for m in minutes])


@lru_cache(maxsize=8)
def tell_daylight_hours(site: Site, date: dt.date) -> str:
    """Tell sunrise and sunset as almanacs, pages and reports do."""
    return str(find_daylight(site, date))


def _find_moment(site: Site | None, date: dt.date, minutes: float) -> dt.datetime:
    zone = ZoneInfo(site.zone) if site is not None else dt.UTC
    midnight = dt.datetime.combine(date, dt.time())
    return (midnight + dt.timedelta(minutes=minutes)).replace(tzinfo=zone)
