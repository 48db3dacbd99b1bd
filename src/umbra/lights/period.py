"""The suns of a period: steps of one or more days, and the sun at their midpoints."""

import datetime as dt
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights.horizon import Horizon
from umbra.lights.weighted import Lights
from umbra.sun import Site, Steps, SunPath, find_sun, make_steps, parse_dates
from umbra.sun.clock import check_steps
from umbra.sun.day_times import Clock, DayClock, is_of_the_sun

__all__ = ["Period", "Refraction", "make_no_period", "make_period"]

Refraction = Literal["standard", "none"]


@dataclass(frozen=True, eq=False)
class Period:
    """
    The same hours of the local clock on one or more dates.

    Parameters
    ----------
    days : tuple of datetime.date
        Local dates, ascending; none of a study that asks for no sun.
    steps : tuple of Steps
        Steps of each day.
    sun : SunPath
        Sun at all midpoints, in order of the days.
    site : Site
        May be None where there are no days.
    refraction : {'standard', 'none'}
    horizon : Horizon, optional
        Land far away. Suns behind it are up, and every receiver is in its shadow.
    """

    days: tuple[dt.date, ...]
    steps: tuple[Steps, ...]
    sun: SunPath
    site: Site
    refraction: Refraction
    horizon: Horizon | None = None

    @property
    def instants(self) -> NDArray[np.datetime64]:
        """UTC midpoints of all steps, (n,) datetime64[us]."""
        return _join((steps.instants for steps in self.steps), np.dtype("datetime64[us]"))

    @property
    def hours(self) -> NDArray[np.float64]:
        """Lengths of all steps, (n,) [h]."""
        return _join((steps.hours for steps in self.steps), np.dtype(np.float64))

    @property
    def starts(self) -> NDArray[np.int64]:
        """UTC start of each step, (n,) [us since 1970]."""
        return _join((steps.stamps[:-1] for steps in self.steps), np.dtype(np.int64))

    @property
    def ends(self) -> NDArray[np.int64]:
        """UTC end of each step, (n,) [us since 1970]."""
        return _join((steps.stamps[1:] for steps in self.steps), np.dtype(np.int64))

    @property
    def day_of_step(self) -> NDArray[np.intp]:
        """Index of each step in ``days``, (n,)."""
        counts = np.array([len(steps.hours) for steps in self.steps], np.intp)
        return np.repeat(np.arange(len(self.days)), counts)

    @property
    def up_hours_by_day(self) -> NDArray[np.float64]:
        """Time with the sun up on each day, by whole steps, (n_days,) [h]."""
        lengths = np.where(self.sun.is_up, self.hours, 0.0)
        return np.bincount(self.day_of_step, lengths, len(self.days)).astype(np.float64)

    @property
    def months(self) -> tuple[int, ...]:
        """Months of the year in which the dates lie, ascending, January is 1."""
        return tuple(sorted({day.month for day in self.days}))

    @property
    def month_of_day(self) -> NDArray[np.intp]:
        """Index of each day's month in ``months``, (n_days,)."""
        return np.searchsorted(self.months, [day.month for day in self.days])

    def make_lights(self, which: NDArray[np.bool_] | None = None) -> Lights:
        """
        Return the suns above the horizon at the steps' midpoints, weighted by hours.

        Parameters
        ----------
        which : (n,) bool, optional
            Selection of the steps with the sun up; all by default.

        Raises
        ------
        InputError
            If the study has no date.
        """
        if not self.days:
            msg = "it asks for suns, and the study has no date; set needs_sun = True in the measure"
            raise InputError(msg)
        is_up = self.sun.is_up if which is None else self.sun.is_up & which
        step = np.flatnonzero(is_up)
        ends = np.searchsorted(self.day_of_step[step], np.arange(len(self.days) + 1))
        days = tuple((slice(int(a), int(b)),) if b > a else () for a, b in pairwise(ends))
        vectors = np.zeros((len(step), 4))
        vectors[:, :3] = self.sun.direction[step]
        return Lights(
            vectors, self.hours[step][:, None], ("shadow",), ("h",), self.starts[step],
            self.ends[step], step, days,
        )  # fmt: skip

    def find_reaching_suns(self) -> NDArray[np.float64]:
        """Find the suns at midpoints and stamps, whose shadows the default extent holds."""
        if not self.days:  # a margin as wide as the model is high, on every side
            turn = np.arange(8) * np.pi / 4
            return np.stack([np.sin(turn), np.cos(turn), np.ones(8)], 1) / np.sqrt(2)
        stamps = np.concatenate([steps.stamps for steps in self.steps])
        path = find_sun(self.site, stamps, refraction=self.refraction)
        return np.concatenate([self.sun.direction[self.sun.is_up], path.direction[path.is_up]])

    def meets_land(self, directions: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which directions (n, 3), or homogeneous lights (n, 4), meet the land, (n,)."""
        if self.horizon is None:
            return np.zeros(len(directions), np.bool_)
        north = 0.0 if self.site is None else self.site.true_north
        return self.horizon.covers(directions, north)

    @property
    def land_hours(self) -> float:
        """Time for which the sun is up behind the land, by whole steps [h]."""
        return float(self.hours[self.sun.is_up & self.meets_land(self.sun.direction)].sum())

    def pick(self, day: int) -> "Period":
        """Return the period of one day alone."""
        is_of_day, sun = self.day_of_step == day, self.sun
        path = (
            sun.altitude[is_of_day],
            sun.azimuth[is_of_day],
            sun.direction[is_of_day],
            sun.is_up[is_of_day],
        )
        return replace(self, days=(self.days[day],), steps=(self.steps[day],), sun=SunPath(*path))


def _join(arrays: Iterable[NDArray], dtype: np.dtype) -> NDArray:
    """Join arrays of one type, of which there may be none."""
    return np.concatenate([np.zeros(0, dtype), *(array.astype(dtype) for array in arrays)])


def make_no_period(site: Site | None) -> Period:
    """Return the period of a study that asks for no sun: no days."""
    none = np.zeros(0)
    sun = SunPath(none, none, np.zeros((0, 3)), np.zeros(0, np.bool_))
    return Period((), (), sun, site, "standard")  # type: ignore[arg-type]


def make_period(
    dates: str | dt.date | Sequence[str | dt.date],
    start: str | dt.time,
    end: str | dt.time,
    every: str | dt.timedelta,
    site: Site,
    *,
    every_days: int = 1,
    refraction: Refraction = "standard",
    clock: Clock = "local",
) -> Period:
    """
    Cut the same hours of some dates into steps, and find the sun at their midpoints.

    Parameters
    ----------
    dates : str, date, or a sequence of them
        As ``umbra.sun.parse_dates`` reads them.
    start, end, every
        As ``umbra.sun.make_steps`` reads them; also times of the sun, such as ``sunrise+1h``.
    site : Site
    every_days : int
        Take every N-th day of a range, a month or a year.
    refraction : {'standard', 'none'}
    clock : {'local', 'standard', 'solar'}
        By which start and end are read.

    Raises
    ------
    InputError
        If one of them cannot be read, or a local time does not exist on a date.
    """
    days = parse_dates(dates, every_days, site.zone)
    find = None
    if clock != "local" or is_of_the_sun(start) or is_of_the_sun(end):
        find = DayClock(site, clock).find
    check_steps(make_steps(days[0], start, end, every, site.zone, find), len(days), every)
    steps = tuple(make_steps(day, start, end, every, site.zone, find) for day in days)
    instants = np.concatenate([day.instants for day in steps])
    return Period(days, steps, find_sun(site, instants, refraction=refraction), site, refraction)
