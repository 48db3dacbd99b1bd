"""Numbers that callers pass: read once, refused in a line, never wrapped, cut or overflowed."""

import warnings
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from support.shapes import box

import umbra
from umbra.scene.numbers import FARTHEST, OUTSIDE, read_array, read_number

TOWER = umbra.Mesh(*box((0, 0, 0), (4, 4, 5)))


def with_index(value, dtype):
    faces = TOWER.faces.astype(dtype)
    faces[3, 1] = value
    return faces


@pytest.mark.parametrize(
    ("value", "dtype"),
    [
        (2**40, np.int64), (2**32, np.int64), (2**32 + 1, np.uint64), (2**70, object), (-1, int),
        (8, np.int64), (2.0**40, float), (np.inf, float), (np.nan, float), (1.5, float),
        (1e300, float), (7.25, np.float32),
    ],
)  # fmt: skip
def test_an_index_that_no_vertex_has_is_refused_by_its_face(value, dtype):
    with pytest.raises(umbra.InputError) as caught:
        umbra.make_scene(TOWER.vertices, with_index(value, dtype))
    assert caught.value.face == 3


def test_whole_indices_of_any_type_are_taken():
    for dtype in (np.uint8, np.int16, np.int64, np.uint64, np.float32, float, object):
        mesh = umbra.Mesh(TOWER.vertices, TOWER.faces.astype(dtype))
        assert mesh.faces.dtype == np.int32
        assert (mesh.faces == TOWER.faces).all()
    assert umbra.Mesh(TOWER.vertices, TOWER.faces).vertices is TOWER.vertices


@given(arrays.arrays(st.sampled_from(["i8", "u8", "f8", "i2"]), (4, 3)))
def test_faces_are_kept_as_given_or_refused(faces):
    vertices = np.arange(30.0).reshape(10, 3)
    try:
        mesh = umbra.Mesh(vertices, faces)
    except umbra.InputError:
        assert not all(0 <= float(one) < 10 and float(one).is_integer() for one in faces.flat)
    else:
        assert (mesh.faces == faces).all()


def test_numbers_of_other_types_are_read():
    assert read_number("n", Decimal("2.5")) == 2.5
    assert read_number("n", np.array(3)) == 3.0
    assert read_array("n", [[Decimal(1), 2]]).tolist() == [[1.0, 2.0]]
    for wrong in ("2.5", b"2", None, True, 1j, [1], np.array([1.0]), object()):
        with pytest.raises(umbra.InputError):
            read_number("n", wrong)
    for wrong in ("abc", [["a"]], [[1], [1, 2]], 1j, {}, object(), np.array("2026-01-01", "M8[D]")):
        with pytest.raises(umbra.InputError):
            read_array("n", wrong)


def study(scale, **options):
    scene = umbra.make_scene(TOWER.vertices * scale, TOWER.faces)
    found = umbra.shadow_study(
        scene, umbra.Site(48, 16), date="2026-03-21", start="09:00", end="17:00", every="2h",
        device="cpu", **options,
    )  # fmt: skip
    return found.dataset.shadow_hours.values


@pytest.mark.parametrize(
    "options",
    [{"receivers": "ground", "size": (12, 12)}, {"receivers": "top", "size": (12, 12)}, {}],
)
def test_hours_do_not_depend_on_the_unit_up_to_the_limit(options):
    def count(exponent):
        scale = 2.0**exponent
        if not options:
            return study(scale, receivers="surfaces", spacing=2.0 * scale)
        extent = tuple((low - 20.0) * scale for low in (0, 0, 44, 44))  # a default one holds 20 m
        return study(scale, extent=extent, **options)

    usual = count(0)
    assert np.nansum(usual) > 0
    largest = int(np.log2(FARTHEST / 8))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for exponent in (10, 20, largest):
            np.testing.assert_array_equal(count(exponent), usual)


