"""``umbra.count``: points, lights and weights of one's own."""

import numpy as np
import pytest
from support.shapes import box, sheet

import umbra

ABOVE, WEST, LOW = (0, 0, 1), (-1, 0, 1), (-1, 0, 0.01)


@pytest.fixture
def table():
    """2 x 2 m at z = 4."""
    return umbra.make_scene(*sheet([(-1, -1, 4), (1, -1, 4), (1, 1, 4), (-1, 1, 4)]))


def test_a_scene_that_is_solved_by_hand(table):
    points = [(0.3, 0.2, 0), (3.5, 0.2, 0), (0.3, 0.2, 5), (9, 0, 0)]
    hidden = umbra.count(table, points, [ABOVE, WEST, LOW])
    np.testing.assert_array_equal(hidden, [[1, 0, 0], [0, 1, 0], [0, 0, 0], [0, 0, 0]])
    assert hidden.dtype == np.bool_
    seen = umbra.count(table, points, [ABOVE, WEST, LOW], of="light")
    np.testing.assert_array_equal(seen, ~hidden)


@pytest.mark.parametrize("length", [1e-3, 1.0, 50.0])
def test_directions_have_any_length(table, length):
    hidden = umbra.count(table, [(3.5, 0.2, 0)], np.array([WEST]) * length)
    assert hidden.all()


def test_weights_are_summed_by_column(table):
    points = [(0.3, 0.2, 0), (3.5, 0.2, 0), (9, 0, 0)]
    weights = np.array([[0.25, 100], [0.5, 10], [1, 1]])
    dark = umbra.count(table, points, [ABOVE, WEST, LOW], weights=weights)
    np.testing.assert_array_equal(dark, [[0.25, 100], [0.5, 10], [0, 0]])
    lit = umbra.count(table, points, [ABOVE, WEST, LOW], weights=weights[:, 0], of="light")
    np.testing.assert_array_equal(lit, [1.5, 1.25, 1.75])


def test_a_lamp_hides_what_lies_behind_the_table_alone(table):
    # Below, beside and above the table; a lamp 4 m over it doubles its shadow.
    points = [(1.9, 0, 0), (2.1, 0, 0), (0, 0, 6), (0, 0, 9), (0.2, 0.1, 3.9)]
    lamp = umbra.count(table, points, [(0, 0, 8, 1), (0, 0, 3, 1), (0, 0, 1, 0)])
    # Under the table a lamp at 3 m lights all that is below it, and nothing above.
    np.testing.assert_array_equal(lamp[:, 0], [1, 0, 0, 0, 1])
    np.testing.assert_array_equal(lamp[:, 1], [0, 0, 1, 1, 0])
    np.testing.assert_array_equal(lamp[:, 2], [0, 0, 0, 0, 1])


