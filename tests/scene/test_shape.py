"""Shapes that bend: the same place stays the same place, normals stay upright."""

import numpy as np

from umbra.scene import Mesh
from umbra.scene.rig import Shape, Skin, make_matrices

FACES = np.zeros((1, 3), np.int32)


def test_corners_at_one_place_stay_at_one_place_to_the_last_bit():
    # Wherever in the arrays they stand: a rounding that depends on it would open the mesh.
    rng = np.random.default_rng(7)
    places = make_matrices(
        rng.normal(size=(6, 3)), rng.normal(size=(6, 4)), rng.uniform(0.5, 2, (6, 3))
    )
    skin = Skin(np.arange(6), rng.normal(size=(6, 4, 4)))
    for count in (5, 64, 333, 4001):
        row = rng.integers(0, 40, count)
        influences = rng.random((40, 4))
        influences /= influences.sum(1, keepdims=True)
        shape = Shape(
            Mesh(100 * rng.normal(size=(40, 3))[row], FACES),
            np.array([0.3, 0.7]),
            offsets=rng.normal(size=(2, 40, 3)).astype("f4")[:, row],
            skin=skin,
            joints=rng.integers(0, 6, (40, 4))[row],
            influences=influences[row],
        )
        bent = shape.pose(places).vertices
        assert len(np.unique(bent, axis=0)) == len(np.unique(row))


def test_normals_stay_at_right_angles_to_a_squeezed_and_mirrored_surface():
    # A roof at 45 degrees, squeezed to half its height and mirrored from east to west.
    vertices = np.array([[0, 0, 0], [2, 0, 2], [0, 3, 0.0]])
    normal = np.array([-1, 0, 1]) / np.sqrt(2)
    squeeze = np.diag([-1, 1, 0.5, 1.0])[None]
    shape = Shape(
        Mesh(vertices, FACES, normals=np.tile(normal, (3, 1))),
        np.zeros(0),
        skin=Skin(np.array([0]), np.eye(4)[None]),
        joints=np.zeros((3, 1), int),
        influences=np.ones((3, 1)),
    )
    bent = shape.pose(squeeze)
    np.testing.assert_allclose(bent.vertices, [[0, 0, 0], [-2, 0, 1], [0, 3, 0]])
    # The outside stays up: it leans east now, and less.
    np.testing.assert_allclose(
        bent.normals, np.tile(np.array([1, 0, 2]) / np.sqrt(5), (3, 1)), rtol=1e-6
    )


def test_what_nothing_bends_is_the_mesh_itself():
    mesh = Mesh(np.eye(3), FACES)
    shape = Shape(mesh, np.zeros(2), offsets=np.ones((2, 3, 3), np.float32))
    assert shape.pose(np.zeros((0, 4, 4))) is mesh
    assert shape.pose(np.zeros((0, 4, 4)), np.array([0, 0.5])).vertices[0].tolist() == [
        1.5,
        0.5,
        0.5,
    ]
