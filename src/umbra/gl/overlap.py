"""
How many shadow volumes can hold one point at most: whether 8 bits of stencil are enough.

Seen from the light every volume is what throws it, so the deepest count is the largest
number of casting faces on one ray from the light. That number changes only where the ray
crosses the silhouette, so half the edges that cross a row of the light's view bound it;
and so do boxes around shells, or around faces, piled up on a grid.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.plan import STENCIL_MOST
from umbra.gl.volumes import BodyVolumes
from umbra.scene.mesh import transform_points
from umbra.volume.bounds import find_box_points
from umbra.volume.facing import find_sides

__all__ = ["bound_boxes", "bound_count", "find_most"]

_ROWS = 4096
_NO_BOUND = 1 << 62
_AXES = np.concatenate([np.eye(3), -np.eye(3)])


def bound_count(
    volumes: list[BodyVolumes], most: list[NDArray[np.int64]], light: NDArray[np.float64]
) -> int:
    """
    Bound the shadow count of any point under a light (4,), relative to the scene's origin.

    The bound is never too low, and no closer than is needed to tell that 255 are enough.
    ``most`` is what ``find_most`` gives for each of the volumes.
    """
    if not volumes:
        return 0
    weights = np.concatenate(most)
    bound = int(weights.sum())
    if bound <= STENCIL_MOST:
        return bound
    boxes = np.concatenate([each.body.world_bounds() for each in volumes])
    bound = min(bound, _count_in_rows(volumes, boxes, light))
    if bound <= STENCIL_MOST:
        return bound
    bound = min(bound, bound_boxes(boxes, weights, light))
    if bound <= STENCIL_MOST:
        return bound
    points, faces = _find_casting(volumes)
    return min(bound, _stack(points, faces, np.ones(len(faces), np.int64), light))


def bound_boxes(
    boxes: NDArray[np.float64], weights: NDArray[np.int64], light: NDArray[np.float64]
) -> int:
    """Bound the count of any point by boxes (n, 2, 3) around casters and what each can add (n,)."""
    if weights.sum() <= STENCIL_MOST:
        return int(weights.sum())
    corners = find_box_points(boxes)[..., :3].reshape(-1, 3)
    shapes = np.arange(len(corners)).reshape(-1, 8)
    return min(int(weights.sum()), _stack(corners, shapes, weights, light))


def _find_casting(volumes: list[BodyVolumes]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Give the points of all instances in the scene's frame, and the faces that cast."""
    points, faces, count = [], [], 0
    for each in volumes:
        for instance, (light, transform, is_closed) in enumerate(
            zip(each.lights, each.body.transforms, each.is_closed, strict=True)
        ):
            caster = each.caster_of(instance)
            side = find_sides(caster.planes[:, :-1], light)
            casts = (side > 0) | ((side < 0) & ~is_closed[caster.component])
            faces.append(caster.faces[casts].astype(np.int64) + count)
            points.append(transform_points(transform, caster.vertices))
            count += len(caster.vertices)
    return np.concatenate(points), np.concatenate(faces)


def find_most(body: Body, opened: NDArray[np.bool_]) -> NDArray[np.int64]:
    """
    Bound what each component of a body's instances adds to a count, (n,) int64.

    What is convex adds 1, all else at most its faces.
    """
    n_faces = np.bincount(body.caster.component)
    most = np.zeros((len(opened), body.n_shells), np.int64)
    if not opened.any():
        of_component = np.where(body.is_convex, 1, n_faces)
        most[:] = np.bincount(body.component_shell, of_component, body.n_shells)
        return most.ravel()
    for row, each in zip(most, opened, strict=True):
        of_component = np.where(body.is_convex & ~each, 1, n_faces)
        row[:] = np.bincount(body.component_shell, of_component, body.n_shells)
    return most.ravel()


def _count_in_rows(
    volumes: list[BodyVolumes], boxes: NDArray[np.float64], light: NDArray[np.float64]
) -> int:
    """
    Bound counts by the silhouette edges that cross a row of the light's view.

    Rows begin and end where nothing throws shadows. A lamp has such a view only from
    outside of everything; elsewhere the answer is useless, and very large.
    """
    low, high = boxes[:, 0].min(0), boxes[:, 1].max(0)
    inside = (light[:3] > low - 1e-6) & (light[:3] < high + 1e-6)
    if light[3] > 0 and inside.all():
        return _NO_BOUND
    # Toward the nearest point of the box, so that all of it is ahead.
    nearest = np.clip(light[:3], low, high) - light[:3]
    ahead = nearest if light[3] > 0 else -light[:3]
    ahead = ahead / np.linalg.norm(ahead)
    across = np.cross(ahead, _AXES[np.abs(ahead).argmin()])
    lists = []
    for each in volumes:
        body = each.body
        instance = each.side_shell // body.n_shells
        numbers = (each.sides[:, :2] >> np.uint32(1)) - body.first[instance, None]
        ends = body.caster.vertices[numbers.astype(np.int64)]
        turn = body.transforms[instance]
        ends = np.einsum("nij,nkj->nki", turn[:, :3, :3], ends) + turn[:, None, :3, 3]
        lists.append(ends - light[3] * light[:3])
    ends = np.concatenate(lists)
    if not len(ends):
        return 0
    height = ends @ across
    if light[3] > 0:
        depth = ends @ ahead
        if depth.min() <= 1e-6 * np.abs(ends).max():
            return _NO_BOUND
        height = height / depth
    top = height.min()
    row = ((height - top) * (_ROWS / max(np.ptp(height), 1e-300))).astype(np.int64)
    row = np.minimum(row, _ROWS - 1)
    load = np.bincount(row.min(1), minlength=_ROWS + 1)
    load -= np.bincount(row.max(1) + 1, minlength=_ROWS + 1)
    return int(np.cumsum(load).max()) // 2


