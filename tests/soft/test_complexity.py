"""Depth complexity over the light: laws solved by hand, rays, and where other methods are wrong."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.raycaster import RayCaster
from support.shapes import box, city, merge, moved, sheet, torus_knot, turned
from support.soft import at, differ, look, look_at_floor
from support.sweeps import reduce_count

from umbra.errors import InputError
from umbra.rays.depth import GROUND, NOTHING
from umbra.scene import Camera, directional_light, point_light
from umbra.soft import ball_light, find_method, rectangle_light
from umbra.soft.complexity import MOST, find_visibility_by_complexity, make_spots

OBLIQUE = Camera((-6, -7, 6), (0, 0, 0.5), size=(120, 90))
PANEL = rectangle_light(point_light((0, 0, 3)), (2, 0, 0), (0, 2, 0))
LIGHTS = {
    "ball": ball_light(point_light((3, 1.7, 8)), 0.6),
    "rectangle": rectangle_light(point_light((3, 1.7, 8)), (1.2, 0.3, 0), (-0.2, 1.1, 0.5)),
    "sky": ball_light(directional_light((3, 1.7, 6)), 2.5),
}


def quad(z, x, y):
    return sheet([(x[0], y[0], z), (x[1], y[0], z), (x[1], y[1], z), (x[0], y[1], z)])


def leave_bottom_out(vertices, faces):
    return vertices, faces[~(vertices[faces][..., 2] < 1.1).all(1)]


FENCE = merge(*(box((x, -0.05, 0.3), (x + 0.1, 0.05, 2)) for x in np.arange(-2, 2, 0.2)))
OVERLAPS = {
    "two plates": merge(quad(1, (-1, 0.6), (-1, 1)), quad(1.6, (-0.7, 1), (-1, 1))),
    "stack": merge(*(quad(1 + 0.2 * k, (-1 + 0.03 * k, 1), (-1, 1)) for k in range(8))),
    "fence": FENCE,
    "open box": leave_bottom_out(*box((-1, -1, 1), (1, 1, 1.5))),
}


@pytest.mark.parametrize("spots", [1, 64])
def test_a_square_plate_needs_one_spot(spots):
    # Half the light's size, half way up: the product of two overlaps, see test_wedges.
    seen = look_at_floor(quad(1, (-0.5, 0.5), (-0.5, 0.5)))
    light = rectangle_light(point_light((0, 0, 2)), (2, 0, 0), (0, 2, 0))
    x, y = np.moveaxis(seen[2].position[..., :2], -1, 0)
    width, depth = (np.clip(2 - np.abs(v), 0, 2) / 2 for v in (x, y))
    np.testing.assert_allclose(
        find_visibility_by_complexity(*seen, light, spots=spots), 1 - width * depth, atol=1e-6
    )


def test_two_that_hide_the_same_half_hide_it_once():
    # The half planes x < 0 at z = 1 and 1.5: the lower one's penumbra is the narrower.
    far = 500
    halves = [quad(z, (-far, 0), (-far, far)) for z in (1, 1.5)]
    seen = look_at_floor(merge(*halves), half=2.0, pixels=80)
    x = seen[2].position[..., 0]
    covered = [np.clip(0.5 - x / 2 * 3 / z + x / 2, 0, 1) for z in (1, 1.5)]
    error = find_visibility_by_complexity(*seen, PANEL, spots=256) - (1 - np.maximum(*covered))
    assert np.abs(error).max() < 0.01
    assert np.abs(find_method("wedges")(*seen, PANEL) - (1 - np.maximum(*covered))).max() > 0.4


@pytest.mark.parametrize(("spots", "most"), [(16, 0.2), (64, 0.04), (1024, 0.006)])
def test_crossed_half_planes_leave_the_product(spots, most):
    # One leaves a share of the panel's width, the other one of its depth.
    far = 500
    seen = look_at_floor(merge(quad(1, (-far, 0), (-far, far)), quad(1.5, (-far, far), (-far, 0))))
    x, y = np.moveaxis(seen[2].position[..., :2], -1, 0)
    left = np.clip(0.5 + x / 2 * 3 - x / 2, 0, 1) * np.clip(0.5 + y / 2 * 2 - y / 2, 0, 1)
    error = np.abs(find_visibility_by_complexity(*seen, PANEL, spots=spots) - left)
    assert ((left > 0.05) & (left < 0.95)).sum() > 500
    assert error.max() < most


def test_what_hides_everything_twice_needs_few_spots():
    # Without a bottom a box counts twice wherever it counts: only where the front of its top and
    # its walls part do counts differ.
    light = LIGHTS["ball"]
    vertices, faces = turned(box((-1, -1, 1), (1, 1, 1.5)), 25)
    camera = Camera((-6, -7, 0.9), (0, 0, 0), size=(120, 60))
    whole = find_visibility_by_complexity(*look((vertices, faces), camera), light)
    seen = look(leave_bottom_out(vertices, faces), camera)
    floor = seen[2].part == GROUND
    assert np.abs(find_visibility_by_complexity(*seen, light, spots=16) - whole)[floor].max() < 0.02
    assert np.abs(find_method("wedges")(*seen, light) - whole)[floor].max() > 0.3


def test_a_silhouette_that_changes_over_the_light():
    # The middle sees only the top's edges of this box, other points of the light walls, too.
    seen = look_at_floor(box((-0.5, -0.5, 1), (0.5, 0.5, 2)), half=1.01, pixels=101)
    light = rectangle_light(point_light((0, 0, 4)), (2, 0, 0), (0, 2, 0))
    found = find_visibility_by_complexity(*seen, light, spots=1)
    assert at(seen[2], found, 0, 0.3, 0) == pytest.approx(0.0, abs=1e-6)
    assert at(seen[2], found, 0.3, 0.3, 0) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("turn", [0, 33])
def test_a_face_loses_what_is_below_its_horizon(turn):
    # The sun's disc, 0.5 in tangent, set to a third of its radius behind a wall's plane.
    wall = turned(box((-1, 0, 0), (1, 0.3, 2)), turn)
    south = np.sin(np.radians(turn)), -np.cos(np.radians(turn))
    seen = look(wall, Camera((6 * south[0], 6 * south[1], 1), (0, 0, 1), size=(60, 60), fov=35))
    level = np.arctan(0.5 / 3)
    way = (np.sin(level) * south[0], np.sin(level) * south[1], np.cos(level))
    sun = ball_light(directional_light(way), np.degrees(np.arctan(0.5)))
    face = seen[2].part == 0
    d = 1 / 3
    hidden = 0.5 - (np.arcsin(d) + d * np.sqrt(1 - d * d)) / np.pi
    assert face.sum() > 200
    np.testing.assert_allclose(
        find_visibility_by_complexity(*seen, sun, spots=1)[face], 1 - hidden, atol=1e-5
    )


@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.parametrize("shape", OVERLAPS)
def test_overlaps_agree_with_many_samples(shape, name):
    seen = look(OVERLAPS[shape], OBLIQUE)
    truth = find_method("samples")(*seen, LIGHTS[name], samples=1024)
    error = differ(find_visibility_by_complexity(*seen, LIGHTS[name], spots=256), truth)
    assert len(error) > 50
    assert np.abs(error).max() < 0.05
    assert np.abs(error).mean() < 0.005
    few = differ(find_visibility_by_complexity(*seen, LIGHTS[name], spots=32), truth)
    brute = differ(find_method("samples")(*seen, LIGHTS[name], samples=32), truth)
    assert np.abs(few).mean() < 0.6 * np.abs(brute).mean()


@pytest.mark.parametrize("shape", OVERLAPS)
def test_rays_say_the_same(shape):
    # Every visible point asks 64 x 64 rays, spread evenly over the panel.
    light = rectangle_light(point_light((3, 1.7, 8)), (1.2, 0.3, 0), (-0.2, 1.1, 0.5))
    seen = look(OVERLAPS[shape], OBLIQUE)
    frame = seen[2]
    found = find_visibility_by_complexity(*seen, light, spots=1024)
    steps = (np.arange(64) + 0.5) / 64 - 0.5
    u, v = (grid.ravel() for grid in np.meshgrid(steps, steps))
    ends = np.array((3, 1.7, 8)) + np.outer(u, light.edges[0]) + np.outer(v, light.edges[1])
    partial = np.argwhere((frame.part == GROUND) & (found > 0.02) & (found < 0.98))
    rays, none = RayCaster(*OVERLAPS[shape]), np.full(len(ends), -1)
    some = partial[:: max(len(partial) // 25, 1)]
    assert len(some) >= 25
    for r, c in some:
        place = np.append(frame.position[r, c], 1.0)
        hit = rays.count(ends, none, place, place, np.zeros(len(OVERLAPS[shape][1]), bool)).any
        assert found[r, c] == pytest.approx(1 - hit.mean(), abs=0.015)


@given(
    st.integers(0, 10_000),
    st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(4, 9)),
    st.floats(0.05, 0.8),
    st.booleans(),
)
@settings(max_examples=reduce_count(20, 2), deadline=None)
def test_any_triangles_under_any_light(seed, middle, radius, is_ball):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(5, 3, 3)) * (1.2, 1.2, 0.7) + (0, 0, 1.9)
    corners[..., 2] = np.clip(corners[..., 2], 1.0, 3.0)
    soup = corners.reshape(-1, 3), np.arange(15, dtype=np.int32).reshape(-1, 3)
    seen = look_at_floor(soup, half=3.0, pixels=32)
    lamp = point_light(middle)
    light = (
        ball_light(lamp, radius)
        if is_ball
        else rectangle_light(lamp, radius * rng.normal(size=3), radius * rng.normal(size=3))
    )
    truth = find_method("samples")(*seen, light, samples=512)
    error = differ(find_visibility_by_complexity(*seen, light, spots=512), truth)
    assert np.abs(error).max(initial=0) < 0.07


@pytest.mark.parametrize("mesh", [city(2), OVERLAPS["stack"]])
def test_a_light_without_size_casts_the_hard_shadow(mesh):
    seen = look(mesh, Camera((-20, -17, 16), (0, 0, 2), size=(120, 90)))
    counter, view, _, camera = seen
    light = point_light((21, 8, 40))
    hard = counter.count(view, camera, light) == 0
    assert (find_visibility_by_complexity(*seen, ball_light(light, 1e-7)) != hard).sum() == 0


def test_an_edge_through_the_middle_of_the_light_leaves_no_speck():
    half = quad(1, (-50, 0), (-50, 50))
    seen = look_at_floor(half, pixels=81)
    for light in (
        ball_light(point_light((0, 0, 3)), 0.5),
        ball_light(directional_light((0, 0, 1)), 5.0),
    ):
        column = find_visibility_by_complexity(*seen, light)[:, 40]
        np.testing.assert_allclose(column, 0.5, atol=0.002)


def test_a_panel_in_a_ceiling_is_not_hidden_by_it():
    # The panel's middle lies on the ceiling, and so does all of it.
    ceiling, table = quad(3, (-4, 4), (-4, 4)), box((-0.5, -0.5, 0.5), (0.5, 0.5, 1))
    camera = Camera((-3, -3, 2.5), (0, 0, 0.4), size=(80, 60), fov=60)
    bare, under = look(table, camera), look(merge(table, ceiling), camera)
    floor = (bare[2].part == GROUND) & (under[2].part == GROUND)
    one, two = (
        find_visibility_by_complexity(*bare, PANEL),
        find_visibility_by_complexity(*under, PANEL),
    )
    assert ((one > 0) & (one < 1) & floor).sum() > 200
    np.testing.assert_allclose(two[floor], one[floor], atol=1e-6)


def test_a_lamp_within_a_cage():
    # Each bar is closed, and so is the box of glass around the lamp, of which one side is open.
    cage = merge(*(box((x, y, 2), (x + 0.1, y + 0.1, 4)) for x in (-0.5, 0.4) for y in (-0.5, 0.4)))
    lid = box((-0.6, -0.6, 4), (0.6, 0.6, 4.1))
    seen = look(merge(cage, lid), OBLIQUE)
    light = ball_light(point_light((0, 0, 3)), 0.2)
    truth = find_method("samples")(*seen, light, samples=1024)
    error = differ(find_visibility_by_complexity(*seen, light, spots=256), truth)
    assert len(error) > 200
    assert np.abs(error).max() < 0.06


def test_a_lamp_half_within_a_caster_is_only_near():
    # The middle is in the tube of a knot, and rays to it pass other loops. What cuts the lamp is
    # not cut at the right place; that the tube is around the middle must still be told.
    vertices, faces = torus_knot()
    vertices = vertices - (0, 0, vertices[:, 2].min() - 0.3)
    seen = look((vertices, faces), Camera((-12, -14, 10), (0, 0, 1), size=(120, 90)))
    light = ball_light(point_light(vertices[:10].mean(0)), 1.76)
    truth = find_method("samples")(*seen, light, samples=512)
    error = differ(find_visibility_by_complexity(*seen, light, spots=256), truth)
    assert len(error) > 5000
    assert np.abs(error).mean() < 0.15


def test_moving_everything_far_away_changes_nothing():
    far = np.array([4e5, 5e6, 200.0])
    camera = Camera(OBLIQUE.eye + far, OBLIQUE.target + far, size=OBLIQUE.size)
    away = look(moved(FENCE, far), camera, ground=far[2])
    one = find_visibility_by_complexity(*look(FENCE, OBLIQUE), LIGHTS["ball"])
    two = find_visibility_by_complexity(
        *away, ball_light(point_light(LIGHTS["ball"].light.position[:3] + far), 0.6)
    )
    # A spot that an edge passes within a micrometre may be on either side of it.
    assert (np.abs(one - two) > 1e-3).sum() <= 4


def test_threads_change_nothing():
    seen = look(FENCE, OBLIQUE)
    one = find_visibility_by_complexity(*seen, LIGHTS["sky"])
    seen[0].threads = 2
    np.testing.assert_array_equal(find_visibility_by_complexity(*seen, LIGHTS["sky"]), one)


def test_spots_fill_the_light_evenly():
    disc, square = make_spots(LIGHTS["ball"], 400), make_spots(PANEL, 400)
    assert disc.shape == square.shape == (400, 2)
    away = np.linalg.norm(disc, axis=1)
    np.testing.assert_allclose(
        [(away < r).mean() for r in (0.5, 0.8, 1)], [0.25, 0.64, 1], atol=3e-3
    )
    assert np.abs(disc.mean(0)).max() < 0.01
    quarter = [((square * (i, j)) > 0).all(1).mean() for i in (-1, 1) for j in (-1, 1)]
    np.testing.assert_allclose(quarter, 0.25, atol=0.02)
    assert np.abs(square).max() <= 1


@pytest.mark.parametrize("spots", [0, -3, MOST + 1])
def test_impossible_spots_are_refused(spots):
    seen = look(FENCE, OBLIQUE)
    with pytest.raises(InputError, match=rf"{spots} spots of the light .* give 1 to 4096"):
        find_visibility_by_complexity(*seen, LIGHTS["ball"], spots=spots)


def test_nothing_seen_is_lit():
    seen = look(FENCE, Camera((0, -6, 1), (0, 0, 4), size=(40, 40)))
    nothing = seen[1].face == NOTHING
    assert nothing.any()
    assert (find_visibility_by_complexity(*seen, LIGHTS["ball"])[nothing] == 1).all()
