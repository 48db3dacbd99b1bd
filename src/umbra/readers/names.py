"""What things are called: no two alike, and buildings of a table by what tells most apart."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.readers.columns import find_column
from umbra.readers.table import Table

__all__ = ["UniqueNames", "name_features"]

NAMES = ("name", "building:name", "building_name", "bldg_name", "bezeichnung", "naam", "nom")
"""Columns of names that people give, without upper case."""
IDS = (
    "id",
    "gml_id",
    "gmlid",
    "osm_id",
    "@id",
    "fid",
    "identificatie",
    "objectid",
    "building_id",
)
OWN = "id"  # --name-column id means the features' own, where no column is called so


class UniqueNames:
    """
    Names that were given, so that the next one is another: ``Tower``, ``Tower (2)``.

    Attributes
    ----------
    numbered : int
        How many words had been given before.
    """

    def __init__(self) -> None:
        self._used: set[str] = set()
        self._counts: dict[str, int] = {}
        self.numbered = 0

    def add(self, word: str) -> str:
        """Give the word, numbered if it was given before."""
        name, count = word, self._counts.get(word, 1)
        while name in self._used:
            count += 1
            name = f"{word} ({count})"
        self._counts[word] = count
        self.numbered += name != word
        self._used.add(name)
        return name


def name_features(table: Table, chosen: str | None = None) -> tuple[list[str], list[str]]:
    """
    Name each feature, no two alike.

    The first column in which all differ is taken: of names, the features' own ids, of ids.
    If there is none, the one that tells most apart.

    Parameters
    ----------
    table : Table
    chosen : str, optional
        The column to take.

    Returns
    -------
    names : list of str
        One for each row. Equal ones are numbered, as in ``Tower (2)``; one that has none is
        called by its number in the file, from 1. Of rows without polygons that number.
    notes : list of str

    Raises
    ------
    InputError
        If the chosen column is not there.
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
    note = f"names are those of {title} (--name-column)"
    if empty and empty < len(rows):
        note += f"; footprints without one, named by their order: {empty}"
    if twice:
        note += f"; footprints whose name is another's, numbered: {twice}"
    return names, [note]


def _choose(table: Table, rows: Sequence[int], chosen: str | None) -> tuple[str | None, list[str]]:
    """Give what the names are of, None for nothing, and the words of all rows."""
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
        found = (usual[word] for word in words if word in usual)
        return [(f"the column '{name}'", [_read(v) for v in table.columns[name]]) for name in found]

    candidates = [*read(NAMES), ("the features' own ids", own), *read(IDS)]
    apart = [len({words[row] for row in rows} - {""}) for _, words in candidates]
    most = max(apart)
    nothing = [""] * len(table.names)
    if most == 0:
        return None, nothing
    best = candidates[apart.index(most)]
    if most == 1 and len(rows) > 1:  # such as an Id of 0 on each
        return f"their order in the file, for {best[0]} tells none apart", nothing
    return best


def _read(value: Any) -> str:
    if value is None or isinstance(value, (list, dict)):
        return ""
    if isinstance(value, float) and value.is_integer():
        return str(int(value))  # as a database gives whole numbers where one is missing
    return str(value).strip()
