"""Several dates: what is found of each is what a study of that date alone finds."""

import numpy as np
import pytest
from support.days import parts
from support.shapes import box, moved

import umbra
from umbra.study import run_study
from umbra.study.accumulators import step_masks

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DATES = ("2026-03-21", "2026-06-21", "2026-12-21")
HOURS = {"start": "09:00", "end": "15:00", "every": "30min"}
PLACE = {"extent": (-18, -14, 18, 24), "cell": 2.0, "ground": 0.0}
TABLE = [(0.0, -2.0, 0.0), (3.0, 1.0, 0.5), (-2.5, 3.0, 1.0), (40.0, 0.0, 0.0)]
RECEIVERS = {
    "ground": PLACE,
    "top": PLACE,
    "south": {"cell": 1.0, "on": ["house"]},
    "surfaces": {"spacing": 1.5, "on": ["house", "shed"]},
    "points": {"points": np.array(TABLE)},
}


@pytest.fixture(scope="module")
def street():
    """A tower is proposed south of a house; a tree and a shed stand beside it."""
    return parts(
        tower=box((-3, -8, 0), (3, -4, 13)),
        house=box((-5, 4, 0), (5, 10, 4)),
        shed=moved(box((0, 0, 0), (3, 3, 2)), (8, 5, 0)),
        tree=moved(box((0, 0, 3), (3, 3, 7)), (-10, 0, 0)),
    )


def run(street, receivers="ground", **options):
    return umbra.shadow_study(
        street, VIENNA, receivers=receivers, **{**HOURS, **RECEIVERS[receivers], **options}
    )


@pytest.mark.parametrize(
    "more",
    [{}, {"exact": True, "every": "1h"}, {"canopy": ["tree"], "transmissivity": 0.4}],
    ids=["steps", "exact", "canopy"],
)
@pytest.mark.parametrize("receivers", RECEIVERS)
def test_everything_is_found_of_each_date(street, receivers, more):
    asked = {"proposed": ["tower"], "under": "4h", "by": "part", **more}
    several = run(street, receivers, date=DATES, **asked)
    judged = np.zeros(several.newly_under.shape, int)
    for k, date in enumerate(DATES):
        alone = run(street, receivers, date=date, **asked)
        of_day = several.isel(day=k)
        for name in ("sun_hours", "shadow_hours", "cast_hours", "sole_hours", "hours_lost",
                     "newly_under"):  # fmt: skip
            np.testing.assert_allclose(
                of_day[f"{name}_by_day"], alone[name], atol=1e-5, err_msg=f"{name} {date}"
            )
        judged += alone.newly_under.values
        if receivers == "points":  # they have no area that neighbours could lose
            continue
        # Who loses sun, and how much, on that date: the others stand in the table with 0.
        of_day = of_day.assign_coords(neighbour=several.neighbour)
        assert set(alone.neighbour.values) <= set(several.neighbour.values)
        for name in several.neighbour.values.tolist():
            for what in ("area_touched", "area_newly_under", "most_hours_lost", "mean_hours_lost"):
                found = float(of_day[f"neighbour_{what}_by_day"].sel(neighbour=name))
                there = name in alone.neighbour.values
                wanted = float(alone[f"neighbour_{what}"].sel(neighbour=name)) if there else 0.0
                assert found == pytest.approx(wanted, abs=1e-5), (what, name, date)
    # A limit is one of a date: of all of them it is told how often it is crossed.
    np.testing.assert_array_equal(several.newly_under_days, judged)
    np.testing.assert_array_equal(several.newly_under, judged > 0)
    assert judged.max() > 0
    np.testing.assert_allclose(
        several.hours_lost, several.hours_lost_by_day.sum("day", skipna=False), atol=1e-5
    )


def test_a_sum_over_dates_is_under_no_limit(street):
    """Cells that keep 5 h over three dates may have lost their 2 h on the darkest of them."""
    options = {"proposed": ["tower"], "under": "2h", "date": DATES}
    by_day, summed = run(street, **options), run(street, **options, by_day=False)
    for name in ("newly_under", "newly_under_days", "hours_lost", "neighbour_area_newly_under"):
        np.testing.assert_allclose(summed[name], by_day[name], atol=1e-5, err_msg=name)
    assert not [name for name in summed.variables if name.endswith("_by_day")]
    # The limit held against the sums would find fewer cells.
    sun, lost = summed.sun_hours, summed.hours_lost
    by_sum = (sun < 2) & (sun + lost >= 2)
    newly = summed.newly_under.values > 0
    assert int(newly.sum()) == 7
    assert int(by_sum.sum()) == 2
    table = summed.set_coords("neighbour").set_index(neighbour="neighbour")
    assert float(table.neighbour_area_newly_under.sum()) == newly.sum() * 4.0