def _stack(
    points: NDArray[np.float64], shapes: NDArray[np.integer], weights: NDArray, light: NDArray
) -> int:
    """Bound how much weight lies on one ray from the light; shapes are hulls of points."""
    if light[3] == 0:
        toward = light[:3] / np.linalg.norm(light[:3])
        right = np.cross(toward, _AXES[np.abs(toward).argmin()])
        right /= np.linalg.norm(right)
        frames = [np.stack([right, np.cross(toward, right), toward])]
    else:  # the six sides of a cube around it
        frames = [np.roll(np.eye(3), k + 1, 1) * [[1], [1], [s]] for k in range(3) for s in (1, -1)]
    cells = int(np.clip(4 * np.sqrt(len(shapes)), 64, 1024))
    boxes, owners = np.zeros((len(shapes), 4)), np.zeros(len(shapes), np.int64)
    deepest = 0
    for frame in frames:
        n = _flatten(points, shapes, light, np.ascontiguousarray(frame), boxes, owners)
        if n:
            heap = np.zeros((cells + 1, cells + 1), np.int64)
            _pile(boxes[:n], weights[owners[:n]], heap)
            deepest = max(deepest, int(heap.cumsum(0).cumsum(1).max()))
    return deepest


@njit(cache=True, nogil=True)
def _flatten(points, shapes, light, frame, boxes, owners):
    """
    Box the shapes as a light sees them along a frame's third row; give how many it sees.

    A point light sees the square from -1 to 1 through one side of a cube; a shape that
    reaches beside it and back may be anywhere in it.
    """
    n = 0
    for s in range(shapes.shape[0]):
        u0 = v0 = np.inf
        u1 = v1 = -np.inf
        is_ahead = False
        is_beside = False
        right = left = above = below = True  # of the square with all points
        for k in range(shapes.shape[1]):
            i = shapes[s, k]
            x = points[i, 0] - light[3] * light[0]
            y = points[i, 1] - light[3] * light[1]
            z = points[i, 2] - light[3] * light[2]
            u = frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z
            v = frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z
            if light[3] > 0.0:
                ahead = frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z
                right &= u > ahead
                left &= -u > ahead
                above &= v > ahead
                below &= -v > ahead
                if ahead <= 1e-9 * (abs(x) + abs(y) + abs(z)):
                    is_beside = True
                    continue
                u /= ahead
                v /= ahead
            is_ahead = True
            u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
        if not is_ahead or (light[3] > 0.0 and (right or left or above or below)):
            continue
        if is_beside:
            u0 = v0 = -1.0
            u1 = v1 = 1.0
        elif light[3] > 0.0:
            u0, u1, v0, v1 = max(u0, -1.0), min(u1, 1.0), max(v0, -1.0), min(v1, 1.0)
        boxes[n, 0], boxes[n, 1], boxes[n, 2], boxes[n, 3] = u0, u1, v0, v1
        owners[n] = s
        n += 1
    return n


@njit(cache=True, nogil=True)
def _pile(boxes, weights, heap):
    """Note where boxes begin and end: two cumulative sums then give what lies in a cell."""
    cells = heap.shape[0] - 1
    u0 = v0 = np.inf
    u1 = v1 = -np.inf
    for box in boxes:
        u0, u1, v0, v1 = min(u0, box[0]), max(u1, box[1]), min(v0, box[2]), max(v1, box[3])
    across = cells / max(u1 - u0, 1e-300)
    down = cells / max(v1 - v0, 1e-300)
    for i in range(boxes.shape[0]):
        c0 = min(int((boxes[i, 0] - u0) * across), cells - 1)
        c1 = min(int((boxes[i, 1] - u0) * across), cells - 1) + 1
        r0 = min(int((boxes[i, 2] - v0) * down), cells - 1)
        r1 = min(int((boxes[i, 3] - v0) * down), cells - 1) + 1
        heap[r0, c0] += weights[i]
        heap[r0, c1] -= weights[i]
        heap[r1, c0] -= weights[i]
        heap[r1, c1] += weights[i]
