"""Named areas: their shares and hours of sun, against shapely and by hand."""

import json

import numpy as np
import pytest
from support.days import around, parts
from support.shapes import box, sheet

import umbra
from umbra.errors import InputError
from umbra.receivers import find_kind
from umbra.receivers.lattice import choose_side, cut_polygon
from umbra.scene.named_places import Area
from umbra.writers.folder import Outputs

shapely = pytest.importorskip("shapely")

HOLED = shapely.box(-8, 2, 9, 17).difference(shapely.Point(1, 10).buffer(3))
BENT = shapely.Polygon([(0, 3), (12, 5), (12, 19), (6, 19), (6, 8), (0, 8)])
SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-21", "every": "1h", "threads": 1}


@pytest.fixture(scope="module")
def scene():
    """A wall of 10 m along x, whose north face is y = 0."""
    return parts(wall=box((-300, -1, 0), (300, 0, 10)))


@pytest.mark.parametrize("turn", [0, 17, 45])
@pytest.mark.parametrize("shape", [HOLED, BENT])
def test_shares_are_those_of_the_shadow_line(scene, at_45, noon, shape, turn):
    """Under a sun 45 degrees high in the south the wall's shadow ends at y = 10."""
    shape = shapely.affinity.rotate(shape, turn, origin=(0, 10))
    shape = shape.intersection(shapely.box(-50, 0.1, 50, 50))
    study = umbra.shadow_study(
        scene, at_45, **around(noon), refraction="none", areas={"garden": shape},
        least="1s", receivers="areas", ground=0.0, threads=1,
    )  # fmt: skip
    (row,) = study.areas.to_dict("records")
    lit = shape.intersection(shapely.box(-50, 10, 50, 50)).area / shape.area
    assert row["share_1s"] == pytest.approx(lit, abs=2e-3)
    assert row["mean_sun_hours"] * 1800 == pytest.approx(lit, abs=2e-3)
    assert row["area_m2"] == pytest.approx(shape.area, rel=1e-12)
    assert (row["least_sun_hours"], row["most_sun_hours"] * 1800) == (0.0, pytest.approx(1.0))


def test_squares_add_up_and_lie_inside():
    for shape in (HOLED, BENT, shapely.MultiPolygon([BENT, shapely.box(40, 40, 41, 43)])):
        points, areas = cut_polygon(shape, choose_side(shape.area, None))
        assert areas.sum() == pytest.approx(shape.area, rel=1e-12)
        assert shapely.intersects_xy(shape, *points.T).all()
        assert len(points) >= 400
        # A second moment about a corner is exact to the square of the side.
        moment = (areas * points[:, 0] ** 2).sum()
        finer, small = cut_polygon(shape, choose_side(shape.area, None) / 4)
        assert moment == pytest.approx((small * finer[:, 0] ** 2).sum(), rel=1e-3)


def test_lines_along_the_sides_pass_between_the_squares():
    """A lattice along the sides would be off by half a square: 1.3 %."""
    points, areas = cut_polygon(shapely.box(0, 0, 10, 10), 0.25)
    lines = np.linspace(0.5, 9.5, 91)
    found = [areas[points[:, 1] < line].sum() / 100 for line in lines]
    assert np.abs(found - lines / 10).max() < 1e-3


def test_the_last_sun_is_that_of_the_sample_that_keeps_it_longest():
    """East of a wall along y the sun leaves first beside the wall, and last far from it."""
    wall = parts(wall=box((-1, -300, 0), (0, 300, 10)))
    areas = {"near": shapely.box(0.1, 0, 1, 5), "both": shapely.box(0.1, 0, 20, 5)}
    asked = {**DAY, "every": "15min", "receivers": "areas", "ground": 0.0}
    near, both = umbra.shadow_study(wall, SITE, **asked, areas=areas).areas["last_sun"]
    assert both - near > np.timedelta64(2, "h")


