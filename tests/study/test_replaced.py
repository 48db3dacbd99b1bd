"""What a proposal replaces: against two studies of scenes edited by hand, and in closed form."""

import json

import numpy as np
import pytest
from support.days import around
from support.shapes import box

import umbra
from umbra.errors import InputError
from umbra.scene import Mesh, Part, make_scene
from umbra.study import StudyOptions
from umbra.study.remarks import tell_request

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-05", "start": "08:00", "end": "16:30", "every": "1h", "threads": 2}
PLACE = {"extent": (-20, -20, 40, 40), "size": (60, 60), "ground": 0.0}
POINTS = [(30.0, 30.0, 1.0), (6.0, 14.0, 0.1), (6.0, 4.0, 1.0)]  # the last inside the old house


def block(name, low, high, layer="existing", kind=""):
    return Part(name, kind, Mesh(*box(low, high)), layer=layer)


@pytest.fixture(scope="module")
def quarter():
    """An old house of 8 m and a crown beside it make way for a tower of 20 m; a neighbour stays."""
    return make_scene([
        block("neighbour", (2, 22, 0), (14, 30, 9)),
        block("land", (-20, -20, -2), (40, 40, -1), kind="LandUse"),
        block("old", (0, 0, 0), (12, 8, 8)),
        block("crown", (14, 2, 3), (18, 6, 9), kind="tree"),
        block("tower", (1, 1, 0), (6, 7, 20), layer="new"),
    ])  # fmt: skip


def edit(scene, *gone):
    return make_scene([part for part in scene.parts if part.name not in gone])


def ask(scene, **options):
    return umbra.shadow_study(scene, SITE, **{**DAY, **options})


REPLACED = {"proposed": "new", "replace": ["old", "crown"], "under": "5h"}


def check(after, before, quarter, **options):
    """Compare a study with those of what stands after and before."""
    own = ask(edit(quarter, *before[0]), **options)
    earlier = ask(edit(quarter, *before[1]), **options)
    np.testing.assert_array_equal(after.sun_hours.values, own.sun_hours.values)
    known = ~np.isnan(after.hours_lost.values)
    lost = (earlier.sun_hours.values - own.sun_hours.values)[known]
    np.testing.assert_allclose(after.hours_lost.values[known], lost, atol=2e-3)
    sun = own.sun_hours.values
    newly = (sun < 5 - 1e-4) & (earlier.sun_hours.values >= 5 - 1e-4) & known
    np.testing.assert_array_equal(after.newly_under.values, newly)
    return lost, known


@pytest.mark.parametrize("canopy", [{}, {"canopy": "crown", "transmissivity": 0.25}])
@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_plans_before_and_after(quarter, receivers, canopy):
    options = {**PLACE, "receivers": receivers}
    after = ask(quarter, **options, **REPLACED, **canopy)
    own = ask(edit(quarter, "old", "crown"), **options)
    earlier = ask(edit(quarter, "tower"), **options, **canopy)
    np.testing.assert_array_equal(after.sun_hours.values, own.sun_hours.values)
    known = ~np.isnan(after.hours_lost.values)
    lost = (earlier.sun_hours.values - own.sun_hours.values)[known]
    np.testing.assert_allclose(after.hours_lost.values[known], lost, atol=1e-5)
    # Sun is lost to the tower and won from the house, whose plan and the crown's are of neither.
    assert (lost > 0.5).any()
    assert (lost < -0.5).any()
    crown = 0 if canopy and receivers == "top" else 16
    assert (~known).sum() == 12 * 8 + crown or canopy
    assert after.attrs["replaced"] == "old, crown"


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize(
    "receivers",
    [
        {"receivers": "surfaces", "on": ["neighbour"], "spacing": 2.0},
        {"receivers": "points", "points": POINTS},
        {"receivers": "south", "extent": (-20, 0, 40, 10), "cell": 1.0},
    ],
)
def test_samples_before_and_after(quarter, receivers, exact):
    given = {**receivers, "ground": 0.0, "exact": exact}
    after = ask(quarter, **given, **REPLACED)
    states = ("old", "crown"), ("tower",)
    if given["receivers"] == "south":  # looks through the tower alone: the rest must be in view
        given["proposed"] = None
        known = ~np.isnan(after.hours_lost.values)
        assert (after.hours_lost.values[known] > 0.5).any()
        return
    lost, known = check(after, states, quarter, **given)
    assert known.all()
    assert (np.abs(lost) > 0.1).any()
    if given["receivers"] == "points":  # in the old house there was no sun
        assert after.hours_lost.values[2] == pytest.approx(-after.sun_hours.values[2], abs=1e-3)


@pytest.mark.parametrize("exact", [False, True])
def test_measures_before_and_after(quarter, exact):
    given = {
        "receivers": "points", "points": POINTS[:2], "measure": ["sky_view_factor"],
        "exact": exact, "sky_directions": 400,
    }  # fmt: skip
    scene = quarter
    both = umbra.shadow_study(scene, proposed="new", replace=["old", "crown"], **given)
    after = umbra.shadow_study(edit(scene, "old", "crown"), **given)
    before = umbra.shadow_study(edit(scene, "tower"), **given)
    for name, one in (("sky_view_factor", after), ("sky_view_factor_before", before)):
        np.testing.assert_allclose(both[name].values, one.sky_view_factor.values, rtol=1e-6)
    assert (both.sky_view_factor_lost.values != 0).all()


