"""
The eye's own shadow count: which faces lie between the eye and the light.

z-pass starts at the eye, so it must know how deep in shadow the eye stands. That
anchor is counted once per view, with the same lit flags as everything else.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster

__all__ = ["BLOCK", "Anchor", "FaceBlocks", "find_anchor"]

BLOCK = 64
"""Faces in a block."""


@dataclass(frozen=True, eq=False)
class FaceBlocks:
    """
    Bounding boxes of runs of 64 faces, which lie near each other in a caster.

    Parameters
    ----------
    bounds : (n_blocks, 6) float64
        Lowest and highest corner.
    """

    bounds: NDArray[np.float64]

    @classmethod
    def of(cls, caster: Caster) -> "FaceBlocks":
        """Bound a caster's faces."""
        starts = np.arange(0, len(caster.faces), BLOCK)
        corners = caster.vertices[caster.faces]
        low = (
            np.minimum.reduceat(corners.min(1), starts, axis=0) if len(starts) else np.zeros((0, 3))
        )
        high = np.maximum.reduceat(corners.max(1), starts, axis=0) if len(starts) else low
        return cls(np.concatenate([low, high], 1))


@dataclass(frozen=True, eq=False)
class Anchor:
    """
    Faces pierced on the way from the eye to the light.

    Parameters
    ----------
    lit, unlit : (n_components,) int64
        Pierced faces of each component that face the light, or do not.
    """

    lit: NDArray[np.int64]
    unlit: NDArray[np.int64]

    def count(self, is_closed: NDArray[np.bool_]) -> int:
        """Give the eye's shadow count under each component's rule."""
        return int(self.lit.sum() + self.unlit[~is_closed].sum())

    @property
    def enclosed(self) -> NDArray[np.bool_]:
        """
        Components around the light but not the eye, more often than the reverse.

        Lit minus unlit is the winding number at the eye less that at the light;
        where it is negative, the closed rule could miss a shadow.
        """
        return self.lit < self.unlit


def find_anchor(
    caster: Caster, blocks: FaceBlocks, eye: NDArray[np.float64], light: NDArray[np.float64]
) -> Anchor:
    """
    Count the faces between two homogeneous points.

    Parameters
    ----------
    caster : Caster
    blocks : FaceBlocks
    eye, light : (4,) float64
        In the caster's frame; w = 0 is infinitely far.

    Returns
    -------
    anchor : Anchor
    """
    n = len(caster.is_closed)
    anchor = Anchor(np.zeros(n, np.int64), np.zeros(n, np.int64))
    if eye[3] == 0 and light[3] == 0:
        return anchor  # both beyond everything
    start, end = (eye, light) if eye[3] else (light, eye)
    way = end[:3] - end[3] * start[:3]
    nudge = np.zeros(3)
    for attempt in range(8):
        clean = _pierce(
            caster.vertices, caster.faces, caster.planes, caster.component, blocks.bounds,
            start[:3] + nudge, way - end[3] * nudge, bool(end[3]), eye, light,
            anchor.lit, anchor.unlit,
        )  # fmt: skip
        if clean:
            break
        # The way passes exactly through a vertex: step aside by less than rounding shows.
        anchor.lit[:] = anchor.unlit[:] = 0
        nudge = np.array([0.61, 0.58, 0.53]) * 1e-11 * (attempt + 1)
        nudge *= 1.0 + np.abs(start[:3]).max()
    return anchor


@njit(cache=True, nogil=True)
def _side(a, b, start, way):
    """Give on which side of the directed line the edge a to b passes (Pluecker)."""
    ax, ay, az = a[0] - start[0], a[1] - start[1], a[2] - start[2]
    bx, by, bz = b[0] - start[0], b[1] - start[1], b[2] - start[2]
    return (
        way[0] * (ay * bz - az * by) + way[1] * (az * bx - ax * bz) + way[2] * (ax * by - ay * bx)
    )


@njit(cache=True, nogil=True)
def _misses(box, start, way, finite):
    """Whether the way certainly misses a box; rounding only ever keeps boxes."""
    near = 0.0
    far = 1.0 if finite else np.inf
    for k in range(3):
        margin = 1e-9 * (1.0 + abs(box[k]) + abs(box[k + 3]) + abs(start[k]))
        low = box[k] - margin - start[k]
        high = box[k + 3] + margin - start[k]
        if way[k] == 0.0:
            if low > 0.0 or high < 0.0:
                return True
        else:
            t0 = low / way[k]
            t1 = high / way[k]
            near = max(near, min(t0, t1))
            far = min(far, max(t0, t1))
    return near > far * (1.0 + 1e-9)


@njit(cache=True, nogil=True)
def _pierce(vertices, faces, planes, component, boxes, start, way, finite, eye, light, lit, unlit):
    """Count pierced faces; False if the way passes through a vertex."""
    side = np.empty(3)
    for block in range(boxes.shape[0]):
        if _misses(boxes[block], start, way, finite):
            continue
        for f in range(block * BLOCK, min(faces.shape[0], block * BLOCK + BLOCK)):
            at_light = 0.0
            at_eye = 0.0
            for k in range(4):
                at_light += planes[k, f] * light[k]
                at_eye += planes[k, f] * eye[k]
            if not ((at_light > 0.0 and at_eye < 0.0) or (at_light < 0.0 and at_eye > 0.0)):
                continue
            zeros = 0
            positive = 0
            for k in range(3):
                a = faces[f, k]
                b = faces[f, (k + 1) % 3]
                # Both faces of an edge must agree on a tie: ask in one direction only.
                if a < b:
                    side[k] = _side(vertices[a], vertices[b], start, way)
                    forward = side[k] >= 0.0
                else:
                    side[k] = _side(vertices[b], vertices[a], start, way)
                    forward = not side[k] >= 0.0
                zeros += side[k] == 0.0
                positive += forward
            if positive in (0, 3):
                if zeros > 1:
                    return False
                if at_light > 0.0:
                    lit[component[f]] += 1
                else:
                    unlit[component[f]] += 1
            elif zeros > 1:
                return False
    return True
