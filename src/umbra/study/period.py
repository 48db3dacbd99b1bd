"""The time axis of a study: the steps of one or more days, and the sun at their midpoints."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from umbra.study.lights import Lights
from umbra.sun import Site, Steps, SunPath, find_sun, make_steps, parse_dates
from umbra.sun.clock import check_steps

__all__ = ["Period", "make_period"]

Refraction = Literal["standard", "none"]


@dataclass(frozen=True, eq=False)
class Period:
    """
    The same hours of the local clock on one or more dates.

    Parameters
    ----------
    days : tuple of datetime.date
        Local dates, ascending.
    steps : tuple of Steps
        Of each day.
    sun : SunPath
        At all midpoints, day after day.
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
        """Index in ``days`` of each step, (n,)."""
        return np.repeat(np.arange(len(self.days)), [len(steps.hours) for steps in self.steps])

    @property
    def up_hours_by_day(self) -> NDArray[np.float64]:
        """How long the sun is up on each day, by whole steps, (n_days,) [h]."""
        lengths = np.where(self.sun.is_up, self.hours, 0.0)
        return np.bincount(self.day_of_step, lengths, len(self.days)).astype(np.float64)

    def make_lights(self, which: NDArray[np.bool_] | None = None) -> Lights:
        """
        Return the suns above the horizon at the steps' midpoints, weighed in hours.

        Parameters
        ----------
        which : (n,) bool, optional
            Steps that count, of those with the sun up; all by default.
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
        """Find the suns whose shadows a default extent shall hold: at midpoints and stamps."""
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
        Of a range, a month or a year take every N-th day.
    refraction : {'standard', 'none'}

    Raises
    ------
    InputError
        If one of them is not written so, or a local time does not exist on a date.
    """
    days = parse_dates(dates, every_days)
    check_steps(make_steps(days[0], start, end, every, site.zone), len(days), every)
    steps = tuple(make_steps(day, start, end, every, site.zone) for day in days)
    instants = np.concatenate([each.instants for each in steps])
    return Period(days, steps, find_sun(site, instants, refraction=refraction), site, refraction)
