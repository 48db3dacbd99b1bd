"""Light caps, sides and dark caps close every volume: rays go in as often as they come out."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.raycaster import RayCaster
from support.shapes import SCENES, box, jumble, sheet
from support.sweeps import reduce_count

from umbra.cpu.polygons import count_polygons, make_dark_cap, make_light_cap, make_sides
from umbra.scene import Camera
from umbra.volume.adjacency import make_caster

CUBE = box((-1, -1, -1), (1, 1, 1))
OPEN_BOX = CUBE[0], np.delete(CUBE[1], [2, 3], 0)
LIGHTS = [(3, 2, 5, 0), (0.3, -4, 9, 1), (0.1, 0.2, 0.3, 1), (-20, 3, -5, 1), (0.3, 0.2, -1, 0)]


def make_volume(caster, light):
    return [make(caster, light) for make in (make_light_cap, make_dark_cap, make_sides)]


def cover(polygons, camera):
    """Count all polygons before the eye: + where they face it."""
    return count_polygons(polygons, camera.matrix(), np.inf, camera.size, nearer=False)


def test_the_parts_of_a_cube_s_volume():
    caster = make_caster(*CUBE)
    cap, dark, sides = make_volume(caster, np.array([3.0, 2, 5, 0]))
    assert cap.corners.shape == (6, 3, 4)  # three squares
    assert dark.corners.shape == (0, 3, 4)  # a direction has none
    assert sides.corners.shape == (6, 3, 4)  # and its sides are triangles
    np.testing.assert_array_equal(sides.corners[:, 2], [(-3, -2, -5, 0)] * 6)
    cap, dark, sides = make_volume(caster, np.array([30.0, 20, 50, 1]))
    assert cap.corners.shape == (6, 3, 4)
    assert dark.corners.shape == (6, 3, 4)
    assert sides.corners.shape == (6, 4, 4)
    assert (dark.corners[..., 3] == 0).all()
    np.testing.assert_array_equal(sides.corners[:, :, 3], [(1, 1, 0, 0)] * 6)


def test_sides_turn_their_outside_out():
    # Each side's plane has the volume's axis behind it.
    light = np.array([0.3, 0.2, 9.0, 1.0])
    sides = make_sides(make_caster(*CUBE), light)
    for a, b, c, _ in sides.corners:
        out = np.cross(b[:3] - a[:3], c[:3])
        assert out @ (np.array([0, 0, -5.0]) - a[:3]) < 0
    cap = make_light_cap(make_caster(*CUBE), light)
    for a, b, c in cap.corners[..., :3]:
        assert np.cross(b - a, c - a) @ (light[:3] - a) > 0


def test_a_sheet_seen_from_behind_has_its_cap_turned():
    flat = sheet([(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)])
    for light in (0, 0, 5, 1), (0, 0, -5, 1):
        cap = make_light_cap(make_caster(*flat), np.array(light, float))
        assert len(cap.corners) == 2
        for a, b, c in cap.corners[..., :3]:
            assert np.cross(b - a, c - a) @ (np.array(light[:3]) - a) > 0


def test_an_enclosed_light_needs_more_than_a_fan():
    # Five faces of a cube around the light: a fan would close over the missing one.
    caster = make_caster(*OPEN_BOX)
    inside = np.array([0.1, 0.2, 0.3, 1.0])
    assert len(make_dark_cap(caster, inside).corners) == 10  # one for each face
    outside = np.array([0.1, 0.2, 9.3, 1.0])
    edges = make_sides(caster, outside)
    assert len(make_dark_cap(caster, outside).corners) == len(edges.corners)


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("eye", [(9, -14, 6), (0.2, 0.1, 0.25), (-3, 2, -8)])
@pytest.mark.parametrize("mesh", [CUBE, OPEN_BOX], ids=["cube", "open box"])
def test_rays_come_out_as_often_as_they_went_in(mesh, eye, light):
    check_balance(mesh, eye, light)


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_s_volumes_are_closed(name):
    mesh = SCENES[name]()
    for light in (8, -3.3, 20, 1), (0.13, 0.31, 3.3, 1), (0.4, 0.3, 0.7, 0):
        for eye in (20, -25, 14), (0.3, 0.2, 3), (3, 30, -9):
            check_balance(mesh, eye, light)


@settings(max_examples=reduce_count(100, 2), deadline=None, derandomize=True)
@given(
    st.integers(0, 2**32),
    st.integers(1, 25),
    st.integers(3, 9),
    st.tuples(*[st.floats(-9, 9, width=32)] * 3),
    st.tuples(*[st.floats(-9, 9, width=32)] * 3, st.sampled_from([0.0, 1.0])),
)
def test_any_soup_s_volumes_are_closed(seed, n, places, eye, light):
    if np.linalg.norm(light[:3]) < 1e-3:
        return
    mesh = jumble(np.random.default_rng(seed), n, places, low=-6.0)
    # Off whole numbers, so that neither stands in a side of a volume.
    check_balance(mesh, np.add(eye, (0.0137, 0.0071, 0.0193)), light)


def check_balance(mesh, eye, light):
    light, eye = np.array(light, float), np.array(eye, float)
    caster = make_caster(*mesh)
    is_closed = np.zeros(len(mesh[1]), bool)
    is_closed[caster.source] = caster.face_is_closed
    rays = RayCaster(*mesh)
    inside = rays.count(eye[None], [-1], light, light, is_closed).count[0]
    camera = Camera(eye, eye + (0.3, 0.41, -0.17), size=(24, 18), fov=100)
    total = sum(cover(part, camera) for part in make_volume(caster, light))
    # A winding number at the eye below that at the light shifts the closed rule's count.
    lit = rays.count(eye[None], [-1], light, light, np.ones(len(mesh[1]), bool)).count[0]
    assert inside >= lit
    np.testing.assert_array_equal(total, -inside)
