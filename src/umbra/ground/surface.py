"""
Surface through the feet of buildings: level under each, triangulated between them.

It is made once for all feet of a model, and in coordinates that do not depend on the scene's frame,
so that tiles of a city cut the same surface.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.ground.feet import Feet
from umbra.ground.triangulation import find_blades, find_mean_heights, triangulate_with_edges
from umbra.kernels import kernel

__all__ = ["AWAY", "FeetSurface", "make_surface"]

AWAY = 50.0
"""Distance to the next foot beyond which a surface through feet is a guess [m]."""
_SHADOW = 4.0  # heights of the model by which the surface goes on beyond it, as the plan does
_RINGS, _RING = 6, 48  # circles around the model, and corners of each
_LEAST_STEP = 2.0**-10  # feet that are nearer in plan are one corner [m]
_CLOSE = 0.05  # share of a length that is close
_MOST = 2.0**24 - 2  # steps along a side
_GAPS = 16  # places around the buildings, along half of a model
_TOUCH = 0.02  # share of a base over another that is rounding
_APART = 1.0  # by which a base lies over another, if it stands on it [m]
_ROUNDS = 12  # in which blades of ground are cut
_NOTHING = np.zeros((0, 3))
_SAMPLES = 256  # places along a side at which the distance to a foot is measured


@dataclass(frozen=True, eq=False)
class FeetSurface:
    """
    A surface through feet.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the model's own coordinates [m].
    faces : (m, 3) int32
        Counter-clockwise from above; upright where the ground steps from one foot to the next.
    is_under : (m,) bool
        Whether a face lies under a building.
    buildings : int
        Number of buildings whose feet it holds.
    far_share : float
        Share of the buildings' rectangle that is farther than ``AWAY`` from a foot.
    steepest : float
        Slope that 1 % of the ground between buildings exceeds: rise over run.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    is_under: NDArray[np.bool_]
    buildings: int
    far_share: float
    steepest: float


