"""What pictures show besides hours is named in their key, and no colour of the scale."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text

from umbra.writers.contours import find_swatches
from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.picture_content import (
    DOTS_PER_INCH,
    MISSING,
    SKY,
    Appearance,
    DayMap,
    DayShadows,
    Plan,
    find_map_size,
)
from umbra.writers.pixels import shade_ramp
from umbra.writers.profile import make_profile_sheet

PLAN = Plan(np.arange(0.25, 40, 0.5), np.arange(0.25, 30, 0.5), None, None, title="house")
CROWN = np.zeros(PLAN.shape, bool)
CROWN[20:40, 30:50] = True


def find_texts(sheet):
    return " ".join(text.get_text() for text in sheet.leaf.findobj(Text))


def read_map(sheet):
    pixels = sheet.leaf.render()[::-1] / 255
    x, y, w, h = (round(v * DOTS_PER_INCH) for v in sheet.map_box)
    return pixels[y : y + h, x : x + w]


@pytest.mark.parametrize("hours", [0.0, 8.0])
def test_canopies_are_hatched_outlined_and_named(hours):
    plan = replace(PLAN, canopies=CROWN, canopy_name="Tree*, see-through")
    values = np.full(PLAN.shape, hours, np.float32)
    sheet, bare = (
        make_hours_sheet(plan, [DayMap(values)], 8.0),
        make_hours_sheet(PLAN, [DayMap(values)], 8.0),
    )
    assert "Tree*, see-through" in find_texts(sheet)
    assert "see-through" not in find_texts(bare)
    drawn = np.abs(read_map(sheet) - read_map(bare)).max(-1) > 0.1
    rows, cols = drawn.shape
    inside = drawn[round(rows * 0.4) : round(rows * 0.6), round(cols * 0.42) : round(cols * 0.58)]
    assert 0.08 < inside.mean() < 0.2  # lines, and the hours between them
    assert drawn[round(rows / 3) - 3 : round(rows / 3) + 4, cols // 2].any()
    assert not drawn[: rows // 4].any()


def test_a_profile_names_its_canopies():
    plan = replace(PLAN, canopies=CROWN, canopy_name="trees, see-through")
    for n in (3, 20):
        sheet = make_profile_sheet(
            plan, [DayShadows([CROWN] * n, [f"{k:02}:00" for k in range(n)])]
        )
        assert "trees, see-through" in find_texts(sheet)


def test_the_sky_is_named_and_no_colour_of_the_scale():
    size = find_map_size(PLAN)
    none = np.zeros(size, np.uint8)
    sky = none.copy()
    sky[size[0] // 2 :] = 255
    plan = replace(PLAN, appearance=Appearance(none + 255, none, none, none, sky))
    values = np.zeros(PLAN.shape, np.float32)
    values[30:] = np.nan
    sheet = make_hours_sheet(plan, [DayMap(values)], 8.0)
    assert "sky: no hours" in find_texts(sheet)
    pixels = read_map(sheet)
    np.testing.assert_allclose(pixels[-30, 50], SKY, atol=0.01)
    assert np.abs(shade_ramp() - SKY).max(1).min() > 0.06
    assert not find_swatches(
        [replace(plan, appearance=Appearance(none + 255, none, none, none, none))]
    )


def test_surfaces_without_hours_are_grey_and_named():
    bare = np.zeros(PLAN.shape, np.uint8)
    hours = np.where(CROWN, np.float32(np.nan), np.float32(0))
    look = Appearance(np.full_like(bare, 255), bare, bare, bare)
    plan = replace(PLAN, nothing=CROWN, nothing_name="not asked", appearance=look)
    profile = [DayShadows([~CROWN], ["09:00"])]
    for sheet in (make_hours_sheet(plan, [DayMap(hours)], 8.0), make_profile_sheet(plan, profile)):
        assert "not asked" in find_texts(sheet)
        drawn = read_map(sheet)
        rows, cols, _ = drawn.shape
        np.testing.assert_allclose(drawn[rows // 2, cols // 2], MISSING, atol=1 / 255)
        assert np.abs(drawn[rows // 5, cols // 5] - MISSING).max() > 0.02
