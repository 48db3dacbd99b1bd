"""The bound on counts: never too low, and close enough to keep to the stencil."""

import numpy as np
import pytest
from support.shapes import box, city, merge, moved, stack_of_triangles, staircase, terrain

from umbra.gl import bodies
from umbra.gl.bodies import make_bodies
from umbra.gl.geometry import Geometry
from umbra.gl.overlap import bound_boxes, bound_count, bound_nearby, find_most
from umbra.gl.volumes import make_volumes
from umbra.scene import make_scene

SUN = np.array([0.0, 0.6, 0.8, 0.0])


@pytest.fixture
def bound(device):
    def find(mesh, light, drawn=None):
        geometry = Geometry(device, make_scene(*mesh))
        (body,) = make_bodies(make_scene(*mesh), geometry)
        opened = np.zeros((1, len(body.caster.is_closed)), bool)
        light = np.asarray(light, np.float64)
        volumes = make_volumes(body, light, opened)
        geometry.release()
        return bound_count([volumes], [find_most(body, opened)], light, drawn)

    return find


def in_line(n, step):
    return merge(*[moved(box((0, 0, 0), (1, 1, 1)), np.multiply(step, k)) for k in range(n)])


def test_few_convex_things_count_one_each(bound):
    assert bound(in_line(200, (2, 0, 0)), SUN) == 200


@pytest.mark.parametrize("n", [256, 400, 1000])
def test_boxes_beside_each_other_do_not_add_up(bound, n):
    assert 1 <= bound(in_line(n, (3, 0, 0)), SUN) <= n / 100 + 2


@pytest.mark.parametrize("n", [256, 300])
def test_boxes_one_behind_another_do(bound, n):
    assert bound(in_line(n, (0, 3, 4)), SUN) == n
    assert bound(in_line(n, (0, 3, 4)), (0.5, -3, -4, 1)) == n


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_lamp_sees_to_all_sides(bound, axis, sign):
    step = np.zeros(3)
    step[axis] = 2.0 * sign
    light = np.append([0.5, 0.5, 0.5] - 3 * step, 1.0)
    found = bound(in_line(300, step), light)
    assert 300 <= found <= 302
    assert 300 <= bound(in_line(300, step), np.append([0.5, 0.5, 0.5] - step * 0.8, 1.0)) <= 302


def test_a_lamp_among_boxes(bound):
    assert 1 <= bound(city(20), (1.3, 2.1, 40.0, 1.0)) < 100


def test_faces_decide_where_things_cannot(bound):
    stairs = staircase(100)
    assert 100 <= bound(stairs, (0.5, 0, 0.25, 0)) <= 255
    assert bound(staircase(300), (0.5, 0, 0.25, 0)) >= 300
    assert bound(stack_of_triangles(1000), (0.1, 0.05, 1, 0)) == 1000


@pytest.mark.parametrize("light", [(0.4, 0.3, 0.7, 0), (30, -20, 90, 1), (300, 200, 90, 1)])
def test_a_fine_terrain_stays_in_the_stencil(bound, light):
    assert 1 <= bound(terrain(200), light) <= 255


def test_only_what_is_drawn_adds_up(bound):
    rows = in_line(700, (0, 3, 4))
    drawn = np.arange(700) % 7 < 3  # 300 of them
    for light in SUN, (0.5, -3, -4, 1):
        assert bound(rows, light) == 700
        assert bound(rows, light, drawn) == 300
        assert bound(rows, light, drawn & (np.arange(700) < 400)) <= 255


@pytest.mark.parametrize("sun", [(0.1, -0.1, 1, 0), (0, 0, 1, 0), (-0.1, 0, 1, 0)])
def test_no_bound_is_below_what_a_ray_counts(bound, sun):
    # Tilted piles of 300 sheets: a ray through the middle meets each, beside a fine terrain.
    sheets = [moved(box((-9, -9, 0), (9, 9, 0.01)), np.multiply(k / 50, (0.1, -0.1, 1)))
              for k in range(300)]  # fmt: skip
    assert bound(merge(*sheets), sun) >= 300
    assert bound(merge(*sheets, moved(terrain(60), (-3, 5, -40))), sun) >= 300


