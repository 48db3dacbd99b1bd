"""Materials and images: decoded late, refused early."""

import numpy as np
import pytest
from support.shapes import box

from umbra.errors import InputError
from umbra.scene import Image, Material, Mesh, Part, make_image, make_scene
from umbra.scene.material import sample

VERTICES, FACES = box((0, 0, 0), (1, 2, 3))
# Black, white / red, half transparent green.
PIXELS = np.array(
    [[[0, 0, 0, 255], [255, 255, 255, 255]], [[255, 0, 0, 255], [0, 255, 0, 51]]], np.uint8
)


def test_an_image_is_decoded_once_and_only_when_asked():
    calls = []

    def load():
        calls.append(1)
        return PIXELS

    material = Material((0.5, 0.25, 1.0), Image("brick", load))
    scene = make_scene([Part("wall", "", Mesh(VERTICES, FACES), None, material)])
    scene.triangles()
    scene.bounds()
    assert not calls
    assert scene.parts[0].color == (0.5, 0.25, 1.0)
    np.testing.assert_array_equal(scene.parts[0].material.texture, PIXELS)
    _ = material.texture
    assert len(calls) == 1
    assert Material().texture is None


def test_opaque_pixels_get_an_alpha():
    image = make_image(PIXELS[..., :3])
    np.testing.assert_array_equal(image.pixels[..., :3], PIXELS[..., :3])
    assert (image.pixels[..., 3] == 255).all()


def test_texels_are_mixed_in_linear_light():
    image = make_image(PIXELS)
    # Texel centres of a 2 x 2 picture stand at quarters; row 0 is v = 0.
    corners = sample(image, [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]])
    np.testing.assert_allclose(
        corners, [[0, 0, 0, 1], [1, 1, 1, 1], [1, 0, 0, 1], [0, 1, 0, 0.2]], atol=1e-15
    )
    np.testing.assert_allclose(sample(image, [0.5, 0.25]), [0.5, 0.5, 0.5, 1])
    np.testing.assert_allclose(sample(image, [0.5, 0.5]), [0.5, 0.5, 0.25, 0.8])
    # sRGB 188 is half the light of 255.
    half = make_image(np.full((1, 1, 3), 188, np.uint8))
    np.testing.assert_allclose(sample(half, [0.3, 0.9])[:3], 0.503, atol=5e-4)


@pytest.mark.parametrize(
    ("wrap", "left", "right"),
    [("repeat", 10, 10), ("mirror", 0, 20), ("clamp", 0, 20)],
)
def test_pictures_go_on_beyond_their_edges(wrap, left, right):
    # Three texels of 0, 10 and 20 in alpha; at an edge the neighbour is asked.
    pixels = np.zeros((1, 3, 4), np.uint8)
    pixels[0, :, 3] = 0, 10, 20
    image = make_image(pixels, wrap=(wrap, "repeat"))
    edges = 255 * sample(image, [[0.0, 0.5], [1.0, 0.5]])[:, 3]
    np.testing.assert_allclose(edges, [left, right], atol=1e-12)
    # One and a half texels further: on texel 1 again, on texel 1 backwards, at the edge.
    beyond = 255 * sample(image, [1.0 + 1.5 / 3, 0.5])[3]
    assert beyond == pytest.approx({"repeat": 10, "mirror": 10, "clamp": 20}[wrap])
    assert 255 * sample(image, [-0.5 / 3, 0.5])[3] == pytest.approx(
        {"repeat": 20, "mirror": 0, "clamp": 0}[wrap]
    )


def test_what_lets_light_through_says_so():
    assert not Material().is_transparent
    assert Material(opacity=0.5).is_transparent
    assert not Material(alpha_mode="blend").transmits  # as exporters write what is opaque
    assert not Material(alpha_mode="mask").transmits
    assert Material(alpha_mode="mask", alpha_cutoff=1.1).has_holes  # nothing at all
    half, whole = (make_image(np.full((2, 2, 4), level, np.uint8)) for level in (127, 255))
    for image, transmits in ((half, True), (whole, False)):
        assert Material(image=image, alpha_mode="blend").is_transparent == transmits
        assert Material(image=image, alpha_mode="mask").has_holes == transmits
        assert not Material(image=image).transmits
    assert not Material(image=half, alpha_mode="mask").is_transparent


def test_a_cutoff_written_in_decimals_means_a_whole_level():
    image = make_image(np.full((1, 1, 4), 128, np.uint8))
    for cutoff, is_hole in ((128 / 255, False), (0.501961, False), (0.50197, True)):
        material = Material(image=image, alpha_mode="mask", alpha_cutoff=cutoff)
        assert material.has_holes == is_hole


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"color": (0.5, 1.5, 0)}, "color is three numbers between 0 and 1"),
        ({"color": (0.5, 0.5)}, "color is three numbers"),
        ({"emission": (0, 0, -1)}, "emission is three numbers of at least 0"),
        ({"emission": (0, 0, np.inf)}, "emission is three numbers"),
        ({"color": (0, 0, np.nan)}, "color is three numbers"),
        ({"opacity": 1.5}, "opacity lies between 0 and 1"),
        ({"alpha_mode": "BLEND"}, "alpha_mode is one of opaque, mask, blend"),
    ],
)
def test_materials_that_make_no_sense_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Material(**wrong)


def test_images_that_are_none_are_refused():
    for wrong in (PIXELS[0], PIXELS.astype(float), PIXELS[..., :2], PIXELS[:0]):
        with pytest.raises(InputError, match="texture 'brick' is"):
            make_image(wrong, "brick")
    with pytest.raises(InputError, match="wrap is two of repeat, mirror, clamp"):
        make_image(PIXELS, wrap=("repeat", "tile"))


def test_what_a_vertex_carries_has_a_row_for_each():
    uv = np.arange(16).reshape(8, 2)
    mesh = Mesh(VERTICES, FACES, normals=VERTICES, uv=uv, colors=VERTICES)
    assert mesh.normals.dtype == mesh.uv.dtype == mesh.colors.dtype == np.float32
    for name, shape in (("normals", (8, 2)), ("uv", (7, 2)), ("colors", (8, 4))):
        with pytest.raises(InputError, match=f"{name} of shape"):
            Mesh(VERTICES, FACES, **{name: np.zeros(shape)})
    moved = mesh.moved(VERTICES + 1)
    assert moved.uv is mesh.uv
    assert moved.normals is mesh.normals
    # A local origin moves places and nothing else.
    far = make_scene([Part("a", "", Mesh(VERTICES + [2.6e6, 0, 0], FACES, uv=uv))])
    np.testing.assert_array_equal(far.parts[0].mesh.uv, uv)