def test_surfaces_and_parts_have_their_figures_by_date(street):
    several = run(street, "surfaces", date=DATES)
    for k, date in enumerate(DATES):
        alone = run(street, "surfaces", date=date)
        for of in ("surface", "part"):
            for what in ("mean", "least", "most"):
                name = f"{of}_{what}_sun_hours"
                np.testing.assert_allclose(several[f"{name}_by_day"][k], alone[name], atol=1e-5)


def test_sums_are_named_so(street):
    several = run(street, date=DATES, proposed=["tower"], by="part")
    assert several.shadow_hours.attrs["long_name"] == "hours in shadow, sum of 3 dates"
    assert several.hours_lost.attrs["long_name"].endswith("proposal, sum of 3 dates")
    assert several.newly_under.attrs["long_name"].endswith("on at least one of 3 dates")
    assert several.hours_lost_by_day.attrs["long_name"].endswith("proposal, on the day")
    alone = run(street, date=DATES[0])
    assert alone.shadow_hours.attrs["long_name"] == "hours in shadow"


def test_two_studies_are_compared_by_date(street):
    existing = umbra.scene.make_scene([part for part in street.parts if part.name != "tower"])
    before, after = (run(scene, date=DATES) for scene in (existing, street))
    found = umbra.compare(before, after, "4h")
    areas = []
    for k, date in enumerate(DATES):
        alone = umbra.compare(*(run(s, date=date) for s in (existing, street)), "4h")
        np.testing.assert_allclose(found.hours_lost_by_day[k], alone.hours_lost, atol=1e-5)
        np.testing.assert_array_equal(found.newly_under_by_day[k], alone.newly_under)
        assert float(found.area_touched_by_day[k]) == alone.attrs["area_touched"]
        areas.append(alone.attrs["area_newly_under"])
    np.testing.assert_allclose(found.area_newly_under_by_day, areas)
    assert max(areas) > 0
    np.testing.assert_array_equal(found.newly_under, found.newly_under_by_day.any("day"))
    assert found.attrs == {"under_hours": 4.0}
    sums = [run(scene, date=DATES, by_day=False) for scene in (existing, street)]
    with pytest.raises(umbra.InputError, match="limit of one date"):
        umbra.compare(*sums, "4h")
    plain = umbra.compare(*sums, None)
    np.testing.assert_allclose(plain.hours_lost, found.hours_lost, atol=1e-5)
    assert "newly_under" not in plain
    assert plain.hours_lost.attrs["long_name"] == "hours of sun lost, sum of 3 dates"


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"spells": True, "masks": True, "by_day": False},
        {"by": "part", "proposed": "tower", "by_day": False},
        {"by": "part", "canopy": "tree", "transmissivity": 0.5},
        {"by": "part", "exact": True, "canopy": "tree"},
    ],
)
@pytest.mark.parametrize(("dates", "has_sun"), [("14..2026-02-18", 1), ("01..2026-02-03", 0)])
def test_progress_ends_at_its_total_where_the_sun_comes_back(street, options, dates, has_sun):
    site, told = umbra.Site(78.2, 15.6, "Arctic/Longyearbyen"), []
    study = run_study(
        street, site, date=f"2026-02-{dates}", every="1h", extent=(-20, -20, 20, 20), size=(9, 8),
        progress=lambda done, whole: told.append((done, whole)), **options,
    )  # fmt: skip
    assert (study.up_hours > 0) == has_sun
    if not has_sun:
        assert told == []
        assert (study.shadow_hours == 0).all()
        return
    assert told == sorted(told)
    assert told[-1][0] == told[-1][1]
    assert 0 < study.shadow_hours.max() <= study.up_hours
    if options.get("by_day", True):
        by_day = study.more["shadow_hours_by_day"][1]
        np.testing.assert_allclose(by_day.sum(0), study.shadow_hours, atol=1e-5)


def test_days_are_added_up_one_at_a_time(street, monkeypatch):
    shapes = []

    def watched(counter, shape, lights, *rest):
        shapes.append((len(lights), lights.weights.shape[1]))
        return add_up(counter, shape, lights, *rest)

    add_up = step_masks.add_up
    monkeypatch.setattr(step_masks, "add_up", watched)
    study = run(street, date=DATES, by_day=True)
    assert shapes == [(12, 1)] * len(study.day)
