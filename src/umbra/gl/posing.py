"""
Geometry of a posed caster, recomputed for each pose of a bending mesh.

Planes, boxes and volumes in one pass over the faces, so that a mesh can bend at every frame.
Adjacency is kept.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.gl.convexity import Balls, find_convex
from umbra.rays.eye_count import BLOCK
from umbra.volume.adjacency import Caster, make_planes

__all__ = ["PosedShape", "find_welds", "measure_shape"]


@dataclass(frozen=True, eq=False)
class PosedShape:
    """
    Geometry of a posed caster.

    Parameters
    ----------
    planes : (4, n_faces + 1) float64
        As in ``Caster``.
    bounds : (n_components, 2, 3) float64
        Bounds of each component [m].
    blocks : (n_blocks, 6) float64
        As in ``FaceBlocks`` [m].
    volumes : (n_components,) float64
        Six times each component's signed volume [m³].
    is_convex : (n_components,) bool
        Of the balls that were asked about.
    """

    planes: NDArray[np.float64]
    bounds: NDArray[np.float64]
    blocks: NDArray[np.float64]
    volumes: NDArray[np.float64]
    is_convex: NDArray[np.bool_]


def measure_shape(caster: Caster, vertices: NDArray[np.float64], balls: Balls) -> PosedShape:
    """Measure a caster with vertices (n_vertices, 3) float64 in its own frame [m]."""
    n_faces, n_components = len(caster.faces), len(caster.is_closed)
    planes = make_planes(vertices, caster.faces)
    bounds = np.zeros((n_components, 2, 3))
    bounds[:, 0], bounds[:, 1] = np.inf, -np.inf
    blocks = np.zeros((-(-n_faces // BLOCK), 6))
    volumes = np.zeros(n_components)
    _measure_faces(vertices, caster.faces, caster.component, planes, bounds, blocks, volumes)
    is_convex = find_convex(caster, vertices, planes, volumes, balls)
    return PosedShape(planes, bounds, blocks, volumes, is_convex)


@njit(cache=True, nogil=True)
def _measure_faces(vertices, faces, component, planes, bounds, blocks, volumes):
    """Write boxes and volumes in one pass over faces."""
    for face in range(faces.shape[0]):
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        owner, block = component[face], face // BLOCK
        is_first = face % BLOCK == 0
        for axis in range(3):
            p, q, r = vertices[i, axis], vertices[j, axis], vertices[k, axis]
            low, high = min(p, q, r), max(p, q, r)
            bounds[owner, 0, axis] = min(bounds[owner, 0, axis], low)
            bounds[owner, 1, axis] = max(bounds[owner, 1, axis], high)
            blocks[block, axis] = low if is_first else min(blocks[block, axis], low)
            blocks[block, 3 + axis] = high if is_first else max(blocks[block, 3 + axis], high)
        volumes[owner] -= planes[3, face]


def find_welds(caster: Caster, soup: NDArray[np.int32]) -> NDArray[np.int64]:
    """
    Find the pairs of vertices (n, 2) that must coincide for the adjacency to hold.

    ``soup`` (n, 3) are the source faces of the caster, before vertices were welded.
    """
    given = soup[caster.source]
    apart = given != caster.faces
    return np.unique(np.stack([given[apart], caster.faces[apart]], 1), axis=0).astype(np.int64)
