"""Areas on maps: where their names stand, and that the outlines lie where the polygons are."""

import numpy as np
import pytest
import shapely
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.writers.area_outlines import place_names
from umbra.writers.folder.captions import outline_areas
from umbra.writers.hours import make_hours_sheet
from umbra.writers.plan import DayMap, OutlinedArea, Plan

VIENNA = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
FRAME = (0.0, 0.0, 10.0, 10.0)


def overlap(a, b, size):
    return all(abs(a[k] - b[k]) < size[k] - 1e-9 for k in (0, 1))


def test_names_of_areas_that_lie_over_each_other_do_not_overlap():
    size, outer = (1.0, 0.2), (4.0, 4.5, 6.0, 5.5)
    places = place_names([np.array([5.0, 5.0])] * 5, [outer] * 5, [size] * 5, FRAME)
    assert places[0] == (5.0, 5.0)
    pairs = [(a, b) for k, a in enumerate(places) for b in places[:k]]
    assert not any(overlap(a, b, size) for a, b in pairs)


def test_a_name_wider_than_its_area_stands_above_it():
    (place,) = place_names([np.array([5.0, 5.0])], [(4.8, 4.5, 5.2, 5.5)], [(1.0, 0.2)], FRAME)
    assert place[0] == 5.0
    assert place[1] - 0.1 > 5.5


def test_names_stay_in_the_frame():
    middles = [np.array([0.1, 9.95]), np.array([9.9, 0.0])]
    outer = [(0.0, 9.0, 2.0, 10.0), (8.0, 0.0, 10.0, 1.0)]
    for x, y in place_names(middles, outer, [(1.0, 0.2)] * 2, FRAME):
        assert 0.5 <= x <= 9.5
        assert 0.1 <= y <= 9.9


def test_a_map_outlines_an_area_and_its_hole():
    outer = np.array([(10, 10), (90, 10), (90, 90), (10, 90), (10, 10)], float)
    hole = np.array([(60, 60), (80, 60), (80, 80), (60, 80), (60, 60)], float)
    at = np.arange(0.5, 100)
    plan = Plan(at, at, true_north=None)
    hours = [DayMap(np.zeros((100, 100), np.float32))]
    with_area = Plan(at, at, true_north=None, areas=(OutlinedArea("", (outer, hole), (40, 40)),))
    sheets = [make_hours_sheet(one, hours, 8.0) for one in (plan, with_area)]
    bare, drawn = (sheet.leaf.render()[::-1].astype(int) for sheet in sheets)
    is_changed = np.abs(bare - drawn).max(-1) > 60
    (panel,) = sheets[1].maps
    for ring in (outer, hole):
        middles = (ring[:-1] + ring[1:]) / 2
        for x, y in panel.place(middles) * 150:
            near = is_changed[int(y) - 2 : int(y) + 3, int(x) - 2 : int(x) + 3]
            assert near.any()
    x, y = (panel.place([(70, 70)])[0] * 150).astype(int)
    assert not is_changed[y - 10 : y + 10, x - 10 : x + 10].any()


def test_the_areas_of_a_study_are_outlined_with_holes_and_parts():
    ring = shapely.box(-10, 2, 10, 22).difference(shapely.box(-5, 7, 5, 17))
    two = shapely.MultiPolygon([shapely.box(20, 0, 24, 4), shapely.box(30, 0, 34, 4)])
    found = umbra.shadow_study(
        make_scene([Part("tower", "", Mesh(*box((-8, -10, 0), (8, 0, 25))))]), VIENNA,
        date="2026-03-21", start="11:00", end="13:00", every="1h", receivers="areas",
        areas={"ring": ring, "two": two}, ground=0.0, cell=2.0,
    )  # fmt: skip
    outlined = outline_areas(found.result)
    assert [one.name for one in outlined] == ["ring", "two"]
    for one, polygon in zip(outlined, (ring, two), strict=True):
        assert sum(shapely.LineString(r).length for r in one.rings) == pytest.approx(polygon.length)
        assert polygon.contains(shapely.Point(one.middle))
