"""The sheet of plan and elevations: one true, round scale, and room for all on A3."""

import itertools

import numpy as np
import pytest
from matplotlib.text import Text

from umbra.writers.elevations import (
    CAPTION,
    FOOT,
    HEAD,
    PAPER,
    arrange,
    find_pixel_side,
    make_elevations_sheet,
)
from umbra.writers.picture_content import DOTS_PER_INCH, MISSING, DayMap, Plan
from umbra.writers.pixels import shade_ramp
from umbra.writers.sheet import KEY_WIDTH, MARGIN

SIDES = ("South", "East", "North", "West")


@pytest.mark.parametrize(
    ("plan", "wide", "deep", "high", "scale"),
    [
        ((50, 20), 18, 16, 7, 200),
        ((470, 230), 220, 190, 75, 2000),
        ((3000, 3600), 2900, 3500, 100, 25000),
        ((25, 20), 18, 15, 7, 150),
        ((3, 2), 2, 2, 1, 20),
        ((20, 400), 10, 380, 12, 2000),
    ],
)
def test_the_largest_round_scale_that_fits_is_taken(plan, wide, deep, high, scale):
    sizes = [(wide, high), (deep, high)] * 2
    found = arrange(plan, plan, sizes)
    assert found.scale == scale
    room = (PAPER[0] - 2 * MARGIN - KEY_WIDTH, PAPER[1] - HEAD - FOOT)
    boxes = []
    for k, (w, h) in enumerate([plan, *sizes]):
        (x, y), inch = found.corners[k], found.per_metre(k)
        right, low = x + w * inch, y + CAPTION + h * inch
        assert right < room[0]
        assert low < room[1]
        boxes.append((x, y, right, low))
    for a, b in itertools.combinations(boxes, 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


@pytest.mark.parametrize("need", [(50, 20), (20, 50), (70, 60), (330, 180)])
@pytest.mark.parametrize("high", [8, 40])
def test_the_plan_fills_what_room_is_left(need, high):
    sizes = [(0.6 * need[0], high), (0.6 * need[1], high)] * 2
    found = arrange(need, (np.inf, np.inf), sizes)
    assert str(found.scale).strip("0") in {"1", "2", "5"}
    assert min(np.subtract(found.plan, need)) >= 0
    room = (PAPER[0] - 2 * MARGIN - KEY_WIDTH - 0.4, PAPER[1] - HEAD - FOOT)
    ends = [
        (x + w * found.per_metre() + 0.92, y + h * found.per_metre() + 0.5)
        for (x, y), (w, h) in zip(found.corners, [found.plan, *sizes], strict=True)
    ]
    # Both the right and the lower end of the room are reached: no corner is left empty.
    np.testing.assert_allclose(np.max(ends, axis=0), room, atol=1e-6)
    shown = found.plan[0] * found.plan[1] * found.per_metre() ** 2
    assert shown > 0.3 * room[0] * room[1]
    tight = arrange(need, need, sizes)
    assert tight.of_elevations <= tight.scale <= found.scale
    assert tight.plan == pytest.approx(need)


@pytest.mark.parametrize("plan", [(150, 150), (430, 80), (80, 430)])
def test_a_stated_extent_of_any_shape_fills_the_paper(plan):
    sizes = [(31.8, 20.6), (29.7, 20.6)] * 2
    found = arrange(plan, plan, sizes)
    used = [
        (w * found.per_metre(k) + 0.92) * (h * found.per_metre(k) + 0.5)
        for k, (w, h) in enumerate([plan, *sizes])
    ]
    room = (PAPER[0] - 2 * MARGIN - KEY_WIDTH - 0.4, PAPER[1] - HEAD - FOOT)
    assert sum(used) > 0.65 * room[0] * room[1]  # of one scale of 1, 2, 5: 0.18 to 0.39


def make_map(wide, high, hours, axes=("x [m]", "y [m]"), cell=0.5):
    x, y = (cell * (np.arange(round(n / cell)) + 0.5) for n in (wide, high))
    plan = Plan(x, y, None, 0.0 if axes[0] else None, title="house", date="2026", axes=axes)
    return plan, DayMap(np.full(plan.shape, hours, np.float32))


def test_all_maps_are_of_one_scale_and_named():
    sizes = [(18, 7), (16, 7), (18, 7), (16, 7)]
    arrangement = arrange((50, 20), (np.inf, np.inf), sizes)
    maps = [("Plan", *make_map(50, 20, 0.0))]
    for hours, side, size in zip((0, 4, 8, np.nan), SIDES, sizes, strict=True):
        maps.append((f"{side} elevation", *make_map(*size, hours, ("", "z [m]"))))
    sheet = make_elevations_sheet(arrangement, maps, 8.0)
    panels = sheet.panels
    texts = {text.get_text() for text in sheet.leaf.findobj(Text)}
    named = {"Plan", *(f"{side} elevation" for side in SIDES)}
    assert {*named, "1:200", "house, plan and elevations", "N", "hours in shadow", "4 h"} <= texts
    assert any("1:200 on A3 (420 x 297 mm)" in text for text in texts)
    for panel, (w, h) in zip(panels, [(50, 20), *sizes], strict=True):
        rows, cols = panel.map_size
        assert cols * find_pixel_side(arrangement) == pytest.approx(w, abs=0.02)
        assert rows * find_pixel_side(arrangement) == pytest.approx(h, abs=0.02)
        np.testing.assert_allclose(panel.map_box[2], w * 1000 / 200 / 25.4, atol=0.01)
    pixels = sheet.leaf.render()[::-1].astype(float)
    assert pixels.shape[:2] == (round(297 / 25.4 * 150), round(420 / 25.4 * 150 + 0.5))
    ramp = shade_ramp() * 255
    for panel, expected in zip(
        panels, (ramp[0], ramp[0], ramp[128], ramp[-1], np.full(3, MISSING * 255)), strict=True
    ):
        x, y, w, h = panel.map_box
        row, col = (round(v * DOTS_PER_INCH) for v in (y + 0.2 * h, x + 0.3 * w))
        np.testing.assert_allclose(pixels[row, col], expected, atol=3)


def test_captions_name_scales_that_differ():
    sizes = [(18, 7), (16, 7)] * 2
    arrangement = arrange((90, 20), (90, 20), sizes)
    assert (arrangement.scale, arrangement.of_elevations) == (300, 125)
    maps = [("Plan", *make_map(90, 20, 0.0))]
    maps += [(f"{side} elevation", *make_map(*size, 4.0, ("", "z [m]"))) for side, size in
             zip(SIDES, sizes, strict=True)]  # fmt: skip
    sheet = make_elevations_sheet(arrangement, maps, 8.0)
    texts = {text.get_text() for text in sheet.leaf.findobj(Text)}
    assert {"Plan, 1:300", "East elevation, 1:125", "1:300"} <= texts
    assert any("plan 1:300, elevations 1:125 on A3" in text for text in texts)
    widths = [panel.map_box[2] for panel in sheet.panels]
    np.testing.assert_allclose(widths[0], 90 * 1000 / 300 / 25.4, atol=0.01)
    np.testing.assert_allclose(widths[1], 18 * 1000 / 125 / 25.4, atol=0.01)
