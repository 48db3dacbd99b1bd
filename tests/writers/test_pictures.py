"""Pictures: nothing clipped, nothing over anything else, known colours at known places."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.text import Text
from PIL import Image

from umbra.scene.grid import Places
from umbra.writers.contours import Tracer, find_levels, trace
from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.picture_content import (
    DOTS_PER_INCH,
    MISSING,
    DayMap,
    DayShadows,
    Plan,
    find_map_size,
    shade_roofs,
)
from umbra.writers.pixels import (
    SHADE_STOPS,
    PackedMasks,
    make_ramp,
    make_stamp_tints,
    resample,
    shade_ramp,
    write_png,
)
from umbra.writers.point_map import make_points_sheet
from umbra.writers.profile import (
    compose_profile,
    make_profile_sheet,
)
from umbra.writers.sheet import lay_out_sheet

WORDS = {
    "title": "Neubau Hardturm",
    "place": "48.200° N, 16.370° E · Europe/Vienna",
    "date": "18 September 2026, 09:00 to 17:00 CEST",
    "note": "umbra 0.1.0 · cell 0.5 m · midpoints of 15 min steps · refraction standard",
}
LONG = {
    "title": "A_very_long_name_without_a_single_space_" * 4 + "$5_a$.city.jsonl",
    "place": "48.200° N, 16.370° E · America/Argentina/Buenos_Aires",
    "date": "18 September 2026, 09:00 to 17:00 GMT-3",
    "note": "umbra 0.1.0 · " * 20,
}


def make_plan(rows=60, cols=80, cell=0.5, origin=(0.0, 0.0), north=0.0, words=None):
    """Make a plan with one building in its middle third."""
    x, y = (o + cell * (np.arange(n) + 0.5) for o, n in zip(origin, (cols, rows), strict=True))
    height = np.full((rows, cols), np.nan, np.float32)
    height[rows // 3 : -(-2 * rows // 3), cols // 3 : -(-2 * cols // 3)] = 12.0
    return Plan(x, y, height, north, **(WORDS if words is None else words))


def on_roofs(plan):
    """The plan of a study of whatever is topmost."""
    return replace(plan, roofs_cover=False)


def make_hours(plan, most=8.0):
    """Make hours that fall from the building's north side, in steps of a quarter hour."""
    rows, cols = plan.shape
    r, c = np.mgrid[:rows, :cols]
    away = np.hypot((r - rows / 2) / rows, (c - cols / 2) / cols)
    return (np.floor(np.clip(1 - 2 * away, 0, 1) * most * 4) / 4).astype(np.float32)


