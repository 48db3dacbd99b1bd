"""Views: buildings are recognised by shade and lines, and the legend's colours stay readable."""

import numpy as np
import pytest
from matplotlib.text import Text
from support.shapes import box, sheet

from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.sun import Site
from umbra.writers.edges import find_grid_appearance
from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.picture_content import DOTS_PER_INCH, SKY, DayMap, Plan, find_map_size
from umbra.writers.pixels import shade_ramp

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
NIGHTLESS = {"date": "2026-06-21", "start": "12:00", "end": "14:00", "every": "1h"}


def town():
    """A wide low house, and a high one that stands before half of it, seen from the south."""
    shapes = {"low": box((0, 10, 0), (20, 14, 6)), "high": box((2, 0, 0), (8, 4, 12))}
    return make_scene(parts=[Part(name, "house", Mesh(*mesh)) for name, mesh in shapes.items()])


@pytest.fixture(scope="module")
def south():
    return run_study(town(), VIENNA, receivers="south", cell=0.1, **NIGHTLESS)


def look_at(study):
    plan = Plan(study.x, study.y, np.nan_to_num(study.heights + 1), None, axes=("a [m]", "z [m]"))
    size = find_map_size(plan)
    appearance = find_grid_appearance(study, size)
    return Plan(
        plan.x,
        plan.y,
        plan.building_height,
        None,
        axes=plan.axes,
        appearance=appearance,
        roofs_cover=False,
    ), size


def pixel(plan, size, x, y):
    x0, x1, y0, y1 = plan.extent
    return int((y - y0) / (y1 - y0) * size[0]), int((x - x0) / (x1 - x0) * size[1])


def test_lines_run_where_one_house_ends_before_another(south):
    plan, size = look_at(south)
    appearance = plan.appearance
    row, col = pixel(plan, size, 8.0, 3.0)  # the high house's corner before the low one
    assert appearance.lines[row, col - 3 : col + 4].sum(dtype=int) > 180
    assert appearance.jumps[row, col - 3 : col + 4].sum(dtype=int) > 180
    row, col = pixel(plan, size, 14.0, 3.0)  # amid a wall
    assert not appearance.lines[row - 5 : row + 6, col - 5 : col + 6].any()
    row, col = pixel(plan, size, 14.0, 6.0)  # the low house's eaves against the sky
    assert appearance.lines[row - 3 : row + 4, col].sum(dtype=int) > 180
    assert appearance.sky[pixel(plan, size, 14.0, 9.0)] == 255
    assert appearance.sky[pixel(plan, size, 14.0, 3.0)] == 0


def test_a_facade_keeps_the_legend_s_colours_and_the_sky_is_no_value(south):
    plan, _ = look_at(south)
    sheet = make_hours_sheet(plan, [DayMap(south.shadow_hours)], south.up_hours)
    pixels = sheet.leaf.render()[::-1].astype(float)

    def read(x, y):
        across, up = sheet.place((x, y)) * DOTS_PER_INCH
        return pixels[int(up), int(across)]

    np.testing.assert_allclose(read(5.0, 11.0), shade_ramp()[0] * 255, atol=2)  # sunlit wall
    np.testing.assert_allclose(read(14.0, 9.0), np.array(SKY) * 255, atol=2)


def test_walls_roofs_and_ground_differ_by_luminance_only():
    study = run_study(
        town(), VIENNA, receivers="camera", eye=(-20, -30, 30), target=(8, 6, 0), size=(320, 240),
        **NIGHTLESS,
    )  # fmt: skip
    appearance, part = find_grid_appearance(study, (240, 320)), study.more["part"][1]
    normal = study.more["normal"][1]
    level = normal[..., 2] > 0.99
    shade = appearance.shade.astype(float)

    def inside(mask):
        for axis, shift in ((0, 3), (0, -3), (1, 3), (1, -3)):
            mask = mask & np.roll(mask, shift, axis)
        return mask

    ground, roof = inside(level & (part == -2)), inside(level & (part >= 0))
    south, west = inside(normal[..., 1] < -0.99), inside(normal[..., 0] < -0.99)
    for mask in (ground, roof):
        assert mask.sum() > 50
        assert (shade[mask] > 250).all()  # the legend's own
    for wall in (south, west):
        assert wall.sum() > 50
        assert shade[wall].mean() < 250
        assert np.ptp(shade[wall]) <= 2
    assert abs(shade[south].mean() - shade[west].mean()) > 8


