"""Where a study's cells are, how the default extent is chosen, and what does not fit."""

import numpy as np
import pytest
from support.days import around, parts, pole
from support.shapes import box

import umbra
from umbra import InputError
from umbra.receivers import layout
from umbra.receivers.counted import NEAR
from umbra.scene import make_scene

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-06-21", "start": "11:00", "end": "13:00", "every": "1h"}
HOUSE = box((0, 0, 0), (8, 6, 10))


def study(scene=None, **options):
    return umbra.shadow_study(scene or make_scene(*HOUSE), VIENNA, **{**DAY, **options})


@pytest.mark.parametrize(
    ("extent", "cell", "x", "y"),
    [
        ((0, 0, 10, 5), 0.5, (20, 0.25, 9.75), (10, 0.25, 4.75)),
        ((-3, 2, 0, 4), 1.0, (3, -2.5, -0.5), (2, 2.5, 3.5)),
        ((0, 0, 0.3, 0.7), 0.1, (3, 0.05, 0.25), (7, 0.05, 0.65)),  # not 4 x 8 by rounding
        ((0, 0, 10.2, 5), 0.5, (21, 0.25, 10.25), (10, 0.25, 4.75)),  # covers all of it
        ((0, 0, 2, 3), 100.0, (1, 50, 50), (1, 50, 50)),
    ],
)
def test_extent_and_cell(extent, cell, x, y):
    result = study(extent=extent, cell=cell)
    for values, (count, first, last) in ((result.x, x), (result.y, y)):
        assert len(values) == count
        np.testing.assert_allclose([values[0], values[-1]], [first, last], atol=1e-12)


def test_extent_and_size_give_oblong_cells():
    result = study(extent=(-10, 0, 10, 6), size=(50, 30))
    np.testing.assert_allclose(result.x, -9.8 + 0.4 * np.arange(50), atol=1e-12)
    np.testing.assert_allclose(result.y, 0.1 + 0.2 * np.arange(30), atol=1e-12)
    fine = study(extent=(-10, 0, 10, 6), size=(150, 30))  # every third cell has the same centre
    np.testing.assert_array_equal(result.shadow_hours, fine.shadow_hours[:, 1::3])
    assert 0.1 < float((result.shadow_hours > 0).mean()) < 0.9
    assert result.shadow_hours.shape == (30, 50)


def test_size_alone_divides_the_default_extent():
    coarse, fine = study(size=(40, 20)), study(size=(80, 80))
    for name in "xy":
        edges = [
            (r[name].values[[0, -1]] + np.diff(r[name].values)[0] * np.array([-0.5, 0.5]))
            for r in (coarse, fine)
        ]
        np.testing.assert_allclose(*edges)


