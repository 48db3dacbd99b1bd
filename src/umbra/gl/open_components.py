"""
Lights in and near casters: what to open, where counts start, which faces to cut finer.

Closed components must follow the open rule in some views, as the CPU device decides.

Lit faces alone tell how deep a visible point lies only where its winding number is at
least the light's (docs/papers.md, S1). That can fail only for a component that
holds the light, or is wound inward; of most scenes there is none, and nothing is done.

The far end of a point is its way from the light, which a shader takes as a difference of
float32 numbers. A micrometre from an edge of a few metres that loses all that says where
the edge's shadow goes, and the ways to the edge's ends are opposite: nothing spans the
side between them. So near a lamp each edge and each face gets one more point, where it is
nearest to the lamp, and the ways to it and to corners that are near are found in float64.
Sides and caps are cut there alike, so volumes stay closed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.volumes import BodyVolumes
from umbra.rays.eye_count import find_anchor, find_around
from umbra.rays.holding import find_holders, find_near_faces
from umbra.scene import Camera
from umbra.scene.mesh import transform_points
from umbra.volume.adjacency import Caster
from umbra.volume.box_tree import BoxTree

__all__ = ["Nearby", "find_held", "find_near", "find_nearby", "find_opened", "find_start"]

_ATTEMPTS = 8
_TILT = 1e-5  # a millimetre in a hundred metres
_REACH = 1e-3
"""Of a body's size: farther from a lamp float32 tells its shadows to some millimetres in 10 m."""

_MOST = 2000  # faces; of a finer mesh the nearest


def find_near(
    bodies: Sequence[Body], tree: BoxTree, light: NDArray[np.float64]
) -> list[NDArray[np.intp]]:
    """
    Find the shells near a light (4,), relative to the scene's origin, on which all below depends.

    Returns for each body instances and shells, (n, 2) int each; none under a directional light.
    ``tree`` is of the boxes of all shells of all bodies.
    """
    nothing = np.zeros((0, 2), np.intp)
    if light[3] == 0.0 or not bodies:
        return [nothing for _ in bodies]
    reach = _REACH * max(body.size * body.stretch for body in bodies)
    found = tree.find_holding(light[:3] / light[3], reach)
    lists, first = [], 0
    for body in bodies:
        end = first + body.n_shells * len(body.groups)
        mine = found[np.searchsorted(found, first) : np.searchsorted(found, end)] - first
        lists.append(np.stack(np.divmod(mine, body.n_shells), 1) if len(mine) else nothing)
        first = end
    return lists


def find_held(
    body: Body,
    origin: NDArray[np.float64],
    lights: NDArray[np.float64],
    near: NDArray[np.intp],
) -> NDArray[np.intp]:
    """
    Find the faces of a body's instances that hold the light, and so cast nothing.

    Parameters
    ----------
    body : Body
    origin : (3,) float64
        Of the scene.
    lights : (n_instances, 4) float64
        In each instance's own frame.
    near : (n, 2) int
        Instances and shells near the light, of ``find_near``.

    Returns
    -------
    held : (n, 2) int
        Instance and face.
    """
    held = []
    for instance in np.unique(near[:, 0]).tolist():
        transform = body.transforms[instance]
        coarse = np.abs(origin) + np.abs(transform[:3, 3])  # what the model's coordinates add
        moved = np.abs(np.linalg.inv(transform[:3, :3])) @ coarse
        shells = near[near[:, 0] == instance, 1]
        some = body.list_faces(shells)
        faces = find_holders(body.caster, body.blocks, lights[instance], moved, some)
        held.append(np.stack([np.full(len(faces), instance), faces], 1))
    return np.concatenate([np.zeros((0, 2), np.intp), *held])


def find_opened(
    body: Body,
    camera: Camera,
    origin: NDArray[np.float64],
    lights: NDArray[np.float64],
    held: NDArray[np.intp],
    near: NDArray[np.intp],
) -> NDArray[np.bool_]:
    """
    Find the components to open, (n_instances, n_components) bool.

    Parameters as in ``find_held``, which gives ``held``.
    """
    opened = np.zeros((len(lights), len(body.caster.is_closed)), np.bool_)
    if not len(near) and not body.any_inward:
        return opened
    apex = camera.apex(origin)
    forward = camera.axes()[2]
    asked = range(len(lights)) if body.any_inward else np.unique(near[:, 0]).tolist()
    for instance in asked:
        light = lights[instance]
        shells = near[near[:, 0] == instance, 1]
        suspects = body.is_inward | (body.caster.is_closed & _hold_components(body, shells, light))
        if not suspects.any():
            continue
        transform = body.transforms[instance]
        eye = np.linalg.solve(transform, apex)
        eye[3] = apex[3]
        caster = body.caster.without(held[held[:, 0] == instance, 1])
        found = _enclose(body, caster, eye, light)
        # Past a wall that the near plane cuts away the winding number is not the eye's.
        depth = np.append(forward, -forward @ (camera.eye - origin)) @ transform
        cut = _reach_before(body, depth, camera.near) & suspects
        if cut.any():
            found |= cut & (find_around(caster, body.blocks, light) | body.is_inward)
        opened[instance] = found | (body.caster.is_closed & ~caster.is_closed)
    return opened


