"""
Tangents of meshes for normal maps, as MikkTSpace defines them.

glTF's normal maps are made for the tangents in the file or, if it has none, for those of
MikkTSpace: each face's direction of growing u, averaged by angle over the faces around a point
with one position, normal and texture coordinate that are not mirrored against each other.

Source: M. Mikkelsen, Simulation of Wrinkled Surfaces Revisited, 2008; glTF 2.0, 3.7.2.1.
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["find_tangents"]


def find_tangents(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    normals: NDArray[np.float32],
    uv: NDArray[np.float32],
) -> NDArray[np.float32]:
    """
    Find the tangents of a mesh with normals.

    Points whose faces are mirrored against each other get none, so that each side's tangents are
    those of its other corners.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    normals : (n, 3) float32
    uv : (n, 2) float32
        v grows downward in the image.

    Returns
    -------
    tangents : (n, 4) float32
        Unit vectors along u, and 1 or -1, by which the product of normal and tangent points up
        in the image; all 0 where there are none.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    (u1, v1), (u2, v2) = ((uv[faces[:, k]] - uv[faces[:, 0]]).T.astype(np.float64) for k in (1, 2))
    area = u1 * v2 - u2 * v1  # with v downward: below 0 where the image is not mirrored
    along = np.sign(area)[:, None] * ((b - a) * v2[:, None] - (c - a) * v1[:, None])

    rows = np.ascontiguousarray(np.column_stack([vertices, normals, uv]).astype(np.float64))
    _, point = np.unique(rows.view(f"V{rows.strides[0]}").ravel(), return_inverse=True)
    total = np.zeros((point.max(initial=-1) + 1, 3))
    hands = np.zeros((2, len(total)), np.bool_)
    for k in range(3):
        here = faces[:, k]
        normal = normals[here].astype(np.float64)
        one, two = (
            _project(vertices[faces[:, (k + step) % 3]] - vertices[here], normal) for step in (1, 2)
        )
        angle = np.arccos(np.clip(np.einsum("ij,ij->i", one, two), -1.0, 1.0))
        for axis in range(3):
            total[:, axis] += np.bincount(
                point[here], angle * _project(along, normal)[:, axis], len(total)
            )
        for hand, is_mine in enumerate((area > 0, area < 0)):
            hands[hand, point[here[is_mine]]] = True
    total[hands.all(0)] = 0.0
    tangents = np.zeros((len(vertices), 4), np.float32)
    tangents[:, :3] = _unit(total)[point]
    has_one = tangents.any(1)
    tangents[has_one, 3] = np.where(hands[0], -1.0, 1.0)[point[has_one]]
    return tangents


def _project(ways: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit vectors across normals, (n, 3); 0 where there is no such direction."""
    return _unit(ways - normals * np.einsum("ij,ij->i", ways, normals)[:, None])


def _unit(ways: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(ways, axis=1, keepdims=True)
    return ways / np.where(length > 0, length, 1.0)
