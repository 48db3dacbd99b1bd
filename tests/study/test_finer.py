"""Contours are drawn from finer steps where those cost little, the same ones on every machine."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box

from umbra.scene import Mesh, Part, make_scene
from umbra.study import count_finer, finer, make_preview, refine_preview, run_study
from umbra.sun import Site
from umbra.writers.contours import trace
from umbra.writers.folder.captions import describe_smooth
from umbra.writers.picture_content import Plan
from umbra.writers.sheet import lay_out_sheet

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-21", "start": "09:00", "end": "17:00", "every": "15min"}
TOWER = make_scene(*box((-5, -5, 0), (5, 5, 60)))
EXTENT = (-100, -30, 220, 130)


def study_tower(**options):
    return run_study(TOWER, VIENNA, **{**DAY, "extent": EXTENT, "cell": 1.0, **options})


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_finer_hours_are_nearer_to_exact_ones_by_the_steps_ratio(receivers):
    study = study_tower(receivers=receivers)
    found = count_finer(study)
    assert found.seconds == 60
    assert found.up_hours == pytest.approx(8)
    exact = study_tower(receivers=receivers, exact=True)
    # The tower's shadow passes once: each of its two edges is off by half a step at most.
    coarse, fine = (
        np.abs(hours - exact.shadow_hours).max() * 60
        for hours in (study.shadow_hours, found.shadow_hours)
    )
    assert 7.5 < coarse < 15.1
    assert fine < 1.1
    assert exact.shadow_hours.max() > 2


def test_saw_teeth_leave_the_contours():
    study = study_tower()
    plan = Plan(study.x, study.y)
    sheet = lay_out_sheet(plan, 0.55)
    teeth, smooth = (
        count_teeth(trace(sheet, hours >= 0.75 - 1e-3))
        for hours in (study.shadow_hours, count_finer(study).shadow_hours)
    )
    assert teeth > 200
    assert smooth <= teeth / 3


def count_teeth(lines):
    """Count the turns of more than half a circle's eighth, of lines at every 0.05 inch."""
    turns = 0
    for line in lines:
        along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        even = np.arange(0, along[-1], 0.05)
        x, y = (np.interp(even, along, line[:, k]) for k in range(2))
        way = np.unwrap(np.arctan2(np.diff(y), np.diff(x)))
        turns += (np.abs(np.diff(way)) > np.pi / 8).sum()
    return turns


def test_finer_losses_are_nearer_to_exact_ones(tmp_path):
    parts = {"old": box((-5, -5, 0), (5, 5, 20)), "new": box((20, -5, 0), (30, 5, 50))}
    scene = make_scene(parts=[Part(name, "house", Mesh(*mesh)) for name, mesh in parts.items()])
    asked = {**DAY, "extent": EXTENT, "cell": 1.0, "receivers": "top", "proposed": ("new",)}
    study = run_study(scene, VIENNA, **asked)
    lost = count_finer(study).find_lost([0])
    exact = run_study(scene, VIENNA, **asked, exact=True).more["hours_lost"][1]
    there = np.isfinite(exact)
    assert (~there).any()  # the new roof
    coarse, fine = (
        np.abs(hours - exact)[there].max() * 60 for hours in (study.more["hours_lost"][1], lost)
    )
    assert coarse > 7.5
    assert fine < 2.1  # two edges of each tower's shadow
    assert exact[there].max() > 1


def test_no_more_work_is_done_than_the_study_s_own_or_what_is_free(monkeypatch):
    study, small = study_tower(cell=0.25), study_tower()
    face = finer.FACE * 12
    done = []
    tile = type(study.model.make_tile(study.grid.coarser(8)))
    make = tile.make_counter

    def watch(self):
        counter = make(self)
        add = counter.add_weights

        def add_weights(suns, weights, sums, *more):
            done.append(len(suns) * (sums.size + face))
            add(suns, weights, sums, *more)

        counter.add_weights = add_weights
        return counter

    monkeypatch.setattr(tile, "make_counter", watch)
    own = 32 * (study.grid.rows * study.grid.cols + face)
    seconds = []
    for free in (3 * own, 5 * own, finer.FREE):
        done.clear()
        monkeypatch.setattr(finer, "FREE", free)
        seconds.append(count_finer(study).seconds)
        assert sum(done) <= max(own, free)
    assert seconds == [300, 180, 60]
    monkeypatch.setattr(finer, "FREE", 0)
    assert count_finer(small) is None
    monkeypatch.setattr(finer, "FREE", 12 * own)
    assert count_finer(study, share=1 / 4).seconds == 300  # of four that share what is free