def make_surface(
    feet: Feet, bounds: NDArray[np.float64], standing: NDArray[np.bool_] | None = None
) -> FeetSurface | None:
    """
    Make the surface through feet.

    Between buildings it is the Delaunay triangulation that holds the edges of their bases. Where
    that would leave a blade of ground, corners are added at the mean height of the feet nearby
    (`find_blades`). Where two buildings share a corner at different heights the ground there is the
    lower, and steps up to the other. Beyond the outermost feet it takes their mean height.

    Parameters
    ----------
    feet : Feet
    bounds : (2, 3) float64
        Of the whole model [m].
    standing : (n_buildings,) bool, optional
        Whether no other object is near and lower.

    Returns
    -------
    surface : FeetSurface or None
        None if there are no feet.
    """
    if not len(feet.corners):
        return None
    base = _Bases.of(feet, bounds)
    # What stands on another building is no foot of the ground.
    whole, over = (np.bincount(feet.owner, area) for area in base.areas)
    most = np.full(len(whole), 0.5)
    if standing is not None:
        most[~standing[: len(most)]] = _TOUCH
    fits = (over <= whole * most)[feet.owner]
    if not fits.all():
        feet = Feet(feet.corners[fits], feet.owner[fits])
        base = _Bases.of(feet, bounds)
    heights = _find_heights(base, feet.corners)
    inner = np.zeros((0, 3))
    for _ in range(_ROUNDS):
        more = find_blades(base, heights, inner)
        if not len(more):
            break
        inner = np.concatenate([inner, more])
        base = _Bases.of(feet, bounds, inner)
        heights = _find_heights(base, feet.corners)
    vertices, corner = _join(base.plan, base.triangles, heights)
    steps_up = _find_steps(base.triangles, base.neighbours, corner)
    is_outer = (base.triangles >= base.own + len(inner)).any(1)
    is_open = (base.label < 0) & ~is_outer
    between = vertices[corner[is_open]]
    return FeetSurface(
        vertices, np.concatenate([corner, steps_up]),
        np.append(base.label >= 0, np.zeros(len(steps_up), np.bool_)), feet.count,
        _find_far_share(base.plan[: base.own], base.edges), _find_steepest(between),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Bases:
    """
    Triangulated bases and what lies between them.

    Parameters
    ----------
    plan : (n, 3) float64
        Corners of feet, the lowest in each place, then those added between them, then those of the
        surface's end [m].
    faces : (k, 3) int64
        Corners of each base face.
    edges : (m, 2) int64
    triangles, neighbours : (t, 3) int32
    label : (t,) int32
        Lowest base face that holds each triangle; -1 between the buildings.
    areas : (2, k) float64
        Of each base face: all, and what of it lies over lower ones.
    own : int
        Number of corners of feet, which are the first of ``plan``.
    """

    plan: NDArray[np.float64]
    faces: NDArray[np.int64]
    edges: NDArray[np.int64]
    triangles: NDArray[np.int32]
    neighbours: NDArray[np.int32]
    label: NDArray[np.int32]
    areas: NDArray[np.float64]
    own: int

    @classmethod
    def of(
        cls, feet: Feet, bounds: NDArray[np.float64], inner: NDArray[np.float64] = _NOTHING
    ) -> "_Bases":
        """Triangulate feet, and corners between them (n, 3), in a model's bounds (2, 3) [m]."""
        corners = feet.corners.reshape(-1, 3)
        low, high = np.minimum(bounds[0], corners.min(0)), np.maximum(bounds[1], corners.max(0))
        middle = np.floor((low + high) / 2)[:2]
        radius = float(np.linalg.norm((high - low)[:2])) / 2
        reach = 2.0 * radius + _SHADOW * float(high[2] - low[2]) + 10.0
        step = max(2.0 ** np.ceil(np.log2(2.0 * reach / _MOST)), _LEAST_STEP)
        points = np.rint((corners[:, :2] - (middle - reach)) / step).astype(np.int64)
        order = np.lexsort((*corners.T[[1, 0, 2]], *points.T[::-1]))
        is_new = np.append(True, (np.diff(points[order], axis=0) != 0).any(1))
        index = np.zeros(len(corners), np.int64)
        index[order] = np.cumsum(is_new) - 1
        faces = index.reshape(-1, 3)
        plan, points = corners[order[is_new]], points[order[is_new]]
        hull, lines = _find_hull(plan[:, :2])
        ring = _make_rings(plan, lines, middle, 1.05 * radius + 1.0, reach)
        ring = np.concatenate([inner, ring])
        on_ring = np.rint((ring[:, :2] - (middle - reach)) / step).astype(np.int64)
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]], hull])
        edges = np.unique(np.sort(edges, axis=1), axis=0)
        edges = edges[edges[:, 0] != edges[:, 1]]
        own = len(plan)
        points, plan = np.concatenate([points, on_ring]), np.concatenate([plan, ring])
        triangles, neighbours, _ = triangulate_with_edges(points, edges)
        lowest = feet.corners[:, :, 2].min(1)
        downward = np.argsort(-lowest, kind="stable")
        label, areas = _find_bases(points, triangles, neighbours, faces, lowest, downward)
        return cls(plan, faces, edges, triangles, neighbours, label, areas, own)


def _make_rings(
    plan: NDArray[np.float64],
    lines: NDArray[np.float64],
    middle: NDArray[np.float64],
    first: float,
    last: float,
) -> NDArray[np.float64]:
    """
    Return corners (n, 3) outside the hull of the feet, at the mean height of the feet nearby.

    They lie on a grid, and on circles around the model, the outermost last.
    """
    from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

    tree = cKDTree(plan[:, :2])
    side = first / _GAPS
    steps = (np.arange(-_GAPS, _GAPS + 1) + 0.5) * side
    grid = middle + np.stack(np.meshgrid(steps, steps), -1).reshape(-1, 2)
    grid = grid[np.linalg.norm(grid - middle, axis=1) < first - side / 2]
    grid = grid[(grid @ lines[:, :2].T + lines[:, 2] > side / 2).any(1)]
    grid = grid[tree.query(grid)[0] > side / 2]
    turn = np.arange(_RING) * (2.0 * np.pi / _RING)
    way = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    circles = [middle + r * way for r in np.geomspace(first, last, _RINGS)]
    places = np.concatenate([grid, *circles])
    return np.column_stack([places, find_mean_heights(tree, plan, places)])


