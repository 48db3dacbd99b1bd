"""Shadows of a profile are told apart without their tints: by outlines and times at their tips."""

import itertools

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from support.shapes import box
from support.vision import VISIONS, contrast, see

from umbra.scene import make_scene
from umbra.study import make_preview, run_study
from umbra.sun import Site, find_sun
from umbra.writers.picture_content import DOTS_PER_INCH, DayShadows, Plan
from umbra.writers.profile import SHADE, compose_profile, make_profile_sheet
from umbra.writers.tips import SHADOW_OUTLINE

EAST = (1.0, 0.0)
CELL = 0.5


def make_plan(rows=60, cols=80):
    """Make a plan without a building, its lower left corner at 0, 0."""
    return Plan(CELL * (np.arange(cols) + 0.5), CELL * (np.arange(rows) + 0.5))


def reach_east(plan, lengths, row=25):
    """Make shadows of one wall, 5 m wide, that reach eastward to these places [m]."""
    masks = np.zeros((len(lengths), *plan.shape), bool)
    for mask, length in zip(masks, lengths, strict=True):
        mask[row : row + 10] = (plan.x > 5) & (plan.x < length)
    return masks


def find_dots(panel):
    """Give the middles of the dots on a sheet in model coordinates, in their order."""
    x0, x1, y0, y1 = panel.plan.extent
    x, y, w, h = panel.map_box
    dots = []
    for artist in panel.leaf.findobj(PolyCollection):
        corners = artist.get_paths()[0].vertices
        if len(artist.get_paths()) == 1 and len(corners) > 12:
            at = (corners.min(0) + corners.max(0)) / 2
            dots.append((x0 + (at[0] - x) / w * (x1 - x0), y0 + (at[1] - y) / h * (y1 - y0)))
    return dots


def find_labels(panel):
    """Give the boxes of the labels on a map [pixel], by their texts."""
    renderer = panel.leaf.make_renderer()
    x, y, w, h = (v * DOTS_PER_INCH for v in panel.map_box)
    found = {}
    for text in panel.leaf.findobj(Text):
        at = text.get_window_extent(renderer)
        if text.get_text() and x <= at.x0 and at.x1 <= x + w and y <= at.y0 and at.y1 <= y + h:
            assert text.get_text() not in found
            found[text.get_text()] = at
    return found


def clock(n):
    return [f"{9 + k // 4:02d}:{15 * (k % 4):02d}" for k in range(n)]


def test_each_shadow_has_its_time_at_its_tip():
    plan = make_plan()
    lengths = [15.0, 22.0, 29.0]
    sheet = make_profile_sheet(
        plan, [DayShadows(reach_east(plan, lengths), clock(3), np.array([EAST] * 3))]
    )
    dots = find_dots(sheet)
    assert [x for x, _ in dots] == pytest.approx(lengths, abs=0.2)
    assert all(12.4 < y < 17.6 for _, y in dots)
    labels = find_labels(sheet)
    assert list(labels) == clock(3)
    for label, (x, _) in zip(labels.values(), dots, strict=True):  # just beyond the tip
        tip = sheet.place((x, 0))[0] * DOTS_PER_INCH
        assert 0 < label.x0 - tip < 0.25 * DOTS_PER_INCH


def test_the_tip_is_the_point_farthest_from_the_sun():
    plan = make_plan()
    (mask,) = reach_east(plan, [30.0])
    for away, tip in [((3, 1), (30, 17.5)), ((-1, -2), (5, 12.5)), ((-0.2, 0.1), (5, 17.5))]:
        sheet = make_profile_sheet(plan, [DayShadows([mask], ["12:00"], np.array([away], float))])
        assert find_dots(sheet)[0] == pytest.approx(tip, abs=0.8)  # a corner is rounded


@pytest.mark.parametrize("n", [2, 9, 12, 33])
def test_times_avoid_one_another_even_where_tips_fall_together(n):
    plan = make_plan()
    masks = reach_east(plan, [30.0] * n)
    sheet = make_profile_sheet(plan, [DayShadows(masks, clock(n), np.array([EAST] * n))])
    labels = find_labels(sheet)
    named = clock(n) if n <= 9 else [label for label in clock(n) if label.endswith(":00")]
    assert list(labels) == named
    for one, other in itertools.combinations(labels.values(), 2):
        assert not one.overlaps(other)
    assert len(find_dots(sheet)) == len(named)


