"""Textures, vertex colours and smooth normals on the CPU, at places known by hand."""

from operator import attrgetter

import numpy as np
import pytest
from support.shapes import sheet

from umbra.cpu.appearance import find_appearance
from umbra.cpu.frame import FrameCounter
from umbra.cpu.shade import shade
from umbra.errors import InputError
from umbra.scene import (
    Camera,
    Image,
    Material,
    Mesh,
    Part,
    directional_light,
    make_image,
    make_scene,
)

CORNERS = [(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)]
VERTICES, FACES = sheet(CORNERS)
UV = (np.array(CORNERS)[:, :2] * (1, -1) + 10) / 20  # (0, 0) in the north-west
CAMERA = Camera((0, 0, 9), (0, 0, 0), up=(0, 1, 0), size=(20, 20), height=20.0)
PIXELS = np.zeros((20, 20, 3), np.uint8)
PIXELS[..., 0], PIXELS[..., 1] = np.mgrid[:20, :20] * 12


def find_surfaces(*seen):
    return attrgetter("albedo", "normal")(find_appearance(*seen))


def see(*parts, camera=CAMERA, ground=None):
    scene = make_scene(list(parts))
    view, frame = FrameCounter(scene, ground=ground).see(camera)
    return scene, view, frame


def move(x=0.0, y=0.0, scale=1.0):
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:2, 3] = x, y
    return matrix


def test_every_texel_falls_on_its_pixel():
    material = Material((1, 1, 1), make_image(PIXELS), is_unlit=True)
    scene, view, frame = see(Part("floor", "", Mesh(VERTICES, FACES, uv=UV), None, material))
    light = directional_light((0, 0, 1))
    lit = [np.zeros((20, 20), bool)]
    np.testing.assert_array_equal(shade(scene, frame, [light], lit, view), PIXELS)
    assert (shade(scene, frame, [light], lit) == 255).all()  # without the view


def test_each_part_has_its_own_picture_wherever_it_stands():
    # Two floors of half the size beside each other, the second far down the list and mirrored.
    mesh = Mesh(VERTICES, FACES, uv=UV)
    bare = Part("bare", "", Mesh(VERTICES - (0, 0, 5), FACES), None, Material((0.25, 0.5, 1)))
    first = Part("a", "", mesh, move(-5, 5, 0.5), Material((1, 1, 1), make_image(PIXELS)))
    mirror = move(5, 5, 0.5) @ np.diag([-1.0, 1, 1, 1])
    second = Part("b", "", mesh, mirror, Material((1, 0.5, 0), make_image(PIXELS)))
    scene, view, frame = see(bare, first, second)
    albedo, normal = find_surfaces(scene, frame, view)
    albedo = albedo.reshape(20, 20, 3)
    np.testing.assert_allclose(albedo[10:], np.broadcast_to([0.25, 0.5, 1], (10, 20, 3)))
    left, right = albedo[:10, :10], albedo[:10, 10:]
    # Mirrored in x: the green of the columns runs backwards.
    np.testing.assert_allclose(right[..., 0], left[..., 0], atol=1e-12)
    np.testing.assert_allclose(right[..., 1], 0.5 * left[:, ::-1, 1], atol=1e-12)
    assert np.ptp(left[0, :, 1]) > 0.5
    np.testing.assert_allclose(normal, np.tile([0, 0, 1], (400, 1)), atol=1e-12)


def test_vertex_colours_run_from_corner_to_corner():
    colors = np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    part = Part("floor", "", Mesh(VERTICES, FACES, colors=colors), None, Material((1, 0.5, 1)))
    scene, view, frame = see(part, ground=-3.0)
    albedo, _ = find_surfaces(scene, frame, view)
    x, y = ((frame.position[..., k].ravel() + 10) / 20 for k in (0, 1))
    np.testing.assert_allclose(albedo, np.stack([x, 0.5 * y, np.ones(400)], 1), atol=1e-6)


def test_smooth_normals_turn_with_the_part_to_the_side_that_is_seen():
    # Normals lean outward along x at both rims; the part is squeezed to half in x and lies
    # upside down, so that its back is seen.
    lean = np.array([(np.sign(x), 0, 1) for x, _, _ in CORNERS]) / np.sqrt(2)
    squeeze = np.diag([0.5, -1.0, -1, 1])
    scene, view, frame = see(Part("floor", "", Mesh(VERTICES, FACES, normals=lean), squeeze))
    seen = frame.part == 0
    _, normal = find_surfaces(scene, frame, view)
    slope = frame.position[seen][:, 0] / 5  # from -1 to 1 across the squeezed floor
    # The leaning half, weighed by the inverse of the squeeze, flips to the upper side.
    expected = np.stack([-2 * slope, 0 * slope, 1 + 0 * slope], 1)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(normal, expected, atol=1e-6)
    _, flat = find_surfaces(scene, frame)
    np.testing.assert_allclose(flat, np.tile([0, 0, 1], (seen.sum(), 1)), atol=1e-12)


def test_far_from_zero_the_picture_is_the_same():
    material = Material((1, 1, 1), make_image(PIXELS))
    away = np.array([2_600_000, 1_200_000, 400])
    camera = Camera(away + (0, 0, 9), away, up=(0, 1, 0), size=(20, 20), height=20.0)
    near = see(Part("floor", "", Mesh(VERTICES, FACES, uv=UV), None, material))
    far = see(Part("floor", "", Mesh(VERTICES + away, FACES, uv=UV), None, material), camera=camera)
    one, other = (find_surfaces(scene, frame, view)[0] for scene, view, frame in (near, far))
    np.testing.assert_allclose(one, other, atol=1e-6)


def test_a_picture_that_cannot_be_decoded_is_named():
    def fail():
        msg = "texture 'brick' cannot be read"
        raise InputError(msg)

    part = Part(
        "floor", "", Mesh(VERTICES, FACES, uv=UV), None, Material(image=Image("brick", fail))
    )
    scene, view, frame = see(part)
    with pytest.raises(InputError, match="'brick' cannot be read"):
        find_surfaces(scene, frame, view)
