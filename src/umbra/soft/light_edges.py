"""
Edges that may bound what a receiver sees hidden of a light, and their penumbra wedges.

A receiver has a silhouette of its own: an edge is on it where the receiver sees its two faces from
different sides. An edge affects only receivers in its wedge, bounded by four planes (Akenine-Möller
and Assarsson 2002).
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.soft import AreaLight, make_axes
from umbra.volume.adjacency import Caster

if TYPE_CHECKING:
    from umbra.soft.frames import VolumeCounts

__all__ = [
    "EdgeTable",
    "LightFrame",
    "find_light_edges",
    "find_multiplicity",
    "find_open_components",
    "is_in",
    "list_light_edges",
    "make_coverage_planes",
    "map_to_unit_light",
    "open_components",
]


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


def find_light_edges(counter: "VolumeCounts", light: AreaLight) -> tuple[EdgeTable, LightFrame]:
    """Find the edges of a counter's casters that may bound what is seen of a light."""
    source = light.light.local(counter.scene.origin)
    caster = counter.find_casting(source)
    if not light.light.is_point:
        source[:3] /= np.linalg.norm(source[:3])
    edges = list_light_edges(caster, caster.vertices, source, light.radius)
    is_square = light.edges is not None
    return edges, LightFrame(source, light.radius, is_square, map_to_unit_light(light, source))


def open_components(counter: "VolumeCounts", light: AreaLight) -> "VolumeCounts":
    """Return a counter whose components that reach into the light follow the open rule."""
    opened = find_open_components(counter.caster, light, light.light.local(counter.scene.origin))
    return counter.with_caster(counter.caster.opened(opened)) if opened.any() else counter


def find_open_components(
    caster: Caster, light: AreaLight, source: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """
    Find the closed components whose bounding box meets the light, (n_components,) bool.

    Components in front of some spots and behind others must follow the open rule for all spots.
    ``source`` (4,) is the light's centre in the caster's frame.
    """
    if source[3] == 0.0:
        return np.zeros(len(caster.is_closed), np.bool_)
    low = np.full((len(caster.is_closed), 3), np.inf)
    high = -low
    corners = caster.vertices[caster.faces]
    np.minimum.at(low, caster.component, corners.min(1))
    np.maximum.at(high, caster.component, corners.max(1))
    middle = source[:3] / source[3]
    meets = (low <= middle + light.radius) & (high >= middle - light.radius)
    return caster.is_closed & meets.all(1)


def list_light_edges(
    caster: Caster, vertices: NDArray[np.float64], source: NDArray[np.float64], radius: float
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
    source : (4,) float64
        The light's centre; a unit direction for w = 0.
    radius : float
        Radius of the light's bounding sphere [m]; for a disc in the sky tan of its angular radius.
    """
    planes = caster.planes[:, :-1].T
    if vertices is not caster.vertices:
        planes = _make_planes_again(caster, vertices)
    size = np.linalg.norm(planes[:, :3], axis=1)
    planes = planes / np.where(size > 0, size, 1.0)[:, None]
    side = planes @ source
    sure = np.where(np.abs(side) > 1.0001 * radius, np.sign(side), np.nan)
    turn = np.where(caster.turn, -1.0, 1.0)
    first, second = caster.edge_faces.T
    possible = np.flatnonzero(~(sure[first] == turn * sure[second]))
    faces = planes[caster.edge_faces[possible]]
    ends = vertices[caster.edges[possible].ravel()].reshape(-1, 6)
    wedges = np.zeros((len(possible), 4, 4))
    make_coverage_planes(ends, source, radius, wedges)
    return EdgeTable(ends, faces, caster.weight[possible] / 2.0, turn[possible], wedges)


def _make_planes_again(caster: Caster, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the planes (n_faces, 4) of moved vertices; 0 for faces that cast nothing."""
    a, b, c = (vertices[caster.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    planes = np.concatenate([normal, -np.einsum("ij,ij->i", normal, a)[:, None]], 1)
    planes[~caster.planes[:, :-1].any(0)] = 0.0
    return planes


@kernel
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


@kernel
def is_in(planes, x, y, z, margin):
    """Tell whether a point is in a wedge of ``make_coverage_planes``, or within a margin of it."""
    for k in range(4):
        p = planes[k]
        if p[0] * x + p[1] * y + p[2] * z + p[3] > margin:
            return False
    return True


@kernel
def find_multiplicity(edges, e, x, y, z, margin):
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


def map_to_unit_light(light: AreaLight, source: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Find the map of a light's plane to the unit light, (3, 3).

    Rows u and v map to the unit square or disc, the third is the plane's normal; all 0 for a ball,
    whose plane faces each receiver. ``source`` (4,) is the light's centre, or a unit direction.
    """
    if light.edges is not None:
        half_u, half_v = light.edges / 2
        normal = np.cross(half_u, half_v)
        area = np.linalg.norm(normal)
        normal /= area
        return np.stack([np.cross(half_v, normal) / area, np.cross(normal, half_u) / area, normal])
    if light.light.is_point:
        return np.zeros((3, 3))
    return np.stack([*(axis / light.radius for axis in make_axes(source[:3])), source[:3]])
