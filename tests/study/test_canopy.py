"""Canopies: light that is weakened, by hand, by rays, and against studies without them."""

import numpy as np
import pytest
from support.days import around
from support.raycaster import RayCaster
from support.shapes import box, city, moved, torus_knot

import umbra
from umbra.casters import Season
from umbra.errors import InputError
from umbra.receivers import plan as study_module
from umbra.scene import Mesh, Part, make_scene
from umbra.study import make_preview, run_study

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-05", "start": "08:00", "end": "16:30", "every": "30min"}
PLACE = {"extent": (-31, -33, 36, 42), "size": (41, 43), "ground": 0.0}
RECEIVERS = ["ground", "top", "south", "200/40", "camera", "surfaces", "points"]


@pytest.fixture(scope="module")
def park():
    """Nine houses, one of them proposed, and among them crowns that overlap one another."""
    vertices, faces = city(3, seed=5, cell=13.0)
    made = []
    for k in range(9):
        name, layer = f"house {k}", "proposed" if k == 4 else "existing"
        made.append(
            Part(name, "Building", Mesh(vertices, faces[12 * k : 12 * k + 12]), layer=layer)
        )
    knot = torus_knot(n=24, m=5, radius=2.5, tube=0.8)
    for k, (x, y) in enumerate([(-6, -6), (-4, -7), (8, 7), (7, -19), (20, 18), (-20, 4)]):
        mesh = Mesh(*moved(knot, (x, y, 6 + k)))
        made.append(Part(f"tree {k}", "Tree", mesh, layer="old" if k < 3 else "young"))
    return make_scene(made)