def test_a_garden_smaller_than_a_cell_is_sampled(scene):
    areas = {"park": shapely.box(-20, 1, 20, 41), "yard": shapely.box(0, 5, 0.5, 5.5)}
    study = umbra.shadow_study(scene, SITE, **DAY, areas=areas, cell=2.0, receivers="areas")
    table = study.result.areas
    counts = np.bincount(study.result.laid.owner)
    assert (counts >= 400).all()
    assert "1 too small for cells of 2 m" in table.notes[-1]
    assert list(study.areas["name"]) == ["park", "yard"]
    assert study.areas["area_m2"].tolist() == pytest.approx([1600.0, 0.25])


def test_each_date_has_its_row_and_variables_are_by_name_and_date(scene, tmp_path):
    import xarray as xr  # noqa: PLC0415

    study = umbra.shadow_study(
        scene, SITE, date="2026-03-21,2026-06-21", every="1h", cell=4.0, least="90min",
        areas={"garden": HOLED, "yard": BENT}, threads=1,
    )  # fmt: skip
    frame = study.areas
    assert list(frame.columns) == [
        "name", "date", "area_m2", "share_90min", "mean_sun_hours", "least_sun_hours",
        "most_sun_hours", "first_sun", "last_sun", "from", "to",
    ]  # fmt: skip
    assert [str(day.date()) for day in frame["date"]] == ["2026-03-21", "2026-06-21"] * 2
    study.write(tmp_path)
    with xr.open_dataset(tmp_path / "study.nc") as found:
        assert found.share_90min.dims == ("name", "date")
        one = found.mean_sun_hours.sel(name="yard", date="2026-06-21")
        assert float(one) == pytest.approx(frame["mean_sun_hours"][3])
        assert found.first_sun.dtype.kind == "M"
    lines = (tmp_path / "areas.csv").read_text().splitlines()
    assert lines[0] == ",".join(frame.columns)
    assert len(lines) == 5
    assert lines[1].split(",")[-2:] == ["2026-03-21T09:00:00+01:00", "2026-03-21T17:00:00+01:00"]


def test_before_is_without_the_proposal_and_ratios_are_of_it():
    scene = parts(
        old=box((-300, -1, 0), (0, 0, 10)), new=box((0, -1, 0), (300, 0, 30))
    )  # fmt: skip
    areas = {"garden": shapely.box(-10, 1, 10, 21)}
    both = umbra.shadow_study(scene, SITE, **DAY, areas=areas, receivers="areas", proposed="new")
    old = umbra.shadow_study(scene, SITE, **DAY, areas=areas, receivers="areas", no_cast="new")
    with_new, without = both.areas.iloc[0], old.areas.iloc[0]
    for column in ("share_2h", "mean_sun_hours", "most_sun_hours", "first_sun", "last_sun"):
        assert with_new[f"{column}_before"] == without[column]
    for column in ("share_2h", "mean_sun_hours"):
        assert with_new[f"{column}_ratio"] == with_new[column] / without[column]
        assert 0 < with_new[f"{column}_ratio"] < 0.9


def test_without_any_other_caster_all_is_sun_before():
    scene = parts(new=box((-300, -1, 0), (300, 0, 10)))
    study = umbra.shadow_study(
        scene, SITE, **DAY, areas={"garden": HOLED}, receivers="areas", proposed="new"
    )
    row = study.areas.iloc[0]
    assert row["share_2h_before"] == pytest.approx(1.0, abs=1e-9)
    assert row["mean_sun_hours_before"] == pytest.approx(8.0, abs=1e-6)


def test_the_same_beside_a_plan_and_alone(scene):
    beside = umbra.shadow_study(scene, SITE, **DAY, areas={"garden": HOLED}, cell=1.0)
    alone = umbra.shadow_study(
        scene, SITE, **DAY, areas={"garden": HOLED}, cell=1.0, receivers="areas"
    )
    assert beside.areas.equals(alone.areas)
    hours = alone.result.laid.average(alone.result.sun_hours)
    assert hours == pytest.approx(alone.areas["mean_sun_hours"].to_numpy(), abs=1e-6)


