"""Tables of footprints: polygons, and columns of heights, bases and names."""

import math
import re
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, find_similar
from umbra.readers.model import UniqueNames

__all__ = [
    "HEIGHTS",
    "ColumnNumbers",
    "FootprintTable",
    "Rings",
    "find_column",
    "has_height",
    "name_features",
    "parse_numbers",
]


@dataclass(frozen=True, eq=False)
class Rings:
    """Polygons as flat arrays, ring after ring, without closing corners."""

    points: NDArray[np.float64]  # (n_points, 2): x and y of all rings' corners
    lengths: NDArray[np.int64]  # (n_rings,): corners of each ring
    # (n_rings,): of each ring, ascending from 0; a polygon's first ring is its outside
    polygon: NDArray[np.int64]
    feature: NDArray[np.int64]  # (n_polygons,): row of the table that each polygon belongs to

    @property
    def starts(self) -> NDArray[np.int64]:
        """First corner of each ring, (n_rings,)."""
        return np.cumsum(self.lengths) - self.lengths

    @property
    def following(self) -> NDArray[np.int64]:
        """The next corner in each corner's ring, (n_points,)."""
        following = np.arange(1, len(self.points) + 1)
        following[np.cumsum(self.lengths) - 1] = self.starts
        return following

    @property
    def is_outer(self) -> NDArray[np.bool_]:
        """Which rings are a polygon's outside, (n_rings,)."""
        return np.diff(self.polygon, prepend=-1) != 0

    def select(
        self, polygons: NDArray[np.bool_], rings: NDArray[np.bool_] | None = None
    ) -> "Rings":
        """Keep some polygons, and of those some rings."""
        is_kept = polygons[self.polygon] if rings is None else polygons[self.polygon] & rings
        return Rings(
            self.points[np.repeat(is_kept, self.lengths)],
            self.lengths[is_kept],
            (np.cumsum(polygons) - 1)[self.polygon[is_kept]],
            self.feature[polygons],
        )


@dataclass(frozen=True, eq=False)
class FootprintTable:
    """A file of footprints."""

    format: str  # for people: ``GeoJSON``
    rings: Rings
    names: list[str | None]  # of the features, where the file numbers them
    columns: dict[str, list[Any]]  # values of every feature, None where it has none
    crs: str | None
    notes: tuple[str, ...] = ()


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
"""Usual names of height columns, in lower case."""

BASES = ("base", "base_z", "base_height", "base_elevation")
"""Usual names of columns of the base's height, in lower case."""

