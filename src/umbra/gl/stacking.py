"""Weights of boxes and other shapes, added up on a grid in a light's view."""

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.volume.bounds import find_box_points

__all__ = ["AXES", "stack_boxes", "stack_shapes"]

_CUBE = [np.roll(np.eye(3), k + 1, 1) * [[1], [1], [s]] for k in range(3) for s in (1, -1)]
AXES = np.concatenate([np.eye(3), -np.eye(3)])
"""Directions of which any other has one nearly across it."""


def stack_boxes(
    boxes: NDArray[np.float64], weights: NDArray[np.int64], light: NDArray[np.float64]
) -> int:
    """Bound the total weight on one ray from the light (4,); boxes are (n, 2, 3)."""
    if light[3] == 0:
        flat = np.zeros((len(boxes), 4))
        _flatten_boxes(boxes, _find_sun_frame(light), flat)
        return int(_find_peak(flat, weights, _count_cells(len(boxes))))
    corners = find_box_points(boxes)[..., :3].reshape(-1, 3)
    return stack_shapes(corners, np.arange(len(corners)).reshape(-1, 8), weights, light)


def stack_shapes(
    points: NDArray[np.float64], shapes: NDArray[np.integer], weights: NDArray, light: NDArray
) -> int:
    """Bound the total weight on one ray from the light; shapes are hulls of points."""
    # The six sides of a cube around a lamp.
    frames = [_find_sun_frame(light)] if light[3] == 0 else _CUBE
    cells = _count_cells(len(shapes))
    return int(_find_deepest(points, shapes, weights, light, np.array(frames), cells))


def _find_sun_frame(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return orthonormal rows, the last of which points toward a directional light."""
    toward = light[:3] / np.linalg.norm(light[:3])
    right = np.cross(toward, AXES[np.abs(toward).argmin()])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


def _count_cells(shapes: int) -> int:
    """Return the number of cells on a side of the grid for n shapes."""
    return int(np.clip(4 * np.sqrt(shapes), 64, 1024))


@kernel
def _find_deepest(points, shapes, weights, light, frames, cells):
    """Return the largest weight in one cell of the light's view, over all frames (3, 3)."""
    boxes, owners = np.zeros((shapes.shape[0], 4)), np.zeros(shapes.shape[0], np.int64)
    deepest = 0
    for number in range(frames.shape[0]):
        n = _flatten(points, shapes, light, frames[number], boxes, owners)
        if n > 0:
            deepest = max(deepest, _find_peak(boxes[:n], weights[owners[:n]], cells))
    return deepest


@kernel
def _find_peak(boxes, weights, cells):
    """Return the largest total weight of boxes (n, 4) in one cell of a grid."""
    heap, column = np.zeros((cells + 1, cells + 1), np.int64), np.zeros(cells + 1, np.int64)
    _pile(boxes, weights, heap)
    deepest = 0
    for row in range(cells):
        here = 0
        for cell in range(cells):
            column[cell] += heap[row, cell]
            here += column[cell]
            deepest = max(deepest, here)
    return deepest


@kernel
def _flatten_boxes(boxes, frame, flat):
    """Bound boxes (n, 2, 3) in the view along a frame's third row, without their corners."""
    for i in range(boxes.shape[0]):
        for k in range(2):
            low = high = 0.0
            for axis in range(3):
                a, b = frame[k, axis] * boxes[i, 0, axis], frame[k, axis] * boxes[i, 1, axis]
                low += min(a, b)
                high += max(a, b)
            flat[i, 2 * k], flat[i, 2 * k + 1] = low, high


@kernel
def _flatten(points, shapes, light, frame, boxes, owners):
    """
    Bound the shapes in a light's view along a frame's third row; return how many are in view.

    A point light's view through one side of a cube is the square from -1 to 1; a shape
    that extends behind the light may cover all of it.
    """
    n = 0
    for s in range(shapes.shape[0]):
        u0 = v0 = np.inf
        u1 = v1 = -np.inf
        is_ahead = False
        is_beside = False
        right = left = above = below = True  # all points on that side of the square
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


@kernel
def _pile(boxes, weights, heap):
    """Mark where boxes begin and end: two cumulative sums then give the weight in each cell."""
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
