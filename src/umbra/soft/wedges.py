"""
Penumbra wedges: soft shadows from the hard count and the silhouette edges alone.

Akenine-Möller and Assarsson 2002 and 2003. The silhouette is taken from the light's centre. The
coverage is exact for receivers for which all of the light has this silhouette and no part of it is
hidden twice; where casters overlap, their coverages are summed and clamped::

    coverage = hard count - sum of s Q multiplicity / area of the light,

with s and Q of ``parts.py``. An edge affects only receivers in its penumbra wedge, bounded by four
planes. Wedges are culled against tiles of pixels first.
"""

from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.kernels import run_shared, take_next
from umbra.machine import use_threads
from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.scene import Camera
from umbra.soft import AreaLight, make_axes
from umbra.soft.parts import find_signed_part, place_axes, project_edge
from umbra.volume.silhouette import find_silhouette_edges

if TYPE_CHECKING:
    from umbra.soft.frames import VolumeCounts

__all__ = [
    "ASIDE",
    "BLOCK",
    "TILE",
    "add_wedges",
    "count_tiles",
    "find_coverage",
    "find_in_tile",
    "find_tile",
    "find_visibility_by_wedges",
    "is_in",
    "make_coverage_planes",
    "map_to_unit_light",
    "split_block",
]


@njit(cache=True, nogil=True)
def make_coverage_planes(ends, light, radius, planes):
    """
    Bound the penumbra wedge of each edge by four planes.

    Two contain the edge, two an end of it, and all are tangent to the light's sphere. With y on the
    edge, x in the light and P behind y, all have n·(P - y) <= 0.

    Parameters
    ----------
    ends : (n, 6) float64
        Edges in the light's frame [m].
    light : (4,) float64
        Centre of the light; a unit direction for w = 0.
    radius : float
        Radius of the sphere [m]; tangent of the angular radius of a disc in the sky.
    planes : (n, 4, 4) float64
        Output: unit normals, outward, and offsets; 0 where the edge's line meets the sphere.
    """
    e = np.empty(3)
    t = np.empty(3)
    a = np.empty(3)
    b = np.empty(3)
    is_point = light[3] > 0.0
    far_sine = radius / np.sqrt(1.0 + radius * radius)
    for i in range(ends.shape[0]):
        length = 0.0
        for k in range(3):
            t[k] = ends[i, k + 3] - ends[i, k]
            length += t[k] * t[k]
        length = np.sqrt(length)
        planes[i] = 0.0
        if length == 0.0:
            continue
        along = 0.0
        for k in range(3):
            t[k] /= length
            e[k] = light[k] - ends[i, k] if is_point else light[k]
            along += t[k] * e[k]
        apart = 0.0
        for k in range(3):
            e[k] -= along * t[k]
            apart += e[k] * e[k]
        apart = np.sqrt(apart)
        limit = radius if is_point else far_sine
        if apart <= limit * 1.0001:
            continue
        sine = limit / apart
        cosine = np.sqrt(1.0 - sine * sine)
        for k in range(3):
            e[k] /= apart
        b[0] = t[1] * e[2] - t[2] * e[1]
        b[1] = t[2] * e[0] - t[0] * e[2]
        b[2] = t[0] * e[1] - t[1] * e[0]
        for k in range(3):
            planes[i, 0, k] = cosine * b[k] + sine * e[k]
            planes[i, 1, k] = -cosine * b[k] + sine * e[k]
        for end in range(2):
            away = 0.0
            inward = 1.0 - 2.0 * end
            for k in range(3):
                a[k] = light[k] - ends[i, 3 * end + k] if is_point else light[k]
                away += a[k] * a[k]
            away = np.sqrt(away)
            along = 0.0
            for k in range(3):
                a[k] /= away
                along += a[k] * t[k] * inward
            sine = radius / away if is_point else far_sine
            cosine = np.sqrt(1.0 - sine * sine)
            across = np.sqrt(max(1.0 - along * along, 0.0))
            for k in range(3):
                # The part of the edge's inward direction perpendicular to the light's.
                planes[i, 2 + end, k] = (
                    sine * a[k] - cosine * (t[k] * inward - along * a[k]) / across
                )
        for p in range(4):
            first = 3 if p == 3 else 0
            for k in range(3):
                planes[i, p, 3] -= planes[i, p, k] * ends[i, first + k]