def _hold(bounds: NDArray[np.float64], light: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which boxes (n, 2, 3) hold a lamp."""
    margin = 1e-6 * (bounds[:, 1] - bounds[:, 0]).max(1, keepdims=True)
    place = light[:3]
    inside = (place >= bounds[:, 0] - margin) & (place <= bounds[:, 1] + margin)
    return np.asarray(inside.all(1))


def _hold_components(
    body: Body, shells: NDArray[np.intp], light: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Tell which components' boxes hold a lamp that is near some shells, (n_components,)."""
    found = np.zeros(len(body.component_shell), np.bool_)
    holding = shells[_hold(body.bounds[shells], light)]
    if len(holding):
        some = np.flatnonzero(np.isin(body.component_shell, holding))
        found[some] = _hold(body.component_bounds[some], light)
    return found


def _enclose(body: Body, caster: Caster, eye: NDArray, light: NDArray) -> NDArray[np.bool_]:
    """Find the components around the light more often than around the eye."""
    size = 1.0 + max(np.abs(eye[:3]).max(), np.abs(body.bounds).max())
    if eye[3] == 0:
        size = 1.0
    for attempt in range(_ATTEMPTS):  # an eye in a volume's side steps aside
        aside = 1e-10 * attempt * size * np.array([0.83, 0.56, 0.37, 0.0])
        anchor = find_anchor(caster, body.blocks, eye + aside, light)
        if anchor.is_clean:
            break
    return anchor.enclosed


def _reach_before(body: Body, depth: NDArray[np.float64], near: float) -> NDArray[np.bool_]:
    """Tell which components have a face that reaches before the near plane."""
    found = np.zeros(len(body.caster.is_closed), np.bool_)
    along = body.caster.vertices @ depth[:3] + depth[3]
    found[body.caster.component[along[body.caster.faces].min(1) < near]] = True
    return found


def find_start(
    volumes: list[BodyVolumes],
    camera: Camera,
    light: NDArray[np.float64],
    chosen: NDArray[np.bool_],
) -> tuple[int, NDArray[np.float64]]:
    """
    Count the volumes that parallel rays end in, of those drawn to infinity behind surfaces.

    In perspective dark caps are drawn there; parallel rays all end in one point, where
    nothing can be drawn. If that point lies in a volume's side, rays tilt a little.

    Parameters
    ----------
    volumes : list of BodyVolumes
    camera : Camera
    light : (4,) float64
        Relative to the scene's origin, a direction of length 1.
    chosen : (n_shells,) bool
        Components, of all bodies, whose volumes are counted behind and not cut.

    Returns
    -------
    start : int
        0 in perspective, and under a directional light.
    tilt : (2,) float64
        Of the rays to the left and down, as tangents; for ``Projection.tilted``.
    """
    tilt = np.zeros(2)
    if camera.is_perspective or not volumes:
        return 0, tilt
    right, up, forward = camera.axes()
    # Rays along a directional light would meet all ends of volumes in one point.
    along = light[3] == 0 and bool(np.linalg.norm(np.cross(forward, light[:3])) < _TILT)
    for attempt in range(int(along), _ATTEMPTS):
        tilt = _TILT * attempt * np.array([0.83, 0.56])
        start, is_clean = _end_rays(volumes, forward - tilt[0] * right - tilt[1] * up, chosen)
        if is_clean:
            break
    return start, tilt


def _end_rays(
    volumes: list[BodyVolumes], way: NDArray[np.float64], chosen: NDArray[np.bool_]
) -> tuple[int, bool]:
    """Count the chosen volumes at the far end of a way; tell whether none begins there."""
    start, is_clean, offset = 0, True, 0
    for each in volumes:
        body = each.body
        for instance, light in enumerate(each.lights):
            if light[3] and chosen[offset : offset + body.n_shells].any():
                inside = np.linalg.solve(body.transforms[instance], np.append(way, 0.0))
                end = np.append(inside[:3], 0.0)
                anchor = find_anchor(each.caster_of(instance), body.blocks, end, light)
                adds = anchor.lit + anchor.unlit * ~each.is_closed[instance]
                start += int(adds[chosen[offset + body.component_shell]].sum())
                is_clean &= anchor.is_clean
            offset += body.n_shells
    return start, is_clean


@dataclass(frozen=True, eq=False)
class Nearby:
    """
    Points near a light that name their far ends themselves.

    Parameters
    ----------
    points : (n, 2, 3) float64
        Place relative to the scene's origin, and unit vector from the light.
    at_corner, on_edge, on_face : dict
        One, two or three point numbers of the geometry, ascending -> which of these points
        stands for the corner, or lies on the edge or face.
    corners : (n,) int64
        Points of the geometry from which any of this can be met, ascending.
    """

    points: NDArray[np.float64]
    at_corner: dict[int, int]
    on_edge: dict[tuple[int, int], int]
    on_face: dict[tuple[int, ...], int]
    corners: NDArray[np.int64]

    def refine(self, numbers: NDArray[np.uint32], first: int) -> NDArray[np.uint32]:
        """
        Cut triangles (n,) uint32 where they are nearest to the light.

        ``first`` is the number of the first of ``points``, after those of the geometry.
        """
        triangles = numbers.reshape(-1, 3)
        is_near = np.isin(triangles >> 1, self.corners).any(1)
        if not is_near.any():
            return numbers
        cut: list[tuple[int, int, int]] = []
        for triangle in triangles[is_near].tolist():
            cut += self._cut(triangle, first)
        added = np.array(cut, np.uint32).ravel()
        return np.concatenate([triangles[~is_near].ravel(), added])

    def _cut(self, triangle: list[int], first: int) -> list[tuple[int, int, int]]:
        """Cut one triangle at what lies on its edges, and within it if it is a face."""
        rim, feet = [], []
        for k, number in enumerate(triangle):
            onward = triangle[(k + 1) % 3]
            end = number & 1
            stand = self.at_corner.get(number >> 1)
            rim.append(number if stand is None else 2 * (first + stand) + end)
            pair = (min(number, onward) >> 1, max(number, onward) >> 1)
            foot = self.on_edge.get(pair) if end == onward & 1 else None
            if foot is not None:
                feet.append(len(rim))
                rim.append(2 * (first + foot) + end)
        ends = {number & 1 for number in triangle}
        within = self.on_face.get(tuple(sorted(number >> 1 for number in triangle)))
        if len(ends) == 1 and within is not None:
            hub = 2 * (first + within) + ends.pop()
            return [(hub, a, b) for a, b in pairwise([*rim, rim[0]])]
        start = feet[0] if feet else 0
        if len(feet) == 1:
            start = (start + 2) % 4  # the corner across
        rim = rim[start:] + rim[:start]
        return [(rim[0], a, b) for a, b in pairwise(rim[1:])]


def find_nearby(
    volumes: list[BodyVolumes], light: NDArray[np.float64], near: list[NDArray[np.intp]]
) -> Nearby | None:
    """
    Find what a light (4,), relative to the scene's origin, nearly touches; mostly nothing.

    ``near`` are instances and shells of each body, of ``find_near``: only these are asked.
    """
    points: list[NDArray[np.float64]] = []
    at_corner: dict[int, int] = {}
    on_edge: dict[tuple[int, int], int] = {}
    on_face: dict[tuple[int, ...], int] = {}
    met: set[int] = set()
    for each, mine in zip(volumes, near, strict=True):
        body = each.body
        reach = _REACH * body.size
        for instance in np.unique(mine[:, 0]).tolist():
            some = body.list_faces(mine[mine[:, 0] == instance, 1])
            faces = find_near_faces(body.caster, body.blocks, each.lights[instance], reach, some)[
                :_MOST
            ]
            if not len(faces):
                continue
            used, rows = np.unique(body.caster.faces[faces], return_inverse=True)
            # From the light, so that what is near has all its digits.
            apart = body.caster.vertices[used]
            apart = transform_points(body.transforms[instance], apart) - light[:3]
            numbers = body.first[instance] + used
            for corners in rows.reshape(-1, 3):
                names, ways = numbers[corners].tolist(), apart[corners]
                _add_corners(names, ways, reach, at_corner, points)
                _add_edges(names, ways, reach, on_edge, points)
                _add_face(names, ways, reach, on_face, points)
                met.update(names)
    if not points:
        return None
    ways = np.array(points)
    units = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    stacked = np.stack([ways + light[:3], units], 1)
    return Nearby(stacked, at_corner, on_edge, on_face, np.array(sorted(met)))


def _add_corners(
    names: list[int], ways: NDArray, reach: float, at_corner: dict, points: list
) -> None:
    for name, way in zip(names, ways, strict=True):
        if name not in at_corner and 0.0 < np.linalg.norm(way) < reach:
            at_corner[name] = len(points)
            points.append(way)


def _add_edges(names: list[int], ways: NDArray, reach: float, on_edge: dict, points: list) -> None:
    for i, j in ((0, 1), (1, 2), (2, 0)):
        pair = (min(names[i], names[j]), max(names[i], names[j]))
        a, b = (ways[names.index(name)] for name in pair)  # in one direction for both faces
        along = b - a
        part = -(a @ along) / (along @ along)
        foot = a + part * along
        if pair not in on_edge and 0.0 < part < 1.0 and 0.0 < np.linalg.norm(foot) < reach:
            on_edge[pair] = len(points)
            points.append(foot)


def _add_face(names: list[int], ways: NDArray, reach: float, on_face: dict, points: list) -> None:
    a, b, c = ways
    normal = np.cross(b - a, c - a)
    square = normal @ normal
    nearest = ways[np.argmin(np.einsum("ij,ij->i", ways, ways))]
    height = normal @ nearest / square if square > 0.0 else 0.0
    is_over = all(normal @ np.cross(p, q) > 0.0 for p, q in ((a, b), (b, c), (c, a)))
    if is_over and 0.0 < abs(height) * np.sqrt(square) < reach:
        on_face[tuple(sorted(names))] = len(points)
        points.append(height * normal)