def _find_hull(plan: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the edges (n, 2) of the hull of points in plan, and its lines; none if it is flat."""
    from scipy.spatial import ConvexHull, QhullError  # noqa: PLC0415 - comes with pvlib; 0.2 s

    try:
        hull = ConvexHull(plan)
    except (QhullError, ValueError):
        return np.zeros((0, 2), np.int64), np.array([[0.0, 0.0, np.inf]])
    corners = hull.vertices.astype(np.int64)
    edges = np.stack([corners, np.roll(corners, -1)], axis=1)
    return edges[~_find_crests(plan, edges)], hull.equations


def _find_crests(plan: NDArray[np.float64], edges: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Find the edges of the hull that pass a corner closely: the ground there would be a fin."""
    is_crest = np.zeros(len(edges), np.bool_)
    for k, (start, end) in enumerate(edges.tolist()):
        along = plan[end] - plan[start]
        length = float(np.hypot(*along))
        x, y = ((plan - plan[start]) @ np.stack([along, (-along[1], along[0])], axis=1) / length).T
        inside = (x > _CLOSE * length) & (x < (1.0 - _CLOSE) * length)
        away = np.abs(y[inside])
        is_crest[k] = bool(((away > _LEAST_STEP) & (away < _CLOSE * length)).any())
    return is_crest


def _find_nearest(
    plan: NDArray[np.float64], places: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

    away, nearest = cKDTree(plan).query(places)
    return away, nearest


def _find_heights(base: _Bases, corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of each triangle at its corners, (n, 3): of the base that holds it."""
    plan, triangles, label, faces = base.plan, base.triangles, base.label, base.faces
    heights = plan[triangles, 2]
    held = np.flatnonzero(label >= 0)
    own = corners[label[held]]
    a, b, c = own[:, 0], own[:, 1], own[:, 2]
    (ux, uy), (vx, vy) = (b - a)[:, :2].T, (c - a)[:, :2].T
    whole = ux * vy - uy * vx
    for k in range(3):
        x, y = (plan[triangles[held, k], :2] - a[:, :2]).T
        weight_b, weight_c = (x * vy - y * vx) / whole, (ux * y - uy * x) / whole
        z = a[:, 2] + weight_b * (b[:, 2] - a[:, 2]) + weight_c * (c[:, 2] - a[:, 2])
        for m in range(3):  # its own corners exactly
            z = np.where(faces[label[held], m] == triangles[held, k], own[:, m, 2], z)
        is_level = (own[:, 1:, 2] == own[:, :1, 2]).all(1)
        heights[held, k] = np.where(is_level, own[:, 0, 2], z)
    return heights


def _join(
    plan: NDArray[np.float64], triangles: NDArray[np.int32], heights: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return vertices, one for each place and height, and the triangles' corners among them."""
    point, z = triangles.ravel(), heights.ravel()
    order = np.lexsort((z, point))
    is_new = np.append(True, (np.diff(point[order]) != 0) | (np.diff(z[order]) != 0))
    corner = np.zeros(len(point), np.int32)
    corner[order] = np.cumsum(is_new) - 1
    first = order[is_new]
    return np.column_stack([plan[point[first], :2], z[first]]), corner.reshape(-1, 3)


def _find_steps(
    triangles: NDArray[np.int32], neighbours: NDArray[np.int32], corner: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Return upright faces (n, 3) between neighbours that meet at different heights."""
    steps = [np.zeros((0, 3), np.int32)]
    for k in range(3):
        own = np.flatnonzero(neighbours[:, k] > np.arange(len(triangles)))
        other = neighbours[own, k]
        u, v = corner[own, (k + 1) % 3], corner[own, (k + 2) % 3]
        beyond = []
        for name in (triangles[own, (k + 1) % 3], triangles[own, (k + 2) % 3]):
            where = (triangles[other] == name[:, None]).argmax(1)
            beyond.append(corner[other, where])
        for face, is_one in (
            (np.stack([v, u, beyond[0]], 1), u != beyond[0]),
            (np.stack([v, beyond[0], beyond[1]], 1), v != beyond[1]),
        ):
            steps.append(face[is_one])
    return np.concatenate(steps).astype(np.int32)


@kernel
def _find_bases(points, triangles, neighbours, faces, low, order):
    """
    Find the base face that holds each triangle, -1 if none does: the last of some order.

    Returns also, for each face, twice its area, and that of it over faces that are lower by
    ``_APART``; in steps.
    """
    label = np.full(triangles.shape[0], -1, np.int32)
    areas = np.zeros((2, faces.shape[0]))
    at = np.zeros(points.shape[0], np.int32)
    for t in range(triangles.shape[0]):
        for k in range(3):
            at[triangles[t, k]] = t
    seen = np.full(triangles.shape[0], -1, np.int64)
    stack = np.zeros(triangles.shape[0], np.int32)
    for turn in range(2):
        for f in order:
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            whole = abs(_turn(points, a, b, points[c, 0], points[c, 1]))
            if whole == 0.0:
                continue
            mark = f + turn * faces.shape[0]
            count, t = 0, at[a]
            while t >= 0 and seen[t] != mark:  # all around a corner
                seen[t] = mark
                stack[count] = t
                count += 1
                k = 0 if triangles[t, 0] == a else 1 if triangles[t, 1] == a else 2
                t = neighbours[t, (k + 1) % 3]
            while count > 0:
                count -= 1
                t = stack[count]
                i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                x = (points[i, 0] + points[j, 0] + points[k, 0]) / 3.0
                y = (points[i, 1] + points[j, 1] + points[k, 1]) / 3.0
                first, second = _turn(points, a, b, x, y), _turn(points, b, c, x, y)
                third = _turn(points, c, a, x, y)
                if min(first, second, third) <= 0.0 <= max(first, second, third):
                    continue
                if turn == 0:
                    label[t] = f
                else:
                    area = _turn(points, i, j, float(points[k, 0]), float(points[k, 1]))
                    areas[0, f] += area
                    if low[label[t]] < low[f] - _APART:
                        areas[1, f] += area
                for m in range(3):
                    o = neighbours[t, m]
                    if o >= 0 and seen[o] != mark:
                        seen[o] = mark
                        stack[count] = o
                        count += 1
    return label, areas


@partial(kernel, inline="always")
def _turn(points, a, b, x, y):
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    return ux * (y - points[a, 1]) - uy * (x - points[a, 0])


def _find_far_share(plan: NDArray[np.float64], edges: NDArray[np.int64]) -> float:
    """Return the share of the feet's rectangle that is far from all feet."""
    low, high = plan[:, :2].min(0), plan[:, :2].max(0)
    marks = np.concatenate([plan[:, :2], plan[edges, :2].mean(1)])
    x, y = (np.linspace(a, b, _SAMPLES) for a, b in zip(low, high, strict=True))
    places = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    return float((_find_nearest(marks, places)[0] > AWAY).mean())


def _find_steepest(corners: NDArray[np.float64]) -> float:
    """Return the slope that 1 % of the area of triangles (n, 3, 3) exceeds."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = normals[:, 2]
    has_area = area > 0
    if not has_area.any():
        return 0.0
    slope = np.hypot(normals[has_area, 0], normals[has_area, 1]) / area[has_area]
    order = np.argsort(slope, kind="stable")
    total = np.cumsum(area[has_area][order])
    return float(slope[order][np.searchsorted(total, 0.99 * total[-1])])
