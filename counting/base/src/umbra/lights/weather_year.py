"""A year of weather, hour by hour: the sun's and the sky's irradiance, and the suns they are of."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.lights.period import Period, Refraction
from umbra.sun import Site, SunPath, find_sun

__all__ = ["Weather", "WeatherSuns"]

_HOUR = 3_600_000_000  # [us]
_RADIUS = 6371.0  # of the earth [km]
_LEAP_DAY = 31 + 28  # days of a year before it


@dataclass(frozen=True, eq=False)
class WeatherSuns:
    """
    The suns of some steps of time, with the weather of each.

    Parameters
    ----------
    sun : SunPath
    starts, ends : (n,) int64
        UTC start and end of each step [us since 1970].
    hours : (n,) float64
        Lengths of the steps [h].
    overall, beam, diffuse : (n,) float64
        Irradiance of a level plane, of a plane that faces the sun by the sun alone, and of a
        level plane by the sky [W/m2].
    """

    sun: SunPath
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    hours: NDArray[np.float64]
    overall: NDArray[np.float64]
    beam: NDArray[np.float64]
    diffuse: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Weather:
    """
    A year of hours, in the order of the year.

    Parameters
    ----------
    name, sha256 : str
        Of the file.
    latitude, longitude : float
        [degrees]
    elevation : float
        [m]
    utc_offset : float
        Of the clock by which the hours run [h].
    sun_at : float
        When an hour's sun stands, after the hour's start [h]: 0.5 where values are means or sums
        of the hour, as in EPW and TMY3.
    year : int
        Year of the suns; of a typical year, whose months are of several, any without a leap day.
    values : (n, 3) float64
        Global, direct normal and diffuse horizontal irradiance of 8,760 hours, or of 8,784 with a
        leap day [W/m2].
    """

    name: str
    sha256: str
    latitude: float
    longitude: float
    elevation: float
    utc_offset: float
    sun_at: float
    year: int
    values: NDArray[np.float64]

    @property
    def has_leap_day(self) -> bool:
        """Whether there are hours of 29 February."""
        return len(self.values) > 365 * 24

    def measure_distance(self, site: Site) -> float:
        """Return the distance of a site along the earth's surface [km]."""
        up, other = math.radians(self.latitude), math.radians(site.latitude)
        turn = math.radians(self.longitude - site.longitude)
        half = (
            math.sin((up - other) / 2) ** 2
            + math.cos(up) * math.cos(other) * math.sin(turn / 2) ** 2
        )
        return 2 * _RADIUS * math.asin(min(1.0, math.sqrt(half)))

    def find_suns(self, site: Site, period: Period, refraction: Refraction) -> WeatherSuns:
        """
        Find the suns of a period, or where it has no days of the whole year by its own hours.

        Parameters
        ----------
        site : Site
            Whose suns they are.
        period : Period
            Each step has the weather of the hour in which its midpoint lies.
        refraction : {'standard', 'none'}
        """
        if period.days:
            rows = self._find_rows(period.instants)
            sun, starts, ends, hours = period.sun, period.starts, period.ends, period.hours
        else:
            rows = np.arange(len(self.values))
            begin = np.datetime64(f"{self.year:04d}-01-01", "us").astype(np.int64)
            starts = begin - round(self.utc_offset * _HOUR) + rows * _HOUR
            ends, hours = starts + _HOUR, np.ones(len(rows))
            instants = (starts + round(self.sun_at * _HOUR)).view("datetime64[us]")
            sun = find_sun(site, instants, refraction=refraction)
        return WeatherSuns(sun, starts, ends, hours, *self.values[rows].T)

    def _find_rows(self, instants: NDArray[np.datetime64]) -> NDArray[np.int64]:
        """Return the rows of UTC instants; 29 February has those of the 28th where it has none."""
        shift = round((self.utc_offset + 0.5 - self.sun_at) * _HOUR)
        local = instants.astype("datetime64[us]") + np.timedelta64(shift, "us")
        years = local.astype("datetime64[Y]")
        day = (local.astype("datetime64[D]") - years.astype("datetime64[D]")).astype(np.int64)
        hour = (local - local.astype("datetime64[D]")).astype(np.int64) // _HOUR
        number = years.astype(np.int64) + 1970
        is_leap = (number % 4 == 0) & ((number % 100 != 0) | (number % 400 == 0))
        if self.has_leap_day:
            day = np.where(~is_leap & (day >= _LEAP_DAY), day + 1, day)
        else:
            day = np.where(is_leap & (day >= _LEAP_DAY), day - 1, day)
        return day * 24 + hour
