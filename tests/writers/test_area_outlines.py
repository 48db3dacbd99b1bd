"""Areas on maps: where their names stand, and that the outlines lie where the polygons are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from matplotlib.collections import LineCollection
from matplotlib.text import Text
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.scene.grid import Places
from umbra.study import StudyOptions
from umbra.study.preview import make_preview
from umbra.writers.area_outlines import find_names, place_names
from umbra.writers.folder import FolderJob, Outputs
from umbra.writers.folder.captions import describe, outline_areas
from umbra.writers.folder.shown_window import find_shown_window
from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.picture_content import DayMap, OutlinedArea, Plan
from umbra.writers.point_map import fill_points
from umbra.writers.sheet import lay_out_sheet

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
    outlined = outline_areas(found.result.named_areas)
    assert [one.name for one in outlined] == ["ring", "two"]
    for one, polygon in zip(outlined, (ring, two), strict=True):
        assert sum(shapely.LineString(r).length for r in one.rings) == pytest.approx(polygon.length)
        assert polygon.contains(shapely.Point(one.middle))


def test_the_plan_of_a_picture_has_the_areas_of_its_study():
    found = umbra.shadow_study(
        make_scene([Part("tower", "", Mesh(*box((-8, -10, 0), (8, 0, 25))))]), VIENNA,
        date="2026-03-21", start="11:00", end="13:00", every="1h", cell=4.0, ground=0.0,
        areas={"garden": shapely.box(-10, 2, 10, 22)},
    ).result  # fmt: skip
    options = StudyOptions(date="2026-03-21", cell=4.0)
    job = FolderJob(found, Path(), Outputs(), options, None, print)
    assert [one.name for one in describe(job, make_preview(found), range(1)).areas] == ["garden"]


def test_areas_are_filled_with_their_points_and_outlined_off_their_holes():
    """Two areas, one with a hole: red in the west, blue in the east, nothing elsewhere."""
    square = np.array([(10, 10), (90, 10), (90, 90), (10, 90), (10, 10)], float)
    hole = np.array([(20, 60), (40, 60), (40, 80), (20, 80), (20, 60)], float)
    at = np.arange(0.5, 100)
    area = OutlinedArea("", (square, hole), (50, 50))
    plan = Plan(at, at, true_north=None, areas=(area,), fills_areas=True)
    x, y = np.meshgrid(np.arange(12.5, 90, 5), np.arange(12.5, 90, 5))
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    colors = np.where(points[:, :1] < 50, [[1.0, 0, 0]], [[0, 0, 1.0]])
    (panel,) = lay_out_sheet(plan, 0.5).maps
    fill_points(panel, Places(points, np.full_like(points, np.nan)), colors, [])
    drawn = panel.leaf.render()[::-1] / 255

    def look(x, y):
        col, row = (panel.place([(x, y)])[0] * 150).astype(int)
        return drawn[row, col]

    assert look(15, 50) == pytest.approx([1, 0, 0], abs=0.01)
    assert look(85, 50) == pytest.approx([0, 0, 1], abs=0.01)
    for spot in ((30, 70), (5, 5), (95, 50)):
        assert look(*spot).min() > 0.9
    assert look(50, 10).max() < 0.3  # the outline
    assert look(20, 70).max() < 0.3


def test_a_frame_holds_gardens_and_small_buildings_whole():
    heights = np.zeros((100, 200), np.float32)
    heights[40:52, 112:122] = 5  # reaches over the frame by 5
    heights[30:34, 60:200] = 5  # too long to be shown whole
    matters = np.zeros((100, 200), bool)
    matters[40:60, 80:100] = True
    ring = np.array([(75, 30), (105, 30), (105, 70), (75, 70), (75, 30)], float)
    plan = Plan(np.arange(200) + 0.5, np.arange(100) + 0.5, building_height=heights)
    rows, cols = find_shown_window(matters, plan)
    assert (rows.start, rows.stop, cols.start, cols.stop) == (34, 66, 74, 106)
    areas = replace(plan, areas=(OutlinedArea("g", (ring,), (90, 50)),))
    rows, cols = find_shown_window(matters, areas)
    assert (rows.start, rows.stop) == (19, 82)
    assert cols.start <= 64
    assert 122 < cols.stop < 127


def test_lines_of_equal_hours_and_their_labels_leave_names_free():
    at = np.arange(0.5, 100)
    ring = np.array([(20, 20), (80, 20), (80, 80), (20, 80), (20, 20)], float)
    areas = (OutlinedArea("a garden with a long name", (ring,), (50.0, 50.0)),)
    hours = np.broadcast_to(at / 12, (100, 100)).astype(np.float32)  # lines run north
    counts = []
    for shown in ((), areas):
        sheet = make_hours_sheet(Plan(at, at, areas=shown), [DayMap(hours)], 8.0)
        ((_, box),) = find_names(sheet.maps[0]) or [("", (0.0, 0.0, 0.0, 0.0))]
        lines = [
            line.vertices
            for artist in sheet.leaf.artists
            if isinstance(artist, LineCollection) and artist.get_linewidths()[0] == 0.5
            for line in artist.get_paths()
        ]
        labels = [
            a for a in sheet.leaf.artists if isinstance(a, Text) and a.get_text()[-2:] == " h"
        ]
        inside = [((line > box[:2]) & (line < box[2:])).all(1).any() for line in lines]
        counts.append((len(lines), len(labels), sum(inside)))
        for label in labels:
            x, y = label.get_position()
            assert not (box[0] - 0.1 < x < box[2] + 0.1 and box[1] < y < box[3])
    (bare, _, _), (lines, labels, inside) = counts
    assert inside == 0
    assert labels >= 7
    assert lines > bare  # cut in two by the name