@njit(cache=True, nogil=True)
def is_in(planes, x, y, z, margin):
    """Tell whether a point is in a wedge of ``make_coverage_planes``, or within a margin of it."""
    for k in range(4):
        p = planes[k]
        if p[0] * x + p[1] * y + p[2] * z + p[3] > margin:
            return False
    return True


TILE = 8
"""Side of the tiles against which wedges are tested [pixels], ..."""
BLOCK = 64
"""... and of the larger blocks against which they are tested first."""


@njit(cache=True, nogil=True)
def find_in_tile(position, origin, seen, planes, tile, asked, found):
    """
    List the wedges of ``asked`` that may contain a visible point of a tile of pixels.

    Returns the number written to ``found`` (n,), and the margin by which a point may lie outside a
    wedge's planes and still count as inside [m].
    """
    top, bottom, left, right = tile
    low = np.full(3, np.inf)
    high = np.full(3, -np.inf)
    for r in range(top, bottom):
        for c in range(left, right):
            if seen[r, c]:
                for k in range(3):
                    low[k] = min(low[k], position[r, c, k] - origin[k])
                    high[k] = max(high[k], position[r, c, k] - origin[k])
    if not low[0] <= high[0]:
        return 0, 0.0
    reach = 0.5 * np.sqrt(
        (high[0] - low[0]) ** 2 + (high[1] - low[1]) ** 2 + (high[2] - low[2]) ** 2
    )
    slack = 1e-9 * (1.0 + np.abs(low).max() + np.abs(high).max())
    middle = 0.5 * (low + high)
    n_found = 0
    for e in asked:
        if is_in(planes[e], middle[0], middle[1], middle[2], reach + slack):
            found[n_found] = e
            n_found += 1
    return n_found, slack


