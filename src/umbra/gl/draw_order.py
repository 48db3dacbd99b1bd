"""
Order in which a mesh's faces are drawn: neighbours together, so that their vertices are shared.

A device keeps the last vertices that it has placed. Where a file lists faces far from one
another in turn, as subdivided surfaces do, nearly every corner of every face is placed again.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.scene import Mesh, Scene
from umbra.volume.adjacency import sort_along_curve

__all__ = ["count_placed", "find_draw_order"]

_KEPT = 256  # vertices that llvmpipe keeps, by the last digits of their numbers; cards keep fewer
_FEW = 500  # faces that hardly leave such a store
_GOOD = 0.7  # vertices to place for each face: a closed surface of well-ordered faces takes 0.5
_GAIN = 0.9


def find_draw_order(scene: Scene) -> NDArray[np.intp]:
    """Order the faces of ``scene.triangles()`` part by part, (n_faces,); as in the file if good."""
    known: dict[int, NDArray[np.intp] | None] = {}
    counts = [part.triangles for part in scene.parts]
    order = np.arange(sum(counts))
    first = 0
    for part, count in zip(scene.parts, counts, strict=True):
        if count > _FEW:
            if id(part.mesh.faces) not in known:
                known[id(part.mesh.faces)] = _find_better(part.mesh)
            better = known[id(part.mesh.faces)]
            if better is not None:
                order[first : first + count] = first + better
        first += count
    return order


def _find_better(mesh: Mesh) -> NDArray[np.intp] | None:
    """Find a better order of a mesh's faces; None if the file's is as good."""
    faces = mesh.faces
    least, best = _GAIN * count_placed(faces), None
    if least <= _GAIN * _GOOD * len(faces):
        return None
    by_number = np.argsort(faces.min(1), kind="stable")
    along_curve = sort_along_curve(mesh.vertices[faces].mean(1))
    for order in (by_number, along_curve):
        placed = count_placed(faces[order])
        if placed < least:
            least, best = placed, order
    return best


@njit(cache=True, nogil=True)
def count_placed(faces):
    """Count the vertices that a device with a small store places for faces (n, 3) in order."""
    kept = np.full(_KEPT, -1, np.int64)
    placed = 0
    for face in range(faces.shape[0]):
        for corner in range(3):
            vertex = np.int64(faces[face, corner])
            if kept[vertex % _KEPT] != vertex:
                kept[vertex % _KEPT] = vertex
                placed += 1
    return placed
