"""
Upper bounds on the shadow count, to decide whether 8 bits of stencil are enough.

The largest count is the largest number of casting faces on one ray from the light. Boxes
around shells, accumulated on a grid in the light's view, bound it quickly. It changes only
where the ray crosses the silhouette, so half the edges that cross a row of the light's
view bound it, too; and so do boxes around faces.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body
from umbra.gl.stacking import AXES, stack_boxes, stack_shapes
from umbra.gl.volume_plan import STENCIL_MOST
from umbra.gl.volumes import BodyVolumes, list_drawn
from umbra.kernels import kernel
from umbra.scene.mesh import transform_points
from umbra.volume.bounds import move_boxes
from umbra.volume.facing import find_sides

__all__ = ["KnownBound", "bound_boxes", "bound_count", "bound_nearby", "find_most"]

_ROWS = 4096
_SIGNED_MOST = 127  # counts that fit a signed byte: no closer bound is of use
_NO_BOUND = 1 << 62


def bound_count(
    volumes: Sequence[BodyVolumes],
    most: list[NDArray[np.int64]],
    light: NDArray[np.float64],
    drawn: NDArray[np.bool_] | None = None,
) -> int:
    """
    Bound the shadow count of any point under a light (4,), relative to the scene's origin.

    The bound is never too low, and only as close as needed to show that 255 is enough.
    ``most`` is ``find_most`` of each of the volumes. Only ``drawn`` shells (n_shells,)
    are counted, all by default.
    """
    if not len(volumes):
        return 0
    weights = np.concatenate(most)
    if drawn is None:
        drawn = np.ones(len(weights), np.bool_)
    weights = weights[drawn]
    bound = int(weights.sum())
    if bound <= STENCIL_MOST:
        return bound
    boxes = np.concatenate([body_volumes.body.world_bounds() for body_volumes in volumes])[drawn]
    bound = min(bound, bound_boxes(boxes, weights, light))
    if bound <= _SIGNED_MOST:
        return bound
    if any(
        len(body_volumes.body.component_shell) > body_volumes.body.n_shells
        for body_volumes in volumes
    ):
        bound = min(bound, bound_boxes(*_find_components(volumes, drawn), light))
        if bound <= _SIGNED_MOST:
            return bound
    bound = min(bound, _count_in_rows(volumes, drawn, boxes, light))
    if bound <= STENCIL_MOST:
        return bound
    points, faces = _find_casting(volumes, drawn)
    return min(bound, stack_shapes(points, faces, np.ones(len(faces), np.int64), light))


@dataclass(frozen=True, eq=False)
class KnownBound:
    """
    A bound that holds for all lamps near a point, reused while a lamp moves.

    Parameters
    ----------
    light : (4,) float64
        Relative to the scene's origin.
    slack : float
        Largest distance of a lamp from there [m].
    weights : (n_shells,) int64
        Largest count that each shell adds.
    counted : (n_shells,) bool
        Shells included in the bound.
    most : int
        Upper bound of their count.
    """

    light: NDArray[np.float64]
    slack: float
    weights: NDArray[np.int64]
    counted: NDArray[np.bool_]
    most: int

    def holds(
        self, light: NDArray[np.float64], weights: NDArray[np.int64], drawn: NDArray[np.bool_]
    ) -> bool:
        """Return whether the bound holds for a light and its drawn shells."""
        apart = float(np.abs(light - self.light).sum())  # at least the distance
        return (
            apart <= self.slack * light[3]
            and not (drawn & ~self.counted).any()
            and (weights is self.weights or np.array_equal(weights, self.weights))
        )


def bound_nearby(
    volumes: Sequence[BodyVolumes],
    bounds: NDArray[np.float64],
    weights: NDArray[np.int64],
    light: NDArray[np.float64],
    drawn: NDArray[np.bool_],
    known: KnownBound | None,
    slack: float,
) -> tuple[KnownBound | None, int]:
    """
    Bound the shadow count of any point for a light (4,) and, if possible, for lamps near it.

    Moving a lamp is the same as moving the boxes the other way: boxes enlarged by ``slack``
    [m] cover them all. ``bounds`` (n_shells, 2, 3) are of all shells, relative to the scene's
    origin, as the light; ``weights`` (n_shells,) from ``find_most``; ``known`` is the light's
    previous bound, if nothing else moved. Returns what is known now, and the bound.
    """
    most = int(weights[drawn].sum())
    if most <= _SIGNED_MOST:
        return known, most
    if known is not None and known.holds(light, weights, drawn):
        return known, known.most
    if slack > 0.0 and light[3] > 0.0:
        counted = drawn if known is None else drawn | known.counted
        boxes = bounds[counted] + np.array([[-slack], [slack]])
        bound = bound_boxes(boxes, weights[counted], light)
        if bound <= _SIGNED_MOST:
            return KnownBound(light, slack, weights, counted, bound), bound
    bound = bound_count(volumes, [weights], light, drawn)
    return KnownBound(light, 0.0, weights, drawn, bound), bound


def bound_boxes(
    boxes: NDArray[np.float64], weights: NDArray[np.int64], light: NDArray[np.float64]
) -> int:
    """Bound the count of any point by boxes (n, 2, 3) of casters and their largest counts (n,)."""
    if weights.sum() <= _SIGNED_MOST:
        return int(weights.sum())
    return min(int(weights.sum()), stack_boxes(boxes, weights, light))


def _find_components(
    volumes: Sequence[BodyVolumes], drawn: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return boxes (n, 2, 3) of drawn components, and the largest count of each (n,)."""
    boxes, weights = [np.zeros((0, 2, 3))], [np.zeros(0, np.int64)]
    for body_volumes, instance, shells in list_drawn(volumes, drawn):
        body, is_drawn = body_volumes.body, shells[body_volumes.body.component_shell]
        transform, bounds = body.transforms[instance], body.component_bounds[is_drawn]
        boxes.append(bounds if body.is_still else move_boxes(transform[None], bounds)[0])
        adds = np.where(body.is_convex & ~body_volumes.opened[instance], 1, body.n_faces)
        weights.append(adds[is_drawn])
    return np.concatenate(boxes), np.concatenate(weights)


