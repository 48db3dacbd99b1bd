"""Shapes that bend: morph targets added to a mesh, then joints that pull at it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.scene.mesh import Mesh

__all__ = ["Shape", "Skin"]

BLOCK = 2048  # vertices posed at once


@dataclass(frozen=True, eq=False)
class Skin:
    """
    The joints of a skin.

    Parameters
    ----------
    joints : (n_joints,) int
        Nodes of the rig.
    inverse_bind : (n_joints, 4, 4) float64
        From the mesh's frame to each joint's, as bound.
    """

    joints: NDArray[np.int64]
    inverse_bind: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shape:
    """
    A mesh that bends.

    Posed vertices depend on a vertex's own numbers alone and are rounded alike, so
    that vertices at one place stay at one place and the posed mesh stays closed.

    Parameters
    ----------
    rest : Mesh
        Unposed.
    weights : (n_targets,) float64
        Of the morph targets where no track moves them.
    offsets : (n_targets, n_vertices, 3) float32, optional
        What each morph target adds to the vertices at weight 1.
    normal_offsets : (n_targets, n_vertices, 3) float32, optional
    skin : Skin, optional
    joints : (n_vertices, n_influences) int, optional
        Rows of ``skin.joints``.
    influences : (n_vertices, n_influences) float64, optional
        Each vertex's sum to 1.
    """

    rest: Mesh
    weights: NDArray[np.float64]
    offsets: NDArray[np.float32] | None = None
    normal_offsets: NDArray[np.float32] | None = None
    skin: Skin | None = None
    joints: NDArray[np.integer] | None = None
    influences: NDArray[np.float64] | None = None

    def pose(self, places: NDArray[np.float64], weights: NDArray[np.float64] | None = None) -> Mesh:
        """
        Bend the mesh.

        Parameters
        ----------
        places : (n_nodes, 4, 4) float64
            Of the rig's nodes.
        weights : (n_targets,) float64, optional

        Returns
        -------
        mesh : Mesh
            With a skin in the frame of ``places``, else in its node's; ``rest``
            itself where nothing bends it.
        """
        weights = self.weights if weights is None else weights
        vertices = self.rest.vertices
        normals: NDArray[np.floating] | None = self.rest.normals
        if self.offsets is not None:
            for index in np.flatnonzero(weights):
                vertices = vertices + weights[index] * self.offsets[index].astype(np.float64)
                if normals is not None and self.normal_offsets is not None:
                    normals = normals + weights[index] * self.normal_offsets[index]
        if self.skin is not None and self.joints is not None and self.influences is not None:
            pulls = places[self.skin.joints] @ self.skin.inverse_bind
            vertices, normals = _pull(pulls, self.joints, self.influences, vertices, normals)
        if vertices is self.rest.vertices and normals is self.rest.normals:
            return self.rest
        return self.rest.moved(vertices, None if normals is None else _unit(normals))


def _pull(
    pulls: NDArray[np.float64],
    joints: NDArray[np.integer],
    influences: NDArray[np.float64],
    vertices: NDArray[np.float64],
    normals: NDArray[np.floating] | None,
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Move each vertex, and turn its normal, by the mean of its joints' matrices."""
    rows = np.ascontiguousarray(pulls[:, :3].reshape(-1, 12))
    moved = np.zeros(vertices.shape)
    turned = None if normals is None else np.zeros(vertices.shape)
    # In blocks that stay in the cache: seven times faster than all at once.
    for first in range(0, len(vertices), BLOCK):
        block = slice(first, first + BLOCK)
        mixed = np.zeros((len(vertices[block]), 12))
        for joint, share in zip(joints[block].T, influences[block].T, strict=True):
            mixed += share[:, None] * rows[joint]
        matrices = mixed.reshape(-1, 3, 4)
        moved[block] = _apply(matrices, vertices[block]) + matrices[:, :, 3]
        if normals is not None and turned is not None:
            turned[block] = _apply(_find_cofactors(matrices), normals[block].astype(np.float64))
    return moved, turned


def _apply(matrices: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    # One product at a time: a fused multiply-add may round rows at the end of an array
    # otherwise than those within.
    x, y, z = vectors[:, 0, None], vectors[:, 1, None], vectors[:, 2, None]
    return matrices[:, :, 0] * x + matrices[:, :, 1] * y + matrices[:, :, 2] * z


def _find_cofactors(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give what turns normals, (n, 3, 3): the inverse transposed, but for its size."""
    cofactors = np.zeros((len(matrices), 3, 3))
    for i in range(3):
        one, other = matrices[:, i - 2, :3], matrices[:, i - 1, :3]  # the next two, in a ring
        for j in range(3):
            cofactors[:, i, j] = one[:, j - 2] * other[:, j - 1] - one[:, j - 1] * other[:, j - 2]
    mirrored = (matrices[:, 0, :3] * cofactors[:, 0]).sum(1) < 0
    cofactors[mirrored] *= -1.0
    return cofactors


def _unit(normals: NDArray[np.floating]) -> NDArray[np.floating]:
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0, length, 1.0)
