"""The free share of the sun's disc: closed forms, and many rays."""

import numpy as np
import pytest
from support.shapes import box, duplicated, merge, rewound, sheet, soup

from umbra.lights import Horizon
from umbra.rays.disc_sides import make_land_edge
from umbra.rays.face_tree import make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.rays.sun_disc import find_free_disc
from umbra.sky.land_curtain import find_bends
from umbra.volume.adjacency import make_caster

RADIUS = 0.2666
NONE = np.full((1, 3), np.nan)


def find(mesh, toward, point=(0.0, 0.0, 0.0), normal=None, radius=RADIUS):
    normals = NONE if normal is None else np.array([normal], float)
    tree = make_face_tree(make_caster(*mesh))
    toward = np.asarray(toward, float) / np.linalg.norm(toward)
    return find_free_disc(tree, np.array([point]), normals, toward[None], radius)[0, 0]


def segment(height):
    """The share of a disc above a level line, in radii over its middle."""
    return (np.arccos(height) - height * np.sqrt(1 - height**2)) / np.pi


@pytest.mark.parametrize(
    "change", [lambda mesh: mesh, rewound, lambda mesh: duplicated(mesh, [0, 1])]
)
@pytest.mark.parametrize("height", [-1.2, -0.9, -0.3, 0.0, 0.5, 0.99, 1.3])
def test_half_hidden_by_a_wall(change, height):
    """A roof's edge before the sun in the zenith: whichever way it runs, it cuts a segment."""
    at, r = 10.0, np.tan(np.radians(RADIUS))
    for turn in (0.0, 0.4, np.pi / 2):
        x, y = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
        edge = height * r * at
        plan = [a * 5 * x + b * y for a, b in ((-1, -5), (1, -5), (1, edge), (-1, edge))]
        share = find(change(sheet([(*p, at) for p in plan])), (0, 0, 1))
        expected = 1.0 if height < -1 else 0.0 if height > 1 else segment(height)
        assert share == pytest.approx(expected, abs=1e-9)


def test_a_pole_thinner_than_the_disc():
    r = np.tan(np.radians(RADIUS)) * 100 * np.hypot(1, 0.05)
    half = 0.1 * r
    pole = sheet([(-half, 100, -50), (half, 100, -50), (half, 100, 50), (-half, 100, 50)])
    share = find(pole, (0, 1, 0.05))
    hidden = 1 - 2 * segment(0.1)
    assert share == pytest.approx(1 - hidden, abs=1e-5)


def test_the_horizon_and_the_own_surface_hide():
    far = sheet([(500, 500, 500), (501, 500, 500), (501, 501, 500), (500, 501, 500)])
    assert find(far, (0, 1, 0)) == pytest.approx(0.5, abs=1e-9)
    assert find(far, (0, 1, 1), normal=(0, 1, -1)) == pytest.approx(0.5, abs=1e-9)
    assert find(far, (0, 1, 1), normal=(0, -1, 0)) == 0.0
    assert find(far, (0, 1, 1), normal=(0, 1, 0)) == 1.0
    assert find(far, (0, 1, -1)) == 0.0


def judge(tree, points, normals, toward, n=10_000, radius=RADIUS):
    """By rays on a spiral over the disc."""
    return 1 - find_hidden(tree, points, normals, spread(toward, radius, n)).mean(0)


def spread(toward, radius, n):
    """Rays on a spiral over a disc."""
    k = np.arange(n)
    away = np.tan(np.radians(radius)) * np.sqrt((k + 0.5) / n)
    turn = k * np.pi * (3 - 5**0.5)
    e = np.array([0.0, 0, 1]) if abs(toward[2]) < 0.9 else np.array([1.0, 0, 0])
    u = np.cross(e, toward)
    u /= np.linalg.norm(u)
    v = np.cross(toward, u)
    rays = toward + (away * np.cos(turn))[:, None] * u + (away * np.sin(turn))[:, None] * v
    return rays / np.linalg.norm(rays, axis=1)[:, None]


@pytest.mark.parametrize("seed", range(4))
def test_soups_and_towns_by_rays(seed):
    rng = np.random.default_rng(seed)
    if seed % 2:
        corners = rng.uniform(-30, 30, (60, 2))
        tops = rng.uniform(2, 20, 60)
        mesh = merge(*(box((*a, 0), (*(a + 4), t)) for a, t in zip(corners, tops)))
        points = np.column_stack([rng.uniform(-30, 30, (400, 2)), np.full(400, 0.01)])
        normals = np.tile([0.0, 0, 1], (400, 1))
    else:
        mesh = soup(rng, 300)
        points, normals = rng.uniform(-4, 4, (400, 3)), np.full((400, 3), np.nan)
    tree = make_face_tree(make_caster(*mesh))
    toward = np.array([0.5, -0.6, 0.35])
    toward /= np.linalg.norm(toward)
    radius = 3.0  # so that many places see a part of it
    found = find_free_disc(tree, points, normals, toward[None], radius)[0]
    rays = judge(tree, points, normals, toward, radius=radius)
    assert ((found > 0.01) & (found < 0.99)).sum() > 15
    assert np.abs(found - rays).max() < 2e-3
    assert np.abs(found - rays).mean() < 3e-4


def make_quilt(n=12):
    """A slope of small triangles before the sun in the zenith."""
    at = np.linspace(-5, 5, n + 1)
    x, y = (axis.ravel() for axis in np.meshgrid(at, at))
    vertices = np.stack([x, y, 10 + 0.1 * x + 0.07 * np.sin(y)], 1)
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = first, first + 1, first + n + 2, first + n + 1
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype("i4")