@pytest.mark.parametrize(
    ("unit", "place"),
    [
        (1, (6_378_137, 4_500_000)),  # geocentric, and web maps
        (1, (33_500_000, 5_800_000)),  # Gauss-Krüger, UTM with the zone's number
        (4, (160_000_000, 340_000_000)),  # a house in millimetres, in a national grid
        (1024, (2_684_000_000, 1_248_000_000)),  # a quarter of Zürich in millimetres
    ],
)
def test_coordinates_of_real_models_are_far_below_the_limit(unit, place):
    near = umbra.make_scene(TOWER.vertices * unit, TOWER.faces)
    far = umbra.make_scene(TOWER.vertices * unit + (*place, 0), TOWER.faces)
    counted = [
        umbra.shadow_study(
            scene, umbra.Site(48, 16), date="2026-03-21", every="2h", device="cpu", size=(16, 16),
        ).dataset.shadow_hours.values
        for scene in (near, far)
    ]  # fmt: skip
    assert counted[0].any()
    np.testing.assert_array_equal(*counted)


@pytest.mark.parametrize("far", [2e10, 1e20, 1e75, 1e77, 1e103, 1e150, 1e155, 1e200, 1e300])
def test_coordinates_whose_products_overflow_are_refused(far):
    with pytest.raises(umbra.InputError, match="coordinates reach") as caught:
        umbra.make_scene(TOWER.vertices * (far / 5), TOWER.faces)
    assert caught.value.far == pytest.approx(far)
    moved = umbra.Part("a", "", TOWER, np.diag([far / 5] * 3 + [1.0]))
    with pytest.raises(umbra.InputError):
        umbra.make_scene(moved)


@pytest.mark.parametrize("device", ["cpu", "gl"])
def test_pictures_do_not_depend_on_the_unit_up_to_the_limit(device):
    def draw(scale):
        scene = umbra.make_scene(TOWER.vertices * scale, TOWER.faces)
        place = np.array([20.0, -14, 12]) * scale
        camera = umbra.make_camera(scene, eye=place, target=(0, 0, 0), size=(48, 36))
        lamp = umbra.point_light(np.array([6.0, -3, 9]) * scale)
        both = [lamp, umbra.directional_light((1, 2, 3))]
        return umbra.render(scene, camera, both, device=device)

    try:
        usual = draw(1.0)
    except umbra.UmbraError as error:
        if device == "gl":
            pytest.skip(f"there is no OpenGL here: {error}")
        raise
    for exponent in (10, 20, int(np.log2(FARTHEST / 8))):
        np.testing.assert_array_equal(draw(2.0**exponent), usual)


def test_lamps_and_cameras_have_their_own_reach():
    assert umbra.point_light((1.5e11, 0, 0)).position[0] == 1.5e11  # the sun's distance
    for far in (2 * OUTSIDE, 1e300):
        with pytest.raises(umbra.InputError) as caught:
            umbra.point_light((far, 0, 0))
        assert caught.value.far == pytest.approx(far)
        with pytest.raises(umbra.InputError):
            umbra.Camera((far, 0, 0), (0, 0, 0))
        umbra.directional_light((far, 0, 0))  # a direction has any length
    with pytest.raises(umbra.InputError):
        umbra.Light((1, 1, 1, 1e-300))


@pytest.mark.parametrize("length", [1e-300, 1e-160, 1.0, 1e160, 1e300])
def test_the_length_of_a_direction_does_not_count(length):
    scene = umbra.make_scene(TOWER.vertices, TOWER.faces)
    way = np.array([1.0, 2, 3])
    points = [[-1, 1, 0.0], [2, -1, 0.0], [9, 9, 0.0]]
    usual = umbra.count(scene, points, [way])
    assert usual.any()
    assert not usual.all()
    np.testing.assert_array_equal(umbra.count(scene, points, [way * length]), usual)
    axis = umbra.spot_light((0, 0, 9), (1, 2, 3), 30).axis
    assert axis @ axis == pytest.approx(1)
    light = umbra.Light((0, 0, 9, 1), axis=way * length, half_angle=30)
    assert np.linalg.norm(light.axis) == pytest.approx(1)
