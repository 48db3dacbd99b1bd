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

from umbra.gl.bodies import Body
from umbra.gl.volumes import BodyVolumes, list_drawn
from umbra.kernels import kernel
from umbra.rays.eye_count import find_anchor, find_around
from umbra.rays.holding import find_holders
from umbra.scene import Camera
from umbra.volume.adjacency import Caster
from umbra.volume.box_tree import BoxTree

__all__ = ["REACH", "find_faces_at_light", "find_near_shells", "find_opened", "find_start"]

_ATTEMPTS = 8
_TILT = 1e-5  # a millimetre in a hundred metres
REACH = 1e-3
"""Of a body's size: farther from a lamp float32 tells its shadows to some millimetres in 10 m."""


def find_near_shells(
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
    near: list[dict[int, NDArray[np.intp]]] = [{} for _ in lights]
    lamps = np.flatnonzero(lights[:, 3])
    if not len(lamps) or not len(bodies):
        return near
    reach = REACH * max(body.size * body.stretch for body in bodies)
    rows, shells = tree.find_holding(lights[lamps, :3] / lights[lamps, 3:], reach)
    owners = np.searchsorted(starts, shells, "right") - 1
    for row, owner in sorted(set(zip(rows.tolist(), owners.tolist(), strict=True))):
        own = shells[(rows == row) & (owners == owner)] - starts[owner]
        near[lamps[row]][owner] = np.stack(np.divmod(own, bodies[owner].n_shells), 1)
    return near


def find_faces_at_light(
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
        Instances and shells near the light, from ``find_near_shells``.

    Returns
    -------
    held : (n, 2) int
        Instance and face.
    """
    held: list[NDArray[np.intp]] = []
    if not len(near):
        return near
    for instance, shells in body.split(near):
        coarse = np.abs(origin)  # magnitude of the model's coordinates
        if not body.is_still:
            transform = body.transforms[instance]
            coarse = np.abs(np.linalg.inv(transform[:3, :3])) @ (coarse + np.abs(transform[:3, 3]))
        among = body.list_faces(shells)
        faces = find_holders(body.caster, body.blocks, lights[instance], coarse, among)
        if len(faces):
            held.append(np.stack([np.full(len(faces), instance), faces], 1))
    return np.concatenate([near[:0], *held]) if held else near[:0]


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

    Parameters as in ``find_faces_at_light``, which returns ``held``.
    """
    by_instance: dict[int, NDArray[np.bool_]] = {}
    inward = np.flatnonzero(body.is_inward) if body.any_inward else near[:0, 0]
    nearby = dict(body.split(near))
    for instance in range(len(lights)) if body.any_inward else nearby:
        light, shells = lights[instance], nearby.get(instance, near[:0, 1])
        shells = shells[_hold(body.bounds[shells], light[:3])]
        components = body.list_components(shells)
        components = components[_hold(body.component_bounds[components], light[:3])]
        suspects = np.append(inward, components[body.caster.is_closed[components]])
        if not len(suspects):
            continue
        apex, forward = camera.apex(origin), camera.axes()[2]
        eye = body.to_mesh(instance, apex)
        eye[3] = apex[3]
        caster = body.caster.without(held[held[:, 0] == instance, 1])
        by_instance[instance] = _enclose(body, caster, eye, light)
        # Beyond a wall cut away by the near plane the winding number is not the eye's.
        depth = np.append(forward, -forward @ (camera.eye - origin)) @ body.transforms[instance]
        cut = _reach_before(body, depth, camera.near, suspects)
        if len(cut):
            around = find_around(caster, body.blocks, light) | body.is_inward
            by_instance[instance][cut] |= around[cut]
        by_instance[instance] |= body.caster.is_closed & ~caster.is_closed
    if not any(which.any() for which in by_instance.values()):
        return body.none_opened
    opened = np.zeros_like(body.none_opened)
    for instance, which in by_instance.items():
        opened[instance] = which
    return opened


@kernel
def _hold(bounds, position):
    """Find the boxes (n, 2, 3) that hold a lamp, about."""
    holds = np.zeros(bounds.shape[0], np.bool_)
    for i in range(bounds.shape[0]):
        size = 0.0
        for axis in range(3):
            size = max(size, bounds[i, 1, axis] - bounds[i, 0, axis])
        margin, holds[i] = 1e-6 * size, True
        for axis in range(3):
            low, high = bounds[i, 0, axis] - margin, bounds[i, 1, axis] + margin
            holds[i] &= low <= position[axis] <= high
    return holds


def _enclose(body: Body, caster: Caster, eye: NDArray, light: NDArray) -> NDArray[np.bool_]:
    """Find the components with a larger winding number at the light than at the eye."""
    size = 1.0 + max(np.abs(eye[:3]).max(), body.blocks.largest)
    if eye[3] == 0:
        size = 1.0
    for attempt in range(_ATTEMPTS):  # an eye in a volume's side is moved slightly
        aside = 1e-10 * attempt * size * np.array([0.83, 0.56, 0.37, 0.0])
        anchor = find_anchor(caster, body.blocks, eye + aside, light)
        if anchor.is_clean:
            break
    return anchor.enclosed


def _reach_before(
    body: Body, depth: NDArray[np.float64], near: float, suspects: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Find the components, of the suspected, with a face in front of the near plane."""
    boxes = body.component_bounds[suspects]
    nearest = np.minimum(boxes[:, 0] * depth[:3], boxes[:, 1] * depth[:3]).sum(1) + depth[3]
    before = suspects[nearest < near]
    if not len(before):
        return before
    faces = np.flatnonzero(np.isin(body.caster.component, before))
    corners = body.caster.vertices[body.caster.faces[faces]]
    reaches = (corners @ depth[:3] + depth[3]).min(1) < near
    return np.unique(body.caster.component[faces[reaches]]).astype(np.intp)


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
        Tilt of the rays, left and down, as tangents; for ``CameraProjection.tilted``.
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
    for body_volumes, instance, is_chosen in list_drawn(volumes, chosen):
        body, light = body_volumes.body, body_volumes.lights[instance]
        if light[3]:
            end = body.to_mesh(instance, np.append(way, 0.0))
            end[3] = 0.0
            anchor = find_anchor(body_volumes.caster_of(instance), body.blocks, end, light)
            adding = anchor.find_adding(body_volumes.is_closed[instance])
            start += int(is_chosen[body.component_shell[adding]].sum())
            is_clean &= anchor.is_clean
    return start, is_clean