FOOT = 0.3048
"""[m]"""
NUMBER = re.compile(
    r"\s*([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s*"
    r"(?:(m|metres?|meters?)|(ft\.?|feet|foot))?\s*",
    re.IGNORECASE,
)
_IN_FEET = re.compile(r"(.+?)[\s_(\[]+(?:ft|feet|foot)[)\]]?", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class ColumnNumbers:
    """The numbers of a column."""

    values: NDArray[np.float64]  # (n,): naN where there is none
    from_text: int  # how many were text that reads as a number
    odd: list[tuple[int, str]]  # rows whose text is no number, and that text
    in_feet: int = 0  # how many were feet, by their unit or their column's name


def find_column(columns: dict[str, list[Any]], chosen: str | None, names: tuple[str, ...]) -> str:
    """Find a column by its chosen name, case aside, or as the first of some usual names."""
    lower: dict[str, str] = {}
    for name in columns:
        lower.setdefault(name.casefold(), name)
    if chosen is not None:
        if chosen in columns:
            return chosen
        if chosen.casefold() in lower:
            return lower[chosen.casefold()]
        near = find_similar(chosen, columns)
        advice = f"; did you mean '{near[0]}'?" if near else ""
        msg = f"there is no column '{chosen}'; the file has {_list(columns)}{advice}"
        raise InputError(msg, column=chosen, columns=list(columns))
    if usual := find_usual(columns, names):
        return usual
    msg = (
        f"has no heights: no column is called {names[0]} or similar; the file has "
        f"{_list(columns)}; name one with height_column="
    )
    raise InputError(msg, option="height_column", columns=list(columns))


def find_usual(columns: Iterable[str], names: tuple[str, ...]) -> str | None:
    """Find the first of some usual names among columns, in metres before feet; None if none is."""
    every = list(columns)[::-1]
    lower = {column.casefold(): column for column in every}
    plain = {name: column for column in every for name in _name_in_metres(column)}
    return next((table[name] for table in (lower, plain) for name in names if name in table), None)


def has_height(column: str, names: Container[str]) -> bool:
    """Return whether a column is called by one of these names, in metres or in feet."""
    return any(name in names for name in (column.casefold(), *_name_in_metres(column)))


def _name_in_metres(column: str) -> list[str]:
    """Return the name of a column in feet without its unit, in lower case; none of others."""
    match = _IN_FEET.fullmatch(column.strip())
    return [match[1].casefold()] if match else []


def parse_numbers(values: list[Any], column: str = "") -> ColumnNumbers:
    """
    Read a column as metres: numbers, or text such as ``12.5``, ``12,5``, ``12.5 m``, ``41 ft``.

    Numbers without a unit are feet where the column's name says so: ``height_ft``.
    """
    parsed = np.full(len(values), np.nan)
    is_in_feet = bool(_name_in_metres(column))
    from_text = in_feet = 0
    odd: list[tuple[int, str]] = []
    for row, value in enumerate(values):
        if value is None or isinstance(value, bool):
            continue
        if isinstance(value, str):
            if not value.strip():
                continue
            match = NUMBER.fullmatch(value)
            if not match:
                odd.append((row, value))
                continue
            from_text += 1
            number = float(match[1].replace(",", "."))
            is_foot = bool(match[3]) or (is_in_feet and not match[2])
        else:
            try:
                number = float(value)
            except (TypeError, ValueError):
                odd.append((row, str(value)))
                continue
            is_foot = is_in_feet
        if math.isfinite(number):
            parsed[row] = number * FOOT if is_foot else number
            in_feet += is_foot
    return ColumnNumbers(parsed, from_text, odd, in_feet)


def _list(columns: dict[str, list[Any]]) -> str:
    names = list(columns)
    if not names:
        return "no columns"
    more = f" and {len(names) - 20} more" if len(names) > 20 else ""
    return f"the columns {', '.join(names[:20])}{more}" if len(names) > 1 else f"'{names[0]}'"


NAMES = ("name", "building:name", "building_name", "bldg_name", "bezeichnung", "naam", "nom")
"""Usual names of name columns, in lower case."""
IDS = ("id", "gml_id", "gmlid", "osm_id", "@id", "fid", "identificatie", "objectid", "building_id")
OWN = "id"  # name_column='id' means the features' own ids, unless a column is called so


def name_features(table: FootprintTable, chosen: str | None = None) -> tuple[list[str], list[str]]:
    """
    Name each row, no two alike, and note by which column.

    Takes the first column whose values all differ, in the order names, the features' own ids,
    ids; else the one with the most different values. Equal names are numbered, as in
    ``Tower (2)``; a row without a name gets its number in the file, from 1.
    """
    rows = np.unique(table.rings.feature).tolist()
    title, words = _choose(table, rows, chosen)
    empty = sum(not words[row] for row in rows)
    names = [str(row + 1) for row in range(len(words))]
    unique = UniqueNames()
    twice = 0
    for row in rows:
        names[row] = unique.add(words[row] or names[row])
        twice += bool(words[row]) and names[row] != words[row]
    if title is None:
        return names, []
    note = f"names come from {title} (name_column=)"
    if empty and empty < len(rows):
        note += f"; footprints without one, named by their order: {empty}"
    if twice:
        note += f"; footprints with a repeated name, numbered: {twice}"
    return names, [note]


def _choose(
    table: FootprintTable, rows: Sequence[int], chosen: str | None
) -> tuple[str | None, list[str]]:
    """Return the source of the names, None without one, and the name of every row."""
    own = [name or "" for name in table.names]
    if chosen is not None:
        try:
            column = find_column(table.columns, chosen, ())
        except InputError:
            if chosen.casefold() == OWN and any(own):
                return "the features' own ids", own
            raise
        return f"the column '{column}'", [_read(value) for value in table.columns[column]]
    usual = {name.casefold(): name for name in reversed(table.columns)}

    def read(words: Sequence[str]) -> list[tuple[str, list[str]]]:
        names = (usual[word] for word in words if word in usual)
        return [(f"the column '{name}'", [_read(v) for v in table.columns[name]]) for name in names]

    candidates = [*read(NAMES), ("the features' own ids", own), *read(IDS)]
    apart = [len({words[row] for row in rows} - {""}) for _, words in candidates]
    most = max(apart)
    nothing = [""] * len(table.names)
    if most == 0:
        return None, nothing
    best = candidates[apart.index(most)]
    if most == 1 and len(rows) > 1:  # such as an Id of 0 on each
        return f"their order in the file, for {best[0]} is the same for all", nothing
    return best


def _read(value: Any) -> str:
    if value is None or isinstance(value, (list, dict)):
        return ""
    if isinstance(value, float) and value.is_integer():
        return str(int(value))  # integers read as float because a value is missing
    return str(value).strip()
