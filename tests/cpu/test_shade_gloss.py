"""Metallic-roughness shading on the CPU: values solved by hand, and laws."""

import numpy as np
import pytest
from support.glow import CAMERA, SUN, TEXELS, find_truth, make_floor

import umbra
from umbra.cpu.appearance import find_appearance
from umbra.cpu.frame import FrameCounter
from umbra.cpu.shade import compress, find_colors, find_sky_color, reflect_light, reflect_sky
from umbra.scene import Material, Mesh, Part, make_image, make_scene
from umbra.scene.exposure import BOUNCE, HORIZON, SKY, find_ambient, find_exposure

UP = np.array([[0.0, 0.0, 1.0]])
RED = np.array([[0.8, 0.2, 0.1]])


def one(*values):
    return [np.array([value], float) for value in values]


def lean(degrees):
    angle = np.radians(degrees)
    return np.array([[np.sin(angle), 0.0, np.cos(angle)]])


def test_head_on_a_rough_dielectric_scatters_96_percent():
    # h = n, so D = 1 / pi, V = 1/4, F = 0.04: what is mirrored is 0.04 / 4.
    found = reflect_light(RED, *one(0, 1), UP, UP, UP)
    np.testing.assert_allclose(found, 0.96 * RED + 0.01)


def test_head_on_a_rough_metal_mirrors_its_colour():
    found = reflect_light(RED, *one(1, 1), UP, UP, UP)
    np.testing.assert_allclose(found, RED / 4)


def test_a_smooth_metal_has_a_bright_spot():
    # alpha = 1/4: pi D = 16 where h = n; V is 1/4 there.
    found = reflect_light(RED, *one(1, 0.5), UP, UP, UP)
    np.testing.assert_allclose(found, RED * 16 / 4)


def test_light_and_eye_at_60_degrees_on_both_sides():
    # n.l = n.v = v.h = 1/2, n.h = 1, roughness 1: V = 0.5 / (1/2 + 1/2), F = 0.04 + 0.96 / 32.
    found = reflect_light(RED, *one(0, 1), UP, lean(60), lean(-60))
    fresnel = 0.04 + 0.96 / 32
    np.testing.assert_allclose(found, 0.5 * ((1 - fresnel) * RED + fresnel * 0.5))


def test_nothing_comes_from_behind():
    assert not reflect_light(RED, *one(0.5, 0.3), UP, lean(100), UP).any()


def test_light_and_eye_may_change_places():
    # Helmholtz: what is reflected is the same but for the cosine.
    there = reflect_light(RED, *one(1, 0.4), UP, lean(20), lean(-70)) / np.cos(np.radians(20))
    back = reflect_light(RED, *one(1, 0.4), UP, lean(-70), lean(20)) / np.cos(np.radians(70))
    np.testing.assert_allclose(there, back)


@pytest.mark.parametrize("metallic", [0.0, 1.0])
@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
def test_no_more_comes_out_than_went_in(metallic, roughness):
    # A white surface under light from everywhere: sum over directions spread evenly by the cosine.
    rng = np.random.default_rng(3)
    count = 200_000
    square, turn = rng.random(count), 2 * np.pi * rng.random(count)
    toward = np.stack(
        [np.sqrt(square) * np.cos(turn), np.sqrt(square) * np.sin(turn), np.sqrt(1 - square)], 1
    )
    for degrees in (0, 45, 75):
        eye = np.repeat(lean(degrees), count, 0)
        found = reflect_light(
            np.ones((count, 3)), np.full(count, metallic), np.full(count, roughness),
            np.repeat(UP, count, 0), toward, eye,
        ) / toward[:, 2:]  # fmt: skip
        # glTF adds matte and mirrored light as if apart: a dielectric gains 20 % at 75 degrees.
        assert 0.25 < found.mean() < (1.03 if metallic else 1.25)
        if metallic == 1 and roughness == 1 and degrees == 0:
            assert abs(found.mean() - (1 - np.log(2))) < 2e-3  # the integral of m / (1 + m)


