"""The dates of a picture: one map each, or all together as a mean or a sum."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.study import FinerHours, Study, split_dates
from umbra.sun import find_daylight
from umbra.writers.folder.outputs import FolderJob
from umbra.writers.plan import Plan, Show, name_hours

__all__ = ["Scale", "choose_panels", "find_together", "name_shown", "tell_daylight"]

MOST_PANELS = 12
"""Most dates with a map of their own; of more dates every n-th is shown."""


def choose_panels(study: Study) -> range:
    """Return the indices of the dates with a map: all, or every n-th of many."""
    count = len(study.period.days)
    return range(0, count, -(-count // MOST_PANELS))


@dataclass(frozen=True)
class Scale:
    """
    The common scale of a picture's maps.

    Parameters
    ----------
    most : float
        Its upper end: the longest time with the sun up on one of the dates, or on all [h].
    what : str
        What the hours count, for the legend.
    divisor : int
        Divisor of the hours: the number of dates for a mean, else 1.
    show : {'shadow', 'sun'}
    """

    most: float
    what: str
    divisor: int
    show: Show

    @classmethod
    def of(cls, job: FolderJob) -> "Scale":
        """Choose the scale of a study's pictures."""
        dates, show = split_dates(job.study), job.outputs.show
        divisor, words = find_together(job)
        if len(dates) > 1:
            divisor, words = 1, " on the date"
        most = max(one.up_hours for one in dates) / divisor
        return cls(most, f"{name_hours(show)}{words}", divisor, show)

    def read_hours(self, study: Study | FinerHours) -> NDArray[np.float32]:
        """Return hours in shadow, shifted so that the scale's end minus them is sun, if shown."""
        hours = study.shadow_hours / np.float32(self.divisor)
        lack = self.most - study.up_hours / self.divisor if self.show == "sun" else 0.0
        return hours + np.float32(lack)


def tell_daylight(study: Study) -> str:
    """Describe sunrise and sunset on a study's date."""
    return str(find_daylight(study.site, study.period.days[0]))


def find_together(job: FolderJob) -> tuple[int, str]:
    """
    Describe what a picture shows of dates that are not kept apart.

    Returns
    -------
    divisor : int
        Of the sums: 1 where sums were asked for, else the number of dates.
    words : str
        To follow what the hours are of, ", mean of 365 dates"; none of a single date.
    """
    count = len(job.study.period.days)
    if count == 1:
        return 1, ""
    if job.options.by_day is False:
        return 1, f", sum of {count} dates"
    return count, f" a day, mean of {count} dates"


def name_shown(plan: Plan, study: Study) -> Plan:
    """Add to a plan's date how many of many dates have a map."""
    shown, days = choose_panels(study), study.period.days
    return plan if len(shown) == len(days) else replace(plan, date=f"{len(shown)} of {plan.date}")
