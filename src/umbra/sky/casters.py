"""What can obstruct the sky: the triangles of the casting parts, with their edges numbered."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.rays.face_tree import TOUCH
from umbra.scene import Scene
from umbra.scene.derived import derive
from umbra.sky.skyline import BOXES, FACES, STRIPS
from umbra.sky.walls import find_strips
from umbra.volume.adjacency import find_whole, sort_along_curve, weld_vertices

__all__ = ["SkyCasters", "find_sky_casters", "make_sky_casters"]


class SkyCasters(NamedTuple):
    """
    Triangles that can obstruct the sky, in a local frame with z up [m].

    Parameters
    ----------
    vertices : (n_vertices, 3) float64
    faces : (n_faces, 3) int32
        Welded vertices; neighbours are close in memory.
    edges : (n_faces, 3) int32
        Of each face the edges from corner k to k + 1: ``edge << 1 | is_reversed``, edges numbered
        by their two vertices alone, so that any number of faces may meet in one.
    planes : (n_faces, 4) float64
        Unit normal, and the distance within which a point lies on the face's plane [m].
    part : (n_faces,) int32
        Number of the object that a face belongs to.
    is_between : (n_edges,) bool
        Whether faces of several objects meet in an edge.
    boxes, box_boxes : (n, 6) float64
        Lowest and highest corner of each ``FACES`` faces, and of each ``BOXES`` such boxes.
    strips : (n, 8) float64
        Strips of vertical walls, see ``find_strips``.
    strip_boxes, strip_box_boxes : (n, 6) float64
        Boxes around each ``STRIPS`` strips, and around each ``BOXES`` such boxes.
    n_edges : int
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    edges: NDArray[np.int32]
    planes: NDArray[np.float64]
    part: NDArray[np.int32]
    is_between: NDArray[np.bool_]
    boxes: NDArray[np.float64]
    box_boxes: NDArray[np.float64]
    strips: NDArray[np.float64]
    strip_boxes: NDArray[np.float64]
    strip_box_boxes: NDArray[np.float64]
    n_edges: int


def find_sky_casters(
    scene: Scene,
    parts: Sequence[int] | None = None,
    owner: NDArray[np.int32] | None = None,
) -> tuple[SkyCasters, list[str]]:
    """
    Return the casters of some parts (indices; all by default) in the scene's frame, made once.

    And the names of the objects that ``SkyCasters.part`` numbers: parts of one name, or by
    ``owner`` (n_parts,) as they are numbered there.
    """
    chosen = tuple(range(len(scene.parts)) if parts is None else parts)

    def make() -> tuple[SkyCasters, list[str]]:
        soup = scene.triangles(chosen)
        farthest = float(np.abs(scene.bounds()).max(initial=0.0))
        names = list(dict.fromkeys(labels := scene.labels()))
        number = {name: k for k, name in enumerate(names)}
        objects = np.array([number[label] for label in labels], np.int32)
        of_part = objects if owner is None else owner
        return make_sky_casters(soup.vertices, soup.faces, of_part[soup.part], farthest), names

    key = (chosen, None if owner is None else tuple(owner.tolist()))
    return derive(scene, "sky casters", key, make)


def make_sky_casters(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    part: NDArray[np.int32] | None = None,
    farthest: float = 0.0,
) -> SkyCasters:
    """
    Prepare a triangle soup: weld equal vertices, drop faces without area, number the edges.

    ``farthest`` is the largest coordinate of the model's own frame [m], which limits the precision
    of points given in it.
    """
    welded = weld_vertices(vertices).take(faces) if len(faces) else faces.reshape(0, 3)
    part = np.zeros(len(faces), np.int32) if part is None else part
    whole = find_whole(welded)
    a, b, c = (vertices[welded[whole, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    has_area = size > 0
    whole, normal, size = whole[has_area], normal[has_area], size[has_area]
    order = sort_along_curve(vertices[welded[whole]].mean(1))
    whole, normal, size = whole[order], normal[order] / size[order, None], size[order]
    welded = np.ascontiguousarray(welded[whole])
    edges, n_edges = _number_edges(welded, len(vertices))
    corners = vertices[welded]
    touch = TOUCH * max(float(np.abs(corners).max(initial=0.0)), farthest)
    # Rounding tilts the plane of a needle by its length over its width.
    longest = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(1, initial=0.0)
    tilted = np.minimum(2.0**-50 * longest**3 / size, 2.0**-30)
    planes = np.column_stack([normal, np.maximum(touch, tilted)])
    planes = np.ascontiguousarray(planes)
    vertices = np.ascontiguousarray(vertices, np.float64)
    strips = find_strips(vertices, welded, edges, planes, n_edges)
    strip_low = np.minimum(strips[:, :3], strips[:, 3:6])
    strip_high = np.maximum(strips[:, :3], strips[:, 3:6])
    boxes = _bound(corners.min(1), corners.max(1), FACES)
    strip_boxes = _bound(strip_low, strip_high, STRIPS)
    part = np.ascontiguousarray(part[whole], np.int32)
    return SkyCasters(
        vertices, welded, edges, planes, part, _find_between(edges, part, n_edges),
        boxes, _bound(boxes[:, :3], boxes[:, 3:], BOXES),
        strips, strip_boxes, _bound(strip_boxes[:, :3], strip_boxes[:, 3:], BOXES), n_edges,
    )  # fmt: skip


def _find_between(
    edges: NDArray[np.int32], part: NDArray[np.int32], n_edges: int
) -> NDArray[np.bool_]:
    """Return the edges in which faces of several objects meet."""
    number, owner = edges.ravel() >> 1, np.repeat(part, 3)
    first = np.full(n_edges, -1, np.int32)
    first[number] = owner  # any one of them
    is_between = np.zeros(n_edges, np.bool_)
    is_between[number[first[number] != owner]] = True
    return is_between


def _bound(low: NDArray[np.float64], high: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """Return the boxes (m, 6) around each ``size`` boxes of corners (n, 3)."""
    firsts = np.arange(0, len(low), size)
    if not len(firsts):
        return np.zeros((0, 6))
    return np.hstack([np.minimum.reduceat(low, firsts), np.maximum.reduceat(high, firsts)])


def _number_edges(faces: NDArray[np.int32], n_vertices: int) -> tuple[NDArray[np.int32], int]:
    """Make codes of the faces' edges: numbered by vertices, bit 0 where the face goes downward."""
    tail = faces.astype(np.int64)
    head = tail[:, [1, 2, 0]]
    key = np.minimum(tail, head) * max(n_vertices, 1) + np.maximum(tail, head)
    unique, number = np.unique(key, return_inverse=True)
    codes = number.reshape(-1, 3) << 1 | (tail > head)
    return np.ascontiguousarray(codes, np.int32), len(unique)