def test_a_mirror_shows_the_sky_and_the_ground():
    smooth = one(1, 0)
    zenith = reflect_sky(np.ones((1, 3)), *smooth, UP, UP, np.zeros((1, 3)))
    np.testing.assert_allclose(zenith, [SKY], atol=0.01)
    np.testing.assert_allclose(
        find_sky_color(np.array([1e-9 + 0.05]), np.zeros(1)), [HORIZON], atol=0.03
    )
    np.testing.assert_allclose(find_sky_color(np.array([-1.0]), np.zeros(1)), [BOUNCE])
    # A rough one sees both.
    half = find_sky_color(np.zeros(1), np.ones(1))
    np.testing.assert_allclose(half, [(np.array(HORIZON) + BOUNCE) / 2])


def test_highlights_are_compressed_and_nothing_else():
    colours = np.array([[0.8, 0.3, 0.1], [0.1, 0.2, 0.3], [1.0, 0.5, 0.0], [40.0, 20.0, 10.0]])
    found = compress(colours)
    np.testing.assert_array_equal(found[:2], colours[:2])
    # 1 - 0.04 / (1 + 0.2 - 0.8) = 0.9; paled by 1 - 1 / (0.15 * 0.1 + 1).
    pale = 1 - 1 / 1.015
    np.testing.assert_allclose(found[2], 0.9 * np.array([1, 0.5, 0]) * (1 - pale) + 0.9 * pale)
    assert found[3].max() < 1
    assert found[3].min() > 0.8
    rising = compress(np.linspace(0, 9, 400)[:, None].repeat(3, 1))
    assert (np.diff(rising[:, 0]) > 0).all()


def bumpy(normal, uv, eye=(0, 0, 5), transform=None, shape=None, **more):
    """Look at a square, from above, whose image holds one normal."""
    texel = np.round(127.5 * (np.array(normal) + 1)).astype(np.uint8)
    image = make_image(np.tile(texel, (2, 2, 1)), is_data=True)
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    material = Material((1, 1, 1), normal_image=image, **more)
    mesh = Mesh(corners, [(0, 1, 2), (0, 2, 3)], uv=np.array(uv, float), **(shape or {}))
    part = Part("floor", "", mesh, material=material, transform=transform)
    scene = make_scene([part])
    camera = umbra.Camera(eye, (0, 0, 0), (0, 1, 0), (4, 4), height=1.0)
    view, frame = FrameCounter(scene).see(camera)
    return find_appearance(scene, frame, view).normal[0]


UPRIGHT = [(0, 1), (1, 1), (1, 0), (0, 0)]  # u to the right, v down, as pictures lie


@pytest.mark.parametrize(
    ("uv", "expected"),
    [
        (UPRIGHT, (0.6, 0.0, 0.8)),
        ([(1 - u, v) for u, v in UPRIGHT], (-0.6, 0.0, 0.8)),  # mirrored
        ([(v, u) for u, v in UPRIGHT], (0.0, -0.6, 0.8)),
    ],
)
def test_red_leans_along_u(uv, expected):
    np.testing.assert_allclose(bumpy((0.6, 0, 0.8), uv), expected, atol=0.01)


MESH_UP = np.tile([0.0, 0, 1], (4, 1))
MIRROR = np.diag([-1.0, 1, 1, 1])


@pytest.mark.parametrize(
    ("tangent", "eye", "transform", "expected"),
    [
        ((0, 1, 0, 1), (0, 0, 5), None, (-0.48, 0.6, 0.64)),  # red along, green to its left
        ((0, 1, 0, -1), (0, 0, 5), None, (0.48, 0.6, 0.64)),
        ((0, 1, 0, 1), (0, 0, 5), MIRROR, (0.48, 0.6, 0.64)),
        ((0, 1, 0, 1), (0, 0, -5), None, (0.48, -0.6, -0.64)),  # the other side of a bulge
        ((0, 1, 0, 1), (0, 0, -5), MIRROR, (-0.48, -0.6, -0.64)),
        ((0, 0, 0, 0), (0, 0, 5), None, (0.6, 0.48, 0.64)),  # none: those of the faces
        ((0, 0, 0, 0), (0, 0, -5), None, (-0.6, -0.48, -0.64)),
    ],
)
def test_normal_maps_follow_tangents(tangent, eye, transform, expected):
    shape = {"normals": MESH_UP, "tangents": np.tile(np.float32(tangent), (4, 1))}
    found = bumpy((0.6, 0.48, 0.64), UPRIGHT, eye, transform, shape)
    np.testing.assert_allclose(found, expected, atol=0.01)


