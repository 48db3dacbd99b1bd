"""The bytes of a result do not depend on its tiles, and are those of a study of all files."""

from itertools import pairwise

import numpy as np
import pytest
from support.cities import DAY, make_houses, write_city
from support.sweeps import sample_cases

import umbra
from umbra.lights import Horizon
from umbra.tiles import count, receive
from umbra.tiles.count import count_window
from umbra.tiles.receive import LEAST, group_suns
from umbra.tiles.run import count_serially
from umbra.writers.city.store_window import list_neighbours

EXTENT = (84950, 446950, 85520, 447290)
SIDES = (3000, 220, 57)
RING = Horizon("ring", "", np.arange(0, 360, 45.0), np.array([1.0, 2, 1, 6, 2, 3, 5, 1]))


def compare(found, whole, *, rounding=0.0):
    """
    Compare every byte of two datasets; the names of axes and parts as text.

    With rounding, numbers may differ by so much of their size.
    """
    assert set(found.variables) - {"spatial_ref"} == set(whole.variables) - {"spatial_ref"}
    for name in set(whole.variables) - {"spatial_ref"}:
        assert found[name].dims == whole[name].dims, name
        left, right = found[name].values, whole[name].values
        if right.dtype.kind == "U":
            assert left.tolist() == right.tolist(), name
        elif rounding and right.dtype.kind == "f":
            np.testing.assert_allclose(left, right, rtol=rounding, atol=rounding, err_msg=name)
        else:
            assert left.astype(right.dtype).tobytes() == right.tobytes(), name


def check_tiles(files, folder, sides, *, rounding=0.0, **options):
    """Count files in tiles of each side; all are as one study of them, which is returned, too."""
    scene = umbra.read(*files)
    whole = umbra.shadow_study(scene, umbra.find_site(scene), **options).dataset
    for side in sides:
        made = umbra.city_study(files, out=folder / str(side), tiles=side, **options)
        compare(made.dataset.load(), whole, rounding=rounding)
    return made, whole


@pytest.fixture
def groups(monkeypatch):
    """Return the groups of suns that are counted, of 40 and more."""
    found = []

    def see(suns):
        found.extend(some := list(group_suns(suns)))
        return some

    monkeypatch.setattr(receive, "group_suns", see)
    monkeypatch.setattr(receive, "LEAST", 40)
    return found


@pytest.mark.parametrize("receivers", ["ground", "top"])
@pytest.mark.parametrize("more", [{}, {"spells": True}])
def test_tiles_hold_the_bytes_of_one_study(city, tmp_path, receivers, more):
    cell = 5.0 if more else 3.0
    options = {**DAY, **more, "receivers": receivers, "cell": cell, "extent": EXTENT}
    sides = sample_cases(SIDES, 2, len(more))
    made, whole = check_tiles(city, tmp_path, sides, **options)
    assert 0.1 < float(whole.shadow_hours.mean() / 7.5) < 0.9
    assert made.facts["merged_objects"] == 3


MONTHS = {"date": "2026-02-01..2026-04-20", "every_days": 6, "every": "15min"}


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"receivers": "top", "horizon": RING},
        {"spells": True},
        {"proposed": ["west 11"], "every": "20min"},
        {"disc": True, "every": "2h", "cell": 20.0},
    ],
    ids=["groups", "land", "spells", "proposal", "disc"],
)
def test_months_are_those_of_one_study(city, tmp_path, groups, more):
    options = {**MONTHS, "receivers": "ground", "cell": 6.0, "extent": EXTENT, **more}
    _, whole = check_tiles(city, tmp_path, (220,), **options)
    assert whole.month.values.tolist() == [2, 3, 4]
    assert np.ptp(whole.sun_hours_by_month.values.mean((1, 2))) > 0.5
    assert bool(groups) == (set(more) <= {"receivers", "horizon"})


def test_months_of_surfaces_are_the_same_in_any_tiles(city, tmp_path):
    options = {**MONTHS, "receivers": "surfaces", "spacing": 6.0, "every": "2h"}
    found = [
        umbra.city_study(city, out=tmp_path / str(side), tiles=side, **options).dataset.load()
        for side in SIDES[:2]
    ]
    compare(*found)
    whole = (found[0].sun_hours_by_month * found[0].dates_by_month).sum("month")
    np.testing.assert_allclose(whole, found[0].sun_hours, atol=1e-3)


