"""Dates of rules in a year, as studies take them."""

import datetime as dt

from umbra.errors import InputError
from umbra.rules.record import Condition
from umbra.verdicts.moments import find_term

__all__ = ["settle_dates"]


def settle_dates(condition: Condition, year: int, zone: str) -> list[str]:
    """
    Return a condition's dates as a study takes them.

    Parameters
    ----------
    condition : Condition
    year : int
        Of dates without a year. A range that ends before it begins runs into the next.
    zone : str
        Whose calendar holds the terms.

    Raises
    ------
    InputError
        If there is no 29 February in the year.
    """
    dates = []
    for text in condition.dates:
        if text == "year":
            dates.append(str(year))
        elif not text[0].isdigit():
            dates += [str(day) for day in find_term(text, year, zone)]
        else:
            dates.append(_settle(text, year))
    return dates


def _settle(text: str, year: int) -> str:
    first, _, last = text.partition("..")
    start = _add_year(first, year)
    if not last:
        return start
    end = _add_year(last, year)
    if end < start and len(last) == 5:
        end = _add_year(last, year + 1)
    return f"{start}..{end}"


def _add_year(day: str, year: int) -> str:
    whole = day if len(day) > 5 else f"{year}-{day}"
    try:
        dt.date.fromisoformat(whole)
    except ValueError:
        msg = f"there is no {day} in {year}; give a year that has it, or correct the rule"
        raise InputError(msg, option="year") from None
    return whole
