"""Metallic-roughness shading and normal maps on OpenGL: one rule, as on the CPU."""

from dataclasses import replace

import numpy as np
import pytest
from support.glow import CAMERA as ABOVE
from support.glow import SUN as HIGH
from support.glow import TEXELS, make_floor
from support.spheres import make_sphere

import umbra
from umbra.gl.scene_renderer import SceneRenderer
from umbra.readers.gltf_meshes import find_tangents
from umbra.scene import Material, Mesh, Part, make_image, make_scene

SUN = umbra.directional_light((0.4, -0.8, 0.7))
LOW = replace(umbra.directional_light((0.4, -0.9, 0.1)), bend=0.35)
LAMP = umbra.point_light((-4, -5, 6), (1.0, 0.9, 0.8))
CAMERA = umbra.Camera((0, -16, 5), (0, 0, 1.5), size=(240, 140), fov=26)


def make_balls():
    """Balls from smooth to rough, metals behind, and a wall with a relief of tiles."""
    parts = []
    for row, metallic in enumerate((0.0, 1.0)):
        for col, roughness in enumerate((0.15, 0.4, 0.7, 1.0)):
            ball = make_sphere(3, 0.8, (2 * col - 3, 2 * row - 2, 0.8 + 1.5 * row))
            material = Material((0.9, 0.5, 0.2), roughness=roughness, metallic=metallic)
            parts.append(Part(f"{row} {col}", "", ball, material=material))
    x = np.linspace(-1, 1, 32)
    tilt = 0.6 * np.sin(4 * np.pi * x)
    normals = np.stack(
        [*np.broadcast_arrays(tilt[None], 0.5 * tilt[:, None]), np.ones((32, 32))], -1
    )
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    bumps = make_image(np.round(127.5 * (normals + 1)).astype(np.uint8), is_data=True)
    gloss = np.zeros((2, 2, 3), np.uint8)
    gloss[..., 1], gloss[..., 2] = (80, 255), ((255, 255), (0, 0))
    corners = np.array([(-5, 3, 0), (5, 3, 0), (5, 3, 5), (-5, 3, 5)], float)
    uv = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)
    wall = Material(
        (0.7, 0.7, 0.75), roughness=0.6, metallic=1.0, normal_image=bumps,
        gloss_image=make_image(gloss, is_data=True),
    )  # fmt: skip
    mesh = Mesh(corners, [(0, 1, 2), (0, 2, 3)], uv=uv)
    return make_scene([*parts, Part("wall", "", mesh, material=wall)])


@pytest.mark.parametrize(
    "lights",
    [[], [SUN], [LAMP], [SUN, LAMP], [LOW], [LOW, replace(SUN, bend=0.6), LAMP]],
    ids=["none", "sun", "lamp", "both", "low", "many"],
)
def test_both_devices_shade_by_one_rule(device, lights):
    scene = make_balls()
    dark = umbra.point_light((0, 0, 50), (0, 0, 0))
    picture = umbra.render(scene, CAMERA, lights or dark, ground=0.0, samples=1, arrays=True)
    truth, is_wall = picture.image.astype(int), np.abs(picture.position[..., 1] - 3) < 1e-6
    with SceneRenderer(scene, 0.0, device=device) as renderer:
        image = renderer.render(CAMERA, lights)
        smooth = renderer.render(CAMERA, lights, samples=4)
    difference = np.abs(image - truth).max(-1)
    assert (difference[~is_wall] > 3).sum() < 12
    # Textures are filtered with 8 bits between texels, and highlights of a relief are steep.
    assert is_wall.sum() > 5000
    assert np.percentile(difference[is_wall], 99) < 14
    assert np.abs(smooth - truth).mean() < 2.0


