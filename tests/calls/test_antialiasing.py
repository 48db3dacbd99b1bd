"""Smooth edges: what several samples a pixel show, against pictures of many more pixels."""

import numpy as np
import pytest
from support.shapes import box, city

import umbra
from umbra.scene import Material, Mesh, Part, make_image, make_scene
from umbra.scene.camera import find_offsets
from umbra.scene.material import find_linear

SIZE = (120, 90)
GRID = 4  # a side: 16 samples on a grid
VIEWS = {
    "perspective": umbra.Camera((-30, -40, 45), (25, 25, 0), size=SIZE),
    "parallel": umbra.Camera((-30, -40, 45), (25, 25, 0), size=SIZE, height=60.0),
}
SUN = umbra.directional_light((0.3, -0.6, 0.8))
LAMP = umbra.point_light((20, 22, 30), (1, 0.8, 0.6))


def encode(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def supersample(scene, camera, lights, **options):
    """Average a picture of 16 times the pixels in linear light, as shown, 0 to 1."""
    size = tuple(GRID * n for n in camera.size)
    large = umbra.make_camera(
        scene, eye=camera.eye, target=camera.target, size=size,
        **({"fov": camera.fov} if camera.height is None else {"height": camera.height}),
    )  # fmt: skip
    picture = umbra.render(scene, large, lights, samples=1, arrays=True, **options)
    rows, cols = camera.size[1], camera.size[0]
    linear = find_linear(picture.image / 255.0).reshape(rows, GRID, cols, GRID, 3).mean((1, 3))
    return encode(linear), picture


def count_kinds(picture):
    """Count, in each pixel of the smaller picture, what its 16 samples tell apart."""
    normal = np.nan_to_num(np.round(picture.normal, 6))
    distance = np.nan_to_num(np.round((normal * np.nan_to_num(picture.position)).sum(-1), 4))
    rows = np.concatenate([normal, distance[..., None], picture.lit.transpose(1, 2, 0)], -1)
    _, kind = np.unique(rows.reshape(-1, rows.shape[-1]), axis=0, return_inverse=True)
    kind = kind.reshape(picture.normal.shape[:2])
    blocks = kind.reshape(kind.shape[0] // GRID, GRID, -1, GRID).swapaxes(1, 2)
    return (np.diff(np.sort(blocks.reshape(*blocks.shape[:2], -1)), axis=-1) > 0).sum(-1) + 1


@pytest.fixture(scope="module")
def town():
    return make_scene(*city(4, seed=5))


def test_samples_lie_in_rows_and_columns_of_their_own():
    assert find_offsets(1).tolist() == [[0, 0]]
    for count in (2, 3, 8, 16, 64):
        offsets = find_offsets(count)
        middles = (np.arange(count) + 0.5) / count - 0.5
        np.testing.assert_allclose(np.sort(offsets, axis=0), np.stack([middles, middles], 1))


@pytest.mark.parametrize("view", VIEWS)
def test_a_pixel_is_the_mean_of_what_it_holds(town, view):
    camera, lights = VIEWS[view], [SUN, LAMP]
    truth, large = supersample(town, camera, lights, ground=0.0)
    kinds = count_kinds(large)
    errors = [
        np.abs(
            umbra.render(town, camera, lights, ground=0.0, samples=samples, style="plain") / 255
            - truth
        ).max(-1)
        for samples in (1, 4, 8, 16)
    ]
    jagged, *smooth = (error.mean() for error in errors)
    assert jagged > 2 * max(smooth)
    assert max(smooth) < 0.003
    few = kinds <= 3  # more edges than two may meet between samples
    assert errors[0][few].max() > 0.3
    assert [error[few].max() < 0.15 for error in errors[1:]] == [True, True, True]


def test_what_is_thinner_than_a_pixel_is_seen_by_its_share():
    # A rod a quarter of a pixel wide, between the centres of pixels: none of them sees it.
    rod = Part("rod", "", Mesh(*box((0.1, -100, 0), (0.35, 100, 1))), material=Material((0, 0, 0)))
    camera = umbra.Camera((0, 0, 20), (0, 0, 0), (0, 1, 0), (8, 8), height=8)
    scene, light = make_scene([rod]), umbra.directional_light((0, 0, 1))
    centres = umbra.render(scene, camera, light, ground=-5.0, samples=1, style="plain")
    assert (centres == centres[0, 0]).all()
    image = umbra.render(scene, camera, light, ground=-5.0, samples=16, style="plain")
    image = find_linear(image / 255.0)
    share = 1 - image[..., 0] / image[0, 0, 0]
    np.testing.assert_allclose(share[:, 4], 0.25, atol=0.01)
    np.testing.assert_allclose(np.delete(share, 4, 1), 0, atol=0.01)


def test_texels_finer_than_a_pixel_are_averaged():
    board = 255 * (np.indices((64, 64)).sum(0) % 2)[..., None].repeat(3, 2)
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    mesh = Mesh(corners, [(0, 1, 2), (0, 2, 3)], uv=corners[:, :2] / 2 + 0.5)
    part = Part("board", "", mesh, material=Material((1, 1, 1), make_image(board.astype(np.uint8))))
    camera = umbra.Camera((0, 0, 20), (0, 0, 0), (0, 1, 0), (16, 16), height=2)
    light = umbra.directional_light((0, 0, 1))
    levels = {
        samples: find_linear(
            umbra.render(make_scene([part]), camera, light, samples=samples, style="plain") / 255.0
        )
        for samples in (1, 16)
    }
    assert np.ptp(levels[16]) < 0.2 * levels[16].mean()


@pytest.mark.parametrize("soft", [None, "wedges"])
def test_soft_shadows_keep_their_slopes_and_lose_their_jags(town, soft):
    camera = VIEWS["perspective"]
    more = {} if soft is None else {"soft": soft, "light_size": 1.0}
    truth, _ = supersample(town, camera, LAMP, ground=0.0, **more)
    jagged, smooth = (
        np.abs(
            umbra.render(town, camera, LAMP, ground=0.0, samples=n, style="plain", **more) / 255
            - truth
        )
        for n in (1, 8)
    )
    assert smooth.mean() < 0.6 * jagged.mean()
    assert smooth.max() < 0.15 < jagged.max()


def test_arrays_are_those_of_the_centres(town):
    camera = VIEWS["perspective"]
    one, many = (
        umbra.render(town, camera, [SUN, LAMP], ground=0.0, samples=n, arrays=True) for n in (1, 8)
    )
    for name, array in one.arrays().items():
        np.testing.assert_array_equal(array, many.arrays()[name])
    assert (one.image != many.image).any()


@pytest.mark.parametrize(("samples", "words"), [(0, "at least 1"), (65, "at most 64 samples")])
def test_samples_are_a_few(town, samples, words):
    with pytest.raises(umbra.InputError, match=words):
        umbra.render(town, samples=samples)


@pytest.mark.parametrize("offset", [(0.6, 0), (0, -0.6), (0,), (np.nan, 0)])
def test_a_pixel_looks_not_beyond_its_rim(offset):
    with pytest.raises(umbra.InputError, match="at most half a pixel off"):
        umbra.Camera((0, 0, 9), (0, 1, 0), offset=offset)