@njit(cache=True, nogil=True)
def find_tile(number, rows, cols, side):
    """Return a tile's pixels by its index: first row, end row, first column, end column."""
    across = (cols + side - 1) // side
    top = (number // across) * side
    left = (number % across) * side
    return top, min(top + side, rows), left, min(left + side, cols)


@njit(cache=True, nogil=True)
def count_tiles(rows, cols, side):
    """Count the tiles of a picture; ``side`` is their size [pixels]."""
    return ((rows + side - 1) // side) * ((cols + side - 1) // side)


@njit(cache=True, nogil=True)
def split_block(block):
    """List the tiles of a block of pixels, as rows of an array."""
    top, bottom, left, right = block
    tiles = np.empty((count_tiles(bottom - top, right - left, TILE), 4), np.int64)
    for number in range(tiles.shape[0]):
        first, last, begin, end = find_tile(number, bottom - top, right - left, TILE)
        tiles[number] = top + first, top + last, left + begin, left + end
    return tiles


@njit(cache=True, nogil=True)
def add_wedges(position, origin, seen, ends, multiplicity, planes, lamp, cover, unsure, taken):
    """
    Sum s Q multiplicity / area over the silhouette edges, for each visible point.

    Parameters
    ----------
    position : (rows, cols, 3) float64
        In the model's own coordinates [m].
    origin : (3,) float64
        Origin of the frame of edges and light, in those coordinates.
    seen : (rows, cols) bool
        Pixels to evaluate.
    ends : (n, 6) float64
        Silhouette edges, wound as in the lit faces.
    multiplicity : (n,) int64
    planes : (n, 4, 4) float64
        Of ``make_coverage_planes``.
    lamp : tuple
        The light (4,) float64; its radius; whether it is a parallelogram; and its axes (3, 3)
        float64: rows u, v and the normal of its plane; u and v map the plane to the unit light.
    cover : (rows, cols) float64
        Added to.
    unsure : (rows, cols) bool
        Set where an edge passes the light's centre within rounding, so that the hard count may be
        on the other side.
    taken : (2,) int64
        Of ``run_shared``, whose items are tiles.
    """
    rows, cols = seen.shape
    light, radius, is_square, axes = lamp
    every = np.arange(ends.shape[0])
    while True:
        number = take_next(taken)
        if number >= count_tiles(rows, cols, BLOCK):
            return
        block = find_tile(number, rows, cols, BLOCK)
        near = np.empty(ends.shape[0], np.int64)
        n_near, _ = find_in_tile(position, origin, seen, planes, block, every, near)
        found = np.empty(n_near, np.int64)
        own = np.empty((3, 3))
        one = np.empty((8, 2))
        two = np.empty((8, 2))
        for tile in split_block(block):
            n_found, slack = find_in_tile(
                position, origin, seen, planes, tile, near[:n_near], found
            )
            if n_found == 0:
                continue
            for r in range(tile[0], tile[1]):
                for c in range(tile[2], tile[3]):
                    if not seen[r, c]:
                        continue
                    x = position[r, c, 0] - origin[0]
                    y = position[r, c, 1] - origin[1]
                    z = position[r, c, 2] - origin[2]
                    if not place_axes(x, y, z, light, radius, is_square, axes, own):
                        continue
                    total = 0.0
                    for i in range(n_found):
                        e = found[i]
                        if not is_in(planes[e], x, y, z, slack):
                            continue
                        is_between, ax, ay, bx, by = project_edge(ends[e], x, y, z, light, own)
                        if not is_between:
                            continue
                        part, at_middle = find_signed_part(ax, ay, bx, by, is_square, one, two)
                        total += multiplicity[e] * part
                        unsure[r, c] |= at_middle
                    cover[r, c] += total


ASIDE = 1e-3 * np.array([0.61, 0.49, 0.37])
"""Offset of the light where an edge passes its centre [radii]."""


def find_visibility_by_wedges(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
) -> NDArray[np.float32]:
    """Find the share of an area light that each visible point sees, see `umbra.soft`."""
    coverage = find_coverage(counter, view, frame, camera, light)
    return (1.0 - np.clip(coverage, 0.0, 1.0)).astype(np.float32)


def find_coverage(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
) -> NDArray[np.float64]:
    """
    Find the coverage of the light at each visible point, before clamping, float64.

    It is hard count - sum of s Q multiplicity / area: above 1 where casters overlap.
    """
    seen = view.face != NOTHING
    coverage, unsure = _cover(counter, view, frame, camera, light, seen)
    if unsure.any():
        # Rounding could put the hard count and the edge on different sides: use a light offset by a
        # thousandth of its radius, an error of at most 0.001.
        aside, _ = _cover(counter, view, frame, camera, light.moved(ASIDE), unsure)
        coverage[unsure] = aside[unsure]
    return coverage


def _cover(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
    where: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the coverage, and where it may be on the wrong side of an edge."""
    caster, origin = counter.caster, counter.scene.origin
    place = light.light.local(origin)
    edges, multiplicity = find_silhouette_edges(caster, place)
    ends = caster.vertices[edges].reshape(-1, 6)
    if not light.light.is_point:
        place[:3] /= np.linalg.norm(place[:3])
    use_threads(counter.threads)
    planes = np.zeros((len(ends), 4, 4))
    make_coverage_planes(ends, place, light.radius, planes)
    coverage = np.zeros(where.shape)
    unsure = np.zeros(where.shape, np.bool_)
    lamp = place, light.radius, light.edges is not None, map_to_unit_light(light, place)
    run_shared(
        count_tiles(where.shape[0], where.shape[1], BLOCK), add_wedges,
        frame.position, origin, where, ends, multiplicity, planes, lamp, coverage, unsure,
    )  # fmt: skip
    hard = counter.count(view, camera, light.light)
    return np.where(where, hard - coverage, 0.0), unsure


def map_to_unit_light(light: AreaLight, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Find the map of a light's plane to the unit light, (3, 3).

    Rows u and v map to the unit square or disc, the third is the plane's normal; all 0 for a ball,
    whose plane faces each receiver. ``place`` (4,) is the light's centre, or a unit direction.
    """
    if light.edges is not None:
        half_u, half_v = light.edges / 2
        normal = np.cross(half_u, half_v)
        area = np.linalg.norm(normal)
        normal /= area
        return np.stack([np.cross(half_v, normal) / area, np.cross(normal, half_u) / area, normal])
    if light.light.is_point:
        return np.zeros((3, 3))
    return np.stack([*(axis / light.radius for axis in make_axes(place[:3])), place[:3]])