def test_like_houses_of_one_name_stay_two(tmp_path):
    x, y = 84950, 446950
    west, east = tmp_path / "west.city.json", tmp_path / "east.city.json"
    write_city(west, [("house", x, y, 0, 9, 9, 5, 0), ("shed", x + 90, y, 0, 3, 3, 2, 0)])
    gate = ("gate", x - 20, y, 0, 1, 9, 3, 0)  # either file's houses lie in the other's bounds
    write_city(
        east, [("house", x + 40, y, 0, 9, 9, 5, 0), ("shed", x + 90, y, 0, 3, 3, 2, 0), gate]
    )
    made = umbra.city_study(
        [west, east], out=tmp_path / "out", tiles=50, receivers="ground", cell=1.0, **DAY
    )
    assert made.facts["merged_objects"] == 1  # the shed, which stands in both files


@pytest.mark.parametrize("more", [{}, {"masks": True, "date": "2026-12-21,2026-06-21"}])
def test_surfaces_are_in_the_order_of_files_for_any_tiles(city, tmp_path, more):
    options = {**DAY, **more, "receivers": "surfaces", "spacing": 3.0}
    found = [
        umbra.city_study(city, out=tmp_path / str(side), tiles=side, **options).dataset.load()
        for side in (SIDES if not more else SIDES[1:])
    ]
    for other in found[1:]:
        compare(other, found[0])
    assert len(found) > 1
    assert len(found[0].part) == 60 + 60 + 4  # the three in both files once
    # One scene of the files without duplicates.
    scene = umbra.read(*city)
    parts = [
        p for p in scene if not (p.layer == "b_east" and p.name in {"east 0", "east 1", "east 2"})
    ]
    alone = umbra.make_scene(
        [umbra.Part(p.name, p.kind, p.mesh.moved(p.mesh.vertices + scene.origin), layer=p.layer)
         for p in parts], crs=scene.crs,
    )  # fmt: skip
    whole = umbra.shadow_study(alone, umbra.find_site(scene), **options).dataset
    for name in ("shadow_hours", "position", "normal", "area", "surface_of_sample"):
        np.testing.assert_array_equal(found[0][name], whole[name], name)


def test_canopies_let_light_through_in_any_tile(city, tmp_path):
    options = {
        **DAY, "receivers": "top", "cell": 4.0, "extent": EXTENT, "canopy": "east*",
        "transmissivity": 0.3,
    }  # fmt: skip
    _, whole = check_tiles(city, tmp_path, [150], **options)
    assert float(whole.canopy_hours.max()) > 1


def test_solved_instants_are_those_of_one_study(city, tmp_path):
    options = {**DAY, "receivers": "top", "cell": 4.0, "extent": (84990, 446990, 85120, 447110)}
    check_tiles(city, tmp_path, [50], exact=True, **options)


@pytest.mark.parametrize(
    "more",
    [
        {"measure": "sky_blocked_by,sky_view_factor", "who": "west*", "sky_directions": "tregenza"},
        {"measure": "sky_blocked_by,sky_component", "who": "east*", "exact": True},
        {"disc": True, "horizon": RING, **DAY},
    ],
    ids=["directions", "exact", "disc"],
)
def test_what_sees_the_whole_sky_is_that_of_one_study(city, tmp_path, more):
    options = {"receivers": "top", "cell": 6.0, "extent": (84990, 446990, 85120, 447110)}
    # Outlines are integrated in the order of a tile's faces.
    rounding = 1e-12 if "exact" in more else 0.0
    _, whole = check_tiles(city, tmp_path, [50], rounding=rounding, **options, **more)
    names = ("first_contact", "last_contact") if "disc" in more else ("sky_blocked_by",)
    for name in names:
        assert len(np.unique(whole[name].values)) > 20


def test_windows_are_cut_to_the_memory_that_is_given(city, tmp_path, monkeypatch):
    options = {**DAY, "receivers": "top", "cell": 2.0, "extent": EXTENT}
    first = umbra.city_study(city, out=tmp_path / "first", tiles=1000, **options)
    windows = []

    def see(place, grid, needs):
        windows.append((grid.rows, grid.cols))
        return count_window(place, grid, needs)

    monkeypatch.setattr(count, "count_window", see)

    def engine(job, tiles):
        return count_serially(job.with_resources(3.01e8, 2), tiles)

    second = umbra.city_study(city, out=tmp_path / "second", tiles=1000, engine=engine, **options)
    assert len(windows) > 8
    assert min(max(window) for window in windows) <= 64
    compare(second.dataset.load(), first.dataset.load())


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_many_suns_are_counted_in_groups_with_the_same_bytes(city, tmp_path, receivers, groups):
    options = {
        "date": "2026-12-01..2026-12-20", "start": "00:00", "end": "24:00", "every": "30min",
        "by_day": False, "receivers": receivers, "cell": 4.0, "extent": EXTENT,
    }  # fmt: skip
    made, _ = check_tiles(city, tmp_path, [150], **options)
    assert len(groups) > 2 * len(made.job.tiles())
    suns = made.job.open().lights.directions
    assert suns[groups[0], 2].max() < suns[groups[1], 2].min()


