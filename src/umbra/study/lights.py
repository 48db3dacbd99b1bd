"""
Weighted lights, which a study adds up.

A period makes them: steps of one or more days, and the sun at their midpoints.
"""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.sun import Site, Steps, SunPath, find_sun, make_steps, parse_dates
from umbra.sun.clock import check_steps

__all__ = ["Lights", "Period", "make_period"]

Refraction = Literal["standard", "none"]


@dataclass(frozen=True, eq=False)
class Lights:
    """
    Homogeneous lights with a weight in every column.

    One day's hours are one column; hours by day are one column per day.

    Parameters
    ----------
    vectors : (n, 4) float64
        w = 0: unit direction toward the light in the model's axes; w = 1: lamp's position in
        the scene's local frame [m].
    weights : (n, k) float64
    names, units : tuple of str
        Weight in each column.
    starts, ends : (n,) int64
        Start and end of each light's time, UTC [us since 1970]; ascending.
    step : (n,) int64
        Index of each in its source, such as the steps of a study.
    days : tuple of tuple of slice
        Runs of consecutive lights of each day; a day may have none.
    """

    vectors: NDArray[np.float64]
    weights: NDArray[np.float64]
    names: tuple[str, ...]
    units: tuple[str, ...]
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    step: NDArray[np.int64]
    days: tuple[tuple[slice, ...], ...]

    @classmethod
    def of(
        cls,
        vectors: NDArray[np.float64],
        weights: ArrayLike | None = None,
        names: tuple[str, ...] = ("lights",),
        units: tuple[str, ...] = ("1",),
        step: NDArray[np.int64] | None = None,
    ) -> Self:
        """
        Make lights without times.

        Parameters
        ----------
        vectors : (n, 3) or (n, 4) float64
        weights : (n,) or (n, k) float, optional
            1 each by default.
        names, units : tuple of str
        step : (n,) int64, optional
            Index of each in its source.
        """
        count = len(vectors)
        whole = np.zeros((count, 4))
        whole[:, : vectors.shape[1]] = vectors
        given = np.ones(count) if weights is None else np.asarray(weights, np.float64)
        none = np.zeros(count, np.int64)
        return cls(
            whole, given if given.ndim > 1 else given[:, None], names, units, none, none,
            np.arange(count) if step is None else step,
            ((slice(0, count),),) if count else ((),),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.vectors)

    @property
    def are_suns(self) -> NDArray[np.bool_]:
        """Directions above the horizon, which need no rays, (n,) bool."""
        return (self.vectors[:, 3] == 0) & (self.vectors[:, 2] > 0)

    @property
    def directions(self) -> NDArray[np.float64]:
        """Unit directions of suns, (n, 3); homogeneous lights (n, 4) if others are among them."""
        has_others = (self.vectors[:, 3] != 0) | (self.vectors[:, 2] < 0)
        columns = 4 if has_others.any() else 3
        return np.ascontiguousarray(self.vectors[:, :columns])

    def pick(self, which: NDArray[np.bool_]) -> Self:
        """Return some of the lights, without their times."""
        return type(self).of(
            self.vectors[which], self.weights[which], self.names, self.units, self.step[which]
        )

    def split(self) -> tuple[Self, Self]:
        """Return the suns, and all other lights; without their times."""
        return self.pick(self.are_suns), self.pick(~self.are_suns)

    @property
    def lengths(self) -> NDArray[np.int64]:
        """Duration of each light [us]."""
        return self.ends - self.starts


@dataclass(frozen=True, eq=False)
class Period:
    """
    The same hours of the local clock on one or more dates.

    Parameters
    ----------
    days : tuple of datetime.date
        Local dates, ascending.
    steps : tuple of Steps
        Steps of each day.
    sun : SunPath
        Sun at all midpoints, in order of the days.
    site : Site
    refraction : {'standard', 'none'}
    """

    days: tuple[dt.date, ...]
    steps: tuple[Steps, ...]
    sun: SunPath
    site: Site
    refraction: Refraction

    @property
    def instants(self) -> NDArray[np.datetime64]:
        """UTC midpoints of all steps, (n,) datetime64[us]."""
        return np.concatenate([steps.instants for steps in self.steps])

    @property
    def hours(self) -> NDArray[np.float64]:
        """Lengths of all steps, (n,) [h]."""
        return np.concatenate([steps.hours for steps in self.steps])

    @property
    def starts(self) -> NDArray[np.int64]:
        """UTC start of each step, (n,) [us since 1970]."""
        return np.concatenate([steps.stamps[:-1].astype(np.int64) for steps in self.steps])

    @property
    def ends(self) -> NDArray[np.int64]:
        """UTC end of each step, (n,) [us since 1970]."""
        return np.concatenate([steps.stamps[1:].astype(np.int64) for steps in self.steps])

    @property
    def day_of_step(self) -> NDArray[np.intp]:
        """Index of each step in ``days``, (n,)."""
        return np.repeat(np.arange(len(self.days)), [len(steps.hours) for steps in self.steps])

    @property
    def up_hours_by_day(self) -> NDArray[np.float64]:
        """Time with the sun up on each day, by whole steps, (n_days,) [h]."""
        lengths = np.where(self.sun.is_up, self.hours, 0.0)
        return np.bincount(self.day_of_step, lengths, len(self.days)).astype(np.float64)

    def make_lights(self, which: NDArray[np.bool_] | None = None) -> Lights:
        """
        Return the suns above the horizon at the steps' midpoints, weighted by hours.

        Parameters
        ----------
        which : (n,) bool, optional
            Selection of the steps with the sun up; all by default.
        """
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
        stamps = np.concatenate([steps.stamps for steps in self.steps])
        path = find_sun(self.site, stamps, refraction=self.refraction)
        return np.concatenate([self.sun.direction[self.sun.is_up], path.direction[path.is_up]])

    def pick(self, day: int) -> "Period":
        """Return the period of one day alone."""
        mine, sun = self.day_of_step == day, self.sun
        kept = (sun.altitude[mine], sun.azimuth[mine], sun.direction[mine], sun.is_up[mine])
        return replace(self, days=(self.days[day],), steps=(self.steps[day],), sun=SunPath(*kept))


def make_period(
    dates: str | dt.date | Sequence[str | dt.date],
    start: str | dt.time,
    end: str | dt.time,
    every: str | dt.timedelta,
    site: Site,
    *,
    every_days: int = 1,
    refraction: Refraction = "standard",
) -> Period:
    """
    Cut the same hours of some dates into steps, and find the sun at their midpoints.

    Parameters
    ----------
    dates : str, date, or a sequence of them
        As ``umbra.sun.parse_dates`` reads them.
    start, end, every
        As ``umbra.sun.make_steps`` reads them.
    site : Site
    every_days : int
        Take every N-th day of a range, a month or a year.
    refraction : {'standard', 'none'}

    Raises
    ------
    InputError
        If one of them cannot be read, or a local time does not exist on a date.
    """
    days = parse_dates(dates, every_days)
    check_steps(make_steps(days[0], start, end, every, site.zone), len(days), every)
    steps = tuple(make_steps(day, start, end, every, site.zone) for day in days)
    instants = np.concatenate([each.instants for each in steps])
    return Period(days, steps, find_sun(site, instants, refraction=refraction), site, refraction)