def make_relief(transform, *, turned):
    """Make a ball under a relief, open at its poles."""
    u, v = np.meshgrid(np.linspace(0, 1, 25), np.linspace(0.05, 0.95, 25))
    turn, fall = 2 * np.pi * u, np.pi * v
    normals = np.stack([np.sin(fall) * np.cos(turn), np.sin(fall) * np.sin(turn), np.cos(fall)], -1)
    numbers = np.arange(625).reshape(25, 25)
    a, b, c, d = (n.ravel() for n in (numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:],
                                      numbers[:-1, 1:]))  # fmt: skip
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    uv = np.stack([np.abs(u - 0.5) + 0.1 * v, v], -1).reshape(-1, 2).astype(np.float32)  # mirrored
    points = normals.reshape(-1, 3)
    tangents = find_tangents(points, faces, points.astype(np.float32), uv)
    if turned:
        tangents[:, :3] = np.cross(points, tangents[:, :3])
    x = np.linspace(0, 8 * np.pi, 64)
    one = np.ones((64, 64))
    tilt = np.stack([0.5 * np.sin(x) * one, 0.4 * np.cos(x)[:, None] * one, one], -1)
    tilt /= np.linalg.norm(tilt, axis=-1, keepdims=True)
    bumps = make_image(np.round(127.5 * (tilt + 1)).astype(np.uint8), is_data=True)
    material = Material((0.7, 0.6, 0.5), normal_image=bumps)
    mesh = Mesh(points, faces, points.astype(np.float32), uv, tangents=tangents)
    return make_scene([Part("ball", "", mesh, transform, material)])


@pytest.mark.parametrize("eye", [(-3, -4, 2), (0.1, 0.1, 6)], ids=["outside", "through a hole"])
@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1.3, 0.8)], ids=["as made", "mirrored"])
def test_reliefs_follow_tangents_on_both_devices(device, eye, scale):
    camera = umbra.Camera(eye, (0, 0, 0), size=(160, 120), fov=36)
    pictures = []
    for turned in (False, True):
        scene = make_relief(np.diag([*scale, 1.0]), turned=turned)
        truth = umbra.render(scene, camera, SUN, samples=1, style="plain").astype(int)
        with SceneRenderer(scene, device=device) as renderer:
            image = renderer.render(camera, [SUN])
        assert np.percentile(np.abs(image - truth).max(-1), 98) < 8
        pictures.append(image.astype(int))
    assert (np.abs(pictures[0] - pictures[1]).max(-1) > 8).mean() > 0.1


def test_what_glows_beyond_white_keeps_its_hue(device):
    corners = np.array([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], float)
    material = Material((0, 0, 0), emission=(4.0, 2.0, 0.5))
    floor = Part("floor", "", Mesh(corners, [(0, 1, 2), (0, 2, 3)]), material=material)
    camera = umbra.Camera((0, 0, 5), (0, 0, 0), (0, 1, 0), (6, 6), height=1.0)
    scene = make_scene([floor])
    truth = umbra.render(scene, camera, SUN, samples=1, style="plain")
    with SceneRenderer(scene, device=device) as renderer:
        for lights in ([SUN], [SUN, LAMP]):
            image = renderer.render(camera, lights).astype(int)
            assert np.abs(image - truth).max() <= 1
            assert image[0, 0, 0] > image[0, 0, 1] > image[0, 0, 2]


@pytest.mark.parametrize("roughness", [None, 0.4], ids=["matte", "glossy"])
@pytest.mark.parametrize("lights", [[], [HIGH], [HIGH, LAMP]], ids=["none", "one", "two"])
def test_glow_and_occlusion_are_those_of_the_cpu(device, roughness, lights):
    scene = make_floor(roughness)
    dark = umbra.point_light((0, 0, 50), (0, 0, 0))
    truth = umbra.render(scene, ABOVE, lights or dark, samples=1, style="plain").astype(int)
    with SceneRenderer(scene, device=device) as renderer:
        image = renderer.render(ABOVE, lights)
    # Textures are filtered with 8 bits between texels, sums of lights are kept in float16.
    assert np.abs(image - truth)[TEXELS, TEXELS].max() <= 2
    assert truth.std() > 20
