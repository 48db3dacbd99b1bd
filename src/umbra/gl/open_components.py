"""
Lights in and near casters: nearby shells, components to open, start of counts.

Closed components must follow the open rule in some views, as on the CPU device.

Lit faces alone determine the count only where a visible point's winding number is at
least the light's (docs/papers.md, S1). That can fail only for a component that holds
the light or is wound inward; most scenes have none, and nothing is done.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.volumes import BodyVolumes, list_drawn
from umbra.rays.eye_count import find_anchor, find_around
from umbra.rays.holding import find_holders
from umbra.scene import Camera
from umbra.volume.adjacency import Caster
from umbra.volume.box_tree import BoxTree

__all__ = ["REACH", "find_held", "find_near", "find_opened", "find_start"]

_ATTEMPTS = 8
_TILT = 1e-5  # a millimetre in a hundred metres
REACH = 1e-3
"""Of a body's size: farther from a lamp float32 tells its shadows to some millimetres in 10 m."""


def find_near(
    bodies: Sequence[Body],
    starts: NDArray[np.intp],
    tree: BoxTree,
    lights: NDArray[np.float64],
) -> list[dict[int, NDArray[np.intp]]]:
    """
    Find the shells near each light (n, 4), relative to the scene's origin.

    Returns for each light the numbers of bodies, and instances and shells (n, 2) of each; none
    for a directional light. ``tree`` holds the boxes of all shells, body k those from
    ``starts[k]`` to ``starts[k + 1]``.
    """
    found: list[dict[int, NDArray[np.intp]]] = [{} for _ in lights]
    lamps = np.flatnonzero(lights[:, 3])
    if not len(lamps) or not len(bodies):
        return found
    reach = REACH * max(body.size * body.stretch for body in bodies)
    rows, shells = tree.find_holding(lights[lamps, :3] / lights[lamps, 3:], reach)
    owners = np.searchsorted(starts, shells, "right") - 1
    for row, owner in np.unique(np.stack([rows, owners], 1), axis=0).tolist():
        mine = shells[(rows == row) & (owners == owner)] - starts[owner]
        found[lamps[row]][owner] = np.stack(np.divmod(mine, bodies[owner].n_shells), 1)
    return found


def find_held(
    body: Body,
    origin: NDArray[np.float64],
    lights: NDArray[np.float64],
    near: NDArray[np.intp],
) -> NDArray[np.intp]:
    """
    Find the faces of a body's instances on which the light lies; they cast nothing.

    Parameters
    ----------
    body : Body
    origin : (3,) float64
        Origin of the scene.
    lights : (n_instances, 4) float64
        In each instance's own frame.
    near : (n, 2) int
        Instances and shells near the light, from ``find_near``.

    Returns
    -------
    held : (n, 2) int
        Instance and face.
    """
    held: list[NDArray[np.intp]] = []
    if not len(near):
        return near
    for instance in np.unique(near[:, 0]).tolist():
        transform = body.transforms[instance]
        coarse = np.abs(origin) + np.abs(transform[:3, 3])  # magnitude of the model's coordinates
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

    Parameters as in ``find_held``, which returns ``held``.
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
        shells = shells[_hold(body.bounds[shells], light)]
        if not len(shells) and not body.any_inward:
            continue
        suspects = body.is_inward | (body.caster.is_closed & _hold_components(body, shells, light))
        if not suspects.any():
            continue
        transform = body.transforms[instance]
        eye = np.linalg.solve(transform, apex)
        eye[3] = apex[3]
        caster = body.caster.without(held[held[:, 0] == instance, 1])
        found = _enclose(body, caster, eye, light)
        # Beyond a wall cut away by the near plane the winding number is not the eye's.
        depth = np.append(forward, -forward @ (camera.eye - origin)) @ transform
        cut = _reach_before(body, depth, camera.near, suspects)
        if cut.any():
            found |= cut & (find_around(caster, body.blocks, light) | body.is_inward)
        opened[instance] = found | (body.caster.is_closed & ~caster.is_closed)
    return opened


