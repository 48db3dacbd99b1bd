"""Hours on several dates: a map for each, all on one scale."""

import os
from collections.abc import Sequence
from typing import Literal

import numpy as np

from umbra.writers.canopies import find_swatches
from umbra.writers.day_map import DayMap
from umbra.writers.hatch import draw_hatch
from umbra.writers.hours import draw_hours_key, fill_hours
from umbra.writers.panels import make_panels
from umbra.writers.paper import Panel
from umbra.writers.plan import Plan, Show
from umbra.writers.sheet import Sheet

__all__ = ["draw_hour_panels", "make_hour_panels"]


def draw_hour_panels(
    path: str | os.PathLike[str],
    plan: Plan,
    days: Sequence[DayMap],
    max_hours: float,
    receivers: Literal["ground", "top"] = "ground",
    what: str = "",
    show: Show = "shadow",
    hatch: str = "",
) -> None:
    """
    Draw the hours on several dates a map for each, all on one scale.

    Parameters
    ----------
    path : path
    plan : Plan
        Of every map; its words are those of all dates.
    days : sequence of DayMap
    max_hours : float
        The colour scale's end: the most hours that the sun was up on one of the dates [h].
    receivers : {'ground', 'top'}
        As ``draw_hours`` takes them.
    what : str
        What the hours are of, for the key.
    show : {'shadow', 'sun'}
        As ``draw_hours`` takes it.
    hatch : str
        What is hatched, for the key.

    Raises
    ------
    ValueError
        If the hours of a date do not fit the plan.
    OSError
        If the file cannot be written.
    """
    make_hour_panels(plan, days, max_hours, receivers, what, show, hatch)[0].save(path)


def make_hour_panels(
    plan: Plan,
    days: Sequence[DayMap],
    max_hours: float,
    receivers: Literal["ground", "top"] = "ground",
    what: str = "",
    show: Show = "shadow",
    hatch: str = "",
) -> tuple[Sheet, list[Panel]]:
    """Lay out what ``draw_hour_panels`` writes; same parameters, less the path."""
    for day in days:
        if day.hours.shape != plan.shape:
            msg = f"the hours on {day.title} are {day.hours.shape}, but the plan is {plan.shape}"
            raise ValueError(msg)
    sheet, panels = make_panels(plan, [day.title for day in days], [day.remark for day in days])
    for panel, day in zip(panels, days, strict=True):
        hours = np.asarray(day.hours, np.float32)
        fill_hours(panel, hours, max_hours, receivers, show, day.finer)
        if day.hatched is not None and day.hatched.any():
            draw_hatch(panel, day.hatched)
    if max_hours > 0:
        remark = "" if plan.proposed is None else "outlined in red: proposed"
        draw_hours_key(sheet, max_hours, what, remark, show, hatch, find_swatches([plan]))
    return sheet, panels
