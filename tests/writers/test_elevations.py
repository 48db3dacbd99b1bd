"""The sheet of plan and elevations: one true, round scale, all on the axes of the plan."""

import numpy as np
import pytest
from matplotlib.text import Text

from umbra.writers.elevations import (
    AXIS,
    CAPTION,
    FINER_SCALES,
    GAP,
    PAPERS,
    SheetContent,
    arrange,
    find_pixel_side,
    find_room,
    make_elevations_sheet,
)
from umbra.writers.marks import KEY_TITLE
from umbra.writers.paper import SMALL
from umbra.writers.picture_content import DOTS_PER_INCH, MISSING, DayMap, Plan
from umbra.writers.pixels import shade_ramp
from umbra.writers.sheet import MARGIN
from umbra.writers.title_block import BLOCK, TITLE, SunRose

SIDES = ("South", "East", "North", "West")


def fits(scale, need, sizes, paper, has_row):
    inch = 1000 / 25.4 / scale
    south, east, north, west = sizes
    wide = max(need[0], south[0], north[0]) * inch + AXIS
    high = max(need[1], east[0], west[0]) * inch + CAPTION
    wide += (east[1] + west[1]) * inch + 2 * (CAPTION + GAP)
    high += (south[1] + north[1]) * inch + 2 * (CAPTION + GAP)
    room = find_room(paper, has_row=has_row)
    return wide <= room[0] and high <= room[1]


@pytest.mark.parametrize("paper", PAPERS)
@pytest.mark.parametrize(
    ("need", "high"), [((50, 20), 7), ((470, 230), 75), ((3000, 3600), 100), ((3, 2), 1)]
)
def test_the_largest_round_scale_that_fits_is_taken(need, high, paper):
    sizes = [(0.6 * need[0], high), (0.6 * need[1], high)] * 2
    found = arrange(need, need, sizes, paper)
    assert fits(found.scale, need, sizes, paper, found.has_row)
    larger = [scale for scale in FINER_SCALES if scale < found.scale]
    assert not larger or not fits(larger[-1], need, sizes, paper, found.has_row)
    assert found.plan == pytest.approx(need)
    grown = arrange(need, (np.inf, np.inf), sizes, paper)
    assert str(grown.scale).strip("0") in {"1", "125", "2", "25", "5"}
    # The plan reaches both ends of the room.
    inch = grown.per_metre
    spans = [grown.plan[k] * inch + 2 * high * inch + 2 * (CAPTION + GAP) for k in (0, 1)]
    assert np.add(spans, (AXIS, CAPTION)) == pytest.approx(find_room(paper, has_row=grown.has_row))
    # Nothing is empty but the corner between the elevations, and what lies beside them.
    wide, high = (side * inch for side in grown.plan)
    used = wide * high + sum(w * h * inch**2 for w, h in sizes)
    corner = (spans[0] - wide) * (spans[1] - high)
    assert corner < np.prod(PAPERS[paper]) / 4
    assert used > 0.4 * np.prod(find_room(paper, has_row=grown.has_row))


def make_map(wide, high, hours, axes=("x [m]", "y [m]"), cell=0.5, start=0.0):
    x, y = (cell * (np.arange(round(n / cell)) + 0.5) for n in (wide, high))
    plan = Plan(x + start, y, None, 0.0 if axes[0] else None, title="house", date="2026", axes=axes)
    return plan, DayMap(np.full(plan.shape, hours, np.float32))


