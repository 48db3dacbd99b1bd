"""
Skinned vertices: each moves by the mean of its joints' matrices.

In float64 and vertex by vertex, without fused operations, so that vertices with equal numbers
stay bit-identical, wherever they stand in their arrays.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel

__all__ = ["move_skin"]


def move_skin(
    pulls: NDArray[np.float64],
    joints: NDArray[np.integer],
    influences: NDArray[np.float64],
    vertices: NDArray[np.float64],
    normals: NDArray[np.floating] | None,
) -> tuple[NDArray[np.float64], NDArray[np.float32] | None]:
    """
    Move vertices, and turn their normals.

    Parameters
    ----------
    pulls : (n_joints, 4, 4) float64
        From the mesh as bound to where each joint takes it.
    joints : (n, n_influences) int
        Rows of ``pulls``.
    influences : (n, n_influences) float64
        Each vertex's sum to 1.
    vertices : (n, 3) float64
    normals : (n, 3) float, optional
        Of any length.

    Returns
    -------
    vertices : (n, 3) float64
    normals : (n, 3) float32
        Unit normals, 0 where they were; None if none were given.
    """
    moved = np.zeros(vertices.shape)
    given = np.zeros((0, 3)) if normals is None else np.asarray(normals, np.float64)
    turned = np.zeros(given.shape, np.float32)
    rows = np.ascontiguousarray(pulls[:, :3])
    _move(rows, joints, influences, vertices, given, moved, turned)
    return moved, None if normals is None else turned


@kernel
def _move(pulls, joints, influences, vertices, normals, moved, turned):
    """Write the vertices of ``move_skin``, and its normals if there are any."""
    mean, cofactors = np.zeros((3, 4)), np.zeros((3, 3))
    for vertex in range(vertices.shape[0]):
        mean[:] = 0.0
        for k in range(joints.shape[1]):
            share, joint = influences[vertex, k], joints[vertex, k]
            if share != 0.0:
                for i in range(3):
                    for j in range(4):
                        mean[i, j] += share * pulls[joint, i, j]
        x, y, z = vertices[vertex]
        for i in range(3):
            moved[vertex, i] = mean[i, 0] * x + mean[i, 1] * y + mean[i, 2] * z + mean[i, 3]
        if normals.shape[0]:
            _find_cofactors(mean, cofactors)
            _turn(mean, cofactors, normals[vertex], turned[vertex])


@kernel
def _find_cofactors(matrix, cofactors):
    """Write the inverse transposed of a matrix, up to scale, by which normals move."""
    for i in range(3):
        first, second = matrix[(i + 1) % 3], matrix[(i + 2) % 3]
        for j in range(3):
            u, v = (j + 1) % 3, (j + 2) % 3
            cofactors[i, j] = first[u] * second[v] - first[v] * second[u]


@kernel
def _turn(matrix, cofactors, normal, turned):
    """Write a unit normal; leave it 0 where it has no direction."""
    volume = 0.0
    for i in range(3):
        volume += matrix[0, i] * cofactors[0, i]
    bent = (
        cofactors[0, 0] * normal[0] + cofactors[0, 1] * normal[1] + cofactors[0, 2] * normal[2],
        cofactors[1, 0] * normal[0] + cofactors[1, 1] * normal[1] + cofactors[1, 2] * normal[2],
        cofactors[2, 0] * normal[0] + cofactors[2, 1] * normal[1] + cofactors[2, 2] * normal[2],
    )
    square = bent[0] * bent[0] + bent[1] * bent[1] + bent[2] * bent[2]
    if square > 0.0:
        side = -1.0 if volume < 0.0 else 1.0  # a mirror turns the cofactors inward
        for i in range(3):
            turned[i] = side * bent[i] / np.sqrt(square)
