"""Polygons that cross or touch themselves, made valid where shapely is installed."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.readers.footprint_table import Rings

__all__ = ["from_shapes", "repair"]

FEW = 50  # corners, which are repaired in no time however they cross


def repair(rings: Rings) -> tuple[Rings, list[str]]:
    """
    Make every polygon valid: its rings simple, its holes inside.

    Without shapely nothing is repaired; the cutting into triangles notices where it matters.
    """
    rings, notes = _drop_short(rings)
    try:
        import shapely  # noqa: PLC0415 - of the extra gis
    except ImportError:
        return rings, notes
    shapes = _to_shapes(shapely, rings)
    wrong = np.flatnonzero(~shapely.is_valid(shapes))
    if not len(wrong):
        return rings, notes
    wrong, tangled = _leave_tangled(rings, wrong)
    if len(tangled):
        first = int(rings.feature[tangled[0]]) + 1
        notes.append(
            f"footprints too tangled to repair, whose edges cross more than half as often as they "
            f"have corners: {len(tangled)} (first: feature {first})"
        )
    if not len(wrong):
        return rings, notes
    reason = str(shapely.is_valid_reason(shapes[wrong[0]])).partition("[")[0].lower()
    # As GEOS does by structure: holes are holes, and what is covered twice counts once.
    shapes[wrong] = shapely.make_valid(shapes[wrong], method="structure", keep_collapsed=False)
    first = int(rings.feature[wrong[0]]) + 1
    notes.append(f"footprints repaired: {len(wrong)} (first: feature {first}, {reason})")
    fixed, feature = shapely.get_parts(shapes, return_index=True)
    polygons = shapely.get_type_id(fixed) == 3
    filled = polygons & ~shapely.is_empty(fixed)
    return from_shapes(shapely, fixed[filled], rings.feature[feature[filled]]), notes


def _leave_tangled(
    rings: Rings, wrong: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """
    Divide polygons into those to repair and those whose edges cross too often.

    A repair adds a corner at each crossing: 2,000 corners at random took 50 s and 4 GB.
    """
    corners = np.bincount(rings.polygon, rings.lengths, minlength=len(rings.feature))
    large = wrong[corners[wrong] > FEW]
    if not len(large):
        return wrong, large
    from umbra.readers.monotone import is_tangled  # noqa: PLC0415 - it compiles a kernel

    starts, following = rings.starts, rings.following
    first = np.searchsorted(rings.polygon, large)
    tangled = []
    for polygon, ring in zip(large.tolist(), first.tolist(), strict=True):
        begin = int(starts[ring])
        piece = slice(begin, begin + int(corners[polygon]))
        if is_tangled(rings.points[piece], following[piece] - begin):
            tangled.append(polygon)
    return np.setdiff1d(wrong, tangled), np.array(tangled, np.int64)


def from_shapes(shapely: Any, shapes: NDArray[Any], feature: NDArray[np.int64]) -> Rings:
    """Take shapely's polygons, none of them empty, apart."""
    loops, polygon = shapely.get_rings(shapes, return_index=True)
    points, ring = shapely.get_coordinates(loops, return_index=True)
    lengths = np.bincount(ring, minlength=len(loops))
    # shapely closes every ring.
    last = np.cumsum(lengths) - 1
    return Rings(np.delete(points, last, axis=0), lengths - 1, polygon, feature)


def _to_shapes(shapely: Any, rings: Rings) -> NDArray[Any]:
    order = np.insert(np.arange(len(rings.points)), np.cumsum(rings.lengths), rings.starts)
    index = np.repeat(np.arange(len(rings.lengths)), rings.lengths + 1)
    loops = shapely.linearrings(rings.points[order], indices=index)
    return shapely.polygons(loops, indices=rings.polygon)


def _drop_short(rings: Rings) -> tuple[Rings, list[str]]:
    """Drop rings of fewer than three corners, and polygons whose outside is one."""
    short = rings.lengths < 3
    if not short.any():
        return rings, []
    gone = np.zeros(len(rings.feature), np.bool_)
    gone[rings.polygon[short & rings.is_outer]] = True
    notes = [f"rings with fewer than three corners left out: {int(short.sum())}"]
    return rings.select(~gone, ~short), notes