def test_all_maps_are_of_one_scale_and_stand_on_the_axes_of_the_plan():
    sizes = [(18, 7), (16, 7), (18, 7), (16, 7)]
    arrangement = arrange((50, 20), (50, 20), sizes)
    maps = [("Plan", *make_map(50, 20, 0.0))]
    for hours, side, size in zip((0, 4, 8, np.nan), SIDES, sizes, strict=True):
        maps.append((f"{side} elevation", *make_map(*size, hours, ("", "z [m]"))))
    for _, _, day in maps[2::2]:  # a mark at the left foot of east and west: south, and north
        day.hours[:4, :4] = 8.0
    mask = np.zeros((40, 100), bool)
    content = SheetContent(
        (3.0, -1.0), [(f"{hour:02}:00", mask) for hour in range(9, 18)], maps[0][1],
        SunRose(np.array([(120.0, 20.0), (180.0, 40.0)]), [("09", 120.0, 20.0)]),
        np.full((20, 40, 4), (200, 30, 30, 255), np.uint8),
    )  # fmt: skip
    sheet = make_elevations_sheet(arrangement, maps, 8.0, content=content)
    panels, inch = sheet.panels, arrangement.per_metre
    texts = {text.get_text() for text in sheet.leaf.findobj(Text)}
    named = {"Plan", *(f"{side} elevation" for side in SIDES)}
    scale = f"1:{arrangement.scale}"
    assert {*named, scale, "house", "N", "hours in shadow", "4 h", "09:00", "15:00"} <= texts
    assert any(f"{scale} on A3 (420 x 297 mm)" in text for text in texts)
    middle = np.array(panels[0].map_box[:2]) + np.array(panels[0].map_box[2:]) / 2
    middle += np.array([3.0, -1.0]) * inch
    for k, (panel, (w, h)) in enumerate(zip(panels, [(50, 20), *sizes], strict=True)):
        x, y, wide, high = panel.map_box
        is_turned = k in {2, 4}
        np.testing.assert_allclose(
            (wide, high)[:: -1 if is_turned else 1], (w * inch, h * inch), atol=0.01
        )
        rows, cols = panel.map_size[:: -1 if is_turned else 1]
        side = find_pixel_side(arrangement)
        np.testing.assert_allclose((cols * side, rows * side), (w, h), atol=side)
        if k in {1, 3}:
            assert x + wide / 2 == pytest.approx(middle[0], abs=0.01)
        if is_turned:
            assert y + high / 2 == pytest.approx(middle[1], abs=0.01)
    boxes = [panel.map_box for panel in panels]
    for a in range(5):
        for b in range(a):
            (x, y, w, h), (u, v, r, s) = boxes[a], boxes[b]
            assert x + w < u or u + r < x or y + h < v or v + s < y
    assert max(x + w for x, _, w, _ in boxes) < sheet.leaf.width - MARGIN - BLOCK
    pixels = sheet.leaf.render()[::-1].astype(float)
    assert pixels.shape[:2] == (round(297 / 25.4 * 150), round(420 / 25.4 * 150 + 0.5))
    ramp = shade_ramp() * 255

    def read(panel, across, up):
        x, y, w, h = panel.map_box
        row, col = (round(v * DOTS_PER_INCH) for v in (y + up * h, x + across * w))
        return pixels[row, col]

    for panel, expected in zip(
        panels, (ramp[0], ramp[0], ramp[128], ramp[-1], np.full(3, MISSING * 255)), strict=True
    ):
        np.testing.assert_allclose(read(panel, 0.5, 0.6), expected, atol=3)
    # The east's left end is south: it lies low; its foot is on the right. The west's is north.
    dark = read(panels[3], 0.5, 0.6)
    marked = read(panels[2], 0.9, 0.05), read(panels[4], 0.1, 0.95)
    for corner in marked:
        assert np.abs(corner - 255 * 0.075).max() < 8 or np.abs(corner - dark).max() < 8
    assert (np.abs(pixels - (200, 30, 30)).max(-1) < 2).sum() > 500  # the logo


@pytest.mark.parametrize("paper", PAPERS)
def test_a_small_plan_with_towers_leaves_no_quarter_of_the_page_empty(paper):
    sizes = [(200, 207), (150, 207)] * 2
    arrangement = arrange((200, 150), (200, 150), sizes, paper)
    assert not arrangement.has_row
    maps = [("Plan", *make_map(200, 150, 0.0, cell=5.0))]
    for side, size in zip(SIDES, sizes, strict=True):
        maps.append((f"{side} elevation", *make_map(*size, 4.0, ("", "z [m]"), cell=5.0)))
    mask = np.ones((30, 40), bool)
    moments = [(f"{hour:02}:00", mask) for hour in range(9, 18)]
    sun = SunRose(np.array([(120.0, 20.0), (180.0, 40.0)]), [("09", 120.0, 20.0)])
    content = SheetContent((0.0, 0.0), moments, maps[0][1], sun)
    sheet = make_elevations_sheet(arrangement, maps, 8.0, content=content)
    types = {text.get_text(): text.get_fontsize() for text in sheet.leaf.findobj(Text)}
    assert {name for name, _ in moments} <= types.keys()
    larger = 2**0.5 if paper == "a1" else 1
    assert types["house"] == pytest.approx(TITLE * larger, rel=1e-3)
    assert types["hours in shadow"] == pytest.approx(KEY_TITLE * larger, rel=1e-3)
    for name in ("8 h", "y [m]", "z [m]", "100", "0"):  # of the key, axes and the scale bar
        assert types[name] == pytest.approx(SMALL * larger, rel=1e-3)
    ink = (sheet.leaf.render() < 250).any(-1)
    side = round(5 / 25.4 * DOTS_PER_INCH) * (2 if paper == "a1" else 1)
    rows, cols = (n // side for n in ink.shape)
    used = ink[: rows * side, : cols * side].reshape(rows, side, cols, side).any((1, 3))
    around = np.pad(used, 1)
    near = [around[1 + i :][:rows, 1 + j :][:, :cols] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    assert 1 - np.any(near, 0).mean() < 0.25
