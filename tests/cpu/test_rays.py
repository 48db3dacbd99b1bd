"""Ways from single points to the sun: against the float64 ray caster, and the counts."""

import numpy as np
import pytest
from support.judge import on_plane
from support.raycaster import RayCaster
from support.shapes import SCENES, merge, sheet

from umbra.cpu.face_tree import make_face_tree
from umbra.cpu.plane import PlaneSweep
from umbra.cpu.rays import find_hidden
from umbra.scene.grid import Grid
from umbra.volume.adjacency import make_caster

EDGE = 1e-6


def make_suns(rng, n):
    suns = rng.normal(size=(n, 3))
    suns[:, 2] = np.abs(suns[:, 2]) + 0.05
    return suns / np.linalg.norm(suns, axis=1, keepdims=True)


def scatter(rng, vertices, faces, n=1200):
    """Give points on faces, each with the normal of one of its sides."""
    own = rng.integers(0, len(faces), n)
    corners = vertices[faces[own]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    kept = length > 1e-9
    points = np.einsum("ij,ijk->ik", rng.dirichlet([1, 1, 1], n), corners)[kept]
    normals = normals[kept] / length[kept, None] * rng.choice([-1, 1], kept.sum())[:, None]
    return points, normals, own[kept]


@pytest.mark.parametrize("name", list(SCENES))
def test_points_on_faces_agree_with_the_ray_caster(name):
    rng = np.random.default_rng(3)
    vertices, faces = SCENES[name]()
    points, normals, own = scatter(rng, vertices, faces)
    suns = make_suns(rng, 6)
    masks = find_hidden(make_face_tree(make_caster(vertices, faces)), points, normals, suns, 2)
    rays, open_rule = RayCaster(vertices, faces), np.zeros(len(faces), bool)
    for sun, mask in zip(suns, masks):
        facing = np.flatnonzero(normals @ sun > 0)
        assert mask[normals @ sun <= 0].all()  # attached
        light = np.append(sun, 0.0)
        # Seen from the sun's own side: of what touches the point nothing is between.
        pierced = rays.count(points[facing], own[facing], light, light, open_rule)
        differ = facing[(pierced.any != (mask[facing] > 0)) & (pierced.touching == 0)]
        apart = rays.distance_to_shadow_edges(
            points[differ], normals[differ], own[differ], light, open_rule
        )
        assert (apart <= EDGE).all()
        assert len(differ) <= 2


@pytest.mark.parametrize("name", list(SCENES))
def test_points_on_a_plane_agree_with_its_counts(name):
    vertices, faces = SCENES[name]()
    grid = Grid(-9.0371, -8.9137, 0.37, 0.41, 48, 44)
    suns = make_suns(np.random.default_rng(4), 8)
    caster = make_caster(vertices, faces)
    seen = on_plane(grid, 0.0)
    masks = find_hidden(make_face_tree(caster), seen.points, np.array(seen.normals), suns)
    counts = PlaneSweep(caster, grid, 0.0).counts(suns).reshape(len(suns), -1)
    assert (masks != (counts != 0)).sum() <= 3
    assert 0 < masks.mean() < 1


def test_a_point_between_two_coplanar_walls_sees_what_its_own_side_sees():
    # Two sheets in one place, a third behind them: the front sees the sun, the back does not.
    front = sheet([(0, 0, 0), (4, 0, 0), (4, 0, 4), (0, 0, 4)])
    tree = make_face_tree(make_caster(*merge(front, front)))
    points = np.array([(1.3, 0.0, 1.1), (1.3, 0.0, 1.1)])
    normals = np.array([(0.0, -1.0, 0.0), (0.0, 1.0, 0.0)])
    south = np.array([[0.1, -0.8, 0.6]])
    np.testing.assert_array_equal(find_hidden(tree, points, normals, south), [[0, 1]])
    np.testing.assert_array_equal(find_hidden(tree, points, normals, -south), [[1, 0]])


def test_nothing_hides_nothing():
    tree = make_face_tree(make_caster(np.zeros((3, 3)), np.zeros((0, 3), np.int32)))
    up = np.array([[0.0, 0.0, 1.0]])
    assert not find_hidden(tree, np.zeros((1, 3)), up, up).any()


def test_many_faces_in_one_place_and_deep_trees_are_found():
    # Sizes that fall by half each time make a lopsided tree.
    scale = 0.5 ** np.arange(900.0)
    corner = np.array([(0, 0, 5), (1, 0, 5), (0, 1, 5)], float)
    vertices = (corner * np.stack([scale, scale, np.ones(900)], 1)[:, None]).reshape(-1, 3)
    faces = np.arange(2700, dtype=np.int32).reshape(-1, 3)
    tree = make_face_tree(
        make_caster(vertices, np.concatenate([faces, np.tile(faces[:1], (500, 1))]))
    )
    up = np.array([[0.0, 0.0, 1.0]])
    points = np.array([(0.2, 0.2, 0.0), (0.7, 0.7, 0.0)])
    np.testing.assert_array_equal(find_hidden(tree, points, np.repeat(up, 2, 0), up), [[1, 0]])