def test_georeferenced_cells_are_exact_in_the_model_s_own_coordinates():
    corner = np.array([601_234.25, 5_340_567.75])
    scene = make_scene(HOUSE[0] + [*corner, 160], HOUSE[1])
    extent = (*(corner - 12.3), *(corner + 20.1))
    result = study(scene, extent=extent, cell=0.3)
    assert (scene.origin[:2] != 0).all()
    np.testing.assert_allclose(
        result.x, corner[0] - 12.3 + 0.15 + 0.3 * np.arange(108), rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(
        result.y, corner[1] - 12.3 + 0.15 + 0.3 * np.arange(108), rtol=0, atol=1e-9
    )
    assert (result.receiver_z == 160).all()
    # And the house itself is where it is: its ground is in shadow all the time.
    inside = result.shadow_hours.sel(x=corner[0] + 4, y=corner[1] + 3, method="nearest")
    assert float(inside) == 2


def test_cells_outside_the_shadows_lie_in_the_sun():
    result = study(extent=(1000, 1000, 1100, 1050), cell=1.0)
    assert not result.shadow_hours.values.any()
    np.testing.assert_array_equal(result.sun_hours, 2)


def test_casters_outside_the_extent_cast_into_it():
    result = study(extent=(1, 7, 7, 9), cell=0.5)  # the street north of the house at noon
    assert (result.shadow_hours.values[0] > 0).any()
    everywhere = study(extent=(-20, -20, 30, 30), cell=0.5)
    np.testing.assert_array_equal(
        result.shadow_hours, everywhere.shadow_hours.sel(x=result.x, y=result.y)
    )


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_default_extent_holds_the_model_and_its_shadows(receivers):
    result = study(receivers=receivers, cell=0.25)
    wide = study(receivers=receivers, cell=0.25, extent=(-60, -60, 60, 60))
    assert (result.shadow_hours > 0).sum() == (wide.shadow_hours > 0).sum()
    border = np.ones(result.shadow_hours.shape, bool)
    border[1:-1, 1:-1] = False
    assert not result.shadow_hours.values[border].any()
    assert result.x.min() < 0
    assert result.x.max() > 8
    assert result.y.min() < 0
    assert result.y.max() > 6
    ring = NEAR / 0.25  # cells of the ground near the house, on either side
    assert ring < result.sizes["x"] / 2 < ring + 40  # and not much more than both


def test_default_extent_holds_the_profile_s_shadows_too():
    # One step: its midpoint is noon, the stamps are hours away and cast far to either side.
    result = study(start="09:00", end="17:00", every="8h", cell=0.25)
    morning, evening = (
        study(start=start, end=end, every="1min", extent=(-60, -60, 60, 60), cell=0.25)
        for start, end in (("09:00", "09:01"), ("16:59", "17:00"))
    )
    for shadow in (morning, evening):
        x = shadow.x.values[(shadow.shadow_hours.values > 0).any(0)]
        assert result.x.min() <= x.min()
        assert result.x.max() >= x.max()


def test_each_ground_of_one_scene_has_its_own_default_extent():
    scene = make_scene(*HOUSE)
    high, low = (study(scene, ground=ground) for ground in (0.0, -40.0))
    np.testing.assert_array_equal(low.x, study(ground=-40.0).x)  # another scene, nothing kept
    assert high.y[-1] - high.y[0] < low.y[-1] - low.y[0]  # 40 m of slope more


def test_default_extent_is_bounded_at_dawn():
    result = study(start="04:50", end="06:00", every="5min")
    assert float(result.sun_altitude.min()) < 2  # shadows of 280 m and more
    assert 40 < float(result.x.max() - result.x.min()) < 110
    assert max(result.sizes["x"], result.sizes["y"]) <= 1100


def test_default_cell_is_round():
    result = study()
    cell = float(np.diff(result.x)[0])
    assert np.isclose(cell, [0.01, 0.02, 0.05, 0.1]).any()
    assert 400 < max(result.sizes["x"], result.sizes["y"]) < 1100


def test_flat_model_has_a_default_extent():
    sheet = np.array([(0, 0, 0), (10, 0, 0), (10, 10, 0)], float), np.array([[0, 1, 2]])
    assert not study(make_scene(*sheet)).shadow_hours.values.any()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"cell": 1.0, "size": (3, 3)}, "not both"),
        ({"cell": 0.0}, "larger than 0"),
        ({"cell": -1.0}, "larger than 0"),
        ({"cell": float("nan")}, "larger than 0"),
        ({"cell": 1e-300}, "1e-09 at least"),
        ({"cell": 1e-9}, "GB"),
        ({"size": (0, 5)}, "1x1"),
        ({"extent": (0, 0, 0, 5)}, "XMIN < XMAX"),
        ({"extent": (5, 0, 0, 5)}, "got 5,0,0,5"),
        ({"extent": (0, 0, float("inf"), 5)}, "XMIN < XMAX"),
        ({"extent": (-1e308, 0, 1e308, 5)}, "extent"),
        ({"ground": float("nan")}, "ground"),
        ({"receivers": "roof"}, "choose ground, top"),
        ({"device": "gpu"}, "not one of auto, cpu"),
        ({"threads": 0}, "at least 1"),
        ({"refraction": "some"}, "refraction"),
        ({"cast": ["wall*"]}, "mesh"),
        ({"no_cast": ["*"]}, "no part is left"),
        ({"every": "3h"}, "2h"),
    ],
)
def test_wrong_options_are_refused_in_one_line(options, words):
    with pytest.raises(InputError, match=words) as caught:
        study(**options)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"no_cast": 3}, "no_cast is text, or several texts; got 3"),
        ({"cast": [3]}, r"cast is text, or several texts; got \[3\]"),
        ({"masks": "yes"}, "masks is True or False; got 'yes'"),
        ({"threads": True}, "threads is a whole number; got True"),
        ({"date": 20260321}, "'20260321' is not a date"),
    ],
)
def test_wrong_types_are_refused_in_one_line(options, words):
    with pytest.raises(InputError, match=words):
        study(**options)


