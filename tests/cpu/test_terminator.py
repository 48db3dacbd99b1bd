"""Smooth normals on coarse meshes: a terminator without teeth in pictures, exact in arrays."""

import numpy as np
import pytest
from support.shapes import box
from support.spheres import make_sphere

import umbra
from umbra.cpu.frame import FrameCounter
from umbra.cpu.shade import find_colors, find_reached
from umbra.scene import Material, Mesh, Part, make_scene

LIGHT = umbra.directional_light((1.0, -0.35, 0.7))
CAMERA = umbra.Camera((0, -14, 6), (0, 0, 0), size=(120, 120), fov=22)


def make_ball(level, *more):
    return make_scene(
        [Part("ball", "", make_sphere(level, 2.0), material=Material((0.8,) * 3)), *more]
    )


def shade(scene, samples=1, **options):
    """Shade a picture, and shade it as if nothing shaded anything."""
    picture = umbra.render(scene, CAMERA, LIGHT, samples=samples, arrays=True, **options)
    view, frame = FrameCounter(scene).see(CAMERA)
    lit = [np.ones(frame.part.shape)]
    return picture, find_colors(scene, frame, [LIGHT], lit, view)


@pytest.mark.parametrize("level", [1, 2, 3])  # 80, 320, 1280 faces
@pytest.mark.parametrize("soft", [{}, {"soft": "wedges", "light_size": 5.0}])
def test_a_ball_alone_is_shaded_by_its_smooth_normals(level, soft):
    scene = make_ball(level)
    picture, bright = shade(scene, **soft)
    shown = 255 * np.where(bright <= 0.0031308, 12.92 * bright, 1.055 * bright ** (1 / 2.4) - 0.055)
    difference = np.abs(picture.image - np.clip(shown, 0, 255)).max(-1)[picture.is_seen]
    assert difference.max() < (1.0 if not soft else 4.0)
    # Arrays tell what the faces do, teeth and all.
    facing = (np.nan_to_num(picture.normal) * LIGHT.position[:3]).sum(-1) > 0
    np.testing.assert_array_equal(picture.lit[0], facing & picture.is_seen)


def test_other_casters_still_shade_it():
    # A plate before the ball's terminator: what is in its shadow, too, is counted twice.
    way = LIGHT.position[:3] / np.linalg.norm(LIGHT.position[:3])
    low, high = np.array((-1.0, -1.0, -0.01)), np.array((1.0, 1.0, 0.01))
    plate = Part("plate", "", Mesh(*box(low + 4 * way, high + 4 * way)))
    picture, _ = shade(make_ball(1, plate))
    open_, _ = shade(make_ball(1))
    darker = (picture.image.astype(int) < open_.image.astype(int) - 8).all(-1)
    assert darker.sum() > 100
    assert (picture.count[0][darker & (open_.count[0] == 1)] == 2).all()


def test_the_share_of_a_light_is_that_above_the_horizon():
    half, quarter = 0.5, 0.25
    found = find_reached(
        np.array([half, quarter, half, 0.0, 0.0, 0.0]),
        np.array([0, 0, 0, 1, 2, 1]),
        np.array([0.0001, 0.0001, 0.9, -0.1, -0.1, -0.1]),
        np.array([0.2, 0.2, 0.8, 0.1, 0.1, -0.2]),
        0.1,
        np.ones(6, bool),
    )
    np.testing.assert_allclose(found, [1.0, 0.5, half, 1.0, 0.0, 0.0], atol=2e-3)


def test_flat_faces_are_shaded_as_they_are():
    share = np.array([0.5, 0.0])
    found = find_reached(
        share,
        np.array([0, 1]),
        np.array([0.01, -0.1]),
        np.array([0.01, 0.1]),
        0.1,
        np.zeros(2, bool),
    )
    np.testing.assert_array_equal(found, share)