def _find_casting(
    volumes: Sequence[BodyVolumes], drawn: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the points of all instances in the scene's frame, and the faces that cast."""
    points, faces, count = [], [], 0
    for body_volumes, instance, is_drawn in list_drawn(volumes, drawn):
        body, caster = body_volumes.body, body_volumes.caster_of(instance)
        side = find_sides(caster.planes[:, :-1], body_volumes.lights[instance])
        casts = (side > 0) | ((side < 0) & ~body_volumes.is_closed[instance, caster.component])
        casts &= is_drawn[body.component_shell[caster.component]]
        faces.append(caster.faces[casts].astype(np.int64) + count)
        points.append(transform_points(body.transforms[instance], caster.vertices))
        count += len(caster.vertices)
    return np.concatenate(points), np.concatenate(faces)


def find_most(body: Body, opened: NDArray[np.bool_]) -> NDArray[np.int64]:
    """
    Bound the count that each component of a body's instances adds, (n,) int64.

    A convex component adds 1, any other at most its number of faces.
    """
    most = np.tile(body.most, (len(opened), 1))
    if not opened.any():
        return most.ravel()
    for row, is_opened in zip(most, opened, strict=True):
        of_component = np.where(body.is_convex & ~is_opened, 1, body.n_faces)
        row[:] = np.bincount(body.component_shell, of_component, body.n_shells)
    return most.ravel()


def _count_in_rows(
    volumes: Sequence[BodyVolumes],
    drawn: NDArray[np.bool_],
    boxes: NDArray[np.float64],
    light: NDArray[np.float64],
) -> int:
    """
    Bound counts by the silhouette edges that cross a row of the light's view.

    Rows begin and end outside all shadows. A lamp has such a view only from outside all
    boxes; elsewhere the result is very large, and useless.
    """
    low, high = boxes[:, 0].min(0), boxes[:, 1].max(0)
    inside = (light[:3] > low - 1e-6) & (light[:3] < high + 1e-6)
    if light[3] > 0 and inside.all():
        return _NO_BOUND
    # Toward the nearest point of the box, so that the whole box is ahead.
    nearest = np.clip(light[:3], low, high) - light[:3]
    ahead = nearest if light[3] > 0 else -light[:3]
    ahead = ahead / np.linalg.norm(ahead)
    across = np.cross(ahead, AXES[np.abs(ahead).argmin()])
    lists, offset = [], 0
    for body_volumes in volumes:
        body = body_volumes.body
        n = body.n_shells * len(body.groups)
        sides, shells = body_volumes.list_sides(drawn[offset : offset + n])
        offset += n
        heights = np.zeros((len(sides), 2))
        depth, size = _find_heights(
            sides, shells // body.n_shells, body.first, body.caster.vertices, body.transforms,
            light, ahead, across, heights,
        )  # fmt: skip
        if light[3] > 0 and depth <= 1e-6 * size:
            return _NO_BOUND
        lists.append(heights)
    load = np.zeros(_ROWS + 1, np.int64)
    _load_rows(np.concatenate(lists), load)
    return int(np.cumsum(load).max()) // 2


@kernel
def _find_heights(sides, instances, first, vertices, transforms, light, ahead, across, heights):
    """
    Write the heights of edges' ends in the light's view.

    Returns the nearest depth and the largest coordinate.
    """
    nearest, largest = np.inf, 0.0
    for i in range(instances.size):
        instance = instances[i]
        turn = transforms[instance]
        for k in range(2):
            point = vertices[np.int64(sides[i, k] >> np.uint32(1)) - first[instance]]
            height = depth = 0.0
            for axis in range(3):
                coordinate = (
                    turn[axis, 0] * point[0] + turn[axis, 1] * point[1] + turn[axis, 2] * point[2]
                ) + (turn[axis, 3] - light[3] * light[axis])
                largest = max(largest, abs(coordinate))
                height += coordinate * across[axis]
                depth += coordinate * ahead[axis]
            nearest = min(nearest, depth)
            heights[i, k] = height / depth if light[3] > 0.0 and depth > 0.0 else height
    return nearest, largest


@kernel
def _load_rows(heights, load):
    """Mark the row in which each edge begins, and that after which it ends."""
    low, high = np.inf, -np.inf
    for a, b in heights:
        low, high = min(low, a, b), max(high, a, b)
    rows = load.size - 1
    scale = rows / max(high - low, 1e-300)
    for a, b in heights:
        row_a = min(int((a - low) * scale), rows - 1)
        row_b = min(int((b - low) * scale), rows - 1)
        load[min(row_a, row_b)] += 1
        load[max(row_a, row_b) + 1] -= 1
