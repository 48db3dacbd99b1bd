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

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.kernels import run_shared, take_next
from umbra.machine import use_threads
from umbra.methods import Softness
from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.scene import Camera
from umbra.scene.large_lights import spread
from umbra.soft import AreaLight
from umbra.soft.parts import find_signed_part, place_axes, project_edge
from umbra.soft.wedges import (
    ASIDE,
    BLOCK,
    count_tiles,
    find_in_tile,
    find_tile,
    is_in,
    make_coverage_planes,
    map_to_unit_light,
    split_block,
)
from umbra.volume.adjacency import Caster

if TYPE_CHECKING:
    from umbra.soft.frames import VolumeCounts

__all__ = [
    "MOST",
    "SPOTS",
    "EdgeTable",
    "find_open_components",
    "find_visibility_by_complexity",
    "list_light_edges",
    "make_spots",
]

SPOTS = Softness.spots
"""Default number of spots of the light at which casters are counted."""
MOST = 4096
"""Largest number of spots."""


class EdgeTable(NamedTuple):
    """
    Edges that may be on the silhouette as seen by a receiver in their wedge.

    Parameters
    ----------
    ends : (n, 6) float64
        In the light's frame [m].
    faces : (n, 2, 4) float64
        Unit planes, outward, of both faces; 0 for a face that casts nothing.
    weight : (n,) float64
        Half the weight of the pair, see ``umbra.volume.adjacency``.
    turn : (n,) float64
        -1 where the faces have the same direction along the edge, else 1.
    wedges : (n, 4, 4) float64
        Planes from ``make_coverage_planes``.
    """

    ends: NDArray[np.float64]
    faces: NDArray[np.float64]
    weight: NDArray[np.float64]
    turn: NDArray[np.float64]
    wedges: NDArray[np.float64]


class LightFrame(NamedTuple):
    """
    Parameters of a light for kernels.

    Parameters
    ----------
    place : (4,) float64
        Centre; a unit direction for w = 0.
    radius : float
    is_square : bool
    axes : (3, 3) float64
        Axes from ``map_to_unit_light``.
    """

    place: NDArray[np.float64]
    radius: float
    is_square: bool
    axes: NDArray[np.float64]


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
    opened = find_open_components(counter.caster, light, light.light.local(counter.scene.origin))
    if opened.any():
        counter = counter.with_caster(counter.caster.opened(opened))
    coverage = np.zeros(frame.part.shape)
    unsure = np.zeros(frame.part.shape, np.bool_)
    where = view.face != NOTHING
    # Where rounding could put the centre's count and an edge on different sides, use a light offset
    # by a thousandth of its radius.
    for each in (light, light.moved(ASIDE)):
        _cover(counter, view, frame, camera, each, at, where, coverage, unsure)
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


