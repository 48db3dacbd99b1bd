"""Where a proposal stands is told in tiles as in one piece, and its outline is drawn."""

import warnings

import numpy as np
import pytest

import umbra
from umbra.writers.city import overview
from umbra.writers.folder.summary import tell_answers

CUBE = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
SITE = umbra.Site(48.2, 16.4, "Europe/Vienna")
DAY = {"date": "2026-03-21", "every": "4h", "cell": 2.0, "receivers": "ground"}


def write_cube(path, x, side=5.0):
    corners = [(x + side * a, side * b, side * c) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
    path.write_text("".join("v {} {} {}\n".format(*corner) for corner in corners) + CUBE)
    return path


@pytest.fixture
def run(tmp_path):
    """Return a function that counts an old and a new cube in tiles."""

    def run(new, **options):
        files = [
            write_cube(tmp_path / "old.obj", 0, 10.0),
            f"plan={write_cube(tmp_path / 'new.obj', new)}",
        ]
        return umbra.city_study(
            files, SITE, out=tmp_path / "out", proposed=["plan"], tiles="50m",
            reading={"up": "z"},
            **{name: value for name, value in (DAY | options).items() if value is not None},
        )  # fmt: skip

    return run


@pytest.mark.parametrize(("east", "is_told"), [(20, True), (120, False)])
def test_a_proposal_outside_the_plan_is_told(run, east, is_told):
    city = run(100, extent=(-10, -10, east, 20))
    assert len([note for note in city.notes if "80 m outside" in note]) == is_told


@pytest.mark.parametrize(("x", "is_told"), [(5.0, True), (20.0, False)])
def test_a_proposal_on_top_of_a_house_is_told_as_in_one_piece(run, tmp_path, x, is_told):
    city = run(x)
    told = [note for note in city.notes if "overlaps" in note]
    assert len(told) == is_told
    scene = umbra.read(tmp_path / "old.obj", f"plan={tmp_path / 'new.obj'}", up="z")
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        umbra.shadow_study(scene, SITE, proposed=["plan"], **DAY)
    assert told == [str(one.message) for one in warned if "overlaps" in str(one.message)]


@pytest.mark.parametrize("options", [
    {}, {"receivers": "surfaces", "cell": None, "spacing": 2.0},
    {"date": ["2026-03-21", "2026-12-21"], "under": "6h"},
    {"date": ["2026-03-21", "2026-12-21"], "by_day": False, "receivers": "top"},
    {"measure": ["sky_view_factor"], "extent": (-10, -10, 40, 30)},
])  # fmt: skip
def test_what_a_proposal_takes_is_told_as_of_one_study(run, tmp_path, options):
    options = DAY | {"every": "1h"} | options
    city = run(14.0, **options)
    options = {name: value for name, value in options.items() if value is not None}
    scene = umbra.read(tmp_path / "old.obj", f"plan={tmp_path / 'new.obj'}", up="z")
    whole = umbra.shadow_study(scene, SITE, proposed=["plan"], **options).result
    told = city.tell_hours()
    assert told == tell_answers(whole, ["plan"])
    assert "plan takes " in told[0]


def test_shadows_cut_by_the_frame_are_told_unless_it_was_asked_for(run):
    notes = run(20.0, start="06:00", end="18:00", every="30min").notes
    assert len([note for note in notes if "cut at its edge" in note]) == 1


def test_shadows_cut_by_a_chosen_frame_are_not_told(run):
    assert not [note for note in run(20.0, extent=(0, 0, 30, 30)).notes if "cut at" in note]


def test_the_map_outlines_the_proposal(run, monkeypatch):
    drawn, make = [], overview.make_hours_sheet

    def see(plan, *args, **more):
        drawn.append(plan)
        return make(plan, *args, **more)

    monkeypatch.setattr(overview, "make_hours_sheet", see)
    run(20.0, extent=(-10, -10, 40, 30)).write("map")
    assert drawn
    for plan in drawn:
        x, y = np.meshgrid(plan.x, plan.y)
        np.testing.assert_array_equal(plan.proposed, (x > 20) & (x < 25) & (y > 0) & (y < 5))
