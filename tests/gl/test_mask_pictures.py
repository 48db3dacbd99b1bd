"""Pictures by masks: passes and rectangles of the paper's Table 1, and masks of fewer pixels."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from support.shapes import box, city, merge, sheet, torus_knot

from umbra.errors import InputError
from umbra.gl.masks import MASKS, PRINTED
from umbra.gl.masks.mask_frames import MaskPicture
from umbra.scene import Camera, Material, Mesh, Part, directional_light, make_scene, point_light

FLOOR = sheet([(-60, -60, -0.01), (60, -60, -0.01), (60, 60, -0.01), (-60, 60, -0.01)])
CAMERA = Camera((-30, -40, 45), (2, 2, 0), size=(96, 72))
LAMP = point_light((20, 22, 50))
SUN = directional_light((0.5, 0.3, 0.6))
SCREEN_MAX = replace(MASKS["max"], name="screen, max", write="rgb")


@pytest.fixture(scope="module")
def town():
    return make_scene(
        [
            Part("town", "house", Mesh(*city(4)), material=Material((0.9, 0.7, 0.4))),
            Part("floor", "floor", Mesh(*FLOOR), material=Material((0.5, 0.6, 0.5))),
        ]
    )


def draw(device, scene, method, shadows="black", light=LAMP, camera=CAMERA, **options):
    look = {name: options.pop(name) for name in ("white", "remains") if name in options}
    with MaskPicture(scene, method, casters=[0], device=device, **options) as picture:
        picture.draw(camera, light, shadows, **look)
        return picture.read().astype(int), picture.tally


@pytest.mark.parametrize(
    ("method", "ambient", "attenuated"),
    [
        # Roettger et al. 2002, Table 1: passes / rectangles, in brackets by the maximum.
        (MASKS["alpha"], (2, 4), (1, 4)),
        (PRINTED, (2, 4), (1, 4)),
        (MASKS["max"], (2, 4), (1, 2)),
        (MASKS["screen"], (3, 3), (2, 3)),
        (SCREEN_MAX, (3, 3), (2, 1)),
    ],
    ids=["alpha", "alpha as printed", "alpha by maximum", "screen", "screen by maximum"],
)
def test_passes_and_rectangles_are_the_papers(device, town, method, ambient, attenuated):
    assert draw(device, town, method, "ambient")[1].table == ambient
    found, tally = draw(device, town, method, "attenuated")
    assert tally.table == attenuated
    assert tally.batches == (16 if method is PRINTED else 3)
    assert tally.draws == 2 * tally.batches
    assert np.ptp(found) > 100


@pytest.mark.parametrize("shadows", ["black", "ambient", "attenuated"])
@pytest.mark.parametrize("light", [LAMP, directional_light((0.5, 0.3, 0.6))], ids=["lamp", "sun"])
def test_pictures_are_the_stencils(device, town, shadows, light):
    right, _ = draw(device, town, "stencil", shadows, light)
    bare, _ = draw(device, town, "stencil", None, light)
    # Coverage: a good part of the picture is in shadow at all.
    assert (np.abs(right - bare).max(-1) > 20).mean() > 0.05
    for method in (*MASKS, PRINTED, SCREEN_MAX):
        found, _ = draw(device, town, method, shadows, light)
        # What is lit may be 254 of 255 (docs/papers.md, R4).
        assert (np.abs(found - right).max(-1) > 1).sum() <= 2, method


@pytest.mark.parametrize("remains", [0.0, 0.3, 0.8, 1.0])
@pytest.mark.parametrize("scale", [1, 2])
def test_shadows_keep_any_share_of_their_brightness(device, town, remains, scale):
    bare, _ = draw(device, town, "stencil", None, SUN)
    dark, _ = draw(device, town, "stencil", "attenuated", SUN, remains=0.0, scale=scale)
    assert (dark == 0).all(-1).mean() > 0.05
    right = dark + remains * (bare - dark)
    for method in ("stencil", *MASKS, PRINTED, SCREEN_MAX):
        found, tally = draw(device, town, method, "attenuated", SUN, remains=remains, scale=scale)
        # 8 bits of a mask err by 2 of 255.
        assert (np.abs(found - right).max(-1) > 3).mean() <= 0.002, method
        if scale == 1 and method in ("alpha", "max"):
            assert tally.table == (1, 5 if remains else 4)


SPREAD = [LAMP, directional_light((0.5, 0.3, 0.6)), point_light((-30, -5, 30), (0.9, 0.5, 0.2))]


@pytest.mark.parametrize("shadows", ["black", "ambient", "attenuated", None])
@pytest.mark.parametrize("scale", [1, 2])
def test_the_pictures_of_several_lights_add_up(device, town, shadows, scale):
    # Ambient light is there once, and what several light is clipped at white.
    options = {"scale": scale, "filter": "joint"}
    none, _ = draw(device, town, "stencil", "ambient", [])
    alone = [draw(device, town, "stencil", shadows, light, **options)[0] for light in SPREAD]
    ambient = {"black": 0, "ambient": 1, "attenuated": 0, None: 0}[shadows]
    expected = sum(alone) - (len(SPREAD) - 1) * ambient * none
    if shadows in {"attenuated", None}:
        # There each picture alone has all of the ambient light, half of it in shadow.
        half = [
            draw(device, town, "stencil", "black", each, white=True, **options)[0]
            for each in SPREAD
        ]
        kept = [1 if shadows is None else 0.5 + 0.5 * mask / 255 for mask in half]
        expected = sum(alone) - sum(2 / 3 * keep * none for keep in kept)
    seen = none.max(-1) < 255
    for method in ("stencil", "alpha", "screen", "max", "half"):
        found, tally = draw(device, town, method, shadows, SPREAD, **options)
        apart = np.abs(found - np.clip(expected, 0, 255)).max(-1)[seen]
        assert (apart > 4).sum() <= 6, method
        assert tally.rectangles.count("add") == 3
    again, _ = draw(device, town, "alpha", shadows, SPREAD[:1], **options)
    np.testing.assert_array_equal(
        again, draw(device, town, "alpha", shadows, SPREAD[0], **options)[0]
    )


def test_white_pictures_of_several_lights_are_the_mean_of_masks(device, town):
    masks = [draw(device, town, "stencil", light=light, white=True)[0] for light in SPREAD]
    found, _ = draw(device, town, "alpha", light=SPREAD, white=True)
    np.testing.assert_allclose(found, np.mean(masks, 0), atol=2)
    assert len(np.unique(found // 40)) > 3


def test_without_lights_there_is_ambient_light_or_none(device, town):
    ambient, _ = draw(device, town, "alpha", "ambient", [])
    assert ambient.max(initial=0) > 0
    for method in ("stencil", "screen"):
        np.testing.assert_array_equal(draw(device, town, method, "ambient", [])[0], ambient)
        assert draw(device, town, method, "black", [])[0].max() == 0


def test_parallel_rays_that_end_in_volumes(device):
    # Rooms within rooms around a lamp, each without half of its front wall: to the far end of the
    # rays the lamp is hidden by all of their back walls, and each room has more faces than a batch.
    rooms = []
    for size in 1 + 0.25 * np.arange(9):
        vertices, faces = box((-size, -size, 0.2), (size, size, 1.5 * size + 0.8))
        front = np.flatnonzero((vertices[faces][..., 1] < -0.99 * size).all(1))
        rooms.append((vertices, np.delete(faces, front[0], 0)))
    casters = Mesh(*merge(*rooms, torus_knot()))
    scene = make_scene([Part("casters", "c", casters), Part("floor", "f", Mesh(*FLOOR))])
    lamp = point_light((0.13, 0.31, 1.3))
    deepest = 0
    for eye in ((4, -30, 3), (-6, -30, 2.5), (-3, -30, -4)):
        camera = Camera(eye, (0.4, 0, 2), size=(96, 72), height=16.0)
        right, _ = draw(device, scene, "stencil", light=lamp, camera=camera, white=True)
        for method in (*MASKS, PRINTED, SCREEN_MAX):
            found, tally = draw(device, scene, method, light=lamp, camera=camera, white=True)
            assert (np.abs(found - right).max(-1) > 1).sum() <= 4, method
            deepest = max(deepest, tally.rectangles.count("end"))
        assert (right[..., 0] > 128).sum() > 50
    assert deepest > 3


def test_no_light_gets_between_the_volumes_of_polygons(device):
    # 1,200 polygons have a volume each; sides of neighbours lie in one plane.
    scene = make_scene([Part("knot", "k", Mesh(*torus_knot())), Part("floor", "f", Mesh(*FLOOR))])
    camera = Camera((20, -25, 24), (0, 0, 2), size=(400, 400))
    lamp = point_light((8, -3.3, 30))
    right, _ = draw(device, scene, "stencil", light=lamp, camera=camera, white=True)
    found, tally = draw(device, scene, "alpha", light=lamp, camera=camera, white=True)
    assert tally.batches > 100
    right, found = right[..., 0] > 128, found[..., 0] > 128
    beside = np.zeros(right.shape, bool)
    beside[1:-1, 1:-1] = sliding_window_view(right, (3, 3)).min((2, 3)) != sliding_window_view(
        right, (3, 3)
    ).max((2, 3))
    assert not (right != found)[1:-1, 1:-1][~beside[1:-1, 1:-1]].any()
    assert (right != found).sum() <= 8


@pytest.mark.parametrize("method", ["stencil", *MASKS])
@pytest.mark.parametrize("scale", [2, 4])
def test_fewer_pixels_are_best_laid_between_pixels_of_one_surface(device, town, method, scale):
    full, _ = draw(device, town, "stencil", white=True)
    error, wrong = {}, {}
    for kind in ("nearest", "bilinear", "joint"):
        found, tally = draw(device, town, method, white=True, scale=scale, filter=kind)
        apart = np.abs(found - full)[..., 0] / 255
        error[kind], wrong[kind] = apart.mean(), (apart > 0.5).mean()
        # The scene once more, small, and at last a rectangle that lays the mask over it.
        assert len(tally.passes) == 2
        assert tally.rectangles[-1] == "apply"
    assert 0 < error["joint"] < 0.85 * error["nearest"] < 0.85 * error["bilinear"]
    assert wrong["joint"] < 0.85 * wrong["bilinear"]
    assert wrong["bilinear"] <= wrong["nearest"]


def test_a_mask_of_fewer_pixels_says_by_hand_what_filters_do(device):
    # A table of 8 x 8 m, 4 m up, seen from straight above its shadow, one pixel a metre.
    table = sheet([(-4, -4, 4), (4, -4, 4), (4, 4, 4), (-4, 4, 4)])
    scene = make_scene([Part("table", "t", Mesh(*table)), Part("floor", "f", Mesh(*FLOOR))])
    camera = Camera((0, 0, 30), (0, 0, 0), up=(0, 1, 0), size=(32, 32), height=32.0)
    sun = directional_light((-2, 0, 1))  # the shadow is 8 m to the east
    for method in ("stencil", *MASKS):
        with MaskPicture(scene, method, casters=[0], device=device, scale=2) as picture:
            picture.draw(camera, sun, "black", white=True)
            row = picture.read()[16, :, 0] / 255
        # The shadow lies from x = 4 to 12: columns 20 to 27, and two pixels share one of the
        # mask, so that the last before its edge is lit by a quarter, the first beyond by 3/4.
        expected = np.ones(32)
        expected[20:28] = 0.0
        expected[[20, 27]], expected[[19, 28]] = 0.25, 0.75
        np.testing.assert_allclose(row, expected, atol=0.01)


def test_what_is_no_filter_is_refused(device, town):
    with pytest.raises(InputError, match=r"no filter 'sharp'.*nearest, bilinear, joint"):
        MaskPicture(town, "alpha", filter="sharp", device=device)
    with pytest.raises(InputError, match="scale 0"):
        MaskPicture(town, "alpha", scale=0, device=device)
