"""Shadows of pieces of the casters on patches: against rays through each piece alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.raycaster import RayCaster
from support.shapes import SCENES, box, city, jumble, merge, moved, sheet, soup, turned
from support.sweeps import reduce_count

from umbra.cpu.patch_pieces import PieceCounter, PieceEdges
from umbra.cpu.patches import make_patches
from umbra.cpu.shares import Membership
from umbra.rays.face_tree import make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.receivers.samples import sample_surfaces
from umbra.scene import make_scene
from umbra.volume.adjacency import make_caster

EDGE = 1e-6
FLOOR = sheet([(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)])


def make_suns(rng, n, lowest=0.01):
    azimuth, up = rng.uniform(0, 2 * np.pi, n), rng.uniform(lowest, 1.0, n)
    flat = np.sqrt(1 - up**2)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), up], 1)


def count_each(mesh, piece, suns, spacing):
    """Count each piece's shadow on all surfaces, and give the samples and the soup."""
    scene = make_scene(*mesh)
    samples, seen = sample_surfaces(scene, spacing), scene.triangles()
    caster = make_caster(seen.vertices, seen.faces)
    tree = make_face_tree(caster)
    edges = PieceEdges(caster, piece[caster.source])
    counter = PieceCounter(make_patches(samples, tree), edges, tree)
    count = int(piece.max()) + 1
    membership = Membership.of(np.eye(count, dtype=bool), np.zeros(count, bool))
    found = np.zeros((len(suns), count, len(samples.points)), np.float32)
    sole = np.zeros_like(found)
    for k in range(len(suns)):
        weights = np.array([[1.0], [0.0]])
        counter.add_shares(suns[k : k + 1], weights, membership, found[k], sole[k])
    # Eight suns at once are the sum of single ones.
    whole, alone = np.zeros((2, *found.shape[1:]), np.float32)
    weights = np.stack([np.arange(1.0, len(suns) + 1), np.zeros(len(suns))])
    counter.add_shares(suns, weights, membership, whole, alone)
    np.testing.assert_array_equal(whole, np.tensordot(weights[0], found, 1))
    np.testing.assert_array_equal(alone, np.tensordot(weights[0], sole, 1))
    return found, sole, samples, seen


def check(mesh, piece, suns, spacing):
    """Compare with rays through each piece alone; give how many shadows there are."""
    found, sole, samples, seen = count_each(mesh, piece, suns, spacing)
    points, normals = samples.points, samples.normals
    facing = suns @ normals.T > 0
    assert not found[np.broadcast_to(~facing[:, None], found.shape)].any()
    excused = 0
    for p in range(found.shape[1]):
        faces = seen.faces[piece == p]
        tree = make_face_tree(make_caster(seen.vertices, faces))
        truth = find_hidden(tree, points, normals, suns, attached=False)
        rays = RayCaster(seen.vertices, faces)
        for k, sun in enumerate(suns):
            differ = np.flatnonzero(found[k, p] != truth[k])
            if len(differ):
                far = rays.distance_to_shadow_edges(
                    points[differ], normals[differ], np.full(len(differ), -1),
                    np.append(sun, 0.0), np.zeros(len(faces), bool),
                )  # fmt: skip
                assert (far <= EDGE).all(), (p, k, differ[far > EDGE], found[k, p, differ])
                excused += len(differ)
    assert excused <= 1e-4 * found.size + 2
    np.testing.assert_array_equal(sole, found * (found.sum(1, keepdims=True) == 1))
    return int(found.sum()), int(sole.sum())


@pytest.mark.parametrize("name", list(SCENES))
def test_pieces_of_every_scene_agree_with_rays(name):
    mesh = SCENES[name]()
    rng = np.random.default_rng(2)
    piece = rng.integers(0, 3, len(mesh[1]))
    check(mesh, piece, make_suns(rng, 4), np.ptp(mesh[0], axis=0).max() / 60)


@settings(max_examples=reduce_count(15, 2), deadline=None)
@given(seed=st.integers(0, 2**32 - 1), sharp=st.booleans(), floor=st.booleans())
def test_pieces_of_soups_agree_with_rays(seed, sharp, floor):
    rng = np.random.default_rng(seed)
    mesh = (jumble if sharp else soup)(rng)
    mesh = merge(FLOOR, mesh) if floor else mesh
    check(mesh, rng.integers(0, 4, len(mesh[1])), make_suns(rng, 4), 0.21)


def test_houses_of_a_town_cast_their_own_shadows():
    town = city(4, seed=3)
    mesh = turned(merge(FLOOR, town), 17)
    piece = np.append(np.zeros(len(FLOOR[1]), int), 1 + np.arange(len(town[1])) // 12)
    suns = make_suns(np.random.default_rng(8), 6, 0.2)
    cast, sole = check(mesh, piece, suns, 0.4)
    assert cast > sole > 1000


@pytest.mark.parametrize("film", [(-1, 2), (-6, -4)])
def test_a_film_over_a_sample_that_is_asked_hides_only_what_it_covers(film):
    # Too close to the floor to have rims there. It lies over the floor's middle sample, or that is
    # in the rim of the tower's shadow, and the film over the middle of the first run.
    slab = box((film[0], -11, 0), (film[1], -9, 1e-7))
    tower = box((0.25, -14, 0), (3, -12, 8))
    mesh = merge(FLOOR, slab, tower)
    piece = np.repeat([0, 1], [len(FLOOR[1]), 24])
    cast, _ = check(mesh, piece, np.array([[0.0, -0.6, 0.8]]), 0.5)
    assert cast > 40


def test_two_boxes_of_one_place_and_a_wall_that_touches():
    # Sheets that coincide, walls that touch: each hides what it would alone.
    one = box((-1.1, -1.1, 0), (0.9, 0.9, 3))
    beside = moved(one, (2.0, 0, 0))
    mesh = merge(FLOOR, one, one, beside)
    piece = np.repeat([0, 1, 2, 3], [len(FLOOR[1]), 12, 12, 12])
    found, sole, samples, _ = count_each(mesh, piece, np.array([[0.0, -0.6, 0.8]]), 0.5)
    on_floor = np.abs(samples.points[:, 2] - samples.points[:, 2].min()) < 1e-9
    np.testing.assert_array_equal(found[0, 1], found[0, 2])
    assert found[0, 1, on_floor].sum() == found[0, 3, on_floor].sum() == 4 * 8
    assert sole[0, 1:3].sum() == 0
    assert sole[0, 3].sum() == found[0, 3].sum()
