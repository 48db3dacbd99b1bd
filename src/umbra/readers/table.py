"""Polygons with their columns, as any file of footprints holds them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Rings", "Table"]


@dataclass(frozen=True, eq=False)
class Rings:
    """
    Polygons as flat arrays, ring after ring, without closing corners.

    Parameters
    ----------
    points : (n_points, 2) float64
        x and y of all rings' corners.
    lengths : (n_rings,) int64
        Corners of each ring.
    polygon : (n_rings,) int64
        Of each ring, ascending from 0; a polygon's first ring is its outside.
    feature : (n_polygons,) int64
        Row of the table that each polygon belongs to.
    """

    points: NDArray[np.float64]
    lengths: NDArray[np.int64]
    polygon: NDArray[np.int64]
    feature: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Table:
    """
    A file of footprints.

    Parameters
    ----------
    format : str
        For people: ``GeoJSON``.
    rings : Rings
    names : list of (str or None)
        Of the features, where the file numbers them.
    columns : dict of str to list
        Values of every feature, None where it has none.
    crs : str or None
    notes : tuple of str
    """

    format: str
    rings: Rings
    names: list[str | None]
    columns: dict[str, list[Any]]
    crs: str | None
    notes: tuple[str, ...] = ()