def make_shadows(plan, n):
    rows, cols = plan.shape
    for i in range(n):
        mask = np.zeros((rows, cols), bool)
        mask[rows // 3 :, i * cols // (2 * n) : cols // 2 + i * cols // (2 * n)] = True
        yield mask


def clock(n):
    return [f"{9 + i // 4:02d}:{15 * (i % 4):02d}" for i in range(n)]


def check_layout(sheet):
    """Every text and image lies on the paper; no two of them share a place."""
    renderer = sheet.leaf.make_renderer()
    width, height = renderer.get_canvas_width_height()
    boxes = []
    texts = sheet.leaf.findobj(Text)
    for text in texts:
        if text.get_text():
            box = text.get_window_extent(renderer)
            boxes.append((text.get_text(), box.x0, box.y0, box.x1, box.y1))
    x, y, w, h = (v * DOTS_PER_INCH for v in sheet.map_box)
    for pixels in (one for one in sheet.leaf.artists if hasattr(one, "image")):
        (left, bottom), (rows, cols) = pixels.place, pixels.image.shape[:2]
        boxes.append(("image", left, bottom, left + cols, bottom + rows))
    for filled in sheet.leaf.findobj(PolyCollection):
        for polygon in filled.get_paths():
            if len(polygon.vertices) == 5:  # a rectangle, closed; not the arrow
                (x0, y0), (x1, y1) = polygon.vertices.min(0), polygon.vertices.max(0)
                boxes.append(("box", *(v * DOTS_PER_INCH for v in (x0, y0, x1, y1))))
    assert len(boxes) > 6
    assert width >= 4 * DOTS_PER_INCH  # room for words, however narrow the plan
    for name, x0, y0, x1, y1 in boxes:
        inside = x0 >= 4 and y0 >= 4 and x1 <= width - 4 and y1 <= height - 4
        assert inside, f"{name!r} leaves the paper: {x0, y0, x1, y1} of {width, height}"
    for (a, ax0, ay0, ax1, ay1), (b, bx0, by0, bx1, by1) in itertools.combinations(boxes, 2):
        on_map = ax0 >= x and ax1 <= x + w and ay0 >= y and ay1 <= y + h
        if b == "image" and on_map:
            continue  # a contour's label
        apart = ax1 <= bx0 + 1 or bx1 <= ax0 + 1 or ay1 <= by0 + 1 or by1 <= ay0 + 1
        assert apart, f"{a!r} and {b!r} overlap"
    return {text.get_text() for text in texts}


LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SHAPES = [(60, 80), (600, 60), (60, 600), (300, 900), (4, 4), (1, 1), (1, 40), (700, 700)]
LARGE = (2_683_000.0, 1_247_000.0)


@pytest.mark.parametrize(
    ("origin", "words"), [(LARGE, LONG), ((-310.0, -50.0), {})], ids=["long", "none"]
)
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_hours_are_laid_out_well_in_every_shape(shape, origin, words):
    plan = make_plan(*shape, origin=origin, north=-25, words=words)
    texts = check_layout(make_hours_sheet(plan, [DayMap(make_hours(plan))], 8.0))
    assert {"x [m]", "y [m]", "hours in shadow", "N", "8 h"} <= texts


@pytest.mark.parametrize(("n", "words"), [(1, WORDS), (12, LONG), (13, WORDS), (97, LONG)])
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_profiles_are_laid_out_well_in_every_shape(shape, n, words):
    plan = make_plan(*shape, origin=LARGE, north=170, words=words)
    away = np.array([(1.0, 0.2)] * n)
    sheet = make_profile_sheet(plan, [DayShadows(make_shadows(plan, n), clock(n), away)], "CEST")
    texts = check_layout(sheet)
    assert any("CEST" in text for text in texts)
    assert "09:00" in texts


def test_a_title_is_whole_and_its_dollars_are_dollars():
    sheet = lay_out_sheet(make_plan(words=LONG), 0.5)
    texts = [t.get_text() for t in sheet.leaf.findobj(Text)]
    assert LONG["title"] in "".join(texts)
    assert not any(t.get_parse_math() for t in sheet.leaf.findobj(Text) if t.get_text())


@pytest.mark.parametrize(("max_hours", "ticks"), [(0.75, "45 min"), (2.5, "2 h"), (24, "24 h")])
def test_the_scale_ends_where_the_period_does(max_hours, ticks):
    plan = make_plan()
    assert ticks in check_layout(
        make_hours_sheet(plan, [DayMap(make_hours(plan, max_hours))], max_hours)
    )


def test_a_night_says_so_and_has_no_scale_nor_the_colour_of_sun(tmp_path):
    plan, place = make_plan(), np.array([(5.0, 5.0, 0.0)])
    nothing = np.zeros(plan.shape, np.float32)
    point = Places(place, np.full((1, 3), np.nan))
    day, night = DayMap(nothing), DayMap(nothing, is_night=True)
    shadows = DayShadows(make_shadows(plan, 1), clock(1), is_night=True)
    for sheet in (
        make_hours_sheet(plan, [day], 0.0),
        make_profile_sheet(plan, [shadows]),
        make_points_sheet(plan, point, [DayMap(nothing[0, :1])], 0.0),
        make_points_sheet(plan, point, [DayMap(nothing[0, :1], is_night=True)], 8.0),
    ):
        texts = check_layout(sheet)
        assert "the sun stays below the horizon" in texts
    both = make_hours_sheet(plan, [replace(day, title="June"), replace(night, title="May")], 8.0)
    assert "the sun stays below the horizon" in [t.get_text() for t in both.leaf.findobj(Text)]
    both.save(tmp_path / "hours.png")
    june, may = (read_pixel(tmp_path / "hours.png", panel, 5.0, 5.0) for panel in both.maps)
    np.testing.assert_allclose(june, shade_ramp()[0] * 255, atol=1)
    np.testing.assert_allclose(may, 255 * MISSING, atol=1)


def read_pixel(path, sheet, x, y):
    """Read a PNG's pixel at a place in model coordinates."""
    with Image.open(path) as image:
        across, up = sheet.place((x, y)) * DOTS_PER_INCH
        return np.array(image.getpixel((int(across), image.height - 1 - int(up))), float)


def test_hours_have_the_scales_colours_and_roofs_are_grey(tmp_path):
    plan = make_plan()
    hours = np.zeros(plan.shape, np.float32)
    hours[:, 60:] = 8.0
    hours[50:, :20] = np.nan
    make_hours_sheet(plan, [DayMap(hours)], 8.0).save(tmp_path / "hours.png")
    sheet = make_hours_sheet(plan, [DayMap(hours)], 8.0)
    ramp = shade_ramp() * 255
    with Image.open(tmp_path / "hours.png") as image:
        assert image.format == "PNG"
        assert image.mode == "RGB"
        assert image.size == sheet.leaf.make_renderer().get_canvas_width_height()
        assert image.info["dpi"] == pytest.approx((150, 150), abs=0.1)
    west, east, north_west = ((5.0, 5.0), (35.0, 5.0), (5.0, 28.0))
    np.testing.assert_allclose(read_pixel(tmp_path / "hours.png", sheet, *west), ramp[0], atol=1)
    np.testing.assert_allclose(read_pixel(tmp_path / "hours.png", sheet, *east), ramp[-1], atol=1)
    gap = read_pixel(tmp_path / "hours.png", sheet, *north_west)
    np.testing.assert_allclose(gap, 255 * MISSING, atol=1)
    roof = read_pixel(tmp_path / "hours.png", sheet, 18.0, 14.0)
    assert np.ptp(roof) <= 1
    assert 190 < roof[0] < 240

    make_hours_sheet(on_roofs(plan), [DayMap(hours)], 8.0).save(tmp_path / "top.png")
    np.testing.assert_allclose(read_pixel(tmp_path / "top.png", sheet, 18.0, 14.0), ramp[0], atol=1)


def test_both_pictures_name_where_there_is_no_surface_and_draw_it_alike(tmp_path):
    plan = make_plan()
    nothing = np.zeros(plan.shape, np.bool_)
    nothing[:10, :20] = True
    plan = replace(plan, nothing=nothing)
    hours = np.where(nothing, np.nan, np.float32(2))
    for sheet in (
        make_hours_sheet(plan, [DayMap(hours)], 8.0),
        make_profile_sheet(plan, [DayShadows([np.zeros(plan.shape, bool)], ["09:00"])]),
    ):
        assert "no surface here" in check_layout(sheet)
        sheet.save(tmp_path / "a.png")
        found = read_pixel(tmp_path / "a.png", sheet, 4.0, 3.0)
        np.testing.assert_allclose(found, 255 * MISSING, atol=1)


def test_overlapping_shadows_are_darker_and_roofs_lie_on_top(tmp_path):
    plan = make_plan()
    first, second = np.zeros((2, *plan.shape), bool)
    first[:10, :40] = True
    second[:10, 20:] = True
    first[20:40] = True
    make_profile_sheet(plan, [DayShadows(iter([first, second]), ["09:00", "10:00"])]).save(
        tmp_path / "profile.png"
    )
    sheet = make_profile_sheet(plan, [DayShadows([first, second], ["09:00", "10:00"])])
    check_layout(sheet)
    one, both, other, bare, roof = (
        read_pixel(tmp_path / "profile.png", sheet, x, y)
        for x, y in [(5, 2.5), (15, 2.5), (30, 2.5), (5, 27), (20, 15)]
    )
    assert (bare == 255).all()
    assert both @ LUMINANCE < min(one @ LUMINANCE, other @ LUMINANCE) - 10
    assert np.ptp(both) < 8  # all day long is no hour's colour
    assert np.abs(one - other).max() > 60  # stamps tell apart
    assert np.ptp(roof) <= 1
    assert roof[0] > 190

    make_profile_sheet(on_roofs(plan), [DayShadows([first, second], ["09:00", "10:00"])]).save(
        tmp_path / "top.png"
    )
    on_roof = read_pixel(tmp_path / "top.png", sheet, 20, 15)
    assert np.ptp(on_roof) > 20  # shadow falls on the roof


def test_the_legend_shows_the_colours_of_single_stamps():
    n = 9
    masks = [np.full((2, n), False) for _ in range(n)]
    for i, mask in enumerate(masks):
        mask[:, i] = True
    alone = compose_profile(masks, n, (2, n))[0]
    plan = make_plan()
    sheet = make_profile_sheet(plan, [DayShadows(make_shadows(plan, n), clock(n))])
    swatches = [
        artist.get_facecolor()[:, :3]
        for artist in sheet.leaf.artists
        if isinstance(artist, PolyCollection) and len(artist.get_paths()) == n
    ]
    assert len(swatches) == 1
    np.testing.assert_allclose(swatches[0], alone, atol=0.03)


def test_darkness_grows_with_every_layer_and_never_ends_in_black():
    n = 40
    one = np.ones((1, 1), bool)
    zero = np.zeros((1, 1), bool)
    depth = [compose_profile([one] * k + [zero] * (n - k), n, (1, 1))[0, 0] for k in range(n + 1)]
    luminance = np.array(depth) @ LUMINANCE
    assert (np.diff(luminance) < 0).all()
    assert (depth[0] == 1).all()
    assert luminance[1] < 0.95
    assert 0.3 < luminance[-1] < 0.45  # dark, and still a grey that lines and roofs stand out from
    assert luminance[16] - luminance[32] > 0.05  # between high buildings counts still tell apart


def test_a_shadow_keeps_the_hue_of_its_hours():
    masks = np.zeros((33, 1, 3), bool)
    masks[:6, 0, 0] = masks[-6:, 0, 2] = masks[6:-6, 0, 1] = True
    morning, _, evening = compose_profile(masks, 33, (1, 3))[0]
    assert morning[0] > morning[2] + 0.1  # yellow
    assert evening[2] > evening[0] + 0.05  # violet
    assert evening[2] > evening[1] + 0.1


@pytest.mark.parametrize(("shape", "n"), [((60, 80), 4), ((600, 60), 2), ((60, 600), 12)])
def test_several_dates_have_a_panel_each(shape, n):
    plan = make_plan(*shape, origin=LARGE, words=WORDS)
    dates = [f"2026-{month + 1:02d}-21" for month in range(n)]
    masks = np.zeros((n, 9, *shape), bool)
    for k in range(n):
        masks[k, :, : shape[0] // 4, : (k + 1) * shape[1] // n] = True
    days = [DayShadows(masks[k], clock(9), title=date) for k, date in enumerate(dates)]
    sheet = make_profile_sheet(plan, days, "CET/CEST")
    panels = sheet.panels
    texts = check_layout(sheet)
    assert {*dates, "09:00", "11:00", "N", "local time (CET/CEST)"} <= texts
    assert not {"x [m]", "y [m]"} & texts
    assert len(panels) == len({panel.map_box[:2] for panel in panels}) == n
    pixels = sheet.leaf.render()[::-1]
    for k, panel in enumerate(panels):  # each shows its own date's shadows
        rows, cols = panel.map_size
        left, bottom = (round(v * DOTS_PER_INCH) for v in panel.map_box[:2])
        line = pixels[bottom + rows // 8, left : left + cols]
        share = (line.mean(-1) < 240).mean()
        assert share == pytest.approx((k + 1) / n, abs=0.03)


def test_shadows_and_labels_must_match():
    plan = make_plan()
    for n in (2, 4):
        with pytest.raises(ValueError, match=f"{n} shadows for 3 labels"):
            make_profile_sheet(plan, [DayShadows(make_shadows(plan, n), clock(3))])


@pytest.mark.parametrize("wrong", [(3, 4), (80, 60)])
def test_arrays_must_fit_the_plan(wrong):
    plan = make_plan()
    with pytest.raises(ValueError, match="the plan is"):
        make_hours_sheet(plan, [DayMap(np.zeros(wrong))], 8.0)
    with pytest.raises(ValueError, match="the plan is"):
        Plan(plan.x, plan.y, np.zeros(wrong))


def test_the_arrow_points_to_true_north():
    sheet = lay_out_sheet(make_plan(north=90), 0.5)
    letter = next(t for t in sheet.leaf.findobj(Text) if t.get_text() == "N")
    upright = lay_out_sheet(make_plan(north=0), 0.5)
    above = next(t for t in upright.leaf.findobj(Text) if t.get_text() == "N")
    (x0, y0), (x1, y1) = letter.get_position(), above.get_position()
    assert x0 - x1 == pytest.approx(0.29)  # clockwise: to the right
    assert y1 - y0 == pytest.approx(0.29)


def test_north_is_up_and_rows_ascend(tmp_path):
    plan = Plan(np.arange(30.0), np.arange(20.0))
    hours = np.zeros(plan.shape, np.float32)
    hours[-5:, :5] = 8.0
    make_hours_sheet(plan, [DayMap(hours)], 8.0).save(tmp_path / "hours.png")
    with Image.open(tmp_path / "hours.png") as image:
        pixels = np.asarray(image.convert("L")).astype(int)
    sheet = lay_out_sheet(plan, 0.5)
    left, bottom, _, h = (round(v * DOTS_PER_INCH) for v in sheet.map_box)
    top = len(pixels) - bottom - h
    assert pixels[top + 20, left + 20] < 80
    assert pixels[top + h - 20, left + 20] > 220


def test_contours_enclose_at_least_so_many_hours():
    # A step from exactly 2 h to 1.75 h at x = 20 m: the 2 h line is that step.
    plan = Plan(np.arange(40) + 0.5, np.arange(30) + 0.5)
    hours = np.full(plan.shape, 1.75)
    hours[:, :20] = 2.0
    sheet = lay_out_sheet(plan, 0.5)
    (line,) = trace(sheet, hours >= 2 - 1e-3)
    expected = sheet.place((20.0, 0.0))[0]
    np.testing.assert_allclose(line[:, 0], expected, atol=0.01)
    assert np.ptp(line[:, 1]) >= sheet.map_box[3] - 0.01  # right across the map


def test_contours_end_at_hidden_cells_and_do_not_follow_them():
    plan = Plan(np.arange(300) + 0.5, np.arange(300) + 0.5)
    hours = np.zeros(plan.shape)
    hours[:150] = 2.0
    hidden = np.zeros(plan.shape, bool)
    hidden[100:200, 100:200] = True
    hours[hidden] = np.nan
    sheet = lay_out_sheet(plan, 0.5)
    lines = Tracer(sheet, hidden).trace(hours >= 1)
    assert len(lines) == 2
    for line in lines:
        np.testing.assert_allclose(line[:, 1], sheet.place((0.0, 150.0))[1], atol=0.02)
    (left, _), (right, _) = sheet.place((100, 0)), sheet.place((200, 0))
    inner = sorted(np.concatenate(lines)[:, 0])
    assert max(x for x in inner if x < (left + right) / 2) == pytest.approx(left, abs=0.03)
    assert min(x for x in inner if x > (left + right) / 2) == pytest.approx(right, abs=0.03)


def find_labels(sheet):
    return [
        t for t in sheet.leaf.findobj(Text) if t.get_text().endswith(" h") and t.get_path_effects()
    ]


def test_no_label_covers_a_roof():
    plan = make_plan(300, 400)
    near = np.zeros(plan.shape, np.float32)
    near[98:202, 131:269] = 3.0  # two cells wider than the roof: too narrow for a label
    assert not find_labels(make_hours_sheet(plan, [DayMap(near)], 3.0))
    assert find_labels(make_hours_sheet(on_roofs(plan), [DayMap(near)], 3.0))


@pytest.mark.parametrize(
    ("max_hours", "levels"),
    [(0, []), (0.9, []), (1, [1]), (2.5, [1, 2]), (8, list(range(1, 9))), (9, [2, 4, 6, 8]),
     (24, [3, 6, 9, 12, 15, 18, 21, 24]), (float("nan"), [])],
)  # fmt: skip
def test_levels_are_whole_hours_and_few(max_hours, levels):
    assert find_levels(max_hours) == levels


def test_labels_keep_off_roofs_and_edges():
    plan = make_plan(300, 400)
    sheet = make_hours_sheet(plan, [DayMap(make_hours(plan))], 8.0)
    labels = find_labels(sheet)
    assert len(labels) >= 3
    x, y, w, h = sheet.map_box
    for label in labels:
        at = (np.array(label.get_position()) - (x, y)) / (w, h)
        assert not ((at > 1 / 3) & (at < 2 / 3)).all()
        assert ((at > 0.02) & (at < 0.98)).all()


def test_resampling_keeps_the_mean_and_the_cells():
    values = np.random.default_rng(1).random((300, 400)).astype(np.float32)
    assert resample(values, (70, 90)).mean() == pytest.approx(values.mean(), abs=2e-3)
    np.testing.assert_array_equal(
        resample(values[:3, :4], (30, 40)), values[:3, :4].repeat(10, 0).repeat(10, 1)
    )
    stripes = np.arange(300)[:, None] % 2 + np.zeros((300, 300), np.float32)
    for view in (stripes, stripes.T, stripes > 0, stripes.T > 0):
        np.testing.assert_allclose(resample(view, (50, 60)), 0.5, atol=0.08)
    holes = values.copy()
    holes[:, :200] = np.nan
    small = resample(holes, (30, 40))
    assert np.isnan(small[:, :19]).all()
    assert np.isfinite(small[:, 21:]).all()
    flat = np.where(values < 0.3, np.float32(np.nan), np.float32(1))
    np.testing.assert_allclose(resample(flat, (30, 40)), 1, atol=1e-5)  # holes weigh nothing


def test_masks_come_back_from_their_bits():
    masks = list(np.random.default_rng(2).random((5, 7, 9)) > 0.5)
    packed = PackedMasks(iter(masks))
    assert len(packed) == 5
    for _ in range(2):
        np.testing.assert_array_equal(list(packed), masks)


def test_hours_colours_fall_evenly_in_lightness():
    luma = shade_ramp() @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luma) < 0).all()
    assert luma[0] > 0.9
    assert luma[-1] < 0.2
    assert len(SHADE_STOPS) > 2


def test_ramps_start_and_end_at_their_stops():
    # White, grey and black of OKLab (grey: the cube of 0.5 in linear light is 99 of 255 in
    # sRGB), and sRGB's red: its published OKLCh.
    ramp = make_ramp([(1, 0, 0), (0, 0, 0)], [0, 0.5, 1])
    np.testing.assert_allclose(ramp, [[1] * 3, [99 / 255] * 3, [0] * 3], atol=2e-3)
    red = make_ramp([(0.62796, 0.25768, 29.234), (0, 0, 29.234)], [0])
    np.testing.assert_allclose(red, [[1, 0, 0]], atol=5e-3)


def test_tints_of_a_day_all_differ():
    tints = make_stamp_tints(12)
    for a, b in itertools.combinations(tints, 2):
        assert np.abs(a - b).max() > 0.03
    assert make_stamp_tints(1).shape == (1, 3)


def test_roofs_are_shaded_only_where_they_stand():
    plan = make_plan(300, 300)
    size = find_map_size(plan)
    grey, coverage = shade_roofs(plan, size)
    assert grey.shape == coverage.shape == size
    assert coverage[size[0] // 2, size[1] // 2] == 1
    assert coverage[5, 5] == 0
    assert coverage.mean() == pytest.approx(1 / 9, abs=2e-3)


def test_roofs_that_face_the_upper_left_are_bright():
    x, y = np.meshgrid(np.arange(60.0), np.arange(60.0))
    ridge = 50 - 0.5 * np.abs(x - y)  # runs up to the right; falls to both sides
    grey, _ = shade_roofs(Plan(x[0], y[:, 0], ridge), (60, 60))
    upper_left, lower_right = grey[45, 15], grey[15, 45]
    assert upper_left > 0.89
    assert lower_right < 0.82


def test_frames_are_written_top_row_first(tmp_path):
    frame = np.zeros((3, 5, 3), np.uint8)
    frame[0, 4] = [10, 20, 30]
    write_png(tmp_path / "frame.png", frame)
    with Image.open(tmp_path / "frame.png") as image:
        assert image.size == (5, 3)
        assert image.getpixel((4, 0)) == (10, 20, 30)
        np.testing.assert_array_equal(np.asarray(image), frame)
    clear = np.arange(3 * 5 * 4, dtype=np.uint8).reshape(3, 5, 4)
    for some, mode in ((clear, "RGBA"), (clear[..., :2], "LA")):
        write_png(tmp_path / "clear.png", some, 254)
        with Image.open(tmp_path / "clear.png") as image:
            assert (image.mode, image.info["dpi"]) == (mode, (254, 254))
            np.testing.assert_array_equal(np.asarray(image), some)
    for wrong in (frame[..., 0], frame.astype(float), np.zeros((3, 5, 1), np.uint8)):
        with pytest.raises(ValueError, match="uint8"):
            write_png(tmp_path / "wrong.png", wrong)
    assert not (tmp_path / "wrong.png").exists()


def test_points_have_the_colours_of_their_hours_and_their_names(tmp_path):
    plan = make_plan(300, 400)  # a house from x = 66.5 to 133.5 m, y = 50 to 100 m
    points = np.array([(20, 20, 1.5), (180, 20, 1.5), (134, 75, 8), (134, 75, 2), (134, 75, 5)])
    normals = np.full((5, 3), np.nan)
    normals[2:] = (1, 0, 0)
    hours = np.array([0.0, 8.0, 2.0, 6.0, 4.0], np.float32)
    names = ["garden", "yard", "third", "ground", "first"]
    sheet = make_points_sheet(plan, Places(points, normals), [DayMap(hours)], 8.0, names)
    sheet.save(tmp_path / "points.png")
    texts = check_layout(sheet)
    assert {"garden: 0 h", "yard: 8 h", "ground: 6 h", "first: 4 h", "third: 2 h", "N"} <= texts
    ramp = shade_ramp() * 255
    for (x, y, _), index in ((points[0], 0), (points[1], -1)):
        found = read_pixel(tmp_path / "points.png", sheet, x, y)
        np.testing.assert_allclose(found, ramp[index], atol=2)
    discs = next(
        artist for artist in sheet.leaf.artists
        if isinstance(artist, PolyCollection) and len(artist.get_paths()) == 5
    )  # fmt: skip
    middles = np.array([path.vertices[:-1].mean(0) for path in discs.get_paths()])
    wall = sheet.place((134, 75))
    # Three floors side by side, outward from the wall, the lowest first.
    assert wall[0] < middles[3, 0] < middles[4, 0] < middles[2, 0]
    np.testing.assert_allclose(middles[2:, 1], wall[1], atol=1e-6)
    gaps = np.diff(sorted(middles[2:, 0]))
    width = np.ptp(discs.get_paths()[0].vertices[:, 0])
    assert (gaps >= width).all()


def test_many_points_have_no_labels():
    plan = make_plan(300, 400)
    points = np.random.default_rng(0).random((500, 3)) * [190, 140, 3]
    normals = np.full((500, 3), np.nan)
    sheet = make_points_sheet(
        plan, Places(points, normals), [DayMap(np.ones(500, np.float32))], 8.0
    )
    assert not any(": 1 h" in text for text in (t.get_text() for t in sheet.leaf.findobj(Text)))
    few = make_points_sheet(
        plan, Places(points[:9], normals[:9]), [DayMap(np.ones(9, np.float32))], 8.0
    )
    assert {f"{k + 1}: 1 h" for k in range(9)} <= check_layout(few)


@pytest.mark.parametrize(("shape", "n"), [((60, 80), 3), ((600, 60), 2), ((60, 600), 12)])
def test_hours_of_several_dates_are_maps_on_one_scale(shape, n):
    plan = make_plan(*shape, origin=LARGE, words=WORDS)
    hours = [np.full(shape, 8.0 * (k + 1) / n, np.float32) for k in range(n)]
    days = [
        DayMap(h, f"2026-{k + 1:02d}-21", "sunrise 07:42, sunset 16:03 · newly under 2 h: 712 m²")
        for k, h in enumerate(hours)
    ]
    sheet = make_hours_sheet(on_roofs(plan), days, 8.0, hatch="newly under 2 h")
    panels = sheet.panels
    texts = check_layout(sheet)
    assert {*(day.title for day in days), "hours in shadow", "8 h", "newly under 2 h"} <= texts
    assert sum(text.startswith("sunrise 07:42") for text in texts) == 1  # the same for each here
    pixels = sheet.leaf.render()[::-1].astype(float)
    ramp = 255 * shade_ramp()
    for k, panel in enumerate(panels):
        x, y, w, h = panel.map_box
        at = pixels[round((y + h / 8) * DOTS_PER_INCH), round((x + w / 8) * DOTS_PER_INCH)]
        wanted = ramp[round((len(ramp) - 1) * (k + 1) / n)]
        np.testing.assert_allclose(at, wanted, atol=3)
    with pytest.raises(ValueError, match="2026-01-21 are"):
        make_hours_sheet(plan, [replace(days[0], hours=hours[0][1:])], 8.0)


def test_what_is_newly_under_is_hatched_where_it_is_and_told_in_the_key():
    plan = make_plan(300, 400)
    newly = np.zeros(plan.shape, bool)
    newly[20:80, 40:120] = True
    lost = np.full(plan.shape, 8.0, np.float32)
    drawn = []
    for hatched in (np.zeros_like(newly), newly):
        sheet = make_hours_sheet(
            on_roofs(plan), [DayMap(lost, hatched=hatched)], 8.0, hatch="newly under 2 h"
        )
        assert any("newly under 2 h" in text for text in check_layout(sheet))
        drawn.append(sheet.leaf.render()[::-1].astype(float))
    left, bottom = (round(v * DOTS_PER_INCH) for v in sheet.map_box[:2])
    rows, cols = sheet.map_size
    plain, hatch = (d[bottom : bottom + rows, left : left + cols].mean(-1) for d in drawn)
    inside = resample(newly, sheet.map_size) > 0.999
    changed = np.abs(hatch - plain) > 8
    # Dark lines with light rims are seen on the scale's darkest colour, over most of the region.
    assert 0.2 < changed[inside].mean() < 0.7
    assert (hatch - plain)[inside].max() > 60
    rows, cols = (np.flatnonzero(changed.any(axis)) for axis in (1, 0))
    for ends, side in ((rows, inside.any(1)), (cols, inside.any(0))):
        where = np.flatnonzero(side)  # the border is drawn upon the edge
        assert where[0] - 4 <= ends[0]
        assert ends[-1] <= where[-1] + 4


def test_what_is_proposed_is_named_and_outlined_in_red():
    plan = make_plan(300, 400)
    new = np.zeros(plan.shape, bool)
    new[200:260, 300:360] = True  # from x = 150 to 180 m, y = 100 to 130 m
    lost = np.where(new, np.nan, make_hours(plan)).astype(np.float32)
    sheet = make_hours_sheet(
        replace(plan, proposed=new),
        [DayMap(lost)],
        8.0,
        what="hours of sun lost to Tower and Church-nave",
    )
    texts = check_layout(sheet)
    assert "outlined in red: proposed" in texts
    key = " ".join(t.get_text() for t in sheet.leaf.findobj(Text))
    assert "hours of sun lost to" in key
    assert "Church-nave" in key
    pixels = sheet.leaf.render()[::-1].astype(int)
    across, up = (round(v) for v in sheet.place((150.0, 115.0)) * DOTS_PER_INCH)
    border = pixels[up, across - 4 : across + 5]
    assert (border[:, 0] - border[:, 2]).max() > 120  # red at its western wall
    inside = pixels[up, across + 20]
    assert np.ptp(inside) < 10


def test_a_plan_is_cropped_with_all_that_lies_on_it():
    plan = replace(make_plan(60, 80), proposed=np.zeros((60, 80), bool))
    part = plan.crop((slice(20, 40), slice(10, 50)))
    assert part.shape == (20, 40)
    assert (part.x[0], part.y[0]) == (plan.x[10], plan.y[20])
    np.testing.assert_array_equal(part.building_height, plan.building_height[20:40, 10:50])
    assert part.proposed.shape == part.shape
    assert part.title == plan.title


def test_a_low_map_tells_two_heights_at_least():
    plan = Plan(
        457_780 + 0.2 * np.arange(1900), 3.45 + 0.2 * np.arange(61), axes=("a [m]", "z [m]")
    )
    texts = check_layout(make_hours_sheet(on_roofs(plan), [DayMap(np.zeros(plan.shape))], 8.0))
    assert {"5", "10", "15"} <= texts


def test_a_hatch_leaves_the_hours_of_small_facades_visible():
    plan = on_roofs(make_plan(300, 400))
    lost = np.full(plan.shape, 6.0, np.float32)
    rows, cols = find_map_size(plan)
    shares = {}
    for name, side in (("small", 0.02), ("large", 0.5)):
        hatched = np.zeros(plan.shape, bool)
        high, wide = (round(side * n) for n in plan.shape)
        hatched[9 : 9 + high, 9 : 9 + wide] = True
        drawn = []
        for some in (np.zeros_like(hatched), hatched):
            sheet = make_hours_sheet(plan, [DayMap(lost, hatched=some)], 8.0, has_lines=False)
            left, bottom = (round(v * DOTS_PER_INCH) for v in sheet.map_box[:2])
            pixels = sheet.leaf.render()[::-1].astype(int)
            drawn.append(pixels[bottom : bottom + rows, left : left + cols])
        hidden = np.abs(drawn[1] - drawn[0]).max(-1) > 25
        shares[name] = hidden.sum() / (hatched.mean() * rows * cols)
    assert 0.05 < shares["small"] < 0.4  # bold lines and their border: 1.04
    assert 0.1 < shares["large"] < 0.42
