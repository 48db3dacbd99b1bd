"""Patches whose neighbours touch, cut or lie in them, suns in their plane, and real models."""

import numpy as np
import pytest
from support.model_files import DATA, FILES
from support.patches import FLOOR, check, compare_with_rays, make_counter, make_suns, prepare
from support.raycaster import RayCaster
from support.shapes import box, merge, moved, rewound, sheet, terrain, turned

import umbra

TURNS = [0, 90, 23]


@pytest.mark.parametrize("turn", TURNS)
def test_houses_that_share_a_wall(turn):
    # A row of four houses of unequal height and depth, and one that stands in another.
    row = [box((3.1 * k, 0, 0), (3.1 * (k + 1), 5 + k % 2, 3 + k * 1.3)) for k in range(4)]
    mesh = turned(merge(FLOOR, *row, box((4, 1, 0), (5, 2, 9))), turn)
    dark, lit = check(mesh, make_suns(np.random.default_rng(turn), 8), 0.21)
    assert min(dark, lit) > 5000


def test_walls_that_coincide_either_way_round():
    # The same wall twice, and a third time with its other side out; its face is still lit.
    wall = sheet([(-4, 0, 0), (4, 0, 0), (4, 0, 5), (-4, 0, 5)])
    suns = make_suns(np.random.default_rng(3), 8, 0.1)
    for others in ([wall], [rewound(wall)], [wall, rewound(wall), wall]):
        dark, lit = check(merge(FLOOR, wall, *others), suns, 0.19)
        assert min(dark, lit) > 1000
    alone = merge(wall, rewound(wall), wall)
    samples, _, counter, _, _ = prepare(alone, 0.19)
    masks = counter.masks(suns)
    np.testing.assert_array_equal(masks == 0, suns @ samples.normals.T > 0)


@pytest.mark.parametrize("turn", TURNS)
def test_houses_that_a_terrain_cuts(turn):
    ground = moved(terrain(17, 1.6, seed=4, height=3.0), (0, 0, -3))
    houses = [box((x, y, -4), (x + 3.3, y + 4.1, 3 + x / 5)) for x in (-9, 1) for y in (-7, 3)]
    sunk = box((-6, -2, -6), (6, 2, -0.5))  # its roof is partly below the ground
    mesh = turned(merge(ground, *houses, sunk), turn)
    dark, lit = check(mesh, make_suns(np.random.default_rng(turn), 6), 0.23)
    assert min(dark, lit) > 5000
    _, patches, _, _, _ = prepare(mesh, 0.23)
    assert len(patches.cuts) > 50  # where the ground passes through walls


def test_faces_in_a_patchs_plane():
    # A roof that continues in its neighbour's, a terrace in the floor's plane, a slab on it.
    mesh = merge(
        FLOOR, box((-5, -5, 0), (0, 0, 3)), box((0, -5, 0), (5, 0, 3)),
        sheet([(1, 1, 0), (6, 1, 0), (6, 6, 0), (1, 6, 0)]), box((-6, 2, 0), (-2, 6, 1e-4)),
        box((-6, -9, 0), (-2, -7, 1e-7)),
    )  # fmt: skip
    dark, lit = check(mesh, make_suns(np.random.default_rng(6), 8), 0.17)
    assert min(dark, lit) > 5000


@pytest.mark.parametrize("turn", TURNS)
def test_suns_in_the_plane_of_walls_and_roofs(turn):
    gable = (
        np.array([(0, 0, 3), (6, 0, 3), (6, 9, 3), (0, 9, 3), (3, 0, 5), (3, 9, 5)], float),
        np.array([[0, 4, 5], [0, 5, 3], [1, 2, 5], [1, 5, 4], [0, 1, 4], [2, 3, 5]], np.int32),
    )
    mesh = turned(
        merge(FLOOR, box((0, 0, 0), (6, 9, 3)), gable, box((-7, -3, 0), (-6, 9, 7))), turn
    )
    angle = np.radians(turn)
    suns = []
    for off in (0.0, 1e-12, -1e-9, 1e-6, -1e-5, 3e-4, -3e-4):
        along = np.pi / 2 + angle + off  # along the long walls
        slope = np.arctan(2 / 3) + off  # in the plane of a slope
        suns.append((np.cos(along) * 0.8, np.sin(along) * 0.8, 0.6))
        suns.append((np.cos(angle) * np.cos(slope), np.sin(angle) * np.cos(slope), np.sin(slope)))
    suns = np.array(suns)
    suns /= np.linalg.norm(suns, axis=1)[:, None]
    dark, lit = check(mesh, suns, 0.23)
    assert min(dark, lit) > 3000


@pytest.mark.parametrize("thin", [1e-3, 1e-6, 1e-9, 1e-12])
def test_slivers_in_and_beside_patches(thin):
    # Needles that cast, needles that cut the floor, and a wall of two halves and a needle.
    rng = np.random.default_rng(9)
    needles = []
    for _ in range(12):
        start, along, aside = rng.uniform(-5, 5, 3), rng.normal(size=3) * 3, rng.normal(size=3)
        needles.append(
            (start + np.array([0 * along, along, along / 2 + thin * aside]), [(0, 1, 2)])
        )
    needles = [(np.asarray(v), np.array(f, np.int32)) for v, f in needles]
    spots = np.array([(-2, 4, 0), (2, 4, 0), (2, 4, 4), (-2, 4, 4), (0.7 + thin, 4, 2.7 - thin)])
    wall = spots, np.array([[0, 2, 3], [0, 4, 2], [0, 1, 4], [1, 2, 4]], np.int32)
    check(merge(FLOOR, wall, *needles), make_suns(rng, 6), 0.23)


def make_day(count=33):
    """Make the suns of a summer's day at 48 degrees north."""
    hour = np.radians(np.linspace(-108, 108, count))
    sine, cosine = np.sin(np.radians([20, 48.2])), np.cos(np.radians([20, 48.2]))
    up = sine[0] * sine[1] + cosine[0] * cosine[1] * np.cos(hour)
    east = -cosine[0] * np.sin(hour)
    north = sine[0] * cosine[1] - cosine[0] * sine[1] * np.cos(hour)
    return np.stack([east, north, up], 1)[up > 0]


@pytest.mark.parametrize("name", FILES)
def test_surfaces_of_real_models(name):
    if not (DATA / name).is_file():
        pytest.skip(f"{name} is not here: the real models lie outside the repository")
    scene, suns = umbra.read(DATA / name), make_day()
    samples, counter, tree = make_counter(scene, 2.5)
    soup = scene.triangles()
    rays = RayCaster(soup.vertices, soup.faces)
    differ = compare_with_rays(samples, counter.masks(suns), tree, rays, suns)
    assert differ <= 1e-5 * len(suns) * len(samples.points)