@pytest.mark.parametrize("light", [(0.0, 0.6, 0.8, 0), (0.5, -3, -4, 1)])
def test_shells_that_are_put_together_add_up_box_by_box(bound, monkeypatch, light):
    monkeypatch.setattr(bodies, "MOST_SHELLS", 40)
    rows = [moved(in_line(300, (0, 3, 4)), (30 * k, 0, 0)) for k in range(3)]
    assert 300 <= bound(merge(*rows), light) <= 305
    assert 1 <= bound(in_line(1000, (3, 0, 0)), SUN) <= 127


def test_a_bound_of_a_lamp_holds_for_lamps_near_it(device):
    # Two rows of boxes, one behind the other: from the middle a lamp sees one of each, aside more.
    mesh = merge(*[moved(box((0, 0, 0), (1, 1, 1)), (1.2 * k, 5 * (k % 2), 0)) for k in range(200)])
    geometry = Geometry(device, make_scene(*mesh))
    (body,) = make_bodies(make_scene(*mesh), geometry)
    geometry.release()
    opened = np.zeros((1, len(body.caster.is_closed)), bool)
    every = np.ones(200, bool)

    def look(place, known, slack=2.0, drawn=every):
        light = np.array([*place, 1.0])
        volumes = [make_volumes(body, light, opened)]
        weights = find_most(body, opened)
        return bound_nearby(volumes, body.bounds, weights, light, drawn, known, slack)[0]

    first = look((120, -30, 0.5), None)
    assert first.most < 200
    assert look((120.5, -30.9, 0.5), first) is first
    assert look((122.5, -30, 0.5), first) is not first  # too far away
    near, rng = [], np.random.default_rng(1)
    for _ in range(20):
        way = rng.normal(size=3)
        place = (120, -30, 0.5) + 1.15 * way / np.linalg.norm(way)
        near.append(bound_boxes(body.bounds, first.weights, np.array([*place, 1.0])))
    assert 1 < max(near) <= first.most
    few = np.arange(200) < 150
    some = look((120, -30, 0.5), None, drawn=few)
    assert look((120.1, -30, 0.5), some, drawn=few) is some
    more = look((120.1, -30, 0.5), some)  # others are drawn, too
    assert more is not some
    # So few need no search, and what was known stays known.
    assert look((120.1, -30, 0.5), more, drawn=np.arange(200) < 100) is more
    assert not some.counted.all()
    assert more.counted.all()


def test_a_bound_for_lamps_near_a_place_counts_what_only_they_see_in_line(device):
    # A hundred boxes in a row, and as many apart: a lamp beside the row sees few of them in line.
    row = [moved(box((0, 0, 0), (1, 1, 1)), (8, 4 * k, 0)) for k in range(100)]
    apart = [moved(box((0, 0, 0), (1, 1, 1)), (-4 - 4 * k, 0, 0)) for k in range(100)]
    scene = make_scene(*merge(*row, *apart))
    geometry = Geometry(device, scene)
    (body,) = make_bodies(scene, geometry)
    geometry.release()
    opened = np.zeros((1, len(body.caster.is_closed)), bool)
    beside, behind = np.array([2.5, -20.0, 0.5, 1.0]), np.array([8.5, -20.0, 0.5, 1.0])
    volumes = [make_volumes(body, beside, opened)]
    weights = find_most(body, opened)
    every = np.ones(200, bool)
    known, most = bound_nearby(volumes, body.bounds, weights, beside, every, None, 7.0)
    assert (known.slack, known.most) == (7.0, most)
    assert bound_boxes(body.bounds, known.weights, beside) < 90
    assert 100 <= bound_boxes(body.bounds, known.weights, behind) <= known.most
    assert known.holds(behind, known.weights, known.counted)
