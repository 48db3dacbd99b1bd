"""Geodesic spheres with smooth normals."""

import numpy as np

from umbra.scene import Mesh

GOLDEN = (1 + 5**0.5) / 2
CORNERS = [
    (-1, GOLDEN, 0), (1, GOLDEN, 0), (-1, -GOLDEN, 0), (1, -GOLDEN, 0),
    (0, -1, GOLDEN), (0, 1, GOLDEN), (0, -1, -GOLDEN), (0, 1, -GOLDEN),
    (GOLDEN, 0, -1), (GOLDEN, 0, 1), (-GOLDEN, 0, -1), (-GOLDEN, 0, 1),
]  # fmt: skip
FACES = [
    (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
    (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
    (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1),
]  # fmt: skip


def make_sphere(level, radius=1.0, center=(0.0, 0.0, 0.0)):
    """Make a sphere of 20 * 4**level faces."""
    points = np.array(CORNERS, float)[np.array(FACES)]
    for _ in range(level):
        a, b, c = points.transpose(1, 0, 2)
        x, y, z = (a + b) / 2, (b + c) / 2, (c + a) / 2
        points = np.concatenate(
            [np.stack(corners, 1) for corners in ((a, x, z), (b, y, x), (c, z, y), (x, y, z))]
        )
        points /= np.linalg.norm(points, axis=-1, keepdims=True)
    points /= np.linalg.norm(points, axis=-1, keepdims=True)
    where, faces = np.unique(np.round(points.reshape(-1, 3), 12), axis=0, return_inverse=True)
    return Mesh(radius * where + center, faces.reshape(-1, 3), normals=where.astype(np.float32))