def test_exact_hours_are_near_those_of_steps(scene):
    asked = {"areas": {"garden": HOLED}, "receivers": "areas", "threads": 1}
    steps = umbra.shadow_study(scene, SITE, date="2026-03-21", every="5min", **asked).areas
    exact = umbra.shadow_study(scene, SITE, date="2026-03-21", every="1h", exact=True, **asked)
    for column in ("share_2h", "mean_sun_hours"):
        assert exact.areas[column][0] == pytest.approx(steps[column][0], abs=0.01)
    # Within the step, and not at its ends.
    assert exact.areas["last_sun"][0].minute == steps["last_sun"][0].minute


@pytest.mark.parametrize(
    ("on", "heights"),
    [("ground", (0, 4)), ("ground+1.5", (1.5, 5.5)), ("mean+1", (3, 3)), ("top", (5, 5))],
)
def test_what_areas_are_judged_on(on, heights):
    """Land that rises from 0 at x = 0 to 4 at x = 10, and a roof at 5 m over all of it."""
    land, faces = sheet([(0, 0, 0), (10, 0, 4), (10, 10, 4), (0, 10, 0)])
    floors = [sheet([(-1, -1, z), (11, -1, z), (11, 11, z), (-1, 11, z)]) for z in (4.5, 5)]
    scene = umbra.make_scene([
        umbra.Part("land", "TINRelief", umbra.Mesh(land, faces)),
        *(umbra.Part("roof", "Building", umbra.Mesh(*floor)) for floor in floors),
    ])  # fmt: skip
    study = umbra.shadow_study(
        scene, SITE, **DAY, areas={"plot": shapely.box(0, 0, 10, 10)}, areas_on=on,
        receivers="areas",
    )  # fmt: skip
    points = study.result.laid.places.points
    low, high = points[:, 2].min(), points[:, 2].max()
    assert (low, high) == (
        pytest.approx(heights[0], abs=0.15), pytest.approx(heights[1], abs=0.15)
    )  # fmt: skip
    if on == "ground":
        np.testing.assert_allclose(points[:, 2], 0.4 * points[:, 0], atol=1e-12)
        assert "1 area lies in part under roofs" in study.result.areas.notes[0]
    lit = study.areas["mean_sun_hours"][0]
    assert lit == pytest.approx(8.0, abs=1e-6) if on == "top" else lit < 8


def test_parts_of_the_model_are_areas_with_holes():
    ring = [sheet([(0, 0, 0), (9, 0, 0), (9, 3, 0), (0, 3, 0)]),
            sheet([(0, 6, 0), (9, 6, 0), (9, 9, 0), (0, 9, 0)]),
            sheet([(0, 3, 0), (3, 3, 0), (3, 6, 0), (0, 6, 0)]),
            sheet([(6, 3, 0), (9, 3, 0), (9, 6, 0), (6, 6, 0)])]  # fmt: skip
    lawn = [umbra.Part("lawn", "LandUse", umbra.Mesh(*one)) for one in ring]
    tower = umbra.Part("tower", "Building", umbra.Mesh(*box((20, 0, 0), (25, 5, 20))))
    scene = umbra.make_scene([*lawn, tower])
    study = umbra.shadow_study(scene, SITE, **DAY, areas="LandUse", receivers="areas")
    (area,) = study.result.laid.records
    assert (area.name, area.area_m2) == ("lawn", pytest.approx(72.0))
    assert len(area.polygon.interiors) == 1


def test_other_measures_are_means(scene):
    study = umbra.shadow_study(
        scene, measure="sky_view_factor", areas={"yard": shapely.box(-1, 1, 1, 3)},
        receivers="areas", sky_directions=500, threads=1,
    )  # fmt: skip
    frame = study.areas
    assert list(frame.columns) == ["name", "date", "area_m2", "mean_sky_view_factor"]
    assert 0.5 < frame["mean_sky_view_factor"][0] < 0.65
    assert frame["date"].isna().all()


