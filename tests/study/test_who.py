"""Whose shadow it is: against studies of the same casters one by one, and by hand."""

import numpy as np
import pytest
from support.days import around, parts
from support.shapes import box, city, moved

import umbra
from umbra.receivers import plan as study_module
from umbra.scene import Mesh, Part, make_scene

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-05", "start": "08:00", "end": "16:30", "every": "30min"}
PLACE = {"extent": (-31, -33, 36, 42), "size": (67, 75), "ground": 0.0}


@pytest.fixture(scope="module")
def block():
    """Make three rows of houses in two layers; the last house has a gable."""
    vertices, faces = city(3, seed=5, cell=13.0)
    made = []
    for house in range(9):
        mine = faces[12 * house : 12 * house + 12]
        name, layer = f"house {house}", "proposed" if house == 4 else "existing"
        for kind, which in (("RoofSurface", slice(2, 4)), ("WallSurface", [0, 1, *range(4, 12)])):
            made.append(Part(name, kind, Mesh(vertices, mine[which]), layer=layer))
    gable = np.array([(0, 0, 0), (6, 0, 0), (6, 8, 0), (0, 8, 0), (3, 0, 5), (3, 8, 5)], float)
    sides = np.array([[0, 4, 5], [0, 5, 3], [1, 2, 5], [1, 5, 4], [0, 1, 4], [2, 3, 5],
                      [0, 2, 1], [0, 3, 2]], np.int32)  # fmt: skip
    made.append(Part("gable", "RoofSurface", Mesh(gable + [14, 24, 0], sides), layer="existing"))
    return make_scene(made)


def run(block, **options):
    return umbra.shadow_study(block, VIENNA, **{**DAY, **PLACE, **options})


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_hours_cast_are_those_of_the_caster_alone(block, receivers):
    result = run(block, receivers=receivers, who=["house 1", "house [45]", "gable"])
    assert list(result.caster.values) == ["house 1", "house [45]", "gable"]
    for pattern in result.caster.values:
        alone = run(block, cast=[pattern], receivers=receivers, masks=True)
        cast = result.cast_hours.sel(caster=pattern).values
        if receivers == "ground":
            np.testing.assert_allclose(cast, alone.shadow_hours, atol=1e-5)
        else:  # slopes turned from the sun are no one's doing
            assert (cast <= alone.shadow_hours.values + 1e-5).all()
            assert (cast == alone.shadow_hours.values).mean() > 0.9
        without = run(block, no_cast=[pattern], receivers=receivers)
        lost = without.sun_hours.values - result.sun_hours.values
        np.testing.assert_allclose(
            result.sole_hours.sel(caster=pattern).values, lost, atol=1e-5, err_msg=pattern
        )
    assert (result.sole_hours <= result.cast_hours).all()
    assert 0 < float(result.sole_hours.sum()) < float(result.cast_hours.sum())


def test_points_without_a_normal_face_every_light(block):
    points = np.array([(x, y, 0.5) for x in (-6.0, 1.3, 9.7) for y in (-3.0, 4.1, 13.2)])
    result = umbra.shadow_study(
        block, VIENNA, **DAY, receivers="points", points=points, who=["*", "house *"]
    )
    assert result.shadow_hours.max() > 0
    np.testing.assert_allclose(result.cast_hours.sel(caster="*"), result.shadow_hours, atol=1e-5)
    some = result.cast_hours.sel(caster="house *")
    assert 0 < float(some.sum()) <= float(result.shadow_hours.sum())


def test_groups_may_overlap_and_hold_all(block):
    result = run(block, who=["house *", "house 4", "RoofSurface", "*"])
    everything = result.sel(caster="*")
    np.testing.assert_allclose(everything.cast_hours, result.shadow_hours, atol=1e-5)
    np.testing.assert_allclose(everything.sole_hours, result.shadow_hours, atol=1e-5)
    for pattern in ("house *", "house 4", "RoofSurface"):
        without = run(block, no_cast=[pattern])
        lost = without.sun_hours.values - result.sun_hours.values
        np.testing.assert_allclose(result.sole_hours.sel(caster=pattern), lost, atol=1e-5)