def test_groups_hold_each_sun_once_and_enough_suns():
    rng = np.random.default_rng(3)
    for number in (1, 40, 300, 5000):
        suns = rng.normal(size=(number, 3))
        suns[:, 2] = np.abs(suns[:, 2])
        suns /= np.linalg.norm(suns, axis=1)[:, None]
        groups = list(group_suns(suns))
        assert np.array_equal(np.sort(np.concatenate(groups)), np.arange(number))
        assert min(map(len, groups)) >= min(number, LEAST)
        heights = [(suns[some, 2].min(), suns[some, 2].max()) for some in groups]
        assert all(a[1] < b[0] for a, b in pairwise(heights))


@pytest.fixture(scope="module")
def quarter(tmp_path_factory):
    """Return two files of houses that share none; some of either are proposed."""
    folder = tmp_path_factory.mktemp("quarter")
    west = make_houses(1, 30, (85000, 447000), (85120, 447110), "west")
    east = make_houses(2, 30, (85122, 447000), (85240, 447110), "east")
    return [
        write_city(folder / "a_west.city.json", west),
        write_city(folder / "b_east.city.json", east),
    ]


PLOT = "POLYGON ((85000 447000, 85060 447000, 85060 447060, 85000 447060, 85000 447000))"


@pytest.mark.parametrize(
    ("receivers", "more"),
    [
        ("top", {"proposed": "* 1*", "under": "3h", "date": "2026-03-20,2026-12-21"}),
        ("ground", {"proposed": "west 2?", "by": "layer", "every": "10min"}),
        (
            "top",
            {"proposed": "west 2?", "replace": "* 1*", "replace_in": PLOT, "canopy": "east 1?"},
        ),
        ("top", {"who": ("west 1*", "east*"), "canopy": "east 2*"}),
        ("ground", {"by": "part", "who": "* 1", "exact": True, "every": "1h"}),
    ],
)
def test_hours_due_to_groups_are_those_of_one_study(quarter, tmp_path, receivers, more):
    options = {
        **DAY, **more, "receivers": receivers, "cell": 5.0 if "exact" in more else 3.0,
        "extent": (84960, 446960, 85280, 447180),
    }  # fmt: skip
    sides = sample_cases((3000, 110, 64), 2, len(more))
    made, whole = check_tiles(quarter, tmp_path, sides, **options)
    if "proposed" in more:
        rows = list_neighbours(made.folder)
        assert [row["name"] for row in rows] == whole.neighbour.values.tolist()
        names = ("name", "area", "area_touched", "area_newly_under", "most_hours_lost")
        assert set(rows[0]) == {*names, "mean_hours_lost"}
        assert len(whole.neighbour) > (receivers == "top")
        assert float(whole.neighbour_area_newly_under.sum()) > 0


def test_a_proposal_takes_sun_from_the_same_walls_in_any_tile(quarter, tmp_path):
    options = {
        **DAY, "receivers": "surfaces", "spacing": 2.0, "proposed": "west 2?", "by": "kind",
        "replace": "west 1?",
    }  # fmt: skip
    scene = umbra.read(*quarter)
    whole = umbra.shadow_study(scene, umbra.find_site(scene), **options).dataset
    for side in (3000, 70):
        made = umbra.city_study(quarter, out=tmp_path / str(side), tiles=side, **options)
        found = made.dataset.load()
        for name in whole.variables:
            if name.startswith(("neighbour", "hours_lost", "newly", "cast", "sole", "shadow")):
                left, right = found[name].values, whole[name].values
                assert left.astype(right.dtype).tobytes() == right.tobytes(), name
    assert len(whole.neighbour) > 5


def test_a_year_far_from_the_proposal_has_the_same_bytes(quarter, tmp_path, groups):
    options = {
        "date": "2026-12-01..2026-12-20", "start": "00:00", "end": "24:00", "every": "30min",
        "by_day": False, "receivers": "ground", "cell": 4.0, "proposed": "west 20",
        "replace": "west 21",
        "extent": (84960, 446860, 85280, 447180),
    }  # fmt: skip
    check_tiles(quarter, tmp_path, [80], **options)
    assert groups  # of the tiles that the proposal cannot reach
