"""
Soft shadows by depth complexity: the number of casters over each sample spot of the light.

Laine et al. 2005; Forest, Barthe and Paulin 2008. The number of surfaces between a receiver P and a
spot of the light changes only where the spot crosses the projection of an edge that is on the
silhouette *as seen from P*. So the count at a spot is the hard count at the light's centre plus the
edges between centre and spot, and a spot is visible where its count is 0: casters that hide the
same part of the light hide it once, and the silhouette may change over the light.

The spots sample only overlaps. The mean count over the light is an exact closed form of the same
edges (``parts.py``); where casters do not overlap it is the coverage. With m a spot's count, h = 1
where m > 0 and <> the mean over the spots,

    coverage = <h> + b (mean count - <m>),  b = cov(h, m) / var(m).

This is a control variate: exact for any number of spots where every hidden part of the light is
hidden equally often.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.kernels import kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.methods import Softness
from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.scene import Camera
from umbra.scene.large_lights import spread
from umbra.soft import AreaLight
from umbra.soft.light_edges import find_light_edges, find_multiplicity, open_components
from umbra.soft.parts import find_signed_part, place_axes, project_edge
from umbra.soft.wedges import ASIDE, BLOCK, count_tiles, find_in_tile, find_tile, split_block

if TYPE_CHECKING:
    from umbra.soft.frames import VolumeCounts

__all__ = ["MOST", "SPOTS", "find_visibility_by_complexity", "make_spots"]

SPOTS = Softness.spots
"""Default number of spots of the light at which casters are counted."""
MOST = 4096
"""Largest number of spots."""


def find_visibility_by_complexity(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
    *,
    spots: int = SPOTS,
) -> NDArray[np.float32]:
    """
    Find the share of an area light that each visible point sees, see `umbra.soft`.

    `InputError` if there is no spot, or more than 4,096.
    """
    at = make_spots(light, spots)
    counter = open_components(counter, light)
    coverage = np.zeros(frame.part.shape)
    unsure = np.zeros(frame.part.shape, np.bool_)
    where = view.face != NOTHING
    # Where rounding could put the centre's count and an edge on different sides, use a light offset
    # by a thousandth of its radius.
    for lamp in (light, light.moved(ASIDE)):
        _cover(counter, view, frame, camera, lamp, at, where, coverage, unsure)
        where = unsure
        if not where.any():
            break
        unsure = np.zeros_like(where)
    return (1.0 - np.clip(coverage, 0.0, 1.0)).astype(np.float32)


def make_spots(light: AreaLight, n: int) -> NDArray[np.float64]:
    """
    Spread n spots (n, 2) over the unit light, the square [-1, 1]² or disc; deterministic.

    `InputError` if there is none, or more than 4,096.
    """
    if not 1 <= n <= MOST:
        msg = f"{n} spots of the light are not possible; give 1 to {MOST}"
        raise InputError(msg, spots=n)
    if light.edges is not None:
        return 2.0 * spread(n, 2) - 1.0
    # A spiral by the golden angle, evenly spread over the disc (Vogel 1979).
    away = np.sqrt((np.arange(n) + 0.5) / n)
    turn = np.arange(n) * np.pi * (3.0 - np.sqrt(5.0))
    return away[:, None] * np.stack([np.cos(turn), np.sin(turn)], 1)


def _cover(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
    spots: NDArray[np.float64],
    where: NDArray[np.bool_],
    coverage: NDArray[np.float64],
    unsure: NDArray[np.bool_],
) -> None:
    """Write the coverage at ``where``; mark where it may be on the wrong side of an edge."""
    use_threads(counter.threads)
    edges, lamp = find_light_edges(counter, light)
    hard = counter.count(view, camera, light.light)
    coverage[where] = hard[where] > 0
    run_shared(
        count_tiles(where.shape[0], where.shape[1], BLOCK), _count_over_light,
        frame.position, frame.normal, counter.scene.origin, where, edges, lamp, spots,
        hard.astype(np.int32), coverage, unsure,
    )  # fmt: skip


@kernel
def _add_to_spots(ax, ay, bx, by, times, spots, counts):
    """Add to the count of each spot (2, n) whose segment from the centre crosses a to b."""
    nx, ny, n0 = ay - by, bx - ax, ax * by - ay * bx
    inside = n0 > 0.0
    for j in range(counts.size):
        sx, sy = spots[0, j], spots[1, j]
        crosses = ((ax * sy - ay * sx > 0.0) != (bx * sy - by * sx > 0.0)) & (
            (nx * sx + ny * sy + n0 > 0.0) != inside
        )
        counts[j] += times if crosses else 0


@kernel
def _estimate(counts, mean):
    """Estimate the coverage from the spots' counts and the mean count over the whole light."""
    n = counts.size
    hidden = 0
    total = 0
    square = 0
    for j in range(n):
        m = max(counts[j], 0)
        hidden += m > 0
        total += m
        square += m * m
    spread_of = square - total * total / n
    if spread_of <= 0.5 / n:  # all equal
        # Whatever all spots miss hides light, or lets it through, once.
        return mean if total <= n else 1.0
    slope = (total - total * hidden / n) / spread_of
    return hidden / n + slope * (mean - total / n)


