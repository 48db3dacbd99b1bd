"""Textures on the device: as sharp as the CPU's, near and far."""

import numpy as np
import pytest

import umbra
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, Material, Mesh, Part, make_image, make_scene

CORNERS = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
UV = CORNERS[:, :2] * (0.5, -0.5) + 0.5
DARK = umbra.point_light((0, 0, 50), (0, 0, 0))


def make_floor(texels):
    material = Material((1, 1, 1), make_image(texels), is_unlit=True)
    return make_scene(
        [Part("floor", "", Mesh(CORNERS, [(0, 1, 2), (0, 2, 3)], uv=UV), material=material)]
    )


def test_magnified_texels_are_the_cpus(device):
    texels = np.random.default_rng(1).integers(0, 255, (8, 8, 3)).astype(np.uint8)
    camera = Camera((0, 0, 9), (0, 0, 0), (0, 1, 0), (40, 40), height=2.0)
    scene = make_floor(texels)
    truth = umbra.render(scene, camera, DARK, samples=1, style="plain").astype(int)
    with SceneRenderer(scene, device=device) as renderer:
        found = renderer.render(camera, [])
    assert np.abs(found - truth).max() <= 3
    np.testing.assert_array_equal(found[2::5, 2::5], texels)


@pytest.mark.parametrize(
    ("eye", "most"), [((0, -0.5, 9), 0.85), ((0.5, -5, 1.5), 2.1)], ids=["above", "slanted"]
)
def test_texels_smaller_than_pixels_are_averaged(device, eye, most):
    # A level coarser or finer lies 0.92 and 1.45 apart from above, 2.5 and 2.4 at a slant.
    rows, cols = np.mgrid[:512, :512]
    level = 128 + 60 * np.sin(cols / 20.0) + 50 * np.where(rows // 40 % 2, 1, -1)
    texels = np.repeat(level[..., None], 3, 2).astype(np.uint8)
    camera = Camera(eye, (0, 0, 0), (0, 1, 0.1), (120, 90), fov=22)
    scene = make_floor(texels)
    truth = umbra.render(scene, camera, DARK, samples=16, style="plain").astype(int)
    with SceneRenderer(scene, device=device) as renderer:
        found = renderer.render(camera, [], samples=4)
    apart = np.abs(found - truth).max(-1)
    assert truth.std() > 20
    assert apart.mean() < most