def test_one_plane_has_no_lines_at_any_slant():
    slope = np.array([(0, 0, 0), (30, 0, 0), (30, 40, 2.0), (0, 40, 2.0)], float)
    scene = make_scene(slope, np.array([[0, 1, 2], [0, 2, 3]]))
    study = run_study(
        scene, VIENNA, receivers="camera", eye=(15, -3, 1.2), target=(15, 40, 1.9), ground=-5.0,
        size=(200, 150), **NIGHTLESS,
    )  # fmt: skip
    appearance, part = find_grid_appearance(study, (150, 200)), study.more["part"][1]
    plane = part == 0
    assert plane.sum() > 1000
    inner = plane & np.roll(plane, 3, 0) & np.roll(plane, -3, 0)
    inner &= np.roll(plane, 3, 1) & np.roll(plane, -3, 1)
    inner[:3] = inner[-3:] = False
    assert not appearance.lines[inner].any()


def test_no_contour_runs_along_an_edge(south):
    plan, _ = look_at(south)
    hours = np.where(south.more["part"][1] == 1, np.float32(2), np.float32(0))
    hours[south.more["part"][1] < 0] = np.nan
    plain = Plan(plan.x, plan.y, plan.building_height, None, roofs_cover=False)

    def count(on):
        sheet = make_hours_sheet(on, [DayMap(hours)], 2.0)
        labels = [t for t in sheet.leaf.findobj(Text) if t.get_text().endswith(" h")]
        return len([t for t in labels if t.get_path_effects()])

    assert count(plain) > 0  # from house to house hours leap
    assert count(plan) == 0


def test_a_plan_s_roofs_are_lined_and_its_ground_is_not():
    study = run_study(town(), VIENNA, receivers="top", cell=0.25, **NIGHTLESS)
    plan = Plan(study.x, study.y, (study.heights).astype(np.float32))
    size = find_map_size(plan)
    appearance = find_grid_appearance(study, size)
    row, col = pixel(plan, size, 8.0, 2.0)
    assert appearance.lines[row, col - 6 : col + 7].sum(dtype=int) > 180
    assert not appearance.lines[pixel(plan, size, 5.0, 2.0)]
    assert (appearance.shade[pixel(plan, size, 5.0, 2.0)], appearance.sky) == (255, None)
    ground = run_study(town(), VIENNA, cell=0.25, **NIGHTLESS)
    assert find_grid_appearance(ground, size) is None


def test_the_rim_of_a_terrain_is_outlined_where_it_is_low_too():
    ramp = sheet([(0, 0, 0), (20, 0, 4), (20, 10, 4), (0, 10, 0)])  # it rises to the east
    scene = make_scene([Part("dsm", "TINRelief", Mesh(*ramp))])
    study = run_study(
        scene, Site(48.2, 16.37, "Europe/Vienna"), date="2026-06-21", every="2h", receivers="top",
        cell=0.25, extent=(-5, -5, 25, 15),
    )  # fmt: skip
    lines = find_grid_appearance(study, (160, 240)).jumps > 0
    for x, y in [(0, 5), (20, 5), (10, 0), (10, 10)]:
        row, col = round((y + 5) * 8), round((x + 5) * 8)
        assert lines[row - 4 : row + 5, col - 4 : col + 5].any(), (x, y)
    assert not lines[60:100, 80:160].any()
