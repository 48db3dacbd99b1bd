"""``umbra.shadow_polygons``: shadows on a plane for any directions."""

import sys

import numpy as np
import pytest
from support.shapes import box, rewound

import umbra

shapely = pytest.importorskip("shapely")
pytest.importorskip("pyclipr")

SITE = umbra.Site(46.95, 7.44, "Europe/Zurich")
FAR = np.array([2.6e6, 1.2e6, 400.0])


def make_tower(shift=(0, 0, 0), **facts):
    vertices, faces = box((0, 0, 0), (2, 3, 4))
    return umbra.make_scene(np.asarray(vertices, float) + shift, faces, **facts)


@pytest.mark.parametrize("length", [1.0, 30.0])
def test_a_shadow_that_is_solved_by_hand(length):
    # From the south-west at 45 degrees in x alone: the tower's shadow reaches 4 m east.
    found = umbra.shadow_polygons(make_tower(), length * np.array([-1.0, 0, 1]))
    assert found.geom_type == "MultiPolygon"
    assert found.symmetric_difference(shapely.box(0, 0, 6, 3)).area < 1e-4
    higher = umbra.shadow_polygons(make_tower(), (-1, 0, 1), plane=1.0)
    assert higher.area == pytest.approx(15, abs=1e-4)
    assert umbra.shadow_polygons(make_tower(), (-1, 0, 1), plane=4.0).is_empty


def test_it_holds_just_the_points_that_lie_in_shadow():
    scene = umbra.make_scene(
        [
            umbra.Part("a", "", umbra.Mesh(*box((0, 0, 0), (2, 3, 4)))),
            umbra.Part("b", "", umbra.Mesh(*rewound(box((5, 5, 0), (7, 9, 3)), range(12)))),
        ]
    )
    rng = np.random.default_rng(5)
    suns = rng.normal(size=(6, 3))
    suns[:, 2] = np.abs(suns[:, 2]) + 0.2
    points = np.column_stack([rng.uniform(-8, 16, (400, 2)), np.zeros(400)])
    hidden = umbra.count(scene, points, suns)
    found = umbra.shadow_polygons(scene, suns)
    inside = np.array([shapely.contains_xy(shape, points[:, :2]) for shape in found]).T
    np.testing.assert_array_equal(inside, hidden)
    only = umbra.shadow_polygons(scene, suns[0], cast="b")
    assert only.area < found[0].area
    assert only.equals(umbra.shadow_polygons(scene, suns[0], no_cast=["a"]))


def test_far_from_zero_it_is_the_same():
    near = umbra.shadow_polygons(make_tower(), (-1, 0.3, 1))
    far = umbra.shadow_polygons(make_tower(FAR), (-1, 0.3, 1), plane=400.0)
    moved = shapely.transform(far, lambda xy: xy - FAR[:2])
    assert moved.symmetric_difference(near).area < 1e-4


def test_without_geopandas_shapes_are_given(monkeypatch):
    monkeypatch.setattr("umbra.calls.counts.find_spec", lambda _: None)
    scene = make_tower(FAR, crs="EPSG:2056")
    sun = umbra.sun_light(SITE, "2026-03-21", "15:00")
    assert umbra.shadow_polygons(scene, sun, plane=400.0).geom_type == "MultiPolygon"
    path = umbra.find_sun(SITE, np.array(["2026-03-21T12", "2026-03-21T14"], "datetime64[us]"))
    assert [one.geom_type for one in umbra.shadow_polygons(scene, path, 400.0)] == 2 * [
        "MultiPolygon"
    ]


def test_with_geopandas_and_a_crs_a_table_is_given():
    pytest.importorskip("geopandas")
    scene = make_tower(FAR, crs="EPSG:2056")
    path = umbra.find_sun(SITE, np.array(["2026-03-21T12", "2026-03-21T14"], "datetime64[us]"))
    table = umbra.shadow_polygons(scene, path, plane=400.0)
    assert table.crs.to_epsg() == 2056
    np.testing.assert_allclose(table.area_m2, table.geometry.area)
    np.testing.assert_array_equal(table.sun_altitude, path.altitude)
    assert len(umbra.shadow_polygons(scene, (0, -1, 1), plane=400.0)) == 1


@pytest.mark.parametrize(
    ("sun", "options", "words"),
    [
        ((0, 1, -0.1), {}, r"1 directions come from below the horizon \(first: row 0\)"),
        (umbra.point_light((0, 0, 9)), {}, "a lamp at a place has w = 1"),
        ((0, 0, 0), {}, "points nowhere"),
        ("noon", {}, "sun= takes an array"),
        ((0, 0, 1), {"plane": np.nan}, "must be a finite number"),
        ((0, 0, 1), {"plane": "roof"}, "must be a finite number; got 'roof'"),
        ((0, 0, 1), {"no_cast": 3}, "no_cast is text, or several texts; got 3"),
        ((0, 0, 1), {"cast": "tree"}, "'tree' matches no part"),
    ],
)
def test_slips_are_told(sun, options, words):
    with pytest.raises(umbra.InputError, match=words):
        umbra.shadow_polygons(make_tower(), sun, **options)


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyclipr", None)
    with pytest.raises(
        umbra.InputError, match=r"shadow_polygons needs pyclipr.*pip install .*\[gis\]"
    ):
        umbra.shadow_polygons(make_tower(), (0, 0, 1))
