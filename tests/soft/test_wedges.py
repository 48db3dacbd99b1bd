"""Penumbra wedges: solved by hand, against many samples, and where they are wrong."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.shapes import box, city, merge, moved, plate, sheet, turned
from support.soft import at, differ, look, look_at_floor
from support.sweeps import reduce_count

from umbra.scene import Camera, directional_light, point_light
from umbra.soft import SUN_RADIUS, ball_light, find_method, rectangle_light
from umbra.soft.wedges import find_coverage, find_visibility_by_wedges

OBLIQUE = Camera((-6, -7, 6), (0, 0, 0.5), size=(120, 90))
TRIANGLE = np.array([(-1, -1, 1), (1.3, -0.6, 2), (-0.3, 1, 3.0)]), np.array([[0, 1, 2]], np.int32)
LIGHTS = {
    "ball": ball_light(point_light((3, 1.7, 8)), 0.6),
    "rectangle": rectangle_light(point_light((3, 1.7, 8)), (1.2, 0.3, 0), (-0.2, 1.1, 0.5)),
    "sky": ball_light(directional_light((3, 1.7, 6)), 2.5),
}


def sample(seen, light, n=1024):
    return find_method("samples")(*seen, light, samples=n)


def test_a_straight_edge_under_a_rectangle_is_a_ramp():
    # A half plane x < 0 at z = 1 under a light 2 m wide at z = 2: at the floor's x the light
    # is covered where the line from there past the edge is to its left: (1 - x) / 2.
    half = sheet([(-500, -500, 1), (0, -500, 1), (0, 500, 1), (-500, 500, 1)])
    seen = look_at_floor(half)
    light = rectangle_light(point_light((0, 0, 2)), (2, 0, 0), (0, 3, 0))
    x = seen[2].position[..., 0]
    expected = np.clip((1 + x) / 2, 0, 1)
    np.testing.assert_allclose(find_visibility_by_wedges(*seen, light), expected, atol=1e-6)


def test_a_straight_edge_under_a_ball_and_under_the_sun():
    # As above, the covered part being a disc's segment beyond the distance d from its middle.
    half = sheet([(-500, -500, 1), (0, -500, 1), (0, 500, 1), (-500, 500, 1)])
    seen = look_at_floor(half)
    x, y = np.moveaxis(seen[2].position[..., :2], -1, 0)

    def segment(d):
        d = np.clip(d, -1, 1)
        return 0.5 + (np.arcsin(d) + d * np.sqrt(1 - d * d)) / np.pi

    # The sun overhead, 0.5 in tangent: hidden to the left of the edge.
    sun = ball_light(directional_light((0, 0, 1)), np.degrees(np.arctan(0.5)))
    np.testing.assert_allclose(find_visibility_by_wedges(*seen, sun), segment(x / 0.5), atol=1e-6)
    # The plane through P and the edge passes a ball at a distance; seen from P in the angle
    # asin(distance / way), over the ball's own asin(0.5 / way).
    ball = ball_light(point_light((0, 0, 2)), 0.5)
    way = np.sqrt(x * x + y * y + 4)
    d = x / np.sqrt(1 + x * x)  # of the ball's middle from the plane; half the way up: 2 x / 2
    sine, rim = d / way, 0.5 / way
    tangents = sine / np.sqrt(1 - sine**2) / (rim / np.sqrt(1 - rim**2))
    np.testing.assert_allclose(find_visibility_by_wedges(*seen, ball), segment(tangents), atol=1e-6)


def test_a_square_plate_over_a_floor():
    # Half the light's size, half way up: under its middle just hidden; the product of two
    # overlaps elsewhere. The light [-1, 1]² at z = 2 is seen from (x, y) through
    # [-1 - x, 1 - x] x [-1 - y, 1 - y], so it covers max(0, 2 - |x|) / 2 of each side.
    seen = look_at_floor(sheet([(-0.5, -0.5, 1), (0.5, -0.5, 1), (0.5, 0.5, 1), (-0.5, 0.5, 1)]))
    light = rectangle_light(point_light((0, 0, 2)), (2, 0, 0), (0, 2, 0))
    x, y = np.moveaxis(seen[2].position[..., :2], -1, 0)
    width, depth = (np.clip(2 - np.abs(v), 0, 2) / 2 for v in (x, y))
    np.testing.assert_allclose(
        find_visibility_by_wedges(*seen, light), 1 - width * depth, atol=1e-6
    )


def test_a_small_hole_is_lit_by_part_of_the_light():
    # Four boards leave a hole of 0.2 x 0.2 m in the middle of a plate of 4 x 4 m.
    spans = ((-2, -0.1, -2, 2), (0.1, 2, -2, 2), (-0.1, 0.1, -2, -0.1), (-0.1, 0.1, 0.1, 2))
    boards = merge(*(sheet([(a, c, 1), (b, c, 1), (b, d, 1), (a, d, 1)]) for a, b, c, d in spans))
    seen = look_at_floor(boards, half=0.5)
    light = rectangle_light(point_light((0, 0, 2)), (2, 0, 0), (0, 2, 0))
    found = find_visibility_by_wedges(*seen, light)
    # From every place near, the whole hole shows light: 0.4 x 0.4 of 2 x 2.
    np.testing.assert_allclose(found, 0.04, atol=1e-6)


@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.parametrize("shape", [plate(2.0), TRIANGLE])
def test_one_flat_caster_agrees_with_samples(shape, name):
    seen = look(shape, OBLIQUE)
    truth, found = sample(seen, LIGHTS[name]), find_visibility_by_wedges(*seen, LIGHTS[name])
    error = differ(found, truth)
    assert len(error) > 50
    assert np.abs(error).max() < 0.025
    assert abs(error.mean()) < 0.003


@pytest.mark.parametrize("name", LIGHTS)
def test_a_tall_box_agrees_with_samples(name):
    # Its silhouette is the same from all of the light.
    seen = look(turned(box((-1, -1, 0), (1, 1, 1.5)), 25), OBLIQUE)
    truth, found = sample(seen, LIGHTS[name]), find_visibility_by_wedges(*seen, LIGHTS[name])
    error = differ(found, truth)
    assert len(error) > 50
    assert np.abs(error).max() < 0.025


@given(
    st.integers(0, 10_000),
    st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(4, 9)),
    st.floats(0.05, 0.8),
    st.booleans(),
)
@settings(max_examples=reduce_count(25, 2), deadline=None)
def test_any_triangle_under_any_light(seed, middle, radius, is_ball):
    rng = np.random.default_rng(seed)
    triangle = rng.normal(size=(3, 3)) * (1.5, 1.5, 0.7) + (0, 0, 1.9)
    triangle[:, 2] = np.clip(triangle[:, 2], 1.0, 3.0)
    if np.linalg.norm(np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])) < 0.2:
        return
    seen = look_at_floor((triangle, np.array([[0, 1, 2]], np.int32)), half=3.0, pixels=32)
    lamp = point_light(middle)
    light = (
        ball_light(lamp, radius)
        if is_ball
        else rectangle_light(lamp, radius * rng.normal(size=3), radius * rng.normal(size=3))
    )
    error = differ(find_visibility_by_wedges(*seen, light), sample(seen, light, 512))
    assert np.abs(error).max(initial=0) < 0.06


@pytest.mark.parametrize("mesh", [city(2), merge(box((-1, -1, 0), (1, 1, 1)), plate(3.0))])
def test_a_light_without_size_casts_the_hard_shadow(mesh):
    seen = look(mesh, Camera((-20, -17, 16), (0, 0, 2), size=(120, 90)))
    counter, view, _, camera = seen
    light = point_light((21, 8, 40))
    hard = counter.count(view, camera, light) == 0
    found = find_visibility_by_wedges(*seen, ball_light(light, 1e-7))
    assert (found != hard).sum() == 0


def test_an_edge_through_the_middle_of_the_light_leaves_no_speck():
    # The floor's pixels at x = 0 see the edge exactly before the light's middle.
    half = sheet([(-50, -50, 1), (0, -50, 1), (0, 50, 1), (-50, 50, 1)])
    seen = look_at_floor(half, pixels=81)
    assert (np.abs(seen[2].position[:, 40, 0]) < 1e-12).all()
    for light in (
        ball_light(point_light((0, 0, 3)), 0.5),
        ball_light(directional_light((0, 0, 1)), 5.0),
    ):
        column = find_visibility_by_wedges(*seen, light)[:, 40]
        np.testing.assert_allclose(column, 0.5, atol=0.002)


def test_moving_everything_far_away_changes_nothing():
    far = np.array([4e5, 5e6, 200.0])
    near = look(turned(box((-1, -1, 0), (1, 1, 1.5)), 25), OBLIQUE)
    camera = Camera(OBLIQUE.eye + far, OBLIQUE.target + far, size=OBLIQUE.size)
    away = look(moved(turned(box((-1, -1, 0), (1, 1, 1.5)), 25), far), camera, ground=far[2])
    one = find_visibility_by_wedges(*near, LIGHTS["ball"])
    two = find_visibility_by_wedges(
        *away, ball_light(point_light(LIGHTS["ball"].light.position[:3] + far), 0.6)
    )
    np.testing.assert_allclose(one, two, atol=1e-4)


def test_threads_change_nothing():
    seen = look(city(2), Camera((-20, -17, 16), (0, 0, 2), size=(120, 90)))
    one = find_visibility_by_wedges(*seen, LIGHTS["sky"])
    seen[0].threads = 2
    np.testing.assert_array_equal(find_visibility_by_wedges(*seen, LIGHTS["sky"]), one)


def test_the_suns_penumbra_widens_by_a_hundred_and_seventh_of_the_way():
    # 10 m behind an edge under a sun overhead: 2 tan 0.2665 degrees x 10 m = 93 mm.
    half = sheet([(-500, -500, 10), (0, -500, 10), (0, 500, 10), (-500, 500, 10)])
    seen = look_at_floor(half, half=0.1, pixels=200)
    found = find_visibility_by_wedges(*seen, ball_light(directional_light((0, 0, 1)), SUN_RADIUS))[
        0
    ]
    partial = ((found > 0) & (found < 1)).sum() * 1e-3
    assert partial == pytest.approx(0.0930, abs=0.002)


def test_where_casters_hide_the_same_part_twice_it_is_wrong():
    # Two half planes, one above the other, hide the same half of the light: 1.0 for 0.5.
    halves = [sheet([(-500, -500, z), (-0.01, -500, z), (-0.01, 500, z), (-500, 500, z)])
              for z in (1, 1.5)]  # fmt: skip
    seen = look_at_floor(merge(*halves), half=0.5, pixels=81)
    light = rectangle_light(point_light((0, 0, 3)), (2, 0, 0), (0, 2, 0))
    coverage = find_coverage(*seen, light)
    assert at(seen[2], coverage, 0, 0, 0) == pytest.approx(1.0, abs=0.04)
    assert at(seen[2], sample(seen, light), 0, 0, 0) == pytest.approx(0.5, abs=0.02)


def test_a_box_without_a_bottom_hides_everything_twice():
    vertices, faces = turned(box((-1, -1, 1), (1, 1, 1.5)), 25)
    bottom = (vertices[faces][..., 2] < 1.1).all(1)
    light = LIGHTS["ball"]
    for kept, deepest in ((faces, 1.0), (faces[~bottom], 2.0)):
        seen = look((vertices, kept), Camera((-6, -7, 0.9), (0, 0, 0), size=(120, 60)))
        coverage = find_coverage(*seen, light)
        assert coverage.max() == pytest.approx(deepest, abs=0.02)
        error = differ(find_visibility_by_wedges(*seen, light), sample(seen, light, 256))
        assert (error.mean() < -0.1) == (deepest == 2)


def test_a_silhouette_that_changes_over_the_light():
    # A box under a light wider than it: the middle sees only the top's edges, though other
    # points of the light also see walls.
    seen = look_at_floor(box((-0.5, -0.5, 1), (0.5, 0.5, 2)), half=1.01, pixels=101)
    light = rectangle_light(point_light((0, 0, 4)), (2, 0, 0), (0, 2, 0))
    coverage = find_coverage(*seen, light)
    assert at(seen[2], coverage, 0, 0.3, 0) == pytest.approx(1.0)
    assert at(seen[2], coverage, 0.3, 0.3, 0) == pytest.approx(1.0)


@pytest.mark.parametrize("aside", [0.0, 1e-7, -0.3])
def test_a_wall_in_whose_plane_the_middle_stands(aside):
    # A floor's point sees the panel x in [aside - 1, aside + 1] at z = 3 past a wall x = 0 of 2 m,
    # whose top is before -x / 2: what is beyond that is hidden.
    seen = look_at_floor(sheet([(0, -500, 0), (0, 500, 0), (0, 500, 2), (0, -500, 2)]), half=1.9)
    x = seen[2].position[..., 0]
    light = rectangle_light(point_light((aside, 0, 3)), (2, 0, 0), (0, 2, 0))
    across = np.sign(x) * aside + np.abs(x) / 2
    np.testing.assert_allclose(
        find_visibility_by_wedges(*seen, light), np.clip(0.5 + across / 2, 0, 1), atol=1e-5
    )