def find_open_components(
    caster: Caster, light: AreaLight, place: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """
    Find the closed components whose bounding box meets the light, (n_components,) bool.

    Components in front of some spots and behind others must follow the open rule for all spots.
    ``place`` (4,) is the light's centre in the caster's frame.
    """
    if place[3] == 0.0:
        return np.zeros(len(caster.is_closed), np.bool_)
    low = np.full((len(caster.is_closed), 3), np.inf)
    high = -low
    corners = caster.vertices[caster.faces]
    np.minimum.at(low, caster.component, corners.min(1))
    np.maximum.at(high, caster.component, corners.max(1))
    middle = place[:3] / place[3]
    meets = (low <= middle + light.radius) & (high >= middle - light.radius)
    return caster.is_closed & meets.all(1)


def list_light_edges(
    caster: Caster, vertices: NDArray[np.float64], place: NDArray[np.float64], radius: float
) -> EdgeTable:
    """
    List the edges that are on the silhouette for some receiver and some spot of the light.

    A spot and a receiver that sees it past an edge see the edge's faces from opposite sides. So an
    edge is left out if the whole light sees both faces lit, or both unlit.

    Parameters
    ----------
    caster : Caster
    vertices : (n_vertices, 3) float64
        The caster's vertices in the light's frame [m].
    place : (4,) float64
        The light's centre; a unit direction for w = 0.
    radius : float
        Radius of the light's bounding sphere [m]; for a disc in the sky tan of its angular radius.
    """
    planes = caster.planes[:, :-1].T
    if vertices is not caster.vertices:
        planes = _make_planes_again(caster, vertices)
    size = np.linalg.norm(planes[:, :3], axis=1)
    planes = planes / np.where(size > 0, size, 1.0)[:, None]
    side = planes @ place
    sure = np.where(np.abs(side) > 1.0001 * radius, np.sign(side), np.nan)
    turn = np.where(caster.turn, -1.0, 1.0)
    one, two = caster.edge_faces.T
    kept = np.flatnonzero(~(sure[one] == turn * sure[two]))
    faces = planes[caster.edge_faces[kept]]
    ends = vertices[caster.edges[kept].ravel()].reshape(-1, 6)
    wedges = np.zeros((len(kept), 4, 4))
    make_coverage_planes(ends, place, radius, wedges)
    return EdgeTable(ends, faces, caster.weight[kept] / 2.0, turn[kept], wedges)


def _make_planes_again(caster: Caster, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the planes (n_faces, 4) of moved vertices; 0 for faces that cast nothing."""
    a, b, c = (vertices[caster.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    planes = np.concatenate([normal, -np.einsum("ij,ij->i", normal, a)[:, None]], 1)
    planes[~caster.planes[:, :-1].any(0)] = 0.0
    return planes


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
    origin = counter.scene.origin
    place = light.light.local(origin)
    caster = counter.find_casting(place)
    if not light.light.is_point:
        place[:3] /= np.linalg.norm(place[:3])
    use_threads(counter.threads)
    edges = list_light_edges(caster, caster.vertices, place, light.radius)
    lamp = LightFrame(place, light.radius, light.edges is not None, map_to_unit_light(light, place))
    hard = counter.count(view, camera, light.light)
    coverage[where] = hard[where] > 0
    run_shared(
        count_tiles(where.shape[0], where.shape[1], BLOCK), _count_over_light,
        frame.position, frame.normal, origin, where, edges, lamp, spots,
        hard.astype(np.int32), coverage, unsure,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _find_multiplicity(edges, e, x, y, z, margin):
    """
    Find an edge's multiplicity, wound as in the faces that a receiver sees from outside.

    0 outside the edge's wedge, widened by a margin, where the edge has no effect.
    """
    if not is_in(edges.wedges[e], x, y, z, margin):
        return 0.0
    sides = 0.0
    for k in range(2):
        f = edges.faces[e, k]
        side = np.sign(f[0] * x + f[1] * y + f[2] * z + f[3])
        sides += side if k == 0 else -edges.turn[e] * side
    return edges.weight[e] * sides


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def _count_over_light(
    position, normal, origin, where, edges, lamp, spots, hard, coverage, unsure, taken
):
    """
    Write the coverage of visible points in penumbra wedges; see the module's docstring.

    ``hard`` (rows, cols) int32 is the count at the light's centre.
    """
    rows, cols = where.shape
    ends, wedges = edges.ends, edges.wedges
    place, radius, is_square, axes = lamp
    across = np.ascontiguousarray(spots.T)
    coarse = 2.0**-40 * np.abs(origin).max()
    every = np.arange(ends.shape[0])
    number = take_next(taken)
    while number < count_tiles(rows, cols, BLOCK):
        block = find_tile(number, rows, cols, BLOCK)
        near = np.empty(ends.shape[0], np.int64)
        n_near, _ = find_in_tile(position, origin, where, wedges, block, every, near)
        found = np.empty(n_near, np.int64)
        own = np.empty((3, 3))
        one = np.empty((8, 2))
        two = np.empty((8, 2))
        counts = np.empty(spots.shape[0], np.int32)
        for tile in split_block(block):
            n_found, slack = find_in_tile(
                position, origin, where, wedges, tile, near[:n_near], found
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
                    if not place_axes(x, y, z, place, radius, is_square, axes, own):
                        continue
                    counts[:] = hard[r, c]
                    mean = np.float64(hard[r, c])
                    has_any = False
                    for i in range(n_found):
                        e = found[i]
                        times = _find_multiplicity(edges, e, x, y, z, 2.0 * off)
                        if times == 0.0:
                            continue
                        is_between, ax, ay, bx, by = project_edge(ends[e], x, y, z, place, own)
                        if not is_between:
                            continue
                        part, at_middle = find_signed_part(ax, ay, bx, by, is_square, one, two)
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