def test_shares_of_the_sky_before_and_after(quarter):
    given = {"receivers": "points", "points": POINTS[:2], "measure": ["sky_blocked_by"],
             "sky_directions": 400, "by": "layer"}  # fmt: skip
    both = umbra.shadow_study(quarter, proposed="new", replace=["old", "crown"], **given)
    before = umbra.shadow_study(edit(quarter, "tower"), **given)
    np.testing.assert_allclose(both.sky_blocked_before.values, before.sky_blocked.values, rtol=1e-6)


def test_the_shadow_of_a_taller_house_in_closed_form(at_45, noon):
    """Under a sun 45 degrees high in the south a wall's shadow is as long as the wall is high."""
    shapely = pytest.importorskip("shapely")
    scene = make_scene([
        block("old", (-300, -1, 0), (300, 0, 12)),
        block("new", (-300, -1, 0), (300, 0, 5), layer="new"),
    ])  # fmt: skip
    found = umbra.shadow_study(
        scene, at_45, **around(noon), refraction="none", proposed="new", replace="old",
        areas={"garden": shapely.box(-20, 0, 20, 20)}, least="1s", receivers="areas", ground=0.0,
        threads=1,
    )  # fmt: skip
    (row,) = found.areas.to_dict("records")
    assert row["share_1s"] == pytest.approx(15 / 20, abs=2e-3)
    assert row["share_1s_before"] == pytest.approx(8 / 20, abs=2e-3)
    assert row["share_1s_ratio"] == pytest.approx(15 / 8, abs=1e-2)


def tell(scene, **options):
    return tell_request(scene, StudyOptions(**DAY, **PLACE, receivers="ground", **options), SITE)


def test_a_plot_replaces_what_lies_in_it_with_half_of_its_plan(quarter, tmp_path):
    shapely = pytest.importorskip("shapely")
    plot = shapely.box(-1, -1, 9, 20)  # 9 of 12 m of the old house; 6 % of the neighbour none
    by_name = ask(quarter, **PLACE, receivers="ground", proposed="new", replace="old")
    by_plot = ask(quarter, **PLACE, receivers="ground", proposed="new", replace_in=plot)
    np.testing.assert_array_equal(by_plot.hours_lost.values, by_name.hours_lost.values)
    path = tmp_path / "plot.geojson"
    path.write_text(json.dumps(shapely.geometry.mapping(plot)))
    by_file = ask(quarter, **PLACE, receivers="ground", proposed="new", replace_in=str(path))
    np.testing.assert_array_equal(by_file.hours_lost.values, by_name.hours_lost.values)
    lines = tell(quarter, proposed="new", replace_in=plot)
    assert any("replaces old (1 object, 12 triangles)" in line for line in lines)
    assert any("cuts old (75 % inside)" in line for line in lines)
    less = tell(quarter, proposed="new", replace_in=shapely.box(-1, -1, 4, 26))
    assert any("nothing stands" in line for line in less)
    cut = next(line for line in less if "cuts" in line)
    assert "neighbour (8.33 % inside)" in cut
    assert "old (33.3 % inside)" in cut


def test_overlap_is_named_unless_it_is_replaced(quarter):
    assert any("overlaps" in line and "'old'" in line for line in tell(quarter, proposed="new"))
    assert not any("overlaps" in line for line in tell(quarter, proposed="new", replace="old"))


@pytest.mark.parametrize(
    ("options", "option"),
    [
        ({"replace": "old"}, "replace"),
        ({"replace_in": "plot.geojson"}, "replace_in"),
        ({"proposed": "new", "replace": "land"}, "replace"),
        ({"proposed": "new", "replace": "tower"}, "replace"),
        ({"proposed": "new", "replace": "odl"}, "replace"),
        ({"proposed": "new", "replace_in": "nowhere.geojson"}, "replace_in"),
        ({"proposed": "new", "replace_in": 3}, "replace_in"),
        ({"proposed": "new", "replace_in": "POLYGON((0 0,1 1"}, "replace_in"),
        ({"proposed": "new", "replace_in": "POINT(0 0)"}, "replace_in"),
    ],
)
def test_wrong_values(quarter, options, option):
    with pytest.raises(InputError) as error:
        ask(quarter, **PLACE, receivers="ground", **options)
    assert error.value.option == option


def test_ground_stays_and_is_that_of_all(quarter):
    """The foot of what is replaced tells of the ground; terrain of its layer is not replaced."""
    found = ask(quarter, proposed="new", replace="existing", receivers="top", cell=2.0)
    names = {part.name for part in found.result.model.scene.parts}
    assert {"land", "tower"} <= names
    assert not {"old", "neighbour"} & names