@pytest.mark.parametrize("gigabytes", [0.5, 4.0, 64.0])
@pytest.mark.parametrize("masks", [False, True])
@pytest.mark.parametrize("extent", [None, (0, 0, 17, 6.3)])
def test_too_large_a_raster_is_told_a_cell_that_fits(monkeypatch, gigabytes, masks, extent):
    monkeypatch.setattr(layout, "find_memory", lambda: gigabytes * 1e9)
    with pytest.raises(InputError, match=r"needs [\d.]+ GB and this (process|machine)") as caught:
        study(cell=0.00007, masks=masks, extent=extent)
    message = str(caught.value)
    assert ("leave out the masks" in message) == masks
    fits = float(message.partition("a cell of ")[2].partition(" m ")[0])
    bounds, suns = (
        layout.Skyline.of(np.array([[0.0, 0, 0], [8, 6, 10]]), 0.0),
        np.array([[0.3, -0.2, 0.8]]),
    )
    grid, _, _ = layout.lay_out(bounds, suns, extent=extent, cell=fits, masks=2 * masks)
    assert grid.cols * grid.rows > 10_000  # and not a guess far on the safe side


def test_parts_in_different_coordinates_are_told_and_no_cell_is_advised():
    corners, suns = np.array([[0.0, 0, 0], [530_009, 180_009, 9]]), np.array([[0.3, -0.2, 0.8]])
    with pytest.raises(InputError, match="551 x 201 km: are all parts in the same") as caught:
        layout.lay_out(layout.Skyline.of(corners, 0.0), suns, cell=0.5)
    assert "would fit" not in str(caught.value)


def test_dates_that_do_not_fit_may_be_kept_as_sums(monkeypatch):
    monkeypatch.setattr(layout, "find_memory", lambda: 4e9)
    options = {"cell": 0.00007, "date": ["2026-09-18", "2026-12-21"]}
    with pytest.raises(InputError, match="or keep only the sums of the dates"):
        study(**options)
    with pytest.raises(InputError) as caught:
        study(**options, by_day=False)
    assert "sums" not in str(caught.value)


def test_small_rasters_fit_on_small_machines(monkeypatch):
    monkeypatch.setattr(layout, "find_memory", lambda: 1e9)
    study(size=(512, 512))


def test_casting_is_chosen_by_name_or_kind(noon, at_45):
    # Two poles 4 m apart; both receive, whoever casts.
    scene = parts(
        west=box((-0.1, -0.1, 0), (0.1, 0.1, 10)), east=box((3.9, -0.1, 0), (4.1, 0.1, 10))
    )
    options = {**around(noon), "refraction": "none", "extent": (-2, -1, 6, 12), "size": (400, 26)}

    def columns(**chosen):
        result = umbra.shadow_study(scene, at_45, **options, **chosen)
        x = result.x.values[(result.shadow_hours.values[10] > 0)]
        return {"west": (x < 2).any(), "east": (x > 2).any()}

    assert columns() == {"west": True, "east": True}
    assert columns(cast=["east"]) == {"west": False, "east": True}
    assert columns(cast=["w*"]) == {"west": True, "east": False}
    assert columns(no_cast=["?est"]) == {"west": False, "east": True}
    assert columns(cast=["*s*"], no_cast=["east"]) == {"west": True, "east": False}
    top = umbra.shadow_study(
        scene, at_45, **{**options, "size": (400, 1300)}, cast=["east"], receivers="top"
    )
    assert float(top.receiver_z.sel(x=0.01, y=0.005, method="nearest")) == 10


def test_pole_s_default_ground_is_its_foot(noon, at_45):
    lifted = make_scene(pole().triangles().vertices + [0, 0, 123.5], pole().triangles().faces)
    result = umbra.shadow_study(lifted, at_45, **around(noon), cell=0.05)
    assert (result.receiver_z == 123.5).all()
    assert float(result.y[(result.shadow_hours > 0).any("x")].max()) == pytest.approx(10.1, abs=0.1)


@pytest.mark.parametrize("stray", [(1e5, 1e5, 0.0), (0.0, 0.0, 1e5), (np.nan, np.nan, np.nan)])
def test_a_vertex_that_no_face_uses_does_not_widen_the_plan(stray):
    vertices, faces = HOUSE
    plain = study()
    found = study(make_scene(np.concatenate([vertices, [stray]]), faces))
    for name in ("x", "y", "shadow_hours"):
        np.testing.assert_array_equal(found[name], plain[name])