def test_by_part_kind_and_layer(block):
    by_part = run(block, by="part")
    assert list(by_part.caster.values) == [f"house {k}" for k in range(9)] + ["gable"]
    one = run(block, who=["house 7"])
    np.testing.assert_array_equal(by_part.cast_hours[7], one.cast_hours[0])
    np.testing.assert_array_equal(by_part.sole_hours[7], one.sole_hours[0])
    by_kind = run(block, by="kind", who=["house *"])
    assert list(by_kind.caster.values) == ["RoofSurface", "WallSurface"]
    by_layer = run(block, by="layer", spells=True, masks=True)
    assert list(by_layer.caster.values) == ["existing", "proposed"]
    np.testing.assert_array_equal(
        by_layer.sole_hours.sel(caster="proposed"), run(block, who=["proposed"]).sole_hours[0]
    )


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_before_and_the_difference_equal_after(block, receivers):
    after = run(block, proposed=["proposed"], under="5h", receivers=receivers)
    existing = make_scene([part for part in block.parts if part.layer == "existing"])
    before = run(existing, receivers=receivers)
    known = ~np.isnan(after.hours_lost.values)
    # Only the proposed house's own cells are left out.
    house = 13.0**2 * np.array([0.3, 0.6]) ** 2
    assert house[0] * 0.9 < (~known).sum() * 67 * 75 / 67 / 75 < house[1] * 1.1
    lost = (before.sun_hours.values - after.sun_hours.values)[known]
    np.testing.assert_allclose(after.hours_lost.values[known], lost, atol=1e-5)
    newly = (after.sun_hours.values < 5 - 1e-4) & (before.sun_hours.values >= 5 - 1e-4) & known
    np.testing.assert_array_equal(after.newly_under.values, newly)
    assert newly.any()
    assert after.attrs["under_hours"] == 5
    # The table adds up to the map.
    cell = 1.0
    assert float(after.neighbour_area_newly_under.sum()) == pytest.approx(newly.sum() * cell)
    touched = (after.hours_lost.values > 1e-4).sum() * cell
    assert float(after.neighbour_area_touched.sum()) == pytest.approx(touched)
    assert "house 4" not in after.neighbour.values
    assert "ground" in after.neighbour.values
    assert float(after.neighbour_most_hours_lost.max()) == pytest.approx(
        np.nanmax(after.hours_lost), abs=1e-5
    )
    # The same from two studies of their own.
    compared = umbra.compare(before, run(block, receivers=receivers), "5h")
    assert compared.attrs["under_hours"] == 5
    if receivers == "top":
        np.testing.assert_array_equal(np.isnan(compared.hours_lost), ~known)
        np.testing.assert_array_equal(compared.newly_under, after.newly_under)
        np.testing.assert_allclose(compared.hours_lost.values[known], lost, atol=1e-5)
        assert compared.attrs["area_newly_under"] == pytest.approx(newly.sum())


def test_a_tower_takes_the_sun_of_the_house_north_of_it(noon, at_45):
    # At 45 degrees a tower of 10 m shades 10 m: the house, 4 m high, begins 3 m behind it.
    scene = parts(
        tower=box((0, -2, 0), (4, 0, 10)), house=box((0, 3, 0), (4, 13, 4)),
        shed=moved(box((0, 0, 0), (2, 2, 2)), (20, 20, 0)),
    )  # fmt: skip
    result = umbra.shadow_study(
        scene, at_45, **around(noon, 7200), refraction="none", receivers="top",
        extent=(-10, -10, 30, 30), cell=0.05, proposed=["tower"], under="1h30min",
    )  # fmt: skip
    table = {str(name): result.isel(neighbour=k) for k, name in enumerate(result.neighbour.values)}
    assert set(table) == {"house", "ground"}  # the shed keeps its sun
    house = table["house"]
    assert float(house.neighbour_area) == pytest.approx(40, rel=0.01)
    # At noon the shadow covers the roof's first 3 m: the one instant of this study.
    assert float(house.neighbour_area_touched) == pytest.approx(12, rel=0.02)
    assert float(house.neighbour_area_newly_under) == pytest.approx(12, rel=0.02)
    assert float(house.neighbour_most_hours_lost) == pytest.approx(2)
    assert float(house.neighbour_mean_hours_lost) == pytest.approx(2 * 12 / 40, rel=0.02)
    assert float(table["ground"].neighbour_area_touched) == pytest.approx(12, rel=0.02)


