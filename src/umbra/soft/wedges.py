"""
Penumbra wedges: soft shadows from the hard count and the silhouette edges alone.

Akenine-Möller and Assarsson 2002 and 2003; here each receiver has its own silhouette, where the
papers take that of the light's centre. The coverage is the mean, over the light, of the number of
surfaces before it: where casters overlap, their coverages are summed and clamped::

    coverage = hard count + sum of s Q multiplicity / area of the light,

with s and Q of ``parts.py``. An edge affects only receivers in its penumbra wedge. Wedges are
culled against tiles of pixels first.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.scene import Camera
from umbra.soft import AreaLight
from umbra.soft.light_edges import find_light_edges, find_multiplicity, is_in, open_components
from umbra.soft.parts import find_signed_part, place_axes, project_edge

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
    "split_block",
]


TILE = 8
"""Side of the tiles against which wedges are tested [pixels], ..."""
BLOCK = 64
"""... and of the larger blocks against which they are tested first."""


@kernel
def find_in_tile(position, origin, seen, planes, tile, wanted, listed):
    """
    List the wedges of ``wanted`` that may contain a visible point of a tile of pixels.

    Returns the number written to ``listed`` (n,), and the margin by which a point may lie outside a
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
    for e in wanted:
        if is_in(planes[e], middle[0], middle[1], middle[2], reach + slack):
            listed[n_found] = e
            n_found += 1
    return n_found, slack


@kernel
def find_tile(number, rows, cols, side):
    """Return a tile's pixels by its index: first row, end row, first column, end column."""
    across = (cols + side - 1) // side
    top = (number // across) * side
    left = (number % across) * side
    return top, min(top + side, rows), left, min(left + side, cols)


@kernel
def count_tiles(rows, cols, side):
    """Count the tiles of a picture; ``side`` is their size [pixels]."""
    return ((rows + side - 1) // side) * ((cols + side - 1) // side)


@kernel
def split_block(block):
    """List the tiles of a block of pixels, as rows of an array."""
    top, bottom, left, right = block
    tiles = np.empty((count_tiles(bottom - top, right - left, TILE), 4), np.int64)
    for number in range(tiles.shape[0]):
        first, last, begin, end = find_tile(number, bottom - top, right - left, TILE)
        tiles[number] = top + first, top + last, left + begin, left + end
    return tiles


@kernel
def add_wedges(position, normal, origin, seen, edges, lamp, cover, unsure, taken):
    """
    Sum s Q multiplicity / area over the silhouette edges, for each visible point.

    Parameters
    ----------
    position : (rows, cols, 3) float64
        In the model's own coordinates [m].
    normal : (rows, cols, 3) float64
        Of the side that is seen.
    origin : (3,) float64
        Origin of the frame of edges and light, in those coordinates.
    seen : (rows, cols) bool
        Pixels to evaluate.
    edges : EdgeTable
    lamp : LightFrame
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
    ends, planes = edges.ends, edges.wedges
    coarse = 2.0**-40 * np.abs(origin).max()
    every = np.arange(ends.shape[0])
    while True:
        number = take_next(taken)
        if number >= count_tiles(rows, cols, BLOCK):
            return
        block = find_tile(number, rows, cols, BLOCK)
        near = np.empty(ends.shape[0], np.int64)
        n_near, _ = find_in_tile(position, origin, seen, planes, block, every, near)
        listed = np.empty(n_near, np.int64)
        own = np.empty((3, 3))
        scratch_a = np.empty((8, 2))
        scratch_b = np.empty((8, 2))
        for tile in split_block(block):
            n_found, slack = find_in_tile(
                position, origin, seen, planes, tile, near[:n_near], listed
            )
            if n_found == 0:
                continue
            for r in range(tile[0], tile[1]):
                for c in range(tile[2], tile[3]):
                    if not seen[r, c]:
                        continue
                    # Slightly in front of its own face, whose edges then lie on its horizon.
                    off = slack + coarse
                    x = position[r, c, 0] - origin[0] + off * normal[r, c, 0]
                    y = position[r, c, 1] - origin[1] + off * normal[r, c, 1]
                    z = position[r, c, 2] - origin[2] + off * normal[r, c, 2]
                    if not place_axes(x, y, z, light, radius, is_square, axes, own):
                        continue
                    total = 0.0
                    for i in range(n_found):
                        e = listed[i]
                        times = find_multiplicity(edges, e, x, y, z, 2.0 * off)
                        if times == 0.0:
                            continue
                        is_between, ax, ay, bx, by = project_edge(ends[e], x, y, z, light, own)
                        if not is_between:
                            continue
                        part, at_middle = find_signed_part(
                            ax, ay, bx, by, is_square, scratch_a, scratch_b
                        )
                        total += times * part
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

    It is the mean number of surfaces before the light: above 1 where casters overlap.
    """
    seen = view.face != NOTHING
    counter = open_components(counter, light)
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
    use_threads(counter.threads)
    edges, lamp = find_light_edges(counter, light)
    coverage = np.zeros(where.shape)
    unsure = np.zeros(where.shape, np.bool_)
    run_shared(
        count_tiles(where.shape[0], where.shape[1], BLOCK), add_wedges,
        frame.position, frame.normal, counter.scene.origin, where, edges, lamp, coverage, unsure,
    )  # fmt: skip
    hard = counter.count(view, camera, light.light)
    return np.where(where, hard + coverage, 0.0), unsure
