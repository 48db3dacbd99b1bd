"""Figures of plans: of whose area, on which ground, and the same in any frame."""

import re
from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box

from umbra.receivers.counted import NEAR, find_near
from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.study.measures import Quantity
from umbra.sun import Site
from umbra.writers.contours import trace
from umbra.writers.folder.foot import tell_cut
from umbra.writers.folder.summary import tell_answers
from umbra.writers.picture_content import DOTS_PER_INCH, Plan
from umbra.writers.report.tables import find_comparisons, find_figures, find_sun_areas
from umbra.writers.sheet import lay_out_sheet

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
TIMES = {"date": "2026-03-21", "start": "09:00", "end": "15:00", "every": "1h"}
NARROW, WIDE = (-40, -44, 40, 50), (-90, -70, 110, 120)


@pytest.fixture(scope="module")
def street():
    boxes = {
        "tower": ((-3, -8, 0), (3, -4, 13)),
        "house": ((-5, 4, 0), (5, 10, 4)),
        "lawn": ((-14, -14, -0.5), (14, 14, 0)),
    }
    return make_scene(
        [
            Part(name, "LandUse" if name == "lawn" else "Building", Mesh(*box(*ends)))
            for name, ends in boxes.items()
        ]
    )


def run(street, receivers, extent=NARROW, **more):
    return run_study(
        street, VIENNA, receivers=receivers, extent=extent, cell=1.0, ground=0.0, **TIMES, **more
    )


def read_groups(table):
    found = {}
    for where, name, *figures in table.rows:
        found.setdefault(where, {})[name] = figures
    return found


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_figures_do_not_depend_on_the_frame(street, receivers):
    narrow, wide = (run(street, receivers, extent) for extent in (NARROW, WIDE))
    assert narrow.shadow_hours.size < wide.shadow_hours.size / 3
    told, same = ({name: value for name, value, _ in find_figures(one)} for one in (narrow, wide))
    assert told == pytest.approx(same)
    assert find_sun_areas(narrow).rows == find_sun_areas(wide).rows
    counted = wide.kind.find_counted(wide)
    y, x = np.nonzero(counted.which)
    assert wide.x[x].min() == pytest.approx(-5 - NEAR, abs=1)  # lawn is ground
    assert wide.y[y].max() == pytest.approx(10 + NEAR, abs=1)


def test_before_and_after_from_above_has_ground_roofs_and_all(street):
    study = run(street, "top", proposed=["tower"], under="4h")
    (table, *_) = find_comparisons(study)
    found = read_groups(table)
    assert list(found) == ["ground", "roofs", "ground and roofs"]
    newly = {where: rows["newly under 4 h [m²]"][-1] for where, rows in found.items()}
    area = float(study.more["neighbour_area_newly_under"][1].sum())
    assert newly["ground and roofs"] == round(area)  # as the picture says
    assert newly["ground"] + newly["roofs"] == round(area)
    assert newly["ground"] > 0
    names = study.more["neighbour"][1].tolist()
    house = study.more["neighbour_area_newly_under"][1][names.index("house")]
    assert newly["roofs"] == round(house)
    for rows in found.values():  # no place gains sun
        assert rows["less than 4 h of sun [m²]"][-1] == rows["newly under 4 h [m²]"][-1]


def test_the_denominator_is_told_in_a_unit_that_is_read_at_a_glance(street):
    counted = run(street, "ground").kind.find_counted(run(street, "ground"))
    assert counted.tell_whole() == f"{counted.whole:,.0f} m²"
    many = counted.__class__(counted.which, counted.weight * 100, "m²", counted.what)
    assert many.tell_whole() == f"{many.whole / 1e4:.3g} ha"


def test_figures_of_a_measure_are_of_the_receivers_that_have_a_value(street):
    study = run(street, "ground")
    counted = study.kind.find_counted(study)
    rows, cols = np.nonzero(counted.which)
    values = np.full(study.shadow_hours.shape, np.nan)
    values[rows[:3], cols[:3]] = (10, 20, 60)
    share = Quantity("share", "%", "share of the morning")
    study = replace(study, quantities=(share,), more=study.more | {"share": (study.dims, values)})
    line = next(line for line in tell_answers(study) if line.startswith(share.long_name))
    whole = counted.weight[counted.which][:3].sum()
    assert re.findall(r"[\d.]+", line) == ["30", f"{whole:.0f}", "10", "60"]
    values[:] = np.nan
    assert len(tell_answers(study)) == 1


def test_near_cells_are_those_of_a_search_in_any_strips(monkeypatch):
    rng = np.random.default_rng(1)
    built = rng.random((60, 37)) < 0.004
    rows, cols = np.nonzero(built)
    y, x = np.indices(built.shape)
    away = np.hypot((x[..., None] - cols) * 1.5, (y[..., None] - rows) * 0.5).min(-1)
    for cells in (37, 37 * 7, 4_000_000):
        monkeypatch.setattr("umbra.receivers.counted._CELLS", cells)
        np.testing.assert_array_equal(find_near(built, (1.5, 0.5), 4.0), away <= 4.0)
    assert find_near(np.zeros((3, 4), bool), (1, 1), 2.0).all()


def test_lines_of_hours_go_straight_to_the_frame():
    for n in (1600, 1000):
        plan = Plan((np.arange(n) + 0.5) * 100 / n, (np.arange(n * 4 // 5) + 0.5) * 100 / n)
        sheet = lay_out_sheet(plan, 0.55)
        x, y = np.meshgrid(plan.x, plan.y)
        left, bottom, wide, high = sheet.map_box
        (line,) = trace(sheet, y < 0.3 * x - 29.5)  # from the lower edge to near a corner
        at = (line - (left, bottom)) / (wide, high) * (100, 80)
        at = at[((at > 0) & (at < (100, 80))).all(1)]
        off = (at[:, 1] - 0.3 * at[:, 0] + 29.5) / np.hypot(0.3, 1) * DOTS_PER_INCH * high / 80
        assert np.abs(off[-2:]).max() < 0.25  # pixels; it was 0.47


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_a_frame_that_cuts_shadows_says_so(street, receivers):
    assert tell_cut(run(street, receivers, (-90, -70, 110, 120))) == ""
    cut = run(street, receivers, (-20, -20, 20, 9))
    hours = cut.shadow_hours[-1][~cut.laid.is_built[-1]]
    assert f"{hours.max():.3g} h" in tell_cut(cut)
    built = run(street, receivers, (-4, 5, 4, 9))  # all under the roof of one house
    assert tell_cut(built) == ""