def test_green_leans_up_in_the_picture():
    np.testing.assert_allclose(bumpy((0, 0.6, 0.8), UPRIGHT), (0, 0.6, 0.8), atol=0.01)
    mirrored = [(1 - u, v) for u, v in UPRIGHT]
    np.testing.assert_allclose(bumpy((0, 0.6, 0.8), mirrored), (0, 0.6, 0.8), atol=0.01)


def test_the_scale_of_normals_flattens_them():
    flat = bumpy((0.6, 0, 0.8), UPRIGHT, normal_scale=0.5)
    np.testing.assert_allclose(flat, np.array([0.3, 0, 0.8]) / np.hypot(0.3, 0.8), atol=0.01)


@pytest.mark.parametrize("name", ["metallic", "roughness"])
def test_shares_are_shares(name):
    with pytest.raises(umbra.InputError, match=f"{name} lies between 0 and 1; got 1.5"):
        Material(**{name: 1.5})


def test_the_even_light_is_the_skys_and_the_grounds():
    # By hand: (0.86 + 2 * 0.42) / 3 = 0.5667, 0.7033, 0.8633; their luminance is 0.6859.
    above, level, below = find_ambient(np.array([1.0, 0.0, -1.0]))
    np.testing.assert_allclose(above, 0.2 / 0.6859 * np.array([0.5667, 0.7033, 0.8633]), rtol=2e-4)
    np.testing.assert_allclose(level, (above + below) / 2)
    luminance = np.array([above, below]) @ (0.2126, 0.7152, 0.0722)
    np.testing.assert_allclose(luminance, [0.2, 0.1])
    # Light from a sky that runs so, summed over the upper half, is that of its closed form.
    rise = (np.arange(2000) + 0.5) / 2000
    dome = (1 - rise[:, None]) * HORIZON + rise[:, None] * SKY
    summed = (2 * rise[:, None] * dome).mean(0)
    np.testing.assert_allclose(above / above.sum(), summed / summed.sum(), rtol=1e-5)


def test_what_glows_and_lies_in_its_own_shade_texel_by_texel():
    scene = make_floor()
    view, frame = FrameCounter(scene).see(CAMERA)
    lit = [np.ones(frame.part.shape, bool)]
    even = find_ambient(np.ones(1))[0]
    cosine = 0.6 / np.linalg.norm((0.3, 0.2, 0.6))
    sun = find_exposure(1) * cosine * np.array(SUN.color)
    found = find_colors(scene, frame, [SUN], lit, view, camera=CAMERA)
    # Occlusion is of the even light alone: the sun's shadows are counted.
    np.testing.assert_allclose(found[TEXELS, TEXELS], compress(find_truth(even, sun)), atol=1e-6)


def test_occlusion_holds_for_what_mirrors_the_sky():
    scene = make_floor(0.3)
    view, frame = FrameCounter(scene).see(CAMERA)
    even = find_ambient(np.ones(1))
    up = np.array([[0.0, 0.0, 1.0]])
    color = np.array([[0.5, 0.4, 0.3]])
    sky = reflect_sky(color, np.zeros(1), np.full(1, 0.3), up, up, even)[0] / color[0]
    found = find_colors(scene, frame, [], [], view, camera=CAMERA)
    np.testing.assert_allclose(
        found[TEXELS, TEXELS], compress(find_truth(sky, (0, 0, 0))), atol=1e-6
    )