def test_names_that_points_have_already_do_not_clash(scene):
    study = umbra.shadow_study(
        scene, SITE, **DAY, receivers="points", points=[[0, 5, 1]], names=["bench"], spells=True,
        areas={"garden": HOLED},
    )  # fmt: skip
    assert study.dataset["name"].item() == "bench"
    assert study.dataset["area_name"].item() == "garden"
    assert study.dataset["area_first_sun"].dims == ("area_name", "date")


SLIPS = [
    ({"bow": shapely.Polygon([(0, 0), (4, 4), (4, 0), (0, 4)])}, "not a valid polygon"),
    ({"far": shapely.box(0, 9e5, 1, 9e5 + 1)}, "from the model"),
    ([Area("a", HOLED), Area("a", BENT)], "2 areas are called 'a'"),
    ({}, "holds no polygon"),
    ({"line": shapely.LineString([(0, 0), (1, 1)])}, "is not a polygon"),
    (7, "areas is a file of polygons"),
    ("Garden*", "matches no part"),
]


@pytest.mark.parametrize(("areas", "words"), SLIPS)
def test_slips_are_one_line_with_the_remedy(scene, areas, words):
    with pytest.raises(umbra.InputError, match=words) as caught:
        umbra.shadow_study(scene, SITE, **DAY, areas=areas, cell=4)
    assert caught.value.option == "areas"
    assert "\n" not in str(caught.value)


def test_slips_in_what_goes_with_areas(scene):
    for given, option in (
        ({"areas_on": "roof"}, "areas_on"), ({"least": "never"}, "least"),
        ({"extent": (100, 100, 110, 110)}, "areas"),
    ):  # fmt: skip
        with pytest.raises(umbra.InputError) as caught:
            umbra.shadow_study(scene, SITE, **DAY, areas={"garden": HOLED}, **given)
        assert caught.value.option == option
    with pytest.raises(umbra.InputError) as caught:
        umbra.shadow_study(scene, SITE, **DAY, least="1h", cell=4)
    assert caught.value.option == "least"
    with pytest.raises(umbra.InputError, match="no areas"):
        umbra.shadow_study(scene, SITE, **DAY, cell=9).areas  # noqa: B018


@pytest.mark.parametrize(
    "more", [{"by": "part"}, {"who": "wall"}, {"who": "wall", "proposed": "wall"}]
)
@pytest.mark.parametrize("receivers", ["areas", "ground"])
def test_who_takes_the_sky_of_areas(scene, receivers, more):
    study = umbra.shadow_study(
        scene, None, measure="sky_blocked_by", receivers=receivers, areas={"garden": BENT},
        ground=0.0, cell=2.0, sky_directions="tregenza", threads=1, **more,
    )  # fmt: skip
    (row,) = study.areas.to_dict("records")
    bare = umbra.shadow_study(
        scene, None, measure="sky_component", receivers="areas", areas={"garden": BENT},
        ground=0.0, cell=2.0, sky_directions="tregenza", threads=1,
    )  # fmt: skip
    (free,) = bare.areas["mean_sky_component"]
    assert row["mean_sky_blocked"] == pytest.approx(100 - free, abs=0.5)
    if "proposed" in more:
        assert row["mean_sky_blocked_before"] == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("receivers", ["areas", "windows"])
def test_a_file_that_is_written_anyhow_is_not_asked_for(receivers):
    with pytest.raises(InputError) as told:
        Outputs(formats="csv").check_receivers(receivers)
    assert told.value.option == "write"
    assert find_kind(receivers).own_table in str(told.value)


