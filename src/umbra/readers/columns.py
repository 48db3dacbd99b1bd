"""Which columns of a table hold heights, and the numbers in them."""

import difflib
import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError

__all__ = ["HEIGHTS", "Numbers", "find_column", "parse_numbers"]

HEIGHTS = (
    "height",
    "building:height",
    "building_height",
    "buildingheight",
    "measuredheight",
    "measured_height",
    "bldg_height",
    "height_m",
    "hoehe",
    "h",
)
"""Names that columns of heights bear, without upper case."""

NUMBER = re.compile(r"\s*([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s*(?:m|metres?|meters?)?\s*")


@dataclass(frozen=True, eq=False)
class Numbers:
    """
    A column, read.

    Parameters
    ----------
    values : (n,) float64
        NaN where there is none.
    from_text : int
        How many were text that reads as a number.
    odd : list of (int, str)
        Rows whose text is no number, and that text.
    """

    values: NDArray[np.float64]
    from_text: int
    odd: list[tuple[int, str]]


def find_column(columns: dict[str, list[Any]], chosen: str | None, names: tuple[str, ...]) -> str:
    """
    Find a column by its chosen name, or as the first of some usual ones.

    Parameters
    ----------
    columns : dict of str to list
    chosen : str, optional
        Compared as it is, then without upper case.
    names : tuple of str
        Usual names, the likeliest first, without upper case.

    Returns
    -------
    column : str

    Raises
    ------
    InputError
        If there is none: names the columns there are, and the one most like it.
    """
    lower: dict[str, str] = {}
    for name in columns:
        lower.setdefault(name.casefold(), name)
    if chosen is not None:
        if chosen in columns:
            return chosen
        if chosen.casefold() in lower:
            return lower[chosen.casefold()]
        near = difflib.get_close_matches(chosen, columns, n=1)
        advice = f"; did you mean '{near[0]}'?" if near else ""
        msg = f"there is no column '{chosen}'; the file has {_list(columns)}{advice}"
        raise InputError(msg, column=chosen, columns=list(columns))
    for name in names:
        if name in lower:
            return lower[name]
    msg = (
        f"says no heights: no column is called {names[0]} or the like; the file has "
        f"{_list(columns)}; name one with --height-column (height_column= in Python)"
    )
    raise InputError(msg, columns=list(columns))


def parse_numbers(values: list[Any]) -> Numbers:
    """
    Read a column as metres: numbers, or text such as ``12.5``, ``12,5`` and ``12.5 m``.

    Parameters
    ----------
    values : list

    Returns
    -------
    numbers : Numbers
    """
    parsed = np.full(len(values), np.nan)
    from_text = 0
    odd: list[tuple[int, str]] = []
    for row, value in enumerate(values):
        if value is None or isinstance(value, bool):
            continue
        if isinstance(value, str):
            if not value.strip():
                continue
            found = NUMBER.fullmatch(value)
            if not found:
                odd.append((row, value))
                continue
            from_text += 1
            number = float(found[1].replace(",", "."))
        else:
            try:
                number = float(value)
            except (TypeError, ValueError):
                odd.append((row, str(value)))
                continue
        if math.isfinite(number):
            parsed[row] = number
    return Numbers(parsed, from_text, odd)


def _list(columns: dict[str, list[Any]]) -> str:
    names = list(columns)
    if not names:
        return "no columns"
    more = f" and {len(names) - 20} more" if len(names) > 20 else ""
    return f"the columns {', '.join(names[:20])}{more}" if len(names) > 1 else f"'{names[0]}'"
