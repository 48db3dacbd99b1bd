"""Sheets of several dates share what no date changes, and small maps show few clock times."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.days import parts
from support.shapes import box

from umbra.receivers.seen import ViewModel
from umbra.study import StudyOptions, make_preview, run, split_dates
from umbra.sun import Site
from umbra.writers.folder import FolderJob, Outputs
from umbra.writers.folder.captions import name_sun
from umbra.writers.folder.elevation_sheet import draw_sheet
from umbra.writers.folder.measured import draw_measures
from umbra.writers.folder.pictures import (
    PictureSheets,
    draw_pictures,
    draw_surfaces,
    look_at_surfaces,
)
from umbra.writers.folder.shown_window import CROPPED, crop_dates
from umbra.writers.picture_content import Plan

SITE = Site(48.2, 16.37, "Europe/Vienna")
DAYS = ["2026-03-21", "2026-04-21", "2026-05-21", "2026-06-21", "2026-07-21"]


def draw(dates, every="15min"):
    """Return the profiles' maps of a study of surfaces, by the file's name."""
    drawn = {}
    painter = SimpleNamespace(
        draw_profile=lambda path, _plan, maps, **_: drawn.setdefault(path.name, maps),
        draw_hours=lambda *_, **__: None,
    )
    scene = parts(tower=box((0, 0, 0), (4, 4, 9)), house=box((10, 0, 0), (18, 6, 5)))
    options = StudyOptions(receivers="surfaces", spacing=1.0, date=dates, every=every)
    study = run(scene, SITE, options)
    job = FolderJob(study, Path(), Outputs(), options, painter, lambda _: None)
    draw_surfaces(look_at_surfaces(job))
    return drawn


def test_the_view_is_looked_at_once_for_all_dates_of_one_size(monkeypatch):
    looked, look = [], ViewModel.look
    monkeypatch.setattr(ViewModel, "look", lambda *args: looked.append(args[1].size) or look(*args))
    draw(DAYS[:3])
    assert len(looked) == len(set(looked)) + 1  # the receivers, and each size of the pictures


def test_shared_cells_change_no_shadow():
    scene = parts(tower=box((0, 0, 0), (4, 4, 9)))
    options = StudyOptions(receivers="215/35", date=DAYS[:2], every="1h", cell=0.5)
    study = run(scene, SITE, options)
    first = make_preview(study)
    first.shadows  # noqa: B018 - counted by the same counter before
    second = make_preview(study, steps=study.period.steps[1], like=first)
    assert second.cells is first.cells
    fresh = make_preview(study, steps=study.period.steps[1])
    np.testing.assert_array_equal(second.shadows, fresh.shadows)
    assert (second.shadows != first.shadows).any()
    assert make_preview(study, 10, like=first).cells is not first.cells


@pytest.mark.parametrize(("dates", "count"), [(DAYS[:4], 33), (DAYS, 9)])
def test_more_than_four_dates_show_round_times(dates, count):
    maps = draw(dates)["profile.png"]
    assert [len(one.labels) for one in maps] == [count] * len(dates)


@pytest.mark.parametrize(("walls", "at", "labels"), [
    (8, (), [["09:00"], ["12:00"], ["15:00"]]),
    (1, (), [[f"{hour:02}:00" for hour in range(9, 18)]]),
    (8, ("10:00", "11:00"), [["10:00", "11:00"]]),
])  # fmt: skip
def test_shadows_of_a_dense_quarter_are_shown_at_three_times(walls, at, labels):
    drawn = {}
    painter = SimpleNamespace(
        draw_profile=lambda path, plan, maps, **_: drawn.setdefault(path.name, (plan, maps)),
        draw_hours=lambda *_, **__: None,
    )
    boxes = {f"w{k}": box((-60, 12 * k, 0), (60, 12 * k + 2, 14)) for k in range(walls)}
    if walls == 1:
        boxes = {"pole": box((0, 0, 0), (2, 2, 14))}
    options = StudyOptions(
        date=DAYS[0], every="1h", cell=2.0, ground=0.0, extent=(-80, -10, 80, 120)
    )
    study = run(parts(**boxes), SITE, options)
    job = FolderJob(study, Path(), Outputs(at=at), options, painter, lambda _: None, only="profile")
    draw_pictures(job, PictureSheets.of(job))
    plan, maps = drawn["profile.png"]
    assert [list(one.labels) for one in maps] == labels
    assert all(mask.shape == plan.shape for one in maps for mask in one.shadows)
    if len(maps) == 3:
        assert len({mask.sum() for one in maps for mask in one.shadows}) == 3


@pytest.mark.parametrize("extent", [None, (-60, -60, 60, 60)])
def test_small_maps_show_all_shadows_of_half_an_hour_and_little_more(extent):
    scene = parts(tower=box((0, 0, 0), (6, 6, 25)), shed=box((-20, 0, 0), (-17, 3, 3)))
    options = StudyOptions(
        date=["2026-03-21", "2026-12-21"], every="15min", cell=1.0, extent=extent, ground=0.0
    )
    study = run(scene, Site(48.2, 16.37, "Europe/Vienna"), options)
    job = SimpleNamespace(study=study, options=options)
    plan = Plan(study.x, study.y, (study.heights - study.ground).astype(np.float32), note="made")
    hours = [date.shadow_hours for date in split_dates(study)]
    cropped, maps = crop_dates(job, plan, hours, hours)
    if extent is not None:
        assert cropped is plan
        return
    lasting = (np.stack(hours) >= 0.5).any(0)
    assert (np.stack(maps) >= 0.5).any(0).sum() == lasting.sum()
    assert cropped.is_building.sum() == plan.is_building.sum()
    assert CROPPED in cropped.note
    rows, cols = (np.ptp(np.flatnonzero(lasting.any(axis))) + 1 for axis in (1, 0))
    assert cropped.shape[0] < 1.2 * rows + 4
    assert cropped.shape[1] < 1.2 * cols + 4
    assert [one.shape for one in maps] == [cropped.shape] * 2
    # Alone a date keeps the ground that its shares are of, but not the other's long shadows.
    alone, (own,) = crop_dates(job, plan, hours[:1], hours[:1])
    assert own.shape == alone.shape
    assert own.size < 0.9 * plan.is_building.size
    counted = study.kind.find_counted(study).which
    held = counted[np.ix_(np.isin(plan.y, alone.y), np.isin(plan.x, alone.x))]
    assert held.sum() == counted.sum()
    assert (own >= 0.5).sum() == (hours[0] >= 0.5).sum()


@pytest.mark.parametrize("by_day", [True, False])
def test_a_sheet_is_titled_by_the_dates_of_its_hours_and_drawn_in_finer_steps(by_day):
    titles, every = [], []

    def see(_path, _on, maps, *_, **__):
        titles.append(maps[0][1].title)
        every.extend(maps)

    painter = SimpleNamespace(draw_elevations=see)
    options = StudyOptions(date=DAYS[:2], every="2h", cell=2.0, by_day=by_day, ground=0.0)
    study = run(parts(tower=box((0, 0, 0), (4, 4, 9))), SITE, options)
    job = FolderJob(study, Path(), Outputs(), options, painter, lambda _: None)
    draw_sheet(job, PictureSheets.of(job).plan)
    ranges = [range(1), range(1, 2)] if by_day else [range(2)]
    pairs = zip(titles, ranges, strict=True)
    assert all(title.endswith(name_sun(study.period, which)) for title, which in pairs)
    # Hours of a date's own steps are multiples of 2 h; sums of dates have these alone.
    assert len(every) == 5 * len(titles)
    for shown in (every[::5], [one for k, one in enumerate(every) if k % 5]):
        hours = np.concatenate([day.hours[np.isfinite(day.hours)] for _, _, day in shown])
        assert (np.abs(hours / 2 - np.rint(hours / 2)) > 0.01).any() == by_day


def test_a_map_of_points_is_titled_by_its_measure():
    titles = []
    painter = SimpleNamespace(
        draw_measured_points=lambda _path, plan, *_: titles.append(plan.title)
    )
    options = StudyOptions(
        receivers="points", points=[(0.0, -3, 1), (8, 2, 1)], measure="sky_view_factor", ground=0.0
    )
    study = run(parts(tower=box((0, 0, 0), (4, 4, 9))), SITE, options)
    job = FolderJob(study, Path(), Outputs(), options, painter, lambda _: None)
    (name,) = draw_measures(job)
    (quantity,) = options.quantities
    assert name == f"{quantity.name}.png"
    assert [title.endswith(quantity.long_name) for title in titles] == [True]


def test_maps_of_what_a_proposal_takes_of_a_measure_outline_it():
    drawn = {}
    painter = SimpleNamespace(draw_measure=lambda path, plan, *_: drawn.update({path.stem: plan}))
    options = StudyOptions(
        measure="sky_view_factor", proposed="tower", ground=0.0, cell=2.0, sky_directions=64,
        extent=(-24, -8, 16, 16),
    )  # fmt: skip
    scene = parts(old=box((-20, 0, 0), (-10, 10, 9)), tower=box((0, 0, 0), (8, 8, 20)))
    study = run(scene, SITE, options)
    draw_measures(FolderJob(study, Path(), Outputs(), options, painter, lambda _: None))
    assert drawn["sky_view_factor"].proposed is None
    plan = drawn["sky_view_factor_lost"]
    x, y = np.meshgrid(plan.x, plan.y)
    np.testing.assert_array_equal(plan.proposed, (x > 0) & (x < 8) & (y > 0) & (y < 8))
