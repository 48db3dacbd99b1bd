"""Checks of layers against the terrain and each other: floating, sunk, overlapping."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Part, Scene, Triangles
from umbra.scene.mesh import find_standing

__all__ = [
    "find_gaps",
    "find_overlaps",
    "find_terrain_height",
    "find_terrain_parts",
    "measure_boxes",
    "stand_on",
]

RASTER, TIN = "Raster", "TINRelief"
"""Kinds of parts that are a terrain."""


def stand_on(parts: Sequence[Part], terrain: Sequence[Part]) -> tuple[tuple[Part, ...], int]:
    """
    Raise parts on z = 0 by the lowest terrain below each; count parts wholly off the terrain.

    Below each corner the terrain's nearest vertex counts, so the height is a cell centre's,
    not a mean.
    """
    soup = Scene(tuple(parts), np.zeros(3)).triangles()
    corner = soup.faces.ravel()
    owner = np.repeat(soup.part, 3)
    height, inside = find_terrain_height(terrain, soup.vertices[:, :2])
    lift = np.full(len(parts), np.inf)
    np.minimum.at(lift, owner, height[corner])
    missed = len(parts) - len(np.unique(owner[inside[corner]]))
    moved = []
    for part, height in zip(parts, lift.tolist(), strict=True):
        corners, faces = np.unique(part.mesh.faces, return_inverse=True)
        vertices = part.mesh.vertices[corners]
        vertices[:, 2] += height
        mesh = replace(part.mesh, vertices=vertices, faces=faces.reshape(-1, 3).astype(np.int32))
        moved.append(replace(part, mesh=mesh))
    return tuple(moved), missed


def find_terrain_height(
    terrain: Sequence[Part], plan: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """
    Return the height (n,) [m] of the terrain at places, and which lie in it.

    The terrain's nearest vertex counts. Triangles may be larger than buildings: in them heights are
    between those of the corners about a place.
    """
    from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

    soup = Scene(tuple(terrain), np.zeros(3)).triangles()
    used = soup.find_corners()
    _, nearest = cKDTree(used[:, :2]).query(plan)
    inside = ((plan >= used[:, :2].min(0)) & (plan <= used[:, :2].max(0))).all(1)
    height = used[nearest, 2]
    if inside.any() and not all(part.kind == RASTER for part in terrain):
        between = _interpolate(soup, plan[inside])
        is_between = np.isfinite(between)  # else in the box, but beside the terrain
        height[inside] = np.where(is_between, between, height[inside])
        inside[inside] = is_between
    return height, inside


def _interpolate(soup: Triangles, plan: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return heights between the corners about places; NaN beside a terrain or if it is upright."""
    from scipy.interpolate import LinearNDInterpolator  # noqa: PLC0415
    from scipy.spatial import QhullError  # noqa: PLC0415

    corners = soup.vertices[soup.faces][..., :2]
    is_near = (corners.max(1) >= plan.min(0)) & (corners.min(1) <= plan.max(0))
    used = soup.vertices[np.unique(soup.faces[is_near.all(1)])]
    try:
        surface = LinearNDInterpolator(used[:, :2] - plan[0], used[:, 2])
    except (QhullError, ValueError):  # all in a line, or too few
        return np.full(len(plan), np.nan)
    heights: NDArray[np.float64] = surface(plan - plan[0])
    return heights


def find_terrain_parts(parts: Sequence[Part]) -> list[Part]:
    """Return the parts that are a terrain."""
    return [part for part in parts if part.kind in {RASTER, TIN} and part.triangles]


SAME = 0.5  # of their union: boxes that share more are one object
FLOATS, SUNK = 1.0, 3.0  # [m]; tolerances above and, for cellars, below the terrain
MOST = 100  # most boxes of a class and cell that each box is compared with


def find_gaps(
    name: str, boxes: NDArray[np.float64], ground: str, terrain: Sequence[Part]
) -> list[str]:
    """
    Return whether a layer floats over a terrain or is sunk in it.

    True if most objects that stand on no other have their base above all the terrain below
    their corners, or far below all of it.

    Parameters
    ----------
    name : str
        Of the layer.
    boxes : (n, 2, 3) float64
        Bounds of its objects [m].
    ground : str
        Name of the terrain.
    terrain : sequence of Part
    """
    boxes = boxes[find_standing(boxes)]
    corners = np.stack([boxes[:, i, 0] for i in (0, 0, 1, 1)], 1)
    across = np.stack([boxes[:, i, 1] for i in (0, 1, 0, 1)], 1)
    height, inside = find_terrain_height(terrain, np.stack([corners, across], 2).reshape(-1, 2))
    height, lies = height.reshape(-1, 4), inside.reshape(-1, 4).all(1)
    feet, height = boxes[lies, 0, 2], height[lies]
    if not len(feet):
        return []
    over, under = float(np.median(feet - height.max(1))), float(np.median(height.min(1) - feet))
    question = "do both count heights from one zero?"
    half = f"half of {len(feet)} buildings"
    if over > FLOATS:
        what = f"floats over the terrain '{ground}': {half} are {over:.1f} m above it or more"
    elif under > SUNK:
        what = f"is sunk in the terrain '{ground}': {half} begin {under:.1f} m below it or more"
        question = "do both count heights from one zero, and is the terrain the bare land?"
    else:
        return []
    return [f"layer '{name}' {what}; {question}"]