def test_two_runs_draw_the_same():
    one, other = (count_finer(study_tower()) for _ in range(2))
    np.testing.assert_array_equal(one.shadow_hours, other.shadow_hours)


def test_what_is_counted_otherwise_has_no_finer_steps():
    assert count_finer(study_tower(disc=True)) is None
    assert count_finer(study_tower(exact=True)) is None
    assert count_finer(study_tower(every="1min", start="12:00", end="12:10")) is None
    assert count_finer(run_study(TOWER, VIENNA, **{**DAY, "date": ["2026-03-21", "2026-06-21"]},
                                 extent=EXTENT, cell=1.0)) is None  # fmt: skip
    study = study_tower()
    assert count_finer(replace(study, facts=study.facts | {"device": "of a package"})) is None


@pytest.mark.parametrize(("every", "end", "seconds"), [("7min", "10:00", 60), ("90s", "9:10", 0)])
def test_steps_are_cut_into_whole_minutes_or_seconds(every, end, seconds):
    found = count_finer(study_tower(every=every, end=end))
    if not seconds:
        assert found is None
        return
    assert found.seconds == seconds
    assert found.up_hours == pytest.approx(1)  # the last step is shorter


def test_an_elevation_takes_finer_steps_for_less_of_the_work():
    study = study_tower(receivers="south", extent=None)
    found = count_finer(study)
    assert 60 <= found.seconds < 900
    assert found.shadow_hours.shape == study.shadow_hours.shape
    plan = count_finer(study_tower())
    assert plan.seconds <= found.seconds


LOW = {"date": "2026-12-21", "start": "09:00", "end": "10:00", "cell": 4.0}


def test_outlines_of_a_low_sun_are_no_staircases():
    study = study_tower(**LOW)
    coarse = make_preview(study)
    fine = refine_preview(study, coarse)
    times = fine.shadows.shape[1] // coarse.shadows.shape[1]
    assert times > 5
    # What is drawn is what a study of such cells counts.
    direct = make_preview(study_tower(**{**LOW, "cell": 4.0 / times}))
    np.testing.assert_array_equal(fine.shadows, direct.shadows)
    np.testing.assert_allclose(fine.x, direct.x)
    teeth, smooth = (
        sum(
            count_teeth(trace(lay_out_sheet(Plan(one.x, one.y), 0.55), mask))
            for mask in one.shadows
        )
        for one in (coarse, fine)
    )
    assert teeth > 20 * max(smooth, 10)


def test_the_profile_tells_the_size_of_its_cells():
    study = study_tower(**LOW)
    coarse = make_preview(study)
    plan = Plan(coarse.x, coarse.y, note="cells of 4 m")
    fine = describe_smooth(plan, study, refine_preview(study, coarse))
    assert fine.note == f"cells of 4 m · shadows in cells of {320 / len(fine.x):.3g} m"
    assert fine.building_height.shape == fine.shape
    assert describe_smooth(plan, study, coarse).note == "cells of 4 m"


@pytest.mark.parametrize(
    ("options", "work"),
    [({"cell": 0.2}, None), ({"canopy": ["*"]}, None), ({}, 1)],
)
def test_a_profile_is_counted_anew_only_where_it_shows_and_costs_little(options, work, monkeypatch):
    study = study_tower(**{**LOW, "every": "1h", **options})
    if work is not None:
        monkeypatch.setattr(finer, "FREE", work)
    coarse = make_preview(study)
    assert refine_preview(study, coarse) is coarse