def test_a_shadow_that_leaves_the_map_is_named_on_it():
    plan = make_plan()
    sheet = make_profile_sheet(
        plan, [DayShadows(reach_east(plan, [99.0]), ["17:00"], np.array([EAST]))]
    )
    assert list(find_labels(sheet)) == ["17:00"]


def test_outlines_end_at_roofs_and_times_keep_off_them():
    height = np.zeros((60, 80))
    height[:, 60:] = 9.0  # from 30 m on
    plan = make_plan()
    plan = Plan(plan.x, plan.y, height.astype(np.float32))
    sheet = make_profile_sheet(
        plan, [DayShadows(reach_east(plan, [35.0]), ["12:00"], np.array([EAST]))]
    )
    ((x, _),) = find_dots(sheet)
    assert 25 < x <= 30
    roof = sheet.place((30, 0))[0] * DOTS_PER_INCH
    assert find_labels(sheet)["12:00"].x1 <= roof


def test_no_time_is_written_for_a_night_or_no_shadow():
    plan = make_plan()
    masks = reach_east(plan, [20.0, 0.0, 0.0])
    away = np.array([EAST, (np.nan, np.nan), EAST])
    sheet = make_profile_sheet(plan, [DayShadows(masks, clock(3), away)])
    assert list(find_labels(sheet)) == ["09:00"]


def test_each_date_has_its_own_times():
    plan = make_plan()
    days = [
        DayShadows(reach_east(plan, [length]), ["10:00"], np.array([EAST]), date)
        for date, length in (("2026-03-21", 20.0), ("2026-06-21", 12.0))
    ]
    panels = make_profile_sheet(plan, days).panels
    assert all("10:00" in find_labels(panel) for panel in panels)


def test_a_study_tells_where_the_sun_casts_shadows():
    # Three hours after noon at the equator, at equinox: the sun is 45 degrees high in the west.
    equator = Site(0.0, 0.0, "UTC")
    scene = make_scene(*box((-0.5, -5, 0), (0.5, 5, 10)))
    options = {"date": "2026-03-20", "start": "12:00", "end": "18:30", "every": "30min"}
    study = run_study(scene, equator, **options, refraction="none", cell=1.0)
    sun = find_sun(equator, study.steps.stamps, refraction="none")
    plan = make_preview(study)
    up = sun.is_up
    assert not up[-1]
    np.testing.assert_allclose(plan.away[up], -sun.direction[up, :2], atol=1e-12)
    assert (plan.away[up][1:, 0] > 0).all()
    assert np.isnan(plan.away[~up]).all()
    # Seen from the south, right is east: shadow goes there, and down.
    facade = run_study(scene, equator, **options, refraction="none", receivers="south", cell=1.0)
    away = make_preview(facade).away[up]
    np.testing.assert_allclose(away, -sun.direction[up][:, [0, 2]], atol=1e-12)


@pytest.mark.parametrize("vision", VISIONS)
@pytest.mark.parametrize("n", [1, 2, 3, 9, 12, 13, 33, 97])
def test_an_outline_stands_out_from_both_its_sides(vision, n):
    # As many shadows over one another as there may be, of the morning, noon and evening.
    masks = np.zeros((n, 3, n + 1), bool)
    for k in range(n + 1):
        masks[:k, 0, k] = True
        masks[(n - k) // 2 : (n - k) // 2 + k, 1, k] = True
        masks[n - k :, 2, k] = True
    fills = compose_profile(masks, n, (3, n + 1))
    outline = see(to_rgb(SHADOW_OUTLINE), vision)
    for shade in (1, 1 - SHADE):
        assert contrast(see(fills * shade, vision), outline).min() > (3 if shade == 1 else 2.5)


def test_few_stamps_are_all_outlined_and_many_by_the_hour():
    plan = make_plan()
    for n, lines in ((9, 9), (13, 4), (33, 9)):
        masks = reach_east(plan, np.linspace(12, 30, n))
        sheet = make_profile_sheet(plan, [DayShadows(masks, clock(n), np.array([EAST] * n))])
        drawn = [
            artist
            for artist in sheet.leaf.findobj(LineCollection)
            if to_rgb(artist.get_color()[0]) == to_rgb(SHADOW_OUTLINE)
        ]
        assert len(drawn) == lines
