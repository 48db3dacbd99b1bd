"""Tangents: hand-solved folds, mirrors, and what meshes do with them."""

import numpy as np
import pytest

from umbra.errors import InputError
from umbra.readers.gltf_meshes import find_tangents
from umbra.scene import Mesh

FLOOR = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], float)
UPRIGHT = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)  # v runs down
TWO = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
UP = np.tile(np.float32([0, 0, 1]), (4, 1))


@pytest.mark.parametrize(
    ("uv", "expected"),
    [
        (UPRIGHT, (1, 0, 0, 1)),
        (UPRIGHT * np.float32([-1, 1]), (-1, 0, 0, -1)),  # mirrored
        (UPRIGHT[:, ::-1] * np.float32([1, -1]), (0, -1, 0, 1)),  # turned
    ],
)
def test_tangents_run_along_u(uv, expected):
    found = find_tangents(FLOOR, TWO, UP, uv)
    np.testing.assert_allclose(found, np.tile(expected, (4, 1)), atol=1e-6)
    assert found.dtype == np.float32


def test_over_a_fold_tangents_are_weighted_by_angle():
    # Up a ramp and down again, u along the way; on the ridge a normal leaned to one side.
    points = np.array([(-1, 0, 0), (0, 0, 1), (0, 1, 1), (3, 0, 0)], float)
    faces = np.array([(0, 1, 2), (1, 3, 2)], np.int32)
    normal = np.array([0.6, 0, 0.8])
    uv = np.array([(0, 0), (1, 0), (1, -1), (4, 0)], np.float32)
    found = find_tangents(points, faces, np.tile(normal, (4, 1)).astype(np.float32), uv)
    # At one end of the ridge the corners' angles across the normal decide; both ways along u lie
    # in the plane of x and z, and so does what is left of them across the normal.
    across = np.array([0.8, 0, -0.6])
    np.testing.assert_allclose(found[1, :3], across, atol=1e-6)
    # Away from a straight ridge each end is that of its only face.
    np.testing.assert_allclose(found[[0, 3], :3], [across, across], atol=1e-6)


def test_larger_corners_weigh_more():
    # Two faces in a plane at one point: u runs to the right in one, upward in the other.
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0), (-1, 1, 0)], float)
    faces = np.array([(0, 1, 2), (0, 3, 4)], np.int32)
    uv = np.array([(0, 0), (1, 0), (0, -1), (1, 0), (1, -1)], np.float32)
    found = find_tangents(points, faces, np.tile(UP[0], (5, 1)), uv)
    weighed = np.array([90.0, 45.0])  # degrees of their corners
    np.testing.assert_allclose(found[0, :2], weighed / np.linalg.norm(weighed), atol=1e-6)
    np.testing.assert_allclose(found[1:3], [(1, 0, 0, 1)] * 2, atol=1e-6)
    np.testing.assert_allclose(found[3:], [(0, 1, 0, 1)] * 2, atol=1e-6)


def test_faces_that_are_mirrored_against_each_other_share_no_tangent():
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0)], float)
    faces = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    uv = np.array([(0, 0), (1, 0), (0, -1), (1, 0)], np.float32)  # u grows away from the middle
    found = find_tangents(points, faces, UP, uv)
    expected = [(0, 0, 0, 0), (1, 0, 0, 1), (0, 0, 0, 0), (-1, 0, 0, -1)]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_points_that_are_alike_share_a_tangent():
    # The floor's two faces do not share corners, and a third is at the same place elsewhere in u.
    points, uv = FLOOR[TWO.ravel()], UPRIGHT[TWO.ravel()]
    faces = np.arange(6, dtype=np.int32).reshape(2, 3)
    bent = points.copy()
    bent[5, 2] = 0.5
    normals = np.tile(np.float32([0, 0, 1]), (6, 1))
    found = find_tangents(bent, faces, normals, uv)
    np.testing.assert_array_equal(found[0], found[3])
    apart = uv.copy()
    apart[3:] += np.float32(2)
    assert (find_tangents(bent, faces, normals, apart)[:3, :3] == (1, 0, 0)).all()


def test_an_image_without_extent_gives_no_tangent():
    assert not find_tangents(FLOOR, TWO, UP, np.zeros((4, 2), np.float32)).any()
    assert find_tangents(FLOOR[:0], TWO[:0], UP[:0], UPRIGHT[:0]).shape == (0, 4)


def test_tangents_have_four_numbers_for_each_vertex():
    assert Mesh(FLOOR, TWO, tangents=np.ones((4, 4))).tangents.dtype == np.float32
    with pytest.raises(InputError, match=r"tangents of shape \(4, 3\) do not fit 4 vertices"):
        Mesh(FLOOR, TWO, tangents=np.ones((4, 3)))
