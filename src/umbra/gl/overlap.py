"""
How many shadow volumes can hold one point at most: whether 8 bits of stencil are enough.

Seen from the light every volume is what throws it, so the deepest count is the largest
number of casting faces on one ray from the light. Boxes around things, or around faces,
bound it from above, on a grid of the light's view.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.volumes import BodyVolumes
from umbra.volume.bounds import find_box_points

__all__ = ["STENCIL_MOST", "bound_count", "find_most"]

STENCIL_MOST = 255
_AXES = np.concatenate([np.eye(3), -np.eye(3)])


def bound_count(
    volumes: list[BodyVolumes], most: list[NDArray[np.int64]], light: NDArray[np.float64]
) -> int:
    """
    Bound the shadow count of any point.

    Parameters
    ----------
    volumes : list of BodyVolumes
    most : list of (n_instances * n_things,) int
        Of ``find_most``: what one thing can add.
    light : (4,) float64
        Relative to the scene's origin.

    Returns
    -------
    bound : int
        Never too low; found no closer than is needed to tell that 255 are enough.
    """
    if not volumes:
        return 0
    weights = np.concatenate(most)
    bound = int(weights.sum())
    if bound <= STENCIL_MOST:
        return bound
    boxes = np.concatenate([each.body.world_bounds() for each in volumes])
    bound = min(bound, _stack(find_box_points(boxes)[..., :3], weights, light))
    if bound <= STENCIL_MOST:
        return bound
    faces = np.concatenate([_find_casting(each) for each in volumes])
    return min(bound, _stack(faces, np.ones(len(faces), np.int64), light))


def _find_casting(volumes: BodyVolumes) -> NDArray[np.float64]:
    """Give the casting faces of all instances in the scene's frame, (n, 3, 3)."""
    body, caster = volumes.body, volumes.body.caster
    lists = []
    for light, transform, is_closed in zip(
        volumes.lights, body.transforms, volumes.is_closed, strict=True
    ):
        side = light @ caster.planes[:, :-1]
        faces = caster.faces[(side > 0) | ((side < 0) & ~is_closed[caster.component])]
        lists.append(caster.vertices[faces] @ transform[:3, :3].T + transform[:3, 3])
    return np.concatenate(lists)


def find_most(body: Body, opened: NDArray[np.bool_]) -> NDArray[np.int64]:
    """
    Bound what each thing of a body adds to a count: 1 for what is convex, else its faces.

    Parameters
    ----------
    body : Body
    opened : (n_instances, n_components) bool

    Returns
    -------
    most : (n_instances * n_things,) int64
    """
    n_faces = np.bincount(body.caster.component)
    most = np.zeros((len(opened), body.n_things), np.int64)
    if not opened.any():
        of_component = np.where(body.is_convex, 1, n_faces)
        most[:] = np.bincount(body.component_thing, of_component, body.n_things)
        return most.ravel()
    for row, each in zip(most, opened, strict=True):
        of_component = np.where(body.is_convex & ~each, 1, n_faces)
        row[:] = np.bincount(body.component_thing, of_component, body.n_things)
    return most.ravel()


def _stack(points: NDArray[np.float64], weights: NDArray, light: NDArray) -> int:
    """Bound how much weight lies on one ray from the light; shapes are (n, m, 3) hulls."""
    cells = int(np.clip(4 * np.sqrt(len(points)), 64, 1024))
    if light[3] == 0:
        toward = light[:3] / np.linalg.norm(light[:3])
        right = np.cross(toward, _AXES[np.abs(toward).argmin()])
        right /= np.linalg.norm(right)
        flat = points @ np.stack([right, np.cross(toward, right)], 1)
        low, high = flat.min(1), flat.max(1)
        corner, size = low.min(0), np.maximum(np.ptp(flat, axis=(0, 1)), 1e-300)
        return _pile((low - corner) / size, (high - corner) / size, weights, cells)
    rays = points - light[:3]
    return max(_pile_face(rays, weights, axis, cells) for axis in _AXES)


def _pile_face(rays: NDArray, weights: NDArray, axis: NDArray, cells: int) -> int:
    """Pile up what a point light sees through one face of a cube around it."""
    ahead = rays @ axis
    some = (ahead > 0).any(1)
    if not some.any():
        return 0
    rays, ahead, weights = rays[some], ahead[some], weights[some]
    whole = ahead.min(1) > 1e-9 * np.abs(rays).max(initial=1e-300)
    k = int(np.abs(axis).argmax())
    across = rays[..., [(k + 1) % 3, (k + 2) % 3]] / np.where(whole[:, None], ahead, 1.0)[..., None]
    low = np.where(whole[:, None], across.min(1), -1.0)
    high = np.where(whole[:, None], across.max(1), 1.0)
    inside = (low <= 1).all(1) & (high >= -1).all(1)
    return _pile((low[inside] + 1) / 2, (high[inside] + 1) / 2, weights[inside], cells)


def _pile(low: NDArray, high: NDArray, weights: NDArray, cells: int) -> int:
    """Add weights over boxes in the unit square, and give the largest sum in a cell."""
    first = np.clip(np.floor(low * cells), 0, cells - 1).astype(np.int64)
    last = np.clip(np.floor(high * cells), 0, cells - 1).astype(np.int64) + 1
    row = cells + 1
    heap = np.zeros(row * row, np.int64)
    for y, x, sign in ((first, first, 1), (first, last, -1), (last, first, -1), (last, last, 1)):
        np.add.at(heap, y[:, 1] * row + x[:, 0], sign * weights)
    return int(heap.reshape(row, row).cumsum(0).cumsum(1).max(initial=0))
