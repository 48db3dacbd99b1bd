"""The moments of a study that films and outlines show: times that a person would ask for."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.study.result import Study
from umbra.sun import find_sun
from umbra.sun.clock import ROUND, Stamps, Steps, find_round_stamps, find_stamps

__all__ = ["Moment", "choose_stamps", "find_moments"]


@dataclass(frozen=True, eq=False)
class Moment:
    """
    An instant, and the sun at it, above the horizon.

    Parameters
    ----------
    instant : datetime
        UTC.
    local : datetime
        By the site's clock.
    altitude, azimuth : float
        Of the sun [degrees].
    direction : (3,) float64
        Toward the sun, in the model's axes.
    """

    instant: dt.datetime
    local: dt.datetime
    altitude: float
    azimuth: float
    direction: NDArray[np.float64]


def choose_stamps(steps: Steps, at: Sequence[str] = ()) -> Stamps:
    """Return the clock times asked for on a date; the ends of its steps by default."""
    return find_stamps(steps.local()[0].date(), at, steps.zone) if at else steps


def find_moments(
    study: Study, at: Sequence[str] = (), *, every: int | None, most: int
) -> list[Moment]:
    """
    Find the moments with the sun up that are asked for, or round ones.

    Parameters
    ----------
    study : Study
    at : sequence of str
        Clock times, as ``umbra.sun.clock.find_stamps`` reads them.
    every : int, optional
        Without ``at``: the spacing at least [min]; None, and where a date's period is shorter
        than two of it: the length of the study's steps, or the next round one.
    most : int
        Of all dates; of many fewer a date are shown, then of every n-th date only.

    Returns
    -------
    moments : list of Moment
    """
    days = study.period.steps
    days = days[:: -(-len(days) // most)]
    chosen = [
        choose_stamps(steps, at) if at else _find_round(steps, every, most // len(days))
        for steps in days
    ]
    path = find_sun(
        study.site, np.concatenate([day.stamps for day in chosen]), refraction=study.refraction
    )
    local = [when for day in chosen for when in day.local()]
    return [
        Moment(
            local[k].astimezone(dt.UTC), local[k], float(path.altitude[k]),
            float(path.azimuth[k]), path.direction[k],
        )
        for k in np.flatnonzero(path.is_up)
    ]  # fmt: skip


def _find_round(steps: Steps, every: int | None, most: int) -> Stamps:
    """Return at most N round times of a date, or its steps' ends if it has none."""
    length = float(steps.hours.sum()) * 60
    least = every if every and every <= length / 2 else float(steps.hours.max()) * 60
    for minutes in ROUND:
        if minutes > least - 1e-6:
            found = find_round_stamps(steps, minutes)
            if len(found.stamps) <= most:
                return found if len(found.stamps) else steps
    return steps
