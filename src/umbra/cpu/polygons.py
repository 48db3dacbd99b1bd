"""
The faces of shadow volumes as homogeneous polygons: sides, light caps, dark caps.

A volume is closed: light cap (the casting faces), dark cap (the light cap extruded to infinity) and
sides, wound outward. A directional light extrudes everything to one point at infinity: no dark cap,
and sides are triangles (McGuire et al. 2003, section 6.3). Points at infinity have w = 0. Each
polygon is counted against a depth buffer, without tiles: for caps and for z-fail.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, inner, kernel
from umbra.rays.depth import bound
from umbra.volume.adjacency import Caster
from umbra.volume.facing import find_sides
from umbra.volume.silhouette import find_silhouette_edges

__all__ = ["VolumePolygons", "count_polygons", "make_dark_cap", "make_light_cap", "make_sides"]


@dataclass(frozen=True, eq=False)
class VolumePolygons:
    """
    Polygons of the same number of corners, with multiplicities.

    ``corners`` (n, 3 or 4, 4) are homogeneous, wound counter-clockwise seen from outside the
    volume; ``multiplicity`` (n,) is positive.
    """

    corners: NDArray[np.float64]
    multiplicity: NDArray[np.int64]


def make_light_cap(
    caster: Caster, light: NDArray[np.float64], among: NDArray[np.intp] | None = None
) -> VolumePolygons:
    """
    Return the casting faces, wound to face the light: triangles with w = 1.

    Lit faces of closed components; all faces of open components except edge-on ones. ``among``
    limits the faces, if given.
    """
    chosen = np.arange(len(caster.faces)) if among is None else among
    side = find_sides(caster.planes[:, chosen], light)
    turned = (side < 0) & ~caster.is_closed[caster.component[chosen]]
    faces = np.concatenate([caster.faces[chosen[side > 0]], caster.faces[chosen[turned]][:, ::-1]])
    corners = np.ones((len(faces), 3, 4))
    corners[..., :3] = caster.vertices[faces]
    return VolumePolygons(corners, np.ones(len(faces), np.int64))


def make_sides(caster: Caster, light: NDArray[np.float64]) -> VolumePolygons:
    """Sweep the silhouette to infinity: quads for a point light, triangles for a direction."""
    edges, multiplicity = find_silhouette_edges(caster, light)
    corners = np.ones((len(edges), 4 if light[3] else 3, 4))
    ends = caster.vertices[edges]
    # A lit face lies left of its edge: the side runs back along it, then away from the light.
    corners[:, 0, :3] = ends[:, 1]
    corners[:, 1, :3] = ends[:, 0]
    if light[3]:
        corners[:, 2] = _extrude(ends[:, 0], light)
        corners[:, 3] = _extrude(ends[:, 1], light)
    else:
        corners[:, 2] = _extrude(ends[:, 0], light)
    return VolumePolygons(corners, multiplicity)


def make_dark_cap(caster: Caster, light: NDArray[np.float64]) -> VolumePolygons:
    """
    Close the volume at infinity: triangles with w = 0; none for a directional light.

    Where the light is outside the caster's bounds, a fan over the extruded silhouette suffices
    (McGuire et al. 2003). A fan around an enclosed light closes the wrong way and shifts every
    z-fail count, so there the light cap's faces are extruded (docs/papers.md, M3).
    """
    if light[3] == 0:
        return VolumePolygons(np.zeros((0, 3, 4)), np.zeros(0, np.int64))
    used = caster.vertices[caster.faces.ravel()]
    low, high = used.min(0), used.max(0)
    margin = 1e-6 * (high - low).max()  # a light in a wall is surrounded by the silhouette
    if ((light[:3] > low - margin) & (light[:3] < high + margin)).all():
        cap = make_light_cap(caster, light)
        return VolumePolygons(
            _extrude(cap.corners[:, ::-1, :3].reshape(-1, 3), light).reshape(-1, 3, 4),
            cap.multiplicity,
        )
    edges, multiplicity = find_silhouette_edges(caster, light)
    if not len(edges):
        return VolumePolygons(np.zeros((0, 3, 4)), multiplicity)
    ends = caster.vertices[edges]
    hub = np.broadcast_to(ends[0, 0], (len(edges), 3))
    fan = np.stack([hub, ends[:, 1], ends[:, 0]], 1)  # the dark cap faces away from the light
    return VolumePolygons(_extrude(fan.reshape(-1, 3), light).reshape(-1, 3, 4), multiplicity)


def _extrude(points: NDArray[np.float64], light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Extrude points to infinity, away from the light, (n, 4)."""
    away = np.zeros((len(points), 4))
    away[:, :3] = light[3] * points - light[:3]
    return away


