"""A study of several dates as one of each."""

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from numpy.typing import NDArray

if TYPE_CHECKING:
    from umbra.study.result import Study

__all__ = ["split_dates", "tell_dates"]

AnyStudy = TypeVar("AnyStudy", bound="Study")
_BY_DAY = "_by_day"
_OF_ALL = {"day", "newly_under_days"}
_DATES = {"days", "first_date", "last_date"}


def split_dates(study: AnyStudy) -> list[AnyStudy]:
    """
    Give the same study of each of its dates, as if it were of that date alone.

    Parameters
    ----------
    study : Study

    Returns
    -------
    studies : list of the same
        Without masks. The study itself, where it has one date or keeps only sums.
    """
    if "shadow_hours_by_day" not in study.more:
        return [study]
    facts = {name: fact for name, fact in study.facts.items() if name not in _DATES}
    hours = study.more["shadow_hours_by_day"][1]
    return [
        replace(
            study,
            period=study.period.pick(day),
            shadow_hours=hours[day],
            up_hours=float(study.more["up_hours_by_day"][1][day]),
            masks=None,
            facts=facts,
            more=_pick(study.more, day),
        )
        for day in range(len(study.period.days))
    ]


def tell_dates(study: "Study") -> str:
    """Say of which date hours are, or of how many they are the sum."""
    days = study.period.days
    return str(days[0]) if len(days) == 1 else f"sum of {len(days)} dates"


def _pick(
    more: dict[str, tuple[tuple[str, ...], NDArray]], day: int
) -> dict[str, tuple[tuple[str, ...], NDArray]]:
    """Give the further arrays of one date: by the names that they have where it is the only one."""
    own = {
        name.removesuffix(_BY_DAY): (dims[1:], array[day])
        for name, (dims, array) in more.items()
        if name.endswith(_BY_DAY)
    }
    kept = {
        name: value
        for name, value in more.items()
        if not (name.endswith(_BY_DAY) or name in _OF_ALL or "time" in value[0])
    }
    for name in ("up_hours", "shadow_hours", "sun_hours"):
        own.pop(name, None)
    return kept | own