@pytest.mark.parametrize("band", [("0", "5"), ("5", "10")])
def test_shares_of_bands_around_a_plot(scene, at_45, noon, band):
    """On a plane 4 m up the shadow of the wall of 10 m ends at y = 6."""
    plot = shapely.box(-20, -31, 20, -1)
    study = umbra.shadow_study(
        scene, at_45, **around(noon), refraction="none", areas={"plot": plot}, ground=0.0,
        areas_on="mean+4", band=",".join(band), least="1s", receivers="areas", threads=1,
    )  # fmt: skip
    near, far = map(float, band)
    ring = plot.buffer(far, quad_segs=64).difference(plot.buffer(near, quad_segs=64))
    dark = ring.intersection(shapely.box(-300, -1, 300, 6)).area / ring.area
    (row,) = study.areas.to_dict("records")
    assert row["name"] == f"plot, {near:g} to {far:g} m"
    assert row["area_m2"] == pytest.approx(ring.area, rel=1e-3)
    assert row["share_1s"] == pytest.approx(1 - dark, abs=5e-3)


def test_bands_lie_over_the_mean_ground_of_their_plot():
    """The plot lies on the lower of two terraces, and its band reaches over both."""
    terraces = {
        f"at {z}": sheet([(x, -60, z), (x + 60, -60, z), (x + 60, 60, z), (x, 60, z)])
        for x, z in ((-60, 0), (0, 3))
    }
    land = umbra.make_scene([
        umbra.Part(name, "Raster", umbra.Mesh(*shape)) for name, shape in terraces.items()
    ])  # fmt: skip
    options = {"areas": {"plot": shapely.box(-20, -5, -4, 5)}, "receivers": "areas"}
    for on, heights in (("mean+4", {4.0}), ("ground+4", {4.0, 7.0})):
        study = umbra.shadow_study(land, SITE, **DAY, **options, areas_on=on, band=["2,10", "1,2"])
        assert set(np.round(study.receiver_z.values, 6)) == heights
        assert len(study.areas) == 2


def test_bands_begin_where_a_road_moves_the_boundary(tmp_path):
    """A road of 6 m south of the plot, as polygons, as a file, and as a part of the model."""
    plot, road = shapely.box(0, 0, 20, 15), [(-40, -6), (60, -6), (60, 0), (-40, 0)]
    moved = shapely.box(0, -3, 20, 15)
    scene = umbra.make_scene([
        umbra.Part("house", "Building", umbra.Mesh(*box((5, 5, 0), (9, 9, 6)))),
        umbra.Part("street", "Road", umbra.Mesh(*sheet([(x, y, 0) for x, y in road]))),
    ])  # fmt: skip
    file = tmp_path / "roads.geojson"
    geometry = {"type": "Polygon", "coordinates": [[*road, road[0]]]}
    file.write_text(json.dumps({"type": "Feature", "properties": {}, "geometry": geometry}))
    options = {"areas": {"plot": plot}, "receivers": "areas", "band": "5,10", "ground": 0.0}
    for roads in ({"road": shapely.Polygon(road)}, file, "Road"):
        study = umbra.shadow_study(scene, SITE, **DAY, **options, roads=roads)
        ring = moved.buffer(10, quad_segs=32).difference(moved.buffer(5, quad_segs=32))
        assert study.areas["area_m2"].item() == pytest.approx(ring.area, rel=1e-6)
        (told,) = [note for note in study.result.areas.notes if "moves" in note]
        assert all(f"{length:.2f} m" in told for length in (3, 6))


def test_roads_without_bands_are_refused(scene):
    for more, option in (({}, "roads"), ({"band": "5,10", "roads": "no such kind"}, "roads")):
        with pytest.raises(InputError) as error:
            umbra.shadow_study(
                scene, SITE, **DAY, areas={"plot": HOLED}, **{"roads": {"r": HOLED}, **more}
            )
        assert error.value.option == option
        assert str(error.value).startswith("roads=")


@pytest.mark.parametrize("band", ["5", "10,5", "a,b", "-1,5", "5,10,15", "5,5", "1,1e9", "nan,5"])
def test_wrong_bands_are_refused(scene, band):
    with pytest.raises(InputError) as error:
        umbra.shadow_study(scene, SITE, **DAY, areas={"plot": HOLED}, band=band)
    assert error.value.option == "band"
    with pytest.raises(InputError) as error:
        umbra.shadow_study(scene, SITE, **DAY, band="5,10")
    assert error.value.option == "band"
