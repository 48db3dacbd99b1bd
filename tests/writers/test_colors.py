"""Colours that are told apart: by anyone, in grey print, and from those of another meaning."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from support.shapes import box
from support.vision import VISIONS, contrast, see, to_cielab, to_oklab

from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.sun import Site
from umbra.writers.edges import find_height_appearance
from umbra.writers.folder import Outputs
from umbra.writers.folder.write import write_study
from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.picture_content import DOTS_PER_INCH, DayMap, Plan, find_map_size
from umbra.writers.pixels import NO_SUN, shade_ramp
from umbra.writers.profile import MOST_SWATCHES, find_tints

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
PLAN = Plan(np.arange(40) + 0.5, np.arange(30) + 0.5, title="t", place="p", date="d", note="n")


def find_steps(colors, vision):
    """Give how much darker in CIELAB's L* each colour is than the one before."""
    return -np.diff(to_cielab(see(colors, vision))[:, 0])


@pytest.mark.parametrize("n", range(2, MOST_SWATCHES + 1))
@pytest.mark.parametrize("vision", VISIONS)
def test_tints_of_a_day_differ_in_lightness(n, vision):
    assert find_steps(find_tints(n), vision).min() >= 5


@pytest.mark.parametrize("vision", VISIONS)
def test_hours_lost_have_a_legible_ramp_that_is_not_the_one_of_shadow(vision):
    lost, shadow = shade_ramp(9, "loss"), shade_ramp(9)
    assert find_steps(lost, vision).min() >= 5
    assert find_steps(shadow, vision).min() >= 5


def test_a_shadow_alone_stands_out_from_paper():
    assert contrast(find_tints(1), np.ones(3)).min() >= 2.8


@pytest.mark.parametrize("vision", VISIONS)
def test_hours_won_and_lost_darken_from_paper_to_both_sides(vision):
    change = shade_ramp(17, "change")
    assert find_steps(change[8:], vision).min() >= 5
    assert find_steps(change[8::-1], vision).min() >= 5
    np.testing.assert_allclose(change[8], 0.98, atol=0.02)
    ends = to_oklab(see(change[[0, -1]], vision))
    if vision != "grey":  # which is told by its words
        assert np.linalg.norm(ends[0, 1:] - ends[1, 1:]) > 0.08


def test_ramps_share_no_hue_and_sunlit_roofs_are_not_paper():
    lost, shadow = (to_oklab(shade_ramp(9, ramp)[2:]) for ramp in ("loss", "shade"))
    apart = np.linalg.norm(lost[:, None, 1:] - shadow[None, :, 1:], axis=-1)
    assert apart.min() > 0.08
    chroma = np.hypot(*to_oklab(shade_ramp()[:1])[0, 1:])
    assert chroma > 0.04
    assert to_cielab(shade_ramp()[-1:])[0, 0] - to_cielab(np.array([NO_SUN]))[0, 0] > 8


@pytest.mark.parametrize("show", ["shadow", "sun"])
def test_places_without_sun_have_a_colour_of_their_own(show):
    up = (8.0, 6.0)
    days = []
    for k, hours in enumerate(up):
        shadow = np.zeros(PLAN.shape, np.float32)
        shadow[:, 20:] = hours - 0.25
        shadow[:15, 20:] = hours
        shifted = shadow + (8 - hours if show == "sun" else 0)
        dark = 8.0 if show == "sun" else hours
        days.append(DayMap(shifted, f"2026-0{k + 1}-21", dark_from=dark))
    sheet = make_hours_sheet(PLAN, days, 8.0, show=show)
    assert "no sun" in {t.get_text() for t in sheet.leaf.artists if hasattr(t, "get_text")}
    pixels = sheet.leaf.render()[::-1] / 255

    def read(panel, across, up):
        x, y, w, h = panel.map_box
        return pixels[round((y + up * h) * DOTS_PER_INCH), round((x + across * w) * DOTS_PER_INCH)]

    for panel in sheet.panels:
        np.testing.assert_allclose(read(panel, 0.77, 0.27), NO_SUN, atol=0.01)
        assert np.abs(read(panel, 0.77, 0.77) - NO_SUN).max() > 0.1  # a quarter of an hour
    none = make_hours_sheet(PLAN, [DayMap(np.zeros(PLAN.shape, np.float32), dark_from=8.0)], 8.0)
    assert "no sun" not in {t.get_text() for t in none.leaf.artists if hasattr(t, "get_text")}


def test_several_dates_are_compared_by_their_sun(tmp_path):
    # A wall to the south of a strip: December has less shadow of its short day, and less sun.
    scene = make_scene([Part("wall", "", Mesh(*box((-30, -2, 0), (30, 0, 6))))])
    dates = ["2026-06-21", "2026-12-21"]
    ask = {"start": "04:00", "end": "21:00", "every": "1h", "extent": (-10, 0, 10, 20), "cell": 1.0}
    pictures = {}
    for show in (None, "sun", "shadow"):
        study = run_study(scene, VIENNA, date=dates, ground=0.0, **ask)
        options = study_options(dates, ask)
        write_study(study, tmp_path / str(show), Outputs(show=show), options)
        pictures[show] = (tmp_path / str(show) / "hours.png").read_bytes()
        alone = run_study(scene, VIENNA, date=dates[0], ground=0.0, **ask)
        write_study(alone, tmp_path / f"{show}1", Outputs(show=show), study_options(dates[0], ask))
        pictures[f"{show} alone"] = (tmp_path / f"{show}1" / "hours.png").read_bytes()
    assert pictures[None] == pictures["sun"] != pictures["shadow"]
    assert pictures["None alone"] == pictures["shadow alone"] != pictures["sun alone"]
    with Image.open(tmp_path / "None" / "hours.png") as image:
        assert image.size[0] > 500


def study_options(date, ask):
    from umbra.study import StudyOptions  # noqa: PLC0415

    return StudyOptions(date=date, ground=0.0, **ask)


@pytest.mark.parametrize("has_relief", [False, True])
def test_roofs_cover_the_hours_of_the_ground_below_them_also_on_a_slope(has_relief):
    heights = np.zeros(PLAN.shape, np.float32)
    heights[10:20, 10:20] = 5.0
    plan = replace(PLAN, building_height=heights)
    if has_relief:  # as a ground that is no plane has
        plan = replace(plan, appearance=find_height_appearance(heights, 1.0, find_map_size(plan)))
    sheet = make_hours_sheet(plan, [DayMap(heights * 8 / 5, dark_from=8.0)], 8.0)
    pixels = sheet.leaf.render()[::-1] / 255
    x, y, w, h = sheet.maps[0].map_box
    middle = pixels[round((y + 0.5 * h) * DOTS_PER_INCH), round((x + 0.375 * w) * DOTS_PER_INCH)]
    assert np.ptp(middle) < 0.03
    assert middle.min() > 0.6
