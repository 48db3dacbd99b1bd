"""Sides of almost no height: a base plate a hair above the lowest receiver."""

import numpy as np
import pytest

from umbra.cpu.frame import FrameCounter
from umbra.cpu.height_field import HeightFieldSweep
from umbra.scene import Camera, directional_light, make_scene
from umbra.scene.grid import Grid
from umbra.volume.adjacency import make_caster


def plate(height):
    """Make a fine grid of triangles with rotated edges at z = height, 100 m wide."""
    n = 12
    x, y = np.meshgrid(np.linspace(0, 100, n), np.linspace(0, 100, n))
    turn = np.radians(17.3)
    points = np.stack(
        [
            x * np.cos(turn) - y * np.sin(turn),
            x * np.sin(turn) + y * np.cos(turn),
            np.full_like(x, height) * (1 + 1e-3 * np.sin(x)),
        ],
        -1,
    ).reshape(-1, 3)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + n], 1), np.stack([a + 1, a + n + 1, a + n], 1)])
    return points, faces


@pytest.mark.parametrize("height", [3.5e-15, 1e-12, 1e-9])
def test_a_plate_on_the_floor_shades_nothing_of_a_field(height):
    points, faces = plate(height)
    grid = Grid(-60.3, -20.1, 0.7, 0.7, 256, 224)
    sweep = HeightFieldSweep(make_caster(points, faces), grid, np.zeros((224, 256)))
    angle = np.radians(np.arange(0, 360, 7.5))
    suns = np.stack([np.cos(angle), np.sin(angle), np.full_like(angle, 0.3)], 1)
    suns /= np.linalg.norm(suns, axis=1, keepdims=True)
    # The plate is a sheet: what lies under it is shaded, nothing beside it is.
    under = sweep.counts(np.array([[0.0, 0.0, 1.0]]))[0] != 0
    x, y = np.meshgrid(grid.x, grid.y)
    turn = np.radians(17.3)
    u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    outside = (u < -1e-3) | (u > 100 + 1e-3) | (v < -1e-3) | (v > 100 + 1e-3)
    assert not (under & outside).any()
    assert not sweep.masks(suns)[:, outside].any()


def test_a_plate_on_the_floor_shades_nothing_in_a_frame():
    points, faces = plate(1e-13)
    counter = FrameCounter(make_scene(points, faces), ground=0.0)
    camera = Camera((-80, -90, 60), (20, 60, 0), size=(320, 200))
    view, frame = counter.see(camera)
    for way in ((1, 0.2, 0.3), (-0.4, 1, 0.2), (0.3, -1, 0.5), (-1, -1, 0.1)):
        counts = counter.count(view, camera, directional_light(way))
        ground = frame.part == -2
        assert ground.any()
        assert not counts[ground].any()