def points():
    rng = np.random.default_rng(7)
    normals = rng.normal(size=(300, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    places = np.column_stack([rng.uniform(-30, 35, (300, 2)), rng.uniform(0.1, 9, 300)])
    return np.column_stack([places, normals / np.linalg.norm(normals, axis=1)[:, None]])


def run(park, receivers="ground", **options):
    where = {
        "ground": PLACE, "top": PLACE, "south": {"cell": 1.5}, "200/40": {"cell": 1.5},
        "camera": {"eye": (-30, -60, 30), "target": (0, 0, 4), "size": (50, 40), "ground": 0.0},
        "surfaces": {"spacing": 2.0}, "points": {"points": points()},
    }[receivers]  # fmt: skip
    return umbra.shadow_study(park, VIENNA, **{**DAY, **where, **options}, receivers=receivers)


def test_a_crown_s_shadow_at_noon_by_hand(noon, at_45):
    # At 45 degrees a plate 6 m up shades what lies 6 m north of it; the box stands in part of it.
    crown = box((-5, -5, 6), (5, 5, 7))
    house = box((1, 0, 0), (3, 1, 20))
    scene = make_scene(
        [Part("crown", "", Mesh(*crown)), Part("house", "", Mesh(*house))],
    )
    result = umbra.shadow_study(
        scene, at_45, **around(noon), refraction="none", extent=(-6, 1.5, 6, 13.5), cell=1.0,
        canopy=["crown"], transmissivity=0.25, masks=True, ground=0.0,
    )  # fmt: skip
    second = 2 / 3600
    y, x = np.meshgrid(result.y.values, result.x.values, indexing="ij")
    behind = (abs(x) < 5) & (y > 1) & (y < 12)
    dark = (x > 1) & (x < 3)  # the house's shadow, 20 m long
    expected = np.where(dark, 0.0, np.where(behind, 0.25, 1.0)) * second
    np.testing.assert_allclose(result.sun_hours, expected, rtol=1e-5)
    np.testing.assert_allclose(result.sun_hours + result.shadow_hours, second, rtol=1e-6)
    np.testing.assert_array_equal(result.in_shadow[0], dark)
    np.testing.assert_array_equal(result.under_canopy[0], behind & ~dark)
    np.testing.assert_allclose(result.canopy_hours, (behind & ~dark) * second, rtol=1e-5)
    assert result.attrs["canopy_transmissivity"] == 0.25


def test_every_instant_is_right_by_rays_through_both_groups(park):
    share = 0.3
    result = run(park, canopy=["Tree"], transmissivity=share, masks=True)
    x, y = np.meshgrid(result.x.values, result.y.values)
    places = np.stack([x, y, np.zeros(x.shape)], -1).reshape(-1, 3)
    groups = []
    for kind in ("Building", "Tree"):
        soup = park.triangles(park.select([kind]))
        groups.append((RayCaster(soup.vertices, soup.faces), len(soup.faces)))
    none, zenith = np.full(len(places), -1), np.array([0.0, 0.0, 1.0, 0.0])
    light = np.zeros(len(places))
    wrong = 0
    for k, sun in enumerate(result.sun_direction.values):
        house, tree = (
            caster.count(places, none, zenith, np.append(sun, 0.0), np.ones(n, bool)).any
            for caster, n in groups
        )
        wrong += (result.in_shadow.values[k].ravel() != house).sum()
        wrong += (result.under_canopy.values[k].ravel() != (tree & ~house)).sum()
        light += np.where(house, 0.0, np.where(tree, share, 1.0)) * 0.5
    assert wrong == 0
    assert result.under_canopy.values.sum() > 500
    np.testing.assert_allclose(result.sun_hours.values.ravel(), light, atol=1e-5)


@pytest.mark.parametrize("receivers", RECEIVERS)
@pytest.mark.parametrize("exact", [False, True])
def test_light_lies_between_solid_crowns_and_none(park, receivers, exact):
    seen = {"on": ["Building"]} if receivers not in {"ground", "top", "points"} else {}
    more = {"exact": exact, **seen}
    found = run(park, receivers, canopy=["Tree"], transmissivity=0.3, spells=exact, **more)
    houses = make_scene([part for part in park.parts if part.kind == "Building"])
    if receivers == "top":  # the crowns receive nothing: let them stand over their own tops
        without = run(houses, receivers, **more)
    else:
        without = run(park, receivers, no_cast=["Tree"], **more)
    whole = run(park, receivers, canopy=["Tree"], transmissivity=0, spells=exact, **more)
    np.testing.assert_allclose(
        found.sun_hours, 0.3 * without.sun_hours + 0.7 * whole.sun_hours, atol=2e-5
    )
    np.testing.assert_allclose(found.canopy_hours, without.sun_hours - whole.sun_hours, atol=2e-5)
    whole_day = found.sun_hours + found.shadow_hours
    np.testing.assert_allclose(whole_day.values[np.isfinite(whole_day)], 8.5, atol=1e-5)
    assert np.nanmax(found.canopy_hours) > 0.5
    if receivers not in {"top"}:
        solid = run(park, receivers, **more)
        np.testing.assert_array_equal(whole.sun_hours, solid.sun_hours)
    if exact:  # spells are of light that nothing weakens
        for name in ("first_sun", "last_sun", "sun_spells", "longest_sun_hours"):
            np.testing.assert_array_equal(found[name], whole[name])
    bare = run(park, receivers, canopy=["Tree"], transmissivity=1, **more)
    np.testing.assert_allclose(bare.sun_hours, without.sun_hours, atol=1e-5)


@pytest.mark.parametrize("way", [{}, {"masks": True}, {"exact": True}, {"sum": True}])
def test_leaves_come_and_go(park, way):
    dates = ["2026-04-14", "2026-04-15", "2026-10-31", "2026-11-01"]
    options = {"canopy": ["Tree"], "every": "1h", "start": "09:00", "end": "15:00", **way}
    by_day = {"by_day": not options.pop("sum", False)}
    found = run(
        park, date=dates, transmissivity="0.03:50%", leaf_on="04-15..10-31", **options, **by_day
    )
    shares = [0.5, 0.03, 0.03, 0.5]
    alone = [
        run(park, date=date, transmissivity=share, **options) for date, share in zip(dates, shares)
    ]
    np.testing.assert_allclose(found.sun_hours, sum(one.sun_hours for one in alone), atol=1e-4)
    np.testing.assert_allclose(
        found.canopy_hours, sum(one.canopy_hours for one in alone), atol=1e-4
    )
    if by_day["by_day"]:
        for k, one in enumerate(alone):
            for name in ("sun_hours", "shadow_hours", "canopy_hours"):
                np.testing.assert_allclose(found[f"{name}_by_day"][k], one[name], atol=1e-5)
    if "masks" in way:
        light = (1 - found.in_shadow) * (1 - (1 - found.canopy_transmissivity) * found.under_canopy)
        np.testing.assert_allclose(found.sun_hours, light.sum("time"), atol=1e-4)
    assert found.attrs["leaf_on"] == "04-15..10-31"
    assert list(found.attrs["canopy_transmissivity"]) == [0.03, 0.5]
    assert (found.sun_hours > alone[0].sun_hours).any()


def test_bare_crowns_that_let_all_through_end_no_spell(park):
    options = {"canopy": ["Tree"], "spells": True}
    bare = run(park, transmissivity=1, **options)
    without = run(park, no_cast=["Tree"], spells=True)
    for name in ("sun_spells", "longest_sun_hours", "sun_hours"):
        np.testing.assert_array_equal(bare[name], without[name])
    assert (run(park, transmissivity=0.9, **options).sun_spells > without.sun_spells).any()


def test_seasons_over_the_new_year_and_of_one_day():
    import datetime as dt  # noqa: PLC0415

    south = Season.of((0.1, 0.6), "10-01..03-31")
    shares = [south.find_share(dt.date(2026, m, d)) for m, d in ((9, 30), (10, 1), (1, 1), (4, 1))]
    assert shares == [0.6, 0.1, 0.1, 0.6]
    one = Season.of("0:1", "02-29..02-29")
    assert one.find_share(dt.date(2024, 2, 29)) == 0
    assert one.find_share(dt.date(2024, 3, 1)) == 1
    assert Season.of(None, None).find_share(dt.date(2026, 1, 1)) == 0.03


@pytest.mark.parametrize("receivers", ["ground", "top", "points"])
@pytest.mark.parametrize("exact", [False, True])
def test_whose_shadow_it_is_adds_up(park, receivers, exact):
    options = {"transmissivity": 0.3, "exact": exact, "every": "1h"}
    groups = ["Tree", "house 4", "old", "tree [13]", "*"]
    found = run(park, receivers, canopy=["Tree"], who=groups, **options)
    for group in groups[:-1]:
        left = [part for part in park.parts if not part.matches(group)]
        canopy = ["Tree"] if any(part.kind == "Tree" for part in left) else []
        rest = {} if canopy else {"transmissivity": None}
        if receivers == "top" and group == "house 4":
            continue  # other receivers
        without = run(make_scene(left), receivers, canopy=canopy, **{**options, **rest})
        np.testing.assert_allclose(
            found.sole_hours.sel(caster=group),
            without.sun_hours - found.sun_hours,
            atol=2e-5, err_msg=group,
        )  # fmt: skip
    everything = found.sel(caster="*")
    if receivers == "ground":
        np.testing.assert_allclose(everything.cast_hours, found.shadow_hours, atol=2e-5)
        np.testing.assert_allclose(everything.sole_hours, found.shadow_hours, atol=2e-5)
        alone = make_scene([part for part in park.parts if part.layer == "old"])
        cast = run(alone, canopy=["Tree"], **options).shadow_hours
        np.testing.assert_allclose(found.cast_hours.sel(caster="old"), cast, atol=2e-5)
    assert float(found.sole_hours.sel(caster="Tree").max()) > 0.3


@pytest.mark.parametrize("exact", [False, True])
def test_a_proposal_among_trees(park, exact):
    options = {"canopy": ["Tree"], "transmissivity": 0.3, "exact": exact, "every": "1h"}
    found = run(park, proposed=["proposed"], under="5h", by="layer", **options)
    existing = make_scene([part for part in park.parts if part.layer != "proposed"])
    before = run(existing, **options).sun_hours
    known = np.isfinite(found.hours_lost.values)
    lost = (before.values - found.sun_hours.values)[known]
    np.testing.assert_allclose(found.hours_lost.values[known], lost, atol=2e-5)
    newly = known & (found.sun_hours.values < 5 - 1e-4) & (before.values >= 5 - 1e-4)
    assert (found.newly_under.values != newly).mean() < 0.002  # rounding at the limit
    np.testing.assert_array_equal(
        found.hours_lost.values[known], found.sole_hours.sel(caster="proposed").values[known]
    )


def test_threads_and_tiles_change_nothing(park, monkeypatch):
    for more in ({"spells": True, "masks": True}, {"exact": True}, {"by": "kind"}):
        options = {"canopy": ["Tree"], "transmissivity": 0.2, "every": "1h", **more}
        whole = run(park, "top", threads=1, **options)
        with monkeypatch.context() as patch:
            patch.setattr(study_module, "TILE", 16)
            tiled = run(park, "top", threads=2, **options)
        for name in set(whole.data_vars) - {"receiver_z"}:
            np.testing.assert_array_equal(tiled[name], whole[name], err_msg=name)


def test_what_is_canopy_is_looked_through(park):
    top = run(park, "top", canopy=["Tree"])
    houses = make_scene([part for part in park.parts if part.kind == "Building"])
    np.testing.assert_array_equal(top.receiver_z, run(houses, "top").receiver_z)
    surfaces = run(park, "surfaces", canopy=["Tree"])
    assert not [name for name in surfaces.part.values if name.startswith("tree")]
    seen = run(park, "camera", canopy=["Tree"]).part.values
    assert not {k for k in np.unique(seen) if k >= 0 and park.parts[k].kind == "Tree"}


def test_polar_night_below_canopies(park):
    polar = umbra.Site(80.0, 15.0, "Arctic/Longyearbyen")
    night = {**DAY, "date": "2026-12-21"}
    study = run_study(park, polar, **night, **PLACE, receivers="top", canopy=["Tree"])
    assert not make_preview(study).shadows.any()


def test_a_scene_of_canopies_alone(park):
    trees = make_scene([part for part in park.parts if part.kind == "Tree"])
    found = run(trees, canopy=["*"], transmissivity=0.5, spells=True)
    solid = run(trees)
    np.testing.assert_allclose(found.shadow_hours, solid.shadow_hours / 2, atol=1e-5)
    for exact in (False, True):
        study = run_study(trees, VIENNA, **DAY, **PLACE, canopy=["*"], exact=exact, who=["tree 0"])
        assert study.shadow_hours.max() > 0
    with pytest.raises(InputError, match="nothing is left to receive"):
        run(trees, "surfaces", canopy=["*"])


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"transmissivity": 0.3}, "transmissivity= is for canopies.*canopy="),
        ({"leaf_on": "04-15..10-31"}, "leaf_on= is for canopies"),
        ({"canopy": ["Tee"]}, "'Tee' matches no part"),
        ({"canopy": ["Tree"], "no_cast": ["Tree"]}, "only parts that do not cast"),
        ({"canopy": ["Tree"], "transmissivity": "3"}, "for 3 % write 0.03 or 3%"),
        ({"canopy": ["Tree"], "transmissivity": "-0.1"}, "from 0 to 1"),
        ({"canopy": ["Tree"], "transmissivity": "nan"}, "from 0 to 1"),
        ({"canopy": ["Tree"], "transmissivity": "some"}, "from 0 to 1"),
        ({"canopy": ["Tree"], "transmissivity": "0.1:0.2:0.3"}, "one share, or two"),
        ({"canopy": ["Tree"], "transmissivity": "0.03:0.5"}, "give leaf_on="),
        ({"canopy": ["Tree"], "leaf_on": "04-15..10-31"}, "transmissivity='0.03:0.5'"),
        ({"canopy": ["Tree"], "transmissivity": "0:1", "leaf_on": "April"}, "MM-DD..MM-DD"),
        ({"canopy": ["Tree"], "transmissivity": "0:1", "leaf_on": "02-30..03-01"}, "no day 02-30"),
    ],
)
def test_slips_are_named(park, options, match):
    with pytest.raises(InputError, match=match) as caught:
        run(park, **options)
    assert "\n" not in str(caught.value)