def test_threads_and_tiles_change_nothing(block, monkeypatch):
    options = {"by": "part", "proposed": ["house 4"], "receivers": "top"}
    one = run(block, threads=1, **options)
    monkeypatch.setattr(study_module, "TILE", 31)
    tiled = run(block, threads=2, **options)
    for name in one.data_vars:
        np.testing.assert_allclose(tiled[name], one[name], atol=1e-9, err_msg=name)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"who": ["tower"]}, "'tower' matches no part"),
        ({"who": ["house 4"], "no_cast": ["proposed"]}, "do not cast"),
        ({"proposed": ["proposed"], "no_cast": ["proposed"]}, "do not cast"),
        ({"proposed": ["proposed"], "under": "soon"}, "least sun"),
        ({"by": "colour"}, "part, kind, layer"),
    ],
)
def test_slips_are_told(block, options, says):
    with pytest.raises(umbra.InputError, match=says):
        run(block, **options)


def test_studies_of_other_cells_are_not_compared(block):
    with pytest.raises(umbra.InputError, match="differ in 'x'"):
        umbra.compare(run(block), run(block, size=(66, 75)))
    with pytest.raises(umbra.InputError, match="differ in 'time'"):
        umbra.compare(run(block), run(block, start="09:00"))


def test_elevations_are_compared_where_they_show_the_same(block):
    existing = make_scene([part for part in block.parts if part.layer == "existing"])
    options = {**DAY, "receivers": "south", "extent": (-31, 0, 36, 20), "cell": 1.0}
    before, after = (umbra.shadow_study(s, VIENNA, **options) for s in (existing, block))
    compared = umbra.compare(before, after, 3)
    known = ~np.isnan(compared.hours_lost.values)
    same = np.abs(before.position.values - after.position.values).max(-1) < 1e-9
    np.testing.assert_array_equal(known, same)
    lost = before.sun_hours.values - after.sun_hours.values
    np.testing.assert_array_equal(compared.hours_lost.values[known], lost[known])
    assert lost[known].min() >= 0
    assert compared.attrs == {"under_hours": 3.0}
    # One pass over the same view says the same where the house itself is not seen.
    both = umbra.shadow_study(block, VIENNA, **options, proposed=["proposed"], under=3.0)
    told = known & ~np.isnan(both.hours_lost.values)
    np.testing.assert_allclose(both.hours_lost.values[told], lost[told], atol=1e-5)
    assert told.sum() > 100


def test_things_of_one_name_in_two_layers_are_told_apart():
    places = ((0, "1", "existing"), (12, "1", "proposed"), (24, "2", "existing"))
    scene = make_scene(
        Part(name, "", Mesh(*box((x, 0, 0), (x + 4, 4, 6))), layer=layer)
        for x, name, layer in places
    )
    assert scene.labels() == ["existing/1", "proposed/1", "2"]
    assert scene.select(["proposed/1"]) == [1]
    assert len(scene["existing/1"]) == 1
    assert len(scene["1"]) == 2
    result = umbra.shadow_study(scene, VIENNA, **DAY, cell=1.0, by="part")
    assert sorted(result.caster.values) == ["2", "existing/1", "proposed/1"]
    sampled = umbra.shadow_study(scene, VIENNA, **DAY, receivers="surfaces", spacing=2.0)
    assert sorted(sampled.part.values) == ["2", "existing/1", "proposed/1"]
