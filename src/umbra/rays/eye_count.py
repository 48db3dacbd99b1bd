"""
The position of a camera among casters and shadow volumes, which z-pass depends on.

The shadow counts where its rays start and end, the faces in front of its near plane, and
the solids that this plane cuts open.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.rays.anchor import BLOCK, Anchor, FaceBlocks, find_anchor
from umbra.scene import Camera
from umbra.volume.adjacency import Caster

__all__ = ["EyeCount", "find_cut_open", "find_eye_count", "find_near_faces"]

UP = np.array([0.0, 0.0, 1.0])
_ALIKE = 1e-9  # places relative to their coordinates, directions as sines


@dataclass(frozen=True, eq=False)
class EyeCount:
    """
    A view in which no ray starts in a volume's side.

    ``start`` and ``end`` tell of where rays start and, in an orthographic view, where they end;
    ``along`` is 1 if rays start in the light, -1 if they run straight to it, else 0.
    """

    matrix: NDArray[np.float64]
    start: Anchor
    end: Anchor
    along: int


def find_eye_count(
    caster: Caster,
    blocks: FaceBlocks,
    camera: Camera,
    origin: NDArray[np.float64],
    light: NDArray[np.float64],
) -> EyeCount:
    """
    Find how deep in shadow a camera stands, under a light (4,) in the caster's frame.

    An eye in the side of a volume steps aside (or parallel rays tilt) until it is in none.
    """
    apex = camera.apex(origin)
    right, up, _ = camera.axes()
    size = 1.0 + max(np.abs(apex[:3]).max(), np.abs(blocks.bounds).max(initial=0.0))
    for attempt in range(8):
        aside = 1e-10 * attempt * np.array([0.83, 0.56])
        if camera.height is None:
            step = size * (aside[0] * right + aside[1] * up) + 0.37 * size * aside[0] * UP
            matrix = camera.matrix(origin - step)
            start = end = find_anchor(caster, blocks, apex + np.append(step, 0.0), light)
        else:
            matrix = camera.matrix(origin)
            matrix[:2] += camera.size[1] / camera.height * np.outer([-1, 1] * aside, matrix[3])
            tilted = apex + np.append(aside[0] * right + aside[1] * up, 0.0)
            start, end = (find_anchor(caster, blocks, way, light) for way in (tilted, -tilted))
        if start.is_clean and end.is_clean:
            break
    return EyeCount(matrix, start, end, _compare(apex, light))


def find_near_faces(
    caster: Caster, blocks: FaceBlocks, camera: Camera, origin: NDArray[np.float64]
) -> NDArray[np.intp]:
    """Find the casting faces that reach in front of the near plane, where nothing is drawn."""
    forward = camera.axes()[2]
    at = (camera.eye - origin) @ forward
    corner = np.where(forward > 0, [0, 1, 2], [3, 4, 5])  # of a box, the nearest
    nearest = blocks.bounds[:, corner] @ forward - at
    some = np.flatnonzero(nearest < camera.near)
    faces = (some[:, None] * BLOCK + np.arange(BLOCK)).ravel()
    faces = faces[faces < len(caster.faces)]
    depth = (caster.vertices[caster.faces[faces]] @ forward).min(1) - at
    return faces[depth < camera.near]


def find_cut_open(
    caster: Caster, blocks: FaceBlocks, near_faces: NDArray[np.intp], light: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """
    Find components, (n_components,) bool, that the near plane opens and whose inside might mislead.

    Past a wall that is not drawn the winding number is not the eye's. Lit faces
    alone still tell, unless the light is inside or the component is wound inward.
    """
    opened = np.zeros(len(caster.is_closed), np.bool_)
    if not len(near_faces):
        return opened
    opened[caster.component[near_faces]] = True
    sky = np.array([0.36, 0.48, 0.8, 0.0])
    around = find_anchor(caster, blocks, sky, light)
    a, b, c = (caster.vertices[caster.faces[:, k]] for k in range(3))
    volume = np.bincount(caster.component, np.einsum("ij,ij->i", a, np.cross(b, c)))
    return opened & ((around.lit != around.unlit) | (volume < 0))


def _compare(apex: NDArray[np.float64], light: NDArray[np.float64]) -> int:
    """Return 1 if rays start in the light, -1 if they run straight to it, else 0."""
    if apex[3] and light[3]:
        apart = np.abs(apex - light).max()
        return int(apart <= _ALIKE * (1.0 + np.abs(apex).max()))
    if apex[3] or light[3]:
        return 0
    a, b = (v[:3] / np.linalg.norm(v[:3]) for v in (apex, light))
    if np.linalg.norm(np.cross(a, b)) > _ALIKE:
        return 0
    return 1 if a @ b > 0 else -1
