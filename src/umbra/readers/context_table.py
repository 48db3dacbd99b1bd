"""Streets, green and water as plain lines and rings: what each is, by the words of its file."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError

__all__ = ["KINDS", "ContextTable", "make_context_table", "name_context_kind"]

KINDS = ("street", "green", "water", "other")
"""What is drawn under a plan, besides buildings."""
_TELLING = ("highway", "railway", "waterway")
"""Columns of OpenStreetMap that say by their names what a feature is."""
_COLUMNS = (
    "kind", "class", "fclass", "type", "layer", "function", "category", "natural", "landuse",
    "leisure", "water", "surface",
)  # fmt: skip
_WORDS = {
    "water": "water waters waterbody river riverbank stream canal lake pond sea wetland basin "
    "reservoir bach fluss see teich wasser gewässer",
    "green": "green park garden grass grassland forest wood meadow scrub tree trees orchard "
    "cemetery vineyard plantcover vegetation allotments hedge lawn grün wald wiese baum bäume",
    "street": "street streets road roads highway rail railway railways track path footway way "
    "pavement kerb sidewalk lane parking square transportsquare strasse straße strassen straßen "
    "weg gleis",
}
_KIND_OF = {word: kind for kind, words in _WORDS.items() for word in words.split()}


@dataclass(frozen=True, eq=False)
class ContextTable:
    """
    Lines and rings of a file, in its own coordinates.

    Parameters
    ----------
    points : (n, 2) float64
    lengths : (m,) int64
        Points of each line or ring.
    is_ring : (m,) bool
        Whether its last point is joined with the first.
    feature : (m,) int64
        Index of its feature.
    kinds : tuple of str
        Of each feature, one of ``KINDS``.
    crs : str, optional
        That the file names.
    is_guess : bool
        Whether the CRS is taken only because the numbers could be degrees.
    """

    points: NDArray[np.float64]
    lengths: NDArray[np.int64]
    is_ring: NDArray[np.bool_]
    feature: NDArray[np.int64]
    kinds: tuple[str, ...]
    crs: str | None = None
    is_guess: bool = False


def make_context_table(
    lines: Sequence[tuple[Sequence[Any], bool, int]],
    kinds: Iterable[str],
    crs: str | None = None,
    *,
    is_guess: bool = False,
) -> ContextTable:
    """
    Make a table of lines: points, whether closed, and feature of each; leave out points.

    Raises
    ------
    InputError
        If a point is not a pair of numbers.
    """
    kept = [
        (line[:-1] if closed and len(line) > 1 and tuple(line[0]) == tuple(line[-1]) else line,
         closed, owner)
        for line, closed, owner in lines
    ]  # fmt: skip
    kept = [(line, closed, owner) for line, closed, owner in kept if len(line) >= 2 + closed]
    try:
        points = np.array([point[:2] for line, _, _ in kept for point in line], np.float64)
        points = points.reshape(-1, 2)
        assert np.isfinite(points).all()
    except (AssertionError, TypeError, ValueError) as error:
        msg = "has a corner that is not a pair of numbers; export it again"
        raise InputError(msg) from error
    return ContextTable(
        points,
        np.array([len(line) for line, _, _ in kept], np.int64),
        np.array([closed for _, closed, _ in kept], np.bool_),
        np.array([owner for _, _, owner in kept], np.int64),
        tuple(kinds),
        crs,
        is_guess,
    )


def name_context_kind(columns: Mapping[str, Any], *names: str) -> str:
    """
    Say what a feature is, by the values of its columns, else by names of its layer or file.

    Parameters
    ----------
    columns : mapping of str to value
        A column without a value says nothing.
    names : str
        Of the layer, of the file; the first that is known decides.
    """
    given = {str(key).casefold(): value for key, value in columns.items() if value is not None}
    for column in _TELLING:
        if given.get(column) not in (None, "", "no"):
            return _KIND_OF.get(column, "water")
    texts = [str(given[column]) for column in _COLUMNS if column in given]
    for text in (*texts, *names):
        words = re.findall(r"[^\W\d_]+", text.casefold())
        kinds = [_KIND_OF[word] for word in words if word in _KIND_OF]
        if kinds:
            return kinds[0]
    return "other"