def test_a_lamp_far_away_is_a_direction():
    scene = umbra.make_scene(*box((0, 0, 0), (3, 4, 5)))
    rng = np.random.default_rng(7)
    points = rng.uniform(-6, 9, (500, 3))
    ways = rng.normal(size=(40, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    lamps = np.column_stack([1e7 * ways, np.ones(40)])
    near = umbra.count(scene, points, ways)
    assert 0.02 < near.mean() < 0.9
    assert (near != umbra.count(scene, points, lamps)).mean() < 1e-3


def test_lamps_agree_with_pierced_triangles():
    vertices, faces = box((0, 0, 0), (3, 4, 5))
    scene = umbra.make_scene(vertices, faces)
    rng = np.random.default_rng(8)
    points, lamps = rng.uniform(-6, 9, (200, 3)), rng.uniform(-6, 9, (30, 3))
    found = umbra.count(scene, points, np.column_stack([lamps, np.ones(30)]))
    corners = np.asarray(vertices, float)[np.asarray(faces)]
    a, e, f = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    way = (lamps - points[:, None])[:, :, None]
    start = points[:, None, None] - a
    cross = np.cross(way, f)
    det = (e * cross).sum(-1)
    u = (start * cross).sum(-1) / det
    turned = np.cross(start, e)
    v, t = (way * turned).sum(-1) / det, (f * turned).sum(-1) / det
    pierced = (u > 0) & (v > 0) & (u + v < 1) & (t > 0) & (t < 1)
    np.testing.assert_array_equal(found, pierced.any(-1))
    assert 0.05 < found.mean() < 0.9


def test_a_surface_that_is_turned_away_is_in_its_own_shadow(table):
    receivers = [(9, 0, 0, 0, 0, 1), (9, 0, 0, 0, 0, -1), (9, 0, 0, 1, 0, 0)]
    hidden = umbra.count(table, receivers, [WEST, (9, 5, 5, 1)[:3]])
    np.testing.assert_array_equal(hidden, [[0, 0], [1, 1], [1, 0]])
    lamp = umbra.count(table, receivers, [(9, 0, 7, 1), (8, 0, 0.5, 1)])
    np.testing.assert_array_equal(lamp[:2], [[0, 0], [1, 1]])
    assert lamp[2, 1]


def test_far_from_zero_it_is_the_same():
    corners = np.array([(-1, -1, 4), (1, -1, 4), (1, 1, 4), (-1, 1, 4)]) + (2.6e6, 1.2e6, 400)
    scene = umbra.make_scene(*sheet(corners))
    points = np.array([(0.3, 0.2, 0), (3.5, 0.2, 0)]) + (2.6e6, 1.2e6, 400)
    lamp = (2.6e6, 1.2e6, 408, 1)
    found = umbra.count(scene, points, [(*ABOVE, 0), (*WEST, 0), lamp])
    np.testing.assert_array_equal(found, [[1, 0, 1], [0, 1, 0]])


def test_parts_may_cast_or_not():
    scene = umbra.make_scene(
        [
            umbra.Part("roof", "", umbra.Mesh(*box((0, 0, 3), (1, 1, 4)))),
            umbra.Part("tree", "", umbra.Mesh(*box((4, 0, 3), (5, 1, 4)))),
        ]
    )
    points = [(0.5, 0.4, 0), (4.5, 0.4, 0)]
    assert umbra.count(scene, points, [ABOVE]).all()
    assert umbra.count(scene, points, [ABOVE], no_cast="tree").tolist() == [[True], [False]]
    assert umbra.count(scene, points, [ABOVE], cast=["tree"]).tolist() == [[False], [True]]


@pytest.mark.parametrize("receivers", ["ground", "top", "surfaces", "south"])
def test_named_receivers_are_those_of_a_study(receivers):
    scene = umbra.make_scene(*box((-1, -1, 0), (1, 1, 3)))
    site = umbra.Site(48.2, 16.37, "Europe/Vienna")
    raster = {"cell": 0.25} if receivers != "surfaces" else {"spacing": 0.4}
    if receivers in {"ground", "top"}:
        raster["extent"] = (-4, -4, 4, 4)
    study = umbra.shadow_study(
        scene, site, date="2026-03-21", every="1h", ground=0.0, receivers=receivers, masks=True,
        **raster,
    )  # fmt: skip
    suns = study.sun_direction.values
    hours = umbra.count(scene, receivers, suns, weights=np.ones(8), ground=0.0, **raster)
    assert hours.dims == study.shadow_hours.dims
    np.testing.assert_allclose(hours, study.shadow_hours)
    hidden = umbra.count(scene, receivers, suns, ground=0.0, **raster)
    assert hidden.dims == (*hours.dims, "light")
    np.testing.assert_array_equal(np.moveaxis(hidden.values, -1, 0), study.in_shadow)


def test_weights_in_columns_on_named_receivers():
    scene = umbra.make_scene(*box((-1, -2, 0), (1, 2, 3)))
    lights = [(*ABOVE, 0), (*WEST, 0), (0, 0, 9, 1)]
    weights = [[1, 2], [3, 4], [10, 20]]
    raster = {"extent": (-1, -2, 1, 2), "cell": 0.5}
    view = umbra.count(scene, "top", lights, weights=weights, of="light", **raster)
    assert view.shape == (8, 4, 2)
    assert view.dims == ("y", "x", "weight")
    np.testing.assert_array_equal(view.x, [-0.75, -0.25, 0.25, 0.75])
    assert (view == [14, 26]).all()
    hidden = umbra.count(scene, "ground", lights, ground=0.0, **raster)
    assert hidden.values.all()


def test_blocks_and_threads_change_nothing(table, monkeypatch):
    rng = np.random.default_rng(9)
    points, ways = rng.uniform(-4, 4, (300, 3)), rng.normal(size=(20, 3))
    weights = rng.uniform(size=(20, 3))
    whole = umbra.count(table, points, ways, weights=weights, threads=1)
    monkeypatch.setattr("umbra.calls.counts._WORK", 9 * 20 * 7)
    pieces = umbra.count(table, points, ways, weights=weights, threads=2)
    np.testing.assert_allclose(pieces, whole, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("arguments", "options", "words"),
    [
        (([(0, 0)], [ABOVE]), {}, r"receivers= takes an array \(n, 3\) or \(n, 6\).*got \(1, 2\)"),
        (("roof", [ABOVE]), {}, "unknown receivers 'roof'"),
        (("top", [ABOVE]), {"spacing": 1.0}, "spacing= is not for receivers='top'"),
        (([(0, 0, 0)], [ABOVE]), {"cell": 1.0}, "cell= is for named receivers"),
        (([(0, 0, 0)], [ABOVE]), {"threads": 0}, "threads must be at least 1"),
        (([(0, 0, np.nan)], [ABOVE]), {}, r"receivers have 1 rows .* \(first: 0\)"),
        (([(0, 0, 0)], ABOVE), {}, r"directions= takes an array .* got \(3,\)"),
        (([(0, 0, 0)], [(0, 0, 0)]), {}, "row 0 of directions is 0 and points nowhere"),
        (([(0, 0, 0)], [(0, 0, 1, 2)]), {}, "w of a light is 1.* row 0 of directions has 2"),
        (([(0, 0, 0)], [ABOVE]), {"weights": [1, 2]}, r"for each of 1 lights; got shape \(2,\)"),
        (
            ([(0, 0, 0)], [ABOVE]),
            {"weights": [np.inf]},
            "1 weights are not finite .first: that of light 0",
        ),
        (([(0, 0, 0)], [ABOVE]), {"of": "sun"}, "of='sun' is not one of shadow, light"),
        (([(0, 0, 0)], [ABOVE]), {"cast": "tower"}, "'tower' matches no part"),
    ],
)
def test_slips_are_told_in_a_line(table, arguments, options, words):
    with pytest.raises(umbra.InputError, match=words) as caught:
        umbra.count(table, *arguments, **options)
    assert "\n" not in str(caught.value)
