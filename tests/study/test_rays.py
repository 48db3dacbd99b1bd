"""Every instant of a study against rays: a float64 ray caster, and Embree in bulk."""

import numpy as np
import pytest
from support.judge import look_down
from support.raycaster import RayCaster
from support.shapes import city, moved, turned

import umbra
from umbra.scene import make_scene
from umbra.scene.grid import Grid

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-05", "start": "07:15", "end": "17:15", "every": "1h", "masks": True}
ZENITH = np.array([0.0, 0.0, 1.0, 0.0])
EDGE = 1e-6
"""Nearer to a shadow's edge than this [m] both answers are right."""


def gabled(width, depth, eaves, ridge):
    """Make a closed house with a gabled roof, its ridge along y."""
    x, y = width / 2, depth / 2
    vertices = [(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0), (-x, -y, eaves), (x, -y, eaves),
                (x, y, eaves), (-x, y, eaves), (0, -y, ridge), (0, y, ridge)]  # fmt: skip
    faces = [(0, 2, 1), (0, 3, 2), (0, 1, 5), (0, 5, 4), (2, 3, 7), (2, 7, 6), (1, 2, 6),
             (1, 6, 5), (3, 0, 4), (3, 4, 7), (4, 5, 8), (6, 7, 9), (5, 6, 9), (5, 9, 8),
             (7, 4, 8), (7, 8, 9)]  # fmt: skip
    return np.array(vertices, float), np.array(faces, np.int32)


@pytest.fixture(scope="module")
def block():
    """Nine gabled houses, turned anyhow, steep and flat ones, and some boxes among them."""
    rng = np.random.default_rng(11)
    meshes = [city(3, seed=5, cell=13.0)]
    for i in range(3):
        for j in range(3):
            eaves = rng.uniform(3, 7)
            house = gabled(*rng.uniform(5, 9, 2), eaves, eaves + rng.uniform(0.3, 8))
            place = ((i - 1) * 13.0 + 6, (j - 1) * 13.0 + 7, -1.0)
            meshes.append(moved(turned(house, rng.uniform(0, 180)), place))
    counts = np.cumsum([0] + [len(v) for v, _ in meshes])
    return (
        np.concatenate([v for v, _ in meshes]),
        np.concatenate([f + n for (_, f), n in zip(meshes, counts)]).astype(np.int32),
    )


@pytest.fixture(scope="module")
def result(block):
    return umbra.shadow_study(
        make_scene(*block), VIENNA, **DAY, receivers="top", ground=0.0,
        extent=(-30, -28, 31, 33), cell=0.31,
    )  # fmt: skip


def seen_places(block, result):
    """Give the cells' places on the topmost surface, their faces, and upward normals."""
    x, y = result.x.values, result.y.values
    grid = Grid(x[0], y[0], x[1] - x[0], y[1] - y[0], len(x), len(y))
    heights, own = look_down(block, grid, 0.0)
    points = np.stack([*np.meshgrid(x, y), heights], -1).reshape(-1, 3)
    own = own.ravel()
    normals = np.broadcast_to([0.0, 0.0, 1.0], points.shape).copy()
    corners = block[0][block[1][own[own >= 0]]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals[own >= 0] = across / np.linalg.norm(across, axis=1, keepdims=True)
    return points, own, normals


def find_wrong(block, points, own, normals, sun, mask):
    """Find where a mask and float64 rays differ, but for places within EDGE of an edge."""
    rays, light = RayCaster(*block), np.append(sun, 0.0)
    closed = np.ones(len(block[1]), bool)
    shaded = rays.count(points, own, ZENITH, light, closed).any
    differ = np.flatnonzero(shaded != (mask > 0))
    distance = rays.distance_to_shadow_edges(
        points[differ], normals[differ], own[differ], light, closed
    )
    assert (distance <= EDGE).sum() <= 3
    return points[differ[distance > EDGE]]


def test_heights_are_those_seen_from_above(block, result):
    points, _, _ = seen_places(block, result)
    np.testing.assert_allclose(result.receiver_z.values.ravel(), points[:, 2], atol=1e-12)
    assert float(result.receiver_z.min()) == 0
    assert float((result.receiver_z > 0).mean()) > 0.15


def test_every_instant_agrees_with_float64_rays(block, result):
    points, own, normals = seen_places(block, result)
    attached = 0
    for sun, mask in zip(result.sun_direction.values, result.in_shadow.values):
        wrong = find_wrong(block, points, own, normals, sun, mask.ravel())
        assert not len(wrong), f"{len(wrong)} cells are wrong: {wrong[:5]}"
        away = (normals @ sun) <= 0
        assert (mask.ravel()[away] == 1).all()
        attached += away.sum()
    assert attached > 5000  # roofs turned from the sun: the test sees attached shadow


def test_every_instant_agrees_with_embree(block, result):
    intersector = pytest.importorskip(
        "embreex.mesh_construction", reason="embreex is not installed"
    )
    from embreex import rtcore_scene  # noqa: PLC0415

    scene = rtcore_scene.EmbreeScene()
    intersector.TriangleMesh(scene, block[0].astype(np.float32), block[1])
    points, own, normals = seen_places(block, result)
    for sun, mask in zip(result.sun_direction.values, result.in_shadow.values):
        away = (normals @ sun) <= 0
        starts = (points + 1e-4 * normals).astype(np.float32)
        ways = np.broadcast_to(sun, points.shape).astype(np.float32)
        hit = scene.run(np.ascontiguousarray(starts), np.ascontiguousarray(ways)) >= 0
        differ = np.flatnonzero((hit | away) != (mask.ravel() > 0))
        assert len(differ) < 0.002 * len(points)
        # Each is tried again in float64, which has to side with the study.
        wrong = find_wrong(
            block, points[differ], own[differ], normals[differ], sun, mask.ravel()[differ]
        )
        assert not len(wrong), f"{len(wrong)} cells are wrong: {wrong[:5]}"
        assert 0.05 < (hit & ~away).mean() < 0.95


def test_ground_agrees_with_float64_rays(block):
    result = umbra.shadow_study(
        make_scene(*block), VIENNA, **DAY, ground=0.0, extent=(-30, -28, 31, 33), cell=0.47
    )
    x, y = np.meshgrid(result.x, result.y)
    points = np.stack([x, y, np.zeros(x.shape)], -1).reshape(-1, 3)
    own = np.full(len(points), -1)
    normals = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    for sun, mask in zip(result.sun_direction.values, result.in_shadow.values):
        wrong = find_wrong(block, points, own, normals, sun, mask.ravel())
        assert not len(wrong), f"{len(wrong)} cells are wrong: {wrong[:5]}"
        assert 0.2 < mask.mean() < 1
