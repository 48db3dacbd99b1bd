"""Which dates a picture shows: each on a map of its own, or all together as a mean or a sum."""

from dataclasses import replace
from typing import Any

from umbra.study import PointStudy, Study
from umbra.sun import find_daylight
from umbra.writers.plan import Plan

__all__ = ["choose_panels", "find_together", "name_shown", "tell_daylight"]

MOST_PANELS = 12
"""Dates of which a picture has a map; of more, every n-th."""


def choose_panels(study: Study | PointStudy) -> range:
    """Give the dates that have a map: all, or every n-th of very many."""
    count = len(study.period.days)
    return range(0, count, -(-count // MOST_PANELS))


def tell_daylight(study: Study | PointStudy) -> str:
    """Say when the sun rises and sets on a study's date."""
    return str(find_daylight(study.site, study.period.days[0]))


def find_together(study: Study | PointStudy, options: dict[str, Any]) -> tuple[int, str]:
    """
    Say what a picture shows of dates that are not kept apart.

    Parameters
    ----------
    study : Study or PointStudy
    options : dict
        Of the command.

    Returns
    -------
    divisor : int
        Of the sums: 1 where sums were asked for, else the number of dates.
    words : str
        To follow what the hours are of, ", mean of 365 dates"; none of a single date.
    """
    count = len(study.period.days)
    if count == 1:
        return 1, ""
    if options.get("by_day") is False:
        return 1, f", sum of {count} dates"
    return count, f" a day, mean of {count} dates"


def name_shown(plan: Plan, study: Study | PointStudy) -> Plan:
    """Say how many of very many dates have a map."""
    shown, days = choose_panels(study), study.period.days
    return plan if len(shown) == len(days) else replace(plan, date=f"{len(shown)} of {plan.date}")
