"""The map of a city says and shows what the picture of a study does."""

import numpy as np
import pytest
from support.cities import DAY, make_houses, write_city
from support.model_files import save_obj
from support.shapes import box

import umbra
from umbra.tiles import count
from umbra.writers.city import finer_squares, overview

EXTENT = (84970, 446970, 85090, 447090)


@pytest.fixture
def drawn(monkeypatch):
    """Return the plans and maps that are drawn."""
    found, make = [], overview.make_hours_sheet

    def see(plan, days, *args, **more):
        found.append((plan, days[0]))
        return make(plan, days, *args, **more)

    monkeypatch.setattr(overview, "make_hours_sheet", see)
    return found


@pytest.fixture
def files(tmp_path):
    houses = make_houses(5, 8, (85000, 447000), (85050, 447050))
    return [
        write_city(tmp_path / "a.city.json", houses[:4]),
        write_city(tmp_path / "b.city.json", houses[4:]),
    ]


@pytest.mark.parametrize("longest", [1600, 30])
def test_footprints_are_buildings_and_captions_name_time_zone_and_ground(
    files, tmp_path, drawn, monkeypatch, longest
):
    monkeypatch.setattr(overview, "LONGEST", longest)
    options = {**DAY, "cell": 2.0, "extent": EXTENT, "ground": 0.5}
    made = umbra.city_study(files, out=tmp_path / "out", tiles=40, receivers="ground", **options)
    made.write("map")
    [(plan, day)] = drawn
    assert plan.place.endswith("Europe/Amsterdam")
    assert plan.date == "08:00 to 17:00 (UTC+01:00)"
    assert "ground at z = 0.5 m" in plan.note
    assert "30 min" in plan.note
    assert ("at the middles of 2 x 2" in plan.note) == (longest == 30)
    assert plan.title == "A + B · shadow on 21 December 2026"
    assert "sun every 1 min (in study.zarr every 30 min)" in plan.note
    # Where a roof is topmost, none of the hours beneath it is shown.
    scene = umbra.read(*files)
    site = umbra.find_site(scene)
    top = umbra.shadow_study(scene, site, receivers="top", **options).dataset.receiver_z.values
    finer = {**options, "receivers": "ground", "every": "1min"}
    is_open = top <= 0.5
    if longest == 1600:
        hours = umbra.shadow_study(scene, site, **finer).dataset.shadow_hours.values
        np.testing.assert_array_equal(plan.is_building, ~is_open)
        np.testing.assert_array_equal(day.hours, np.where(is_open, hours, np.nan))
        np.testing.assert_allclose(plan.building_height[~is_open], (top - 0.5)[~is_open], 1e-6)
        return
    assert plan.shape == (30, 30)
    whole = umbra.shadow_study(scene, site, receivers="ground", **options).dataset
    hours, full = whole.shadow_hours.values, float((whole.shadow_hours + whole.sun_hours).max())
    middle = umbra.shadow_study(scene, site, **finer | {"cell": 4.0}).dataset
    middle, most = middle.shadow_hours.values, float((middle.shadow_hours + middle.sun_hours).max())
    told = set()
    for i, j in np.ndindex(30, 30):
        square = np.s_[2 * i : 2 * i + 2, 2 * j : 2 * j + 2]
        assert plan.is_building[i, j] == (is_open[square].mean() <= 0.5)
        if is_open[square].any():
            mean = hours[square][is_open[square]].mean()
            # The middle of a square lies beneath the roof that covers it in part.
            is_beneath = middle[i, j] > most - 1e-3 and mean < full - 1e-3
            told.add(is_beneath)
            expected = mean if is_beneath else middle[i, j]
            assert day.hours[i, j] == pytest.approx(expected, abs=1e-5)
    assert told == {True, False}


def test_several_dates_are_shown_as_means_and_dates_given_as_objects_are_read_back(
    files, tmp_path, drawn
):
    import datetime as dt  # noqa: PLC0415

    options = {
        "date": [dt.date(2026, 3, 20), dt.date(2026, 12, 21)], "start": dt.time(9), "end": "15:00",
        "every": dt.timedelta(hours=1), "cell": 4.0, "extent": EXTENT, "receivers": "top",
    }  # fmt: skip
    made = umbra.city_study(files, out=tmp_path / "out", tiles=60, **options)
    made.write("map")
    [(plan, day)] = drawn
    assert float(np.nanmax(day.hours)) <= 6
    assert plan.title == "A + B · sun on 20 March and 21 December 2026"
    assert "sun every 1 min" in plan.note
    scene = umbra.read(*files)
    finer = umbra.shadow_study(scene, umbra.find_site(scene), **options | {"every": "1min"}).dataset
    np.testing.assert_allclose(day.hours, finer.shadow_hours.values / 2, 1e-6)
    assert made.dataset.shadow_hours.attrs["long_name"] == "hours in shadow, sum of 2 dates"
    assert plan.building_height is None
    assert plan.appearance is not None


