"""Frames judged by rays: every pixel, from every kind of place, by every kind of light."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.judge import Verdicts, judge_edge_on, judge_frame
from support.shapes import (
    HOUSE,
    SCENES,
    box,
    city,
    jumble,
    merge,
    moved,
    rewound,
    sheet,
    soup,
    stack_of_triangles,
    staircase,
    turned,
)
from support.sweeps import reduce_count, sample_cases, sample_pairs

from umbra.cpu.frame import FrameCounter
from umbra.scene import Camera, directional_light, make_scene, point_light

SIZE = (48, 36)
OUTSIDE = Camera((20, -25, 14), (0, 0, 3), size=SIZE)
ORTHOGRAPHIC = Camera((20, -25, 14), (0, 0, 3), size=SIZE, height=30.0)
INSIDE = Camera((0.3, 0.2, 3), (10, 3, 0), size=SIZE)
BELOW = Camera((20, -25, -9), (0, 0, 3), size=SIZE)
STRAIGHT_DOWN = Camera((0.2, 0.1, 30), (0.2, 0.1, 0), up=(0, 1, 0), size=SIZE, height=24.0)
CAMERAS = {
    "outside": OUTSIDE,
    "orthographic": ORTHOGRAPHIC,
    "inside": INSIDE,
    "below the ground": BELOW,
    "straight down": STRAIGHT_DOWN,
}
LIGHTS = {
    "lamp": point_light((8, -3.3, 20)),
    "lamp inside": point_light((0.13, 0.31, 3.3)),
    "sun": directional_light((0.4, 0.3, 0.7)),
    "sun below": directional_light((0.4, 0.35, -0.7)),
    "lamp below": point_light((30, 3.2, -4)),
    "level": directional_light((0.41, 0.29, 0)),
}


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("name", SCENES)
def test_every_pixel_is_right(name, camera):
    mesh, verdicts = SCENES[name](), Verdicts()
    for light in sample_cases(LIGHTS.values(), 2, len(name) + len(camera)):
        verdicts += judge_frame(mesh, CAMERAS[camera], light)[0]
    # A level sun sees the whole ground edge-on.
    verdicts.check(most_on_edges=0.01)


def test_lights_in_awkward_places():
    eye = OUTSIDE.eye
    back = eye - OUTSIDE.target
    lights = [
        point_light((3, -3, 6)),  # a corner of the house
        point_light((9, -3, 4)),  # in the plane of a wall
        point_light((9, 9, 6)),  # in the plane of the roof
        directional_light((1, 0, 0)),  # in the plane of two walls, the roof and the ground
        directional_light((1, 0, 1)),  # in the plane of two walls
        directional_light((0, 0, 1)),
        directional_light((0, 0, -1)),
        directional_light((0.3, 0.4, 1e-12)),  # as good as level
        point_light(eye),
        point_light(eye + back),  # behind the eye
        point_light(eye - back * 0.999),
        directional_light(back),  # straight from behind
        directional_light(-back),  # straight against
        point_light((4, -8, 0)),  # in the ground
        point_light((1e7, 2e7, 3e7)),
    ]
    for mesh in HOUSE, SCENES["jumble"](), SCENES["coplanar walls"]():
        for camera in OUTSIDE, ORTHOGRAPHIC, STRAIGHT_DOWN:
            for light in lights:
                verdicts, _ = judge_frame(mesh, camera, light)
                verdicts.check(most_on_edges=0.05)


@pytest.mark.parametrize("near", [22.0, 30.0, 33.0, 36.0])
@pytest.mark.parametrize(
    "name", ["one box", "wound inward", "cavity", "nested boxes", "jumble", "sheets", "top flipped"]
)
def test_casters_cut_by_the_near_plane(name, near):
    mesh, verdicts = SCENES[name](), Verdicts()
    for height, light in sample_pairs((None, 25.0), LIGHTS.values(), 2, len(name) + int(near)):
        camera = Camera((20, -25, 14), (0, 0, 3), size=SIZE, near=near, height=height)
        verdicts += judge_frame(mesh, camera, light)[0]
    verdicts.check(most_on_edges=0.01)


def test_a_staircase_counts_its_300_steps():
    # From above, onto the ground before the flight, where the light comes down along the noses.
    camera = Camera((-0.3, 1, 30), (-0.3, 1, 0), up=(0, 1, 0), size=(21, 13), height=0.71)
    light = directional_light((0.5, 0, 0.25))
    verdicts, counts = judge_frame(staircase(), camera, light)
    assert verdicts.check().deepest == 300
    assert counts.max() == 300
    # From the side in perspective, by a lamp on the line of the noses.
    camera = Camera((-3, -2, 2), (-0.2, 1, 0), size=SIZE)
    verdicts, counts = judge_frame(staircase(), camera, point_light((160, 1, 80.2)))
    assert verdicts.check().deepest > 255
    assert counts.max() > 255


@pytest.mark.parametrize(
    "light", [directional_light((0.1, 0.05, 1)), point_light((0.4, 0.3, 25))], ids=["sun", "lamp"]
)
def test_more_layers_than_int16_holds(light):
    mesh = stack_of_triangles(40_000)
    camera = Camera((9, -12, 8), (0, 0, 0), size=(16, 12))
    verdicts, counts = judge_frame(mesh, camera, light)
    verdicts.check()
    assert set(np.unique(counts)) == {0, 40_000}


def test_large_coordinates_change_nothing():
    far = np.array([2.6e6, 1.2e6, 400.0])
    mesh = city(2)
    light = point_light((8, -3.3, 20))
    _, near_counts = judge_frame(mesh, OUTSIDE, light)
    camera = Camera(OUTSIDE.eye + far, OUTSIDE.target + far, size=SIZE)
    verdicts, counts = judge_frame(
        moved(mesh, far), camera, point_light(light.position[:3] + far), ground=far[2]
    )
    verdicts.check()
    # Vertices near 2.6e6 keep 5e-10 m: no pixel of this picture is that near an edge.
    np.testing.assert_array_equal(counts, near_counts)


@pytest.mark.parametrize("camera", ["outside", "orthographic", "below the ground"])
def test_level_faces_under_a_light_in_their_plane(camera):
    # Roofs of one height, undersides in their plane, and walls that rise above it.
    mesh = merge(
        *(
            moved(
                turned(box((-2, -2, low), (2, 1.5, high)), 31 * k),
                (5 * (k % 4) - 8, 6 * (k // 4) - 8, 0),
            )
            for k, (low, high) in enumerate([(0, 4), (0, 7), (4, 8), (-3, 4)] * 3)
        )
    )
    counter = FrameCounter(make_scene(*mesh))
    found = []
    for light in directional_light((0.41, 0.29, 0)), point_light((31.0, -20.0, 4.0)):
        found += [judge_edge_on(counter, CAMERAS[camera], light, how) for how in ("auto", "z-fail")]
    wrong, shaded = np.sum(found, axis=0)
    assert wrong == 0
    assert shaded > 10


@pytest.mark.parametrize("camera", ["outside", "orthographic"])
def test_walls_along_the_light(camera):
    rng = np.random.default_rng(7)
    corners = np.append(rng.integers(-12, 9, (30, 2)), np.zeros((30, 1)), 1)
    mesh = merge(*(box(low, low + rng.uniform(2, 8, 3)) for low in corners))
    found = []
    for turn in 0, 33:  # of the model, with the light: planes then hold it within rounding
        counter = FrameCounter(make_scene(*turned(mesh, turn)), ground=0.0)
        angles = np.radians([0, 90, 180, 270])
        x, y = np.sin(angles - np.radians(turn)), np.cos(angles - np.radians(turn))
        lights = [directional_light(way) for way in np.stack([x, y, np.ones(4)], 1)]
        lamp = turned((corners[:1] + [0, 4.0, 9.0], None), turn)[0][0]
        for light in (*lights, point_light(lamp)):
            found.append(judge_edge_on(counter, CAMERAS[camera], light))
    wrong, shaded = np.sum(found, axis=0)
    assert wrong == 0
    assert shaded > 100


@pytest.mark.parametrize("length", [1e-300, 1e-33, 1.0, 1e300])
def test_a_direction_may_have_any_length(length):
    light = directional_light(np.array([0.5, 0.375, 0.75]) * length)
    verdicts, counts = judge_frame(HOUSE, OUTSIDE, light)
    assert verdicts.check().deepest == 1
    usual = judge_frame(HOUSE, OUTSIDE, directional_light((0.5, 0.375, 0.75)))[1]
    np.testing.assert_array_equal(counts, usual)


@pytest.mark.parametrize("rise", [1e-3, 1e-9, 1e-14, 1.2e-16, 1e-30, 5e-45, -1e-16])
@pytest.mark.parametrize("name", ["jumble", "turned boxes"])
def test_a_sun_as_good_as_level(name, rise):
    # The sine of half a turn is 1.2e-16, and shadows are then 1e16 times as long as high.
    for eye, target in ((20, -25, 14), (0, 0, 3)), ((0.2, 0.1, 2.2), (5, 3, 2)):
        for height in None, 25.0:
            camera = Camera(eye, target, size=SIZE, height=height)
            verdicts, _ = judge_frame(SCENES[name](), camera, directional_light((1, 0.13, rise)))
            verdicts.check(most_on_edges=0.05)


@pytest.mark.parametrize("x", [0.0, 1.0, -3.7])
def test_an_eye_exactly_in_the_side_of_a_volume(x):
    # Under the rim of a roof, lit from the zenith: left of the eye is sun, right is shadow.
    roof = sheet([(x, -6, 5), (x + 6, -6, 5), (x + 6, 9, 5), (x, 9, 5)])
    camera = Camera((x, -2, 1), (x, 4, 0.5), size=(12, 8), fov=70)
    verdicts, counts = judge_frame(roof, camera, directional_light((0, 0, 1)))
    verdicts.check()
    np.testing.assert_array_equal(counts[6], [0] * 6 + [1] * 6)


@pytest.mark.parametrize("eye", [(3, -3, 6), (3, 0.25, 6), (0.5, 0.25, 6), (3, -1, 2), (-2, 2, 0)])
@pytest.mark.parametrize("name", ["one box", "wound inward", "top flipped"])
def test_an_eye_exactly_on_a_surface(name, eye):
    # On a corner, an edge and the middle of the roof; on a wall; at a wall's foot.
    verdicts = Verdicts()
    for target in (9, -9, 1), (-7, 5, 3), (0.4, 0.3, 1):
        for light in LIGHTS.values():
            camera = Camera(eye, target, size=SIZE, fov=80)
            verdicts += judge_frame(SCENES[name](), camera, light)[0]
    verdicts.check(most_on_edges=0.05)


def test_a_lamp_exactly_on_a_surface():
    # On the underside of a slab: its top and sides keep the light from what is above.
    slab = box((-4, -4, 3), (4, 4, 3.2))
    camera = Camera((12, -14, 9), (0, 0, 4), size=SIZE)
    over = merge(slab, sheet([(-1, -1, 6), (1, -1, 6), (1, 1, 6), (-1, 1, 6)]))
    verdicts, counts = judge_frame(over, camera, point_light((0.5, 0.25, 3)))
    verdicts.check()
    assert counts.max() > 0


def test_threads_change_nothing():
    scene = make_scene(*SCENES["turned boxes"]())
    found = []
    for threads in (1, 2, 3):
        counter = FrameCounter(scene, ground=0.0, threads=threads)
        view, _ = counter.see(OUTSIDE)
        found.append([view.key, view.face])
        for light in LIGHTS.values():
            found[-1] += [counter.count(view, OUTSIDE, light, how) for how in ("auto", "z-fail")]
    for again in found[1:]:
        for a, b in zip(found[0], again):
            np.testing.assert_array_equal(a, b)


def count_with_warnings(mesh, camera, light, method):
    lines = []
    counter = FrameCounter(make_scene(*mesh), ground=0.0, warn=lines.append)
    view, _ = counter.see(camera)
    return counter.count(view, camera, light, method), lines


@pytest.mark.parametrize(
    ("camera", "is_right"),
    [
        (OUTSIDE, True),
        (ORTHOGRAPHIC, True),
        (INSIDE, False),  # the eye is in the house, and so in its shadow
        (Camera((-5, -4, 1), (3, 3, 0), size=SIZE), False),  # the eye is in the house's shadow
        (Camera((20, -25, 14), (0, 0, 3), size=SIZE, near=32), False),  # the near plane cuts it
        (BELOW, True),
    ],
)
def test_z_pass_warns_exactly_where_it_is_wrong(camera, is_right):
    light = directional_light((0.6, 0.5, 0.6))
    plain, lines = count_with_warnings(HOUSE, camera, light, "z-pass")
    right, none = count_with_warnings(HOUSE, camera, light, "auto")
    assert not none
    assert (plain == right).all() == is_right
    assert len(lines) == (not is_right)
    assert all("z-pass is wrong for this view" in line for line in lines)


def test_z_pass_does_not_warn_of_casters_behind_the_eye():
    mesh = merge(HOUSE, moved(HOUSE, (60, -70, 0)))
    light = directional_light((0.4, 0.3, 0.7))
    plain, lines = count_with_warnings(mesh, OUTSIDE, light, "z-pass")
    right, _ = count_with_warnings(mesh, OUTSIDE, light, "auto")
    np.testing.assert_array_equal(plain, right)
    assert not lines


def test_an_unknown_method_is_refused():
    with pytest.raises(ValueError, match="no method 'shadow-map'"):
        count_with_warnings(HOUSE, OUTSIDE, LIGHTS["sun"], "shadow-map")


def coordinate(limit):
    return st.floats(-limit, limit, allow_nan=False, width=32)


@st.composite
def meshes(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    kind = draw(st.sampled_from(["soup", "jumble", "boxes", "whole", "sheets"]))
    if kind == "soup":
        return soup(rng, draw(st.integers(1, 12)), low=-6.0)
    if kind == "jumble":
        return jumble(rng, draw(st.integers(1, 20)), draw(st.integers(3, 9)), low=-4.0)
    if kind == "sheets":
        corners = rng.integers(-5, 6, (3, 4, 3)).astype(float)
        corners[:, 3] = corners[:, 0] + corners[:, 2] - corners[:, 1]
        return merge(*map(sheet, corners))
    boxes = []
    for _ in range(draw(st.integers(1, 4))):
        low, size = rng.uniform(-8, 4, 3), rng.uniform(0.5, 9, 3)
        if kind == "whole":  # aligned with each other, with lights and eyes
            low, size = np.round(low), np.ceil(size)
        boxes.append(box(low, low + size))
        if draw(st.booleans()):
            boxes[-1] = rewound(boxes[-1])
    return merge(*boxes)


@st.composite
def lights(draw):
    place = [draw(coordinate(20)) for _ in range(3)]
    if draw(st.booleans()):
        return point_light(place)
    return directional_light(place if any(place) else (0, 0, 1))


@st.composite
def cameras(draw):
    eye = np.array([draw(coordinate(25)) for _ in range(3)])
    target = np.array([draw(coordinate(8)) for _ in range(3)])
    if np.linalg.norm(np.cross(target - eye, (0, 0, 1))) < 1e-2:
        target = eye + (1, 0.5, -0.25)
    return Camera(
        eye,
        target,
        size=(20, 15),
        fov=draw(st.floats(20, 120)),
        height=draw(st.none() | st.floats(1, 40)),
        near=draw(st.sampled_from([0.01, 0.1, 1.0, 8.0])),
        far=draw(st.sampled_from([np.inf, 60.0])),
    )


@settings(
    max_examples=reduce_count(150, 2),
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
@given(meshes(), cameras(), lights(), st.sampled_from([0.0, -3.0, None]))
def test_any_view_of_anything(mesh, camera, light, ground):
    verdicts, _ = judge_frame(mesh, camera, light, ground)
    # Whole numbers put whole rows of a small picture on edges: none else may differ.
    if verdicts.right:
        verdicts.check(most_on_edges=1.0)


@pytest.mark.parametrize("height", [None, 30.0])
def test_a_floor_in_the_ground_plane_stays_in_sight(height):
    floor = sheet([(-7.3, -6.1, 0.1), (6.2, -5.9, 0.1), (7.7, 8.3, 0.1), (-6.6, 7.2, 0.1)])
    camera = Camera((11, -23.7, 14.3), (0.3, 0.2, 0), size=SIZE, height=height)
    counter = FrameCounter(make_scene(*floor), ground=0.1)
    view, _ = counter.see(camera)
    alone, _ = FrameCounter(make_scene(*floor)).see(camera)
    seen = alone.face >= 0
    assert seen.any()
    np.testing.assert_array_equal(view.face[seen], alone.face[seen])