@kernel
def _count_over_light(
    position, normal, origin, where, edges, lamp, spots, hard, coverage, unsure, taken
):
    """
    Write the coverage of visible points in penumbra wedges; see the module's docstring.

    ``hard`` (rows, cols) int32 is the count at the light's centre.
    """
    rows, cols = where.shape
    ends, wedges = edges.ends, edges.wedges
    source, radius, is_square, axes = lamp
    across = np.ascontiguousarray(spots.T)
    coarse = 2.0**-40 * np.abs(origin).max()
    every = np.arange(ends.shape[0])
    number = take_next(taken)
    while number < count_tiles(rows, cols, BLOCK):
        block = find_tile(number, rows, cols, BLOCK)
        near = np.empty(ends.shape[0], np.int64)
        n_near, _ = find_in_tile(position, origin, where, wedges, block, every, near)
        listed = np.empty(n_near, np.int64)
        own = np.empty((3, 3))
        scratch_a = np.empty((8, 2))
        scratch_b = np.empty((8, 2))
        counts = np.empty(spots.shape[0], np.int32)
        for tile in split_block(block):
            n_found, slack = find_in_tile(
                position, origin, where, wedges, tile, near[:n_near], listed
            )
            if n_found == 0:
                continue
            for r in range(tile[0], tile[1]):
                for c in range(tile[2], tile[3]):
                    if not where[r, c]:
                        continue
                    # Slightly in front of its own face, whose edges then lie on its horizon.
                    off = slack + coarse
                    x = position[r, c, 0] - origin[0] + off * normal[r, c, 0]
                    y = position[r, c, 1] - origin[1] + off * normal[r, c, 1]
                    z = position[r, c, 2] - origin[2] + off * normal[r, c, 2]
                    if not place_axes(x, y, z, source, radius, is_square, axes, own):
                        continue
                    counts[:] = hard[r, c]
                    mean = np.float64(hard[r, c])
                    has_any = False
                    for i in range(n_found):
                        e = listed[i]
                        times = find_multiplicity(edges, e, x, y, z, 2.0 * off)
                        if times == 0.0:
                            continue
                        is_between, ax, ay, bx, by = project_edge(ends[e], x, y, z, source, own)
                        if not is_between:
                            continue
                        part, at_middle = find_signed_part(
                            ax, ay, bx, by, is_square, scratch_a, scratch_b
                        )
                        unsure[r, c] |= at_middle
                        if part == 0.0:
                            continue
                        has_any = True
                        mean += times * part
                        step = np.int32(round(times)) if part > 0.0 else -np.int32(round(times))
                        _add_to_spots(ax, ay, bx, by, step, across, counts)
                    if has_any:
                        coverage[r, c] = _estimate(counts, mean)
        number = take_next(taken)
