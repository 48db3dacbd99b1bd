"""The lines that answer at a study's end: their figures are those of what counts."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.receivers.counted import NEAR, Counted
from umbra.scene import Mesh, Part, make_scene
from umbra.sun.clock import say_hours
from umbra.writers.folder.summary import tell_answers
from umbra.writers.report.tables import _compare_group, find_comparisons

VIENNA = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
DATES = ["2026-03-21", "2026-12-21"]
WORDS = ["21 March 2026", "21 December 2026"]


@pytest.fixture(scope="module")
def scene():
    return make_scene(
        [
            Part("old", "", Mesh(*box((0, 0, 0), (10, 10, 8)))),
            Part("new", "", Mesh(*box((0, -30, 0), (10, -20, 20)))),
        ]
    )


def study(scene, **more):
    hours = {"start": "09:00", "end": "17:00", "every": "1h", "cell": 1.0}
    return umbra.shadow_study(scene, VIENNA, **hours, **more)


def test_the_hours_of_each_date_are_of_the_ground_near_buildings(scene):
    found = study(scene, date=DATES, extent=(-60, -60, 60, 60))
    lines = tell_answers(found.result)
    assert [line.partition(" the ")[0] for line in lines] == [f"On {word}" for word in WORDS]
    x, y = np.meshgrid(found.x, found.y)
    in_old = (x > 0) & (x < 10) & (y > 0) & (y < 10)
    in_new = (x > 0) & (x < 10) & (y > -30) & (y < -20)
    inside = np.stack([x[in_old | in_new], y[in_old | in_new]], 1)
    away = np.hypot(*(np.stack([x, y], -1)[..., None, :] - inside).transpose(3, 0, 1, 2)).min(-1)
    counts = (away <= NEAR + 0.5) & ~(in_old | in_new)
    for line, shadow, up in zip(
        lines, found.shadow_hours_by_day.values, found.up_hours_by_day.values, strict=True
    ):
        sun = up - shadow[counts]
        assert f"({counts.sum():,} m²)" in line
        assert f" {say_hours(sun.mean())} of {say_hours(up)} " in line
        assert f" {100 * (sun < 1e-4).mean():.1f} %" in line


def test_what_a_proposal_takes_is_told_with_its_area(scene):
    found = study(scene, date=DATES[0], proposed="new", extent=(-20, -40, 30, 30))
    taken, left = tell_answers(found.result, ["new"])
    lost = found.hours_lost.values
    *_, whole = found.result.kind.list_counted(found.result)
    open_ground = whole.which
    assert taken.startswith("new takes sun from ")
    assert f" on {WORDS[0]}, at most " in taken
    assert f" {((lost > 1e-4) & open_ground).sum():,} m² of " in taken
    assert f" {say_hours(np.nanmax(np.where(open_ground, lost, 0)))};" in taken
    newly = ((found.newly_under.values > 0) & open_ground).sum()
    assert newly > 0
    assert f" {newly:,} m² fall under 2 h" in taken
    assert "on average" in left


def test_a_night_has_no_hours_to_tell(scene):
    night = umbra.shadow_study(
        scene, VIENNA, date=DATES[0], start="00:00", end="02:00", every="1h", cell=5.0
    )
    assert tell_answers(night.result) == []


@pytest.mark.parametrize("day", ["2026-06-21", "2026-12-21"])
def test_the_default_plan_holds_all_ground_that_shares_are_of(scene, day):
    """The ring around two squares of 10 m, 30 m apart, less where the rings meet."""
    found = study(scene, date=day)
    counted = found.result.kind.find_counted(found.result)
    shapely = pytest.importorskip("shapely")
    built = shapely.union_all([shapely.box(0, 0, 10, 10), shapely.box(0, -30, 10, -20)])
    ring = built.buffer(NEAR, quad_segs=64).area - 200
    assert "in the frame" not in counted.what
    assert counted.whole == pytest.approx(ring, rel=0.01)


def test_a_small_model_s_plan_reaches_as_far_as_twice_its_size():
    chair = make_scene([Part("chair", "", Mesh(*box((0, 0, 0), (0.5, 0.5, 1.0))))])
    found = umbra.shadow_study(chair, VIENNA, date="2026-06-21", start="12:00", end="13:00")
    assert found.x.values[0] == pytest.approx(-2.0, abs=0.2)
    assert "within 2 m of buildings" in found.result.kind.find_counted(found.result).what


def test_the_default_plan_holds_areas_and_their_bands(scene):
    shapely = pytest.importorskip("shapely")
    far = {"meadow": shapely.box(-90, -10, -70, 10)}
    found = study(scene, date=DATES[0], areas=far)
    assert found.x.values[0] < -90 < found.x.values[-1]
    found = study(scene, date=DATES[0], areas=far, band=["5,10"])
    assert found.x.values[0] < -100
    found = study(scene, date=DATES[0], areas=far, extent=(-80, -9, 30, 30))
    assert found.x.values[0] == pytest.approx(-79.5)


@pytest.mark.parametrize("extent", [None, (-20, -40, 30, 12)])
def test_a_loss_is_one_number_in_the_sentence_and_in_the_tables(scene, extent):
    found = study(scene, date=DATES[0], proposed="new", extent=extent).result
    taken, _ = tell_answers(found, ["new"])
    comparison, neighbours = find_comparisons(found)
    loss = next(row[3] for row in comparison.rows if row[0] == "loses sun [m²]")
    ground = next(row for row in neighbours.rows if row[0] == "ground")
    assert f" {loss:,} m² of open ground" in taken
    assert round(ground[2]) == loss
    is_cut = bool((np.nan_to_num(found.more["hours_lost"][1])[-1] > 0).any())
    assert ("in the frame" in taken) >= is_cut


def test_before_and_change_add_up_to_after_as_they_are_printed():
    random = np.random.default_rng(5)
    for _ in range(60):
        lost, left = random.uniform(0, 3, (2, 7)).astype(np.float32)
        shown = SimpleNamespace(
            more={"hours_lost": (("sample",), lost), "newly_under": (("sample",), lost > 2)},
            sun_hours=left, up_hours=8.0, facts={}, period=SimpleNamespace(days=[1]),
        )  # fmt: skip
        rows = _compare_group(shown, Counted(np.ones(7, bool), random.uniform(1, 2, 7), "m²", ""))
        for *_, was, now, change in rows:
            assert f"{was + change:.2f}" == f"{now:.2f}"


def test_only_pictures_of_hours_tell_their_accuracy(scene, tmp_path):
    study(scene, date=DATES[0]).write(tmp_path, "svg")
    told = {name: (tmp_path / f"{name}.svg").read_text() for name in ("hours", "profile")}
    assert {name: "min for each edge" in text for name, text in told.items()} == {
        "hours": True, "profile": False
    }  # fmt: skip
    assert all("refraction standard" in text for text in told.values())


def test_one_point_is_one_point():
    points = Counted(np.ones(3, bool), np.ones(3), "points", "points")
    assert points.tell_whole_of() == "3 points"
    assert points.of_weight(1.0).tell_whole() == "1 point"