def test_joined_faces_hide_all_of_a_disc_and_a_hole_shows_its_share():
    vertices, faces = make_quilt()
    wide = 12.0  # degrees: some dozens of faces
    assert find((vertices, faces), (0, 0, 1), radius=wide) == 0.0
    assert find(rewound((vertices, faces)), (0, 0, 1), radius=wide) == 0.0
    middle = vertices[faces].mean(1)
    hole = np.argmin(np.hypot(*(middle[:, :2] - (0.9, 0.4)).T))
    flat = vertices[faces[hole]][:, :2] / vertices[faces[hole]][:, 2:] / np.tan(np.radians(wide))
    (a, b), (c, d) = flat[1] - flat[0], flat[2] - flat[0]
    share = find((vertices, np.delete(faces, hole, 0)), (0, 0, 1), radius=wide)
    assert share == pytest.approx(abs(a * d - b * c) / 2 / np.pi, rel=1e-9)


def test_a_cone_meets_every_box_that_holds_a_face_in_it():
    """Suns along the axes and beside them, where slopes of the cone's sides vanish."""
    rng = np.random.default_rng(3)
    corners = rng.uniform(-30, 30, (2000, 1, 3)) + rng.uniform(-0.5, 0.5, (2000, 3, 3))
    mesh = corners.reshape(-1, 3), np.arange(6000, dtype=np.int32).reshape(-1, 3)
    tree = make_face_tree(make_caster(*mesh))
    points = rng.uniform(-20, 20, (60, 3)) * [1, 1, 0]
    seen = 0
    for way in ((0, 0, 1), (1, 0, 0.04), (0, -1, 0.05), (0.02, 0.02, 1), (-1, 1e-9, 0.3)):
        toward = np.array(way, float) / np.linalg.norm(way)
        found = find_free_disc(tree, points, np.full((60, 3), np.nan), toward[None], 2.0)[0]
        rays = judge(tree, points, np.full((60, 3), np.nan), toward, 3000, 2.0)
        assert np.abs(found - rays).max() < 3e-3
        seen += ((found > 0) & (found < 1)).sum()
    assert seen > 100


def test_a_thicket_is_judged_by_rays():
    rng = np.random.default_rng(5)
    leaves = rng.normal(size=(3000, 1, 3)) * 0.5 + rng.normal(size=(3000, 3, 3)) * 0.05
    vertices = leaves.reshape(-1, 3) + [0, 40, 20]
    mesh = vertices, np.arange(9000, dtype=np.int32).reshape(-1, 3)
    tree = make_face_tree(make_caster(*mesh))
    toward = np.array([0, 40, 20.0]) / np.hypot(40, 20)
    found = find_free_disc(tree, np.zeros((1, 3)), NONE, toward[None], 1.0)[0]
    rays = judge(tree, np.zeros((1, 3)), NONE, toward, 40_000, 1.0)
    assert 0.02 < rays[0] < 0.9
    assert found[0] == pytest.approx(rays[0], abs=5e-3)


def test_points_far_apart_and_several_directions():
    mesh = sheet([(-5, -5, 10), (5, -5, 10), (5, 0, 10), (-5, 0, 10)])
    tree = make_face_tree(make_caster(*mesh))
    points = np.array([[0.0, 0, 0], [0, 40, 0], [0, 3, 0]])
    toward = np.array([[0, 0.3, 1], [0, -0.3, 1.0]]) / np.hypot(0.3, 1)
    found = find_free_disc(tree, points, np.full((3, 3), np.nan), toward, RADIUS)
    assert found[:, :2].tolist() == [[1.0, 1.0], [0.0, 1.0]]
    assert found[:, 2] == pytest.approx([1.0, 0.5], abs=1e-3)


def test_land_cuts_the_disc():
    """Level, steep and ragged land, across north, beside rays; and its own middle."""
    rng = np.random.default_rng(2)
    far = sheet([(500, 500, 500), (501, 500, 500), (501, 501, 500), (500, 501, 500)])
    tree = make_face_tree(make_caster(*far))
    turns, radius, north = np.arange(0, 360, 0.5), 2.0, 25.0
    land = Horizon("", "", turns, rng.uniform(3, 9, len(turns)))
    edge = make_land_edge(*find_bends(land), north)
    seen = 0
    for azimuth, altitude in zip(rng.uniform(0, 360, 40), rng.uniform(1, 11, 40)):
        a, e = np.radians([azimuth if seen else north, altitude])
        toward = np.array([np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), np.sin(e)])
        share = find_free_disc(tree, np.zeros((1, 3)), NONE, toward[None], radius, 1, edge)[0, 0]
        rays = spread(toward, radius, 10_000)
        free = 1 - (land.covers(rays, north) | (rays[:, 2] < 0)).mean()
        assert share == pytest.approx(free, abs=2e-3)
        seen += 0 < share < 1
    assert seen > 10
    level = make_land_edge(*find_bends(Horizon("", "", turns, np.full(len(turns), 20.0))), 0.0)
    for altitude, expected in ((19.7, 0.0), (20.0, 0.5), (20.3, 1.0), (88.0, 1.0)):
        toward = np.array([0, np.cos(np.radians(altitude)), np.sin(np.radians(altitude))])
        share = find_free_disc(tree, np.zeros((1, 3)), NONE, toward[None], RADIUS, 1, level)[0, 0]
        assert share == pytest.approx(expected, abs=1.5e-3)  # the land's line is no great circle