def _hold(bounds: NDArray[np.float64], light: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Find the boxes (n, 2, 3) that hold a lamp."""
    margin = 1e-6 * (bounds[:, 1] - bounds[:, 0]).max(1, keepdims=True)
    place = light[:3]
    inside = (place >= bounds[:, 0] - margin) & (place <= bounds[:, 1] + margin)
    return np.asarray(inside.all(1))


def _hold_components(
    body: Body, shells: NDArray[np.intp], light: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Find the components of the shells whose boxes hold a lamp, (n_components,)."""
    found = np.zeros(len(body.component_shell), np.bool_)
    some = np.flatnonzero(np.isin(body.component_shell, shells))
    found[some] = _hold(body.component_bounds[some], light)
    return found


def _enclose(body: Body, caster: Caster, eye: NDArray, light: NDArray) -> NDArray[np.bool_]:
    """Find the components with a larger winding number at the light than at the eye."""
    size = 1.0 + max(np.abs(eye[:3]).max(), np.abs(body.bounds).max())
    if eye[3] == 0:
        size = 1.0
    for attempt in range(_ATTEMPTS):  # an eye in a volume's side is moved slightly
        aside = 1e-10 * attempt * size * np.array([0.83, 0.56, 0.37, 0.0])
        anchor = find_anchor(caster, body.blocks, eye + aside, light)
        if anchor.is_clean:
            break
    return anchor.enclosed


def _reach_before(
    body: Body, depth: NDArray[np.float64], near: float, suspects: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Find the suspected components with a face in front of the near plane."""
    found = np.zeros(len(suspects), np.bool_)
    boxes = body.component_bounds
    nearest = np.minimum(boxes[:, 0] * depth[:3], boxes[:, 1] * depth[:3]).sum(1) + depth[3]
    asked = suspects & (nearest < near)
    if asked.any():
        faces = np.flatnonzero(asked[body.caster.component])
        corners = body.caster.vertices[body.caster.faces[faces]]
        reaches = (corners @ depth[:3] + depth[3]).min(1) < near
        found[body.caster.component[faces[reaches]]] = True
    return found


def find_start(
    volumes: Sequence[BodyVolumes],
    camera: Camera,
    light: NDArray[np.float64],
    chosen: NDArray[np.bool_],
) -> tuple[int, NDArray[np.float64]]:
    """
    Count the infinite z-fail volumes that hold the far end of parallel rays.

    In perspective, dark caps are drawn there; parallel rays all end in one point, where
    nothing can be drawn. If that point lies in a volume's side, rays are tilted slightly.

    Parameters
    ----------
    volumes : sequence of BodyVolumes
    camera : Camera
    light : (4,) float64
        Relative to the scene's origin, a direction of length 1.
    chosen : (n_shells,) bool
        Components of all bodies whose volumes are z-fail and not cut.

    Returns
    -------
    start : int
        0 in perspective, and under a directional light.
    tilt : (2,) float64
        Tilt of the rays, left and down, as tangents; for ``Projection.tilted``.
    """
    tilt = np.zeros(2)
    if camera.is_perspective:
        return 0, tilt
    right, up, forward = camera.axes()
    # Rays parallel to a directional light end where all its volumes end.
    along = light[3] == 0 and bool(np.linalg.norm(np.cross(forward, light[:3])) < _TILT)
    for attempt in range(int(along), _ATTEMPTS):
        tilt = _TILT * attempt * np.array([0.83, 0.56])
        start, is_clean = _end_rays(volumes, forward - tilt[0] * right - tilt[1] * up, chosen)
        if is_clean:
            break
    return start, tilt


def _end_rays(
    volumes: Sequence[BodyVolumes], way: NDArray[np.float64], chosen: NDArray[np.bool_]
) -> tuple[int, bool]:
    """Count the chosen volumes at the far end of a ray; return whether none begins there."""
    start, is_clean = 0, True
    for each, instance, mine in list_drawn(volumes, chosen):
        body, light = each.body, each.lights[instance]
        if light[3]:
            inside = np.linalg.solve(body.transforms[instance], np.append(way, 0.0))
            end = np.append(inside[:3], 0.0)
            anchor = find_anchor(each.caster_of(instance), body.blocks, end, light)
            adds = anchor.lit + anchor.unlit * ~each.is_closed[instance]
            start += int(adds[mine[body.component_shell]].sum())
            is_clean &= anchor.is_clean
    return start, is_clean
