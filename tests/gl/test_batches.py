"""The order of faces that are drawn: fewer vertices to place, and the same picture."""

import numpy as np
import pytest
from support.spheres import make_sphere

from umbra.gl.batches import count_placed, find_draw_order
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, Material, Mesh, Part, directional_light, make_scene

SUN = directional_light((0.3, -0.6, 0.8))
CAMERA = Camera((0.5, -6, 3), (0.5, 0, 0), size=(96, 72), fov=40)


def shuffle(mesh, seed=1):
    return Mesh(mesh.vertices, np.random.default_rng(seed).permutation(mesh.faces), mesh.normals)


def test_vertices_placed_by_hand():
    # The fourth corner of a square is new; 256 later it is forgotten, as is what it stood on.
    square = [(0, 1, 2), (0, 2, 3)]
    assert count_placed(np.array(square)) == 4
    assert count_placed(np.array([*square, (256, 257, 258), (0, 2, 3)])) == 4 + 3 + 2
    assert count_placed(np.array([*square, (4, 5, 6), (0, 2, 3)])) == 4 + 3


def test_faces_in_disorder_are_drawn_with_their_neighbours():
    ball = make_sphere(4, 1.0, (0, 0, 0))
    mixed = shuffle(ball)
    move = np.eye(4)
    move[0, 3] = 1.5
    few = make_sphere(2, 0.5, (0, 0, 2))
    scene = make_scene([Part("a", "", mixed), Part("few", "", few), Part("b", "", mixed, move)])
    order, n = find_draw_order(scene), len(mixed.faces)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(scene.triangles().faces)))
    first = order[:n]
    assert set(first) == set(range(n))
    np.testing.assert_array_equal(order[-n:], first + n + len(few.faces))
    np.testing.assert_array_equal(order[n:-n], np.arange(n, n + len(few.faces)))
    assert count_placed(mixed.faces[first]) < 0.4 * count_placed(mixed.faces)


def test_a_good_order_is_kept():
    points = np.arange(900.0)
    grid = np.stack([points // 30, points % 30, 0 * points], 1)
    corner = (np.arange(29)[:, None] * 30 + np.arange(29)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 30, corner + 31], 1),
            np.stack([corner, corner + 31, corner + 1], 1),
        ],
        1,
    ).reshape(-1, 3)
    scene = make_scene([Part("floor", "", Mesh(grid, faces.astype(np.int32)))])
    assert len(faces) > 1000
    np.testing.assert_array_equal(find_draw_order(scene), np.arange(len(faces)))


@pytest.mark.parametrize("opacity", [1.0, 0.5])
def test_pictures_do_not_depend_on_the_order(device, opacity):
    ball = make_sphere(4, 1.0, (0, 0, 0))
    pictures = []
    for mesh in (ball, shuffle(ball, 2)):
        other = Part("b", "", shuffle(ball, 3), np.diag([0.5, 0.5, 0.5, 1.0]) + np.eye(4, k=3) * 2)
        scene = make_scene([Part("a", "", mesh, material=Material(opacity=opacity)), other])
        with SceneRenderer(scene, -1.0, device=device) as renderer:
            pictures.append(renderer.render(CAMERA, [SUN]).astype(int))
    assert (np.abs(pictures[0] - pictures[1]).max(-1) > 2).sum() <= 4
    assert pictures[0].std() > 10
