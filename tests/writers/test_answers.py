"""The lines that answer at a study's end: their figures are those of what counts."""

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.receivers.counted import NEAR
from umbra.scene import Mesh, Part, make_scene
from umbra.sun.clock import say_hours
from umbra.writers.folder.summary import tell_answers

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
    assert [line.split(":")[0] for line in lines] == WORDS
    x, y = np.meshgrid(found.x, found.y)
    in_old = (x > 0) & (x < 10) & (y > 0) & (y < 10)
    in_new = (x > 0) & (x < 10) & (y > -30) & (y < -20)
    inside = np.stack([x[in_old | in_new], y[in_old | in_new]], 1)
    away = np.hypot(*(np.stack([x, y], -1)[..., None, :] - inside).transpose(3, 0, 1, 2)).min(-1)
    counts = (away <= NEAR) & ~(in_old | in_new)
    for line, shadow, up in zip(
        lines, found.shadow_hours_by_day.values, found.up_hours_by_day.values, strict=True
    ):
        sun = up - shadow[counts]
        assert f"({counts.sum():,} m²)" in line
        assert f" {say_hours(sun.mean())} of {say_hours(up)} " in line
        assert f" {100 * (sun < 1e-4).mean():.3g} %" in line


def test_what_a_proposal_takes_is_told_with_its_area(scene):
    found = study(scene, date=DATES[0], proposed="new", extent=(-20, -40, 30, 30))
    taken, left = tell_answers(found.result, ["new"])
    lost = found.hours_lost.values
    open_ground = found.result.kind.find_counted(found.result).which
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