def test_lost_hours_are_drawn_in_finer_steps_whatever_the_tiles_in_colours_of_loss(
    files, tmp_path, monkeypatch
):
    drawn, make = [], overview.make_hours_sheet

    def see(plan, days, *args, **more):
        drawn.append((more.get("ramp", "shade"), days[0].hours))
        return make(plan, days, *args, **more)

    monkeypatch.setattr(overview, "make_hours_sheet", see)
    options = {**DAY, "cell": 4.0, "extent": EXTENT, "proposed": "* 1"}
    made = umbra.city_study(files, out=tmp_path / "out", tiles=60, **options)
    paths = made.write("map")
    assert [ramp for ramp, _ in drawn] == ["shade", "loss"]
    scene = umbra.read(*files)
    finer = umbra.shadow_study(scene, umbra.find_site(scene), **options | {"every": "1min"})
    expected = finer.dataset.hours_lost.values
    is_drawn = np.isfinite(drawn[1][1])  # but under roofs
    assert is_drawn.mean() > 0.5
    np.testing.assert_allclose(drawn[1][1][is_drawn], expected[is_drawn], atol=1e-4)
    pictures = [path.read_bytes() for path in paths]
    # Other tiles, and windows that the memory cuts, have the same pictures.
    other = umbra.city_study(files, out=tmp_path / "other", tiles=100, **options)
    monkeypatch.setattr(finer_squares, "LEAST_SIDE", 8)
    monkeypatch.setattr(count.TileNeeds, "bytes", lambda _self, _, grid: 1e12 * (grid.rows > 8))
    assert [path.read_bytes() for path in other.write("map")] == pictures
    # Work that allows no finer steps leaves the store's.
    monkeypatch.setattr(finer_squares, "FREE", 0)
    monkeypatch.setattr(finer_squares, "_MOST", 0)
    made.write("map")
    hours = made.dataset.hours_lost.values
    np.testing.assert_array_equal(drawn[-1][1][is_drawn], hours[is_drawn])
    assert (np.abs(hours - expected) > 0.1).any()


def test_roofs_over_a_ground_through_the_feet_are_buildings(tmp_path, drawn):
    houses = {f"h{i}": box((i * 20, 0, i * 4), (i * 20 + 10, 10, i * 4 + 9 + i)) for i in range(4)}
    file = save_obj(tmp_path / "slope.obj", houses)
    site = umbra.Site(48.2, 16.37, "Europe/Vienna")
    options = {"date": "2026-03-21", "cell": 1.0, "extent": (-10, -10, 80, 20)}
    made = umbra.city_study(
        file, site, out=tmp_path / "out", tiles="30m", reading={"up": "z"}, every="1h", **options
    )
    made.write("map")
    [(plan, day)] = drawn
    assert "through the feet of 4 buildings" in plan.note
    dark = day.find_dark()  # north of each house no sun comes at the equinox
    assert dark.any()
    scene = umbra.read(file, up="z")
    finer = umbra.shadow_study(scene, site, every="1min", **options).dataset
    np.testing.assert_array_equal(dark, (finer.sun_hours.values < 1e-3) & ~plan.is_building)
    expected = np.zeros((30, 90))
    for i in range(4):  # each stands on ground that is level at its foot
        expected[10:20, 10 + i * 20 : 20 + i * 20] = 9 + i
    np.testing.assert_array_equal(plan.is_building, expected > 0)
    np.testing.assert_allclose(plan.building_height, expected, atol=1e-6)


def test_what_all_casters_take_of_the_sky_has_a_map(files, tmp_path):
    made = umbra.city_study(
        files, out=tmp_path / "out", tiles=60, receivers="ground", measure="sky_blocked_by",
        by="part", sky_directions=40, cell=5.0, extent=EXTENT,
    )  # fmt: skip
    names = {path.name for path in made.write("map")}
    assert names == {"sky_blocked.png"}
    assert made.dataset.sky_blocked_by.shape == (8, 24, 24)


def test_what_a_proposal_replaces_stands_on_no_map(tmp_path, drawn):
    shapes = {
        "old": box((0, 0, 0), (20, 12, 9)), "new": box((2, 2, 0), (10, 10, 30)),
        "next": box((30, 0, 0), (40, 12, 9)),
    }  # fmt: skip
    file = save_obj(tmp_path / "all.obj", shapes)
    made = umbra.city_study(
        file, umbra.Site(48.2, 16.37, "Europe/Vienna"), out=tmp_path / "out", tiles="30m",
        reading={"up": "z"}, date="2026-03-21", every="2h", cell=1.0, extent=(-10, -10, 50, 30),
        receivers="ground", ground=0.0, proposed="new", replace="old",
    )  # fmt: skip
    made.write("map")
    expected = np.zeros((40, 60), bool)
    expected[12:20, 12:20] = expected[10:22, 40:50] = True
    for plan, _ in drawn:
        np.testing.assert_array_equal(plan.is_building, expected)
    assert len(drawn) == 2