def find_overlaps(layers: Mapping[str, Sequence[Part]]) -> list[str]:
    """Find objects of one layer that occupy the place of another's."""
    boxes = {name: measure_boxes(parts) for name, parts in layers.items()}
    notes = []
    for layer, other in combinations(boxes, 2):
        (names, a), (others, b) = boxes[layer], boxes[other]
        pairs = _find_same(a, b)
        if len(pairs):
            count = len(np.unique(pairs[:, 1]))
            i, j = pairs[0]
            notes.append(
                f"layers overlap: {count} of {len(b)} objects of '{other}' stand where objects of "
                f"'{layer}' do (first: '{others[j]}' and '{names[i]}'); choose with no_cast="
            )
    return notes


def measure_boxes(parts: Sequence[Part]) -> tuple[list[str], NDArray[np.float64]]:
    """Return the names of objects and their bounding boxes (n, 2, 3)."""
    boxes: dict[str, NDArray[np.float64]] = {}
    for part in parts:
        if part.triangles:
            box = part.bounds
            if part.name in boxes:
                other = boxes[part.name]
                box = np.stack([np.minimum(box[0], other[0]), np.maximum(box[1], other[1])])
            boxes[part.name] = box
    return list(boxes), np.array(list(boxes.values())).reshape(-1, 2, 3)


def _find_same(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.int64]:
    """
    Find pairs (index in a, index in b) of boxes that are nearly one box, by b, then by a.

    Boxes that share more than half have widths within a factor of 2, and corners nearer than
    the smaller one is wide: in the next class of widths and in the next cell at most.
    """
    # Flat boxes have no volume: assume a centimetre of thickness.
    a, b = (np.stack([box[:, 0], np.maximum(box[:, 1], box[:, 0] + 0.01)], 1) for box in (a, b))
    kind_a, kind_b = (
        np.floor(np.log2(box[:, 1, :2] - box[:, 0, :2])).astype(np.int64) for box in (a, b)
    )
    keys = _hash(kind_a, _find_cells(a, kind_a))
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    near = list(product((-1, 0, 1), repeat=2))
    batches = [np.zeros((0, 2), np.int64)]
    for wider in near:
        kind = kind_b + wider
        cells = _find_cells(b, kind)
        for step in near:
            wanted = _hash(kind, cells + step)
            first = np.searchsorted(keys, wanted)
            lengths = np.minimum(np.searchsorted(keys, wanted, "right") - first, MOST)
            j = np.repeat(np.arange(len(b)), lengths)
            offset = np.arange(len(j)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
            i = order[first[j] + offset]
            same = _share_most(a[i], b[j])
            batches.append(np.stack([i[same], j[same]], axis=1))
    pairs = np.unique(np.concatenate(batches)[:, ::-1], axis=0)
    return pairs[:, ::-1]


def _find_cells(boxes: NDArray[np.float64], kind: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the cells of lower corners, (n, 2), on a grid wider than boxes of that class."""
    return np.floor(boxes[:, 0, :2] / np.exp2(kind + 1.0)).astype(np.int64)


def _hash(kind: NDArray[np.int64], cells: NDArray[np.int64]) -> NDArray[np.uint64]:
    """Hash each class and cell; a collision does no harm, because the boxes are compared."""
    mixed = np.zeros(len(kind), np.uint64)
    for column in (*kind.T, *cells.T):
        mixed = (mixed ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return mixed


def _share_most(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which pairs of boxes share more than half of their union."""
    common = np.minimum(a[:, 1], b[:, 1]) - np.maximum(a[:, 0], b[:, 0])
    shared = np.maximum(common, 0).prod(1)
    union = (a[:, 1] - a[:, 0]).prod(1) + (b[:, 1] - b[:, 0]).prod(1) - shared
    return shared > SAME * union
