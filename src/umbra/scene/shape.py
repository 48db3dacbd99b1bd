"""Shapes that bend: morph targets added to a mesh, then joints that pull at it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.scene.mesh import Mesh

__all__ = ["Shape", "Skin"]


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
            blend = _blend(pulls, self.joints, self.influences)
            vertices = _apply(blend, vertices) + blend[:, :, 3]
            if normals is not None:
                normals = _apply(_find_cofactors(blend), normals.astype(np.float64))
        if vertices is self.rest.vertices and normals is self.rest.normals:
            return self.rest
        return self.rest.moved(vertices, None if normals is None else _unit(normals))


def _blend(
    pulls: NDArray[np.float64], joints: NDArray[np.integer], influences: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Mix each vertex's joints, (n_vertices, 3, 4)."""
    mixed = np.zeros((len(joints), 3, 4))
    for k in range(joints.shape[1]):
        mixed += influences[:, k, None, None] * pulls[joints[:, k], :3]
    return mixed


def _apply(matrices: NDArray[np.float64], vectors: NDArray[np.floating]) -> NDArray[np.float64]:
    # One product at a time: a fused multiply-add may round rows at the end of an array
    # otherwise than those within.
    x, y, z = vectors[:, 0, None], vectors[:, 1, None], vectors[:, 2, None]
    return matrices[:, :, 0] * x + matrices[:, :, 1] * y + matrices[:, :, 2] * z


def _find_cofactors(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give what turns normals: the inverse transposed, but for its size."""
    a, b, c = matrices[:, 0, :3], matrices[:, 1, :3], matrices[:, 2, :3]
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    mirrored = (a * cofactors[:, 0]).sum(1) < 0
    cofactors[mirrored] *= -1.0
    return cofactors


def _unit(normals: NDArray[np.floating]) -> NDArray[np.floating]:
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0, length, 1.0)