def count_polygons(
    polygons: VolumePolygons,
    matrix: NDArray[np.float64],
    keys: NDArray[np.float64] | float,
    size: tuple[int, int],
    *,
    nearer: bool,
) -> NDArray[np.int32]:
    """
    Sum the multiplicities of polygons in front of a surface, or behind it.

    ``keys`` are the surface's depth keys, (rows, cols) or one for all; ``nearer`` counts where a
    polygon's key is greater, else where it is not (and the polygon is in front of the eye).
    Polygons that face the eye add their multiplicity, others subtract it.
    """
    cols, rows = size
    sums = np.zeros((rows, cols), np.int32)
    points = polygons.corners @ matrix.T
    surface = np.ascontiguousarray(np.broadcast_to(np.asarray(keys, np.float64), (rows, cols)))
    _count(points, polygons.multiplicity, surface, nearer, sums)
    return sums


@borrowing
def _cross(p, q, out):
    out[0] = p[1] * q[2] - p[2] * q[1]
    out[1] = p[2] * q[0] - p[0] * q[2]
    out[2] = p[0] * q[1] - p[1] * q[0]


@inner
def _plane_of(p, slope):
    """Find the key as a linear functional on a polygon's plane; return twice the signed area."""
    u = np.empty(4)
    v = np.empty(4)
    part = np.empty((3, 3))
    best = 0.0
    # Corners may coincide at infinity: use the corner with the largest triangle.
    for k in range(2, p.shape[0]):
        for j in range(4):
            u[j] = p[1, j] - p[0, j]
            v[j] = p[k, j] - p[0, j]
        _cross(u, v, part[0])
        _cross(v, p[0], part[1])
        _cross(p[0], u, part[2])
        det = p[0, 0] * part[0, 0] + p[0, 1] * part[0, 1] + p[0, 2] * part[0, 2]
        if abs(det) > abs(best):
            best = det
            for j in range(3):
                slope[j] = (p[0, 3] * part[0, j] + u[3] * part[1, j] + v[3] * part[2, j]) / det
    return best


@kernel
def _count(points, multiplicity, surface, nearer, sums):
    rows, cols = sums.shape
    n = points.shape[1]
    line = np.empty(3)
    left = np.empty((4, 2))
    right = np.empty((4, 2))
    slope = np.empty(3)
    span = np.empty(2)
    for q in range(points.shape[0]):
        p = points[q]
        det = _plane_of(p, slope)
        if det == 0.0:
            continue
        sign = 1.0 if det > 0.0 else -1.0
        span[0] = 0.0
        span[1] = np.float64(rows)
        left[:, 0] = -1e9
        right[:, 0] = 1e9
        left[:, 1] = right[:, 1] = 0.0
        for k in range(n):
            _cross(p[k], p[(k + 1) % n], line)
            bound(line[0], line[1], line[2], sign, left[k], right[k], span)
        m = multiplicity[q] if sign < 0.0 else -multiplicity[q]
        for r in range(np.int64(max(span[0], 0.0)), np.int64(min(span[1], np.float64(rows)))):
            y = np.float64(r)
            x0 = -1e9
            x1 = 1e9
            for k in range(n):
                x0 = max(x0, left[k, 0] + left[k, 1] * y)
                x1 = min(x1, right[k, 0] + right[k, 1] * y)
            for c in range(
                np.int64(np.ceil(min(max(x0, 0.0), np.float64(cols)))),
                np.int64(np.ceil(min(max(x1, 0.0), np.float64(cols)))),
            ):
                key = slope[0] * c + slope[1] * y + slope[2]
                if (key > surface[r, c]) == nearer:
                    sums[r, c] += m
