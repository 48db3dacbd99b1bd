"""Measures of the sky: closed forms, canopies, proposals, sets of directions, and what is asked."""

import numpy as np
import pytest

import umbra
from umbra.errors import InputError
from umbra.lights import Lights, find_directions
from umbra.scene import Mesh, Part, make_scene
from umbra.study import StudyOptions, run
from umbra.study.measures import MEASURES, Measure
from umbra.study.measures.measure import COLUMN_BYTES, LEAST_TILE
from umbra.study.setup import Setup

HIGH = 10.0


def box(x0, y0, z0, x1, y1, z1):
    corners = np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)], float)
    faces = [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]  # fmt: skip
    return Mesh(corners, np.array(faces, np.int32))


@pytest.fixture(scope="module")
def wall():
    """A wall so long that it is endless to what stands before its middle."""
    return make_scene([Part("wall", "", box(0, -4000, 0, 5, 4000, HIGH))])


@pytest.fixture(scope="module")
def street():
    """A house, a tree and a tower that is proposed."""
    return make_scene(
        [
            Part("house", "", box(0, 0, 0, 10, 8, 6)),
            Part("tree", "", box(-6, 0, 2, -3, 3, 6)),
            Part("tower", "", box(14, 0, 0, 18, 6, 20)),
        ]
    )


def ask(scene, measure="sky_view_factor", **options):
    options = {"receivers": "ground", "cell": 1.0, "sky_directions": 300, **options}
    return umbra.shadow_study(scene, measure=measure, **options).dataset


def test_a_level_place_before_an_endless_wall(wall):
    """An endless wall of height h at distance d leaves (1 + cos(atan(h / d))) / 2 of the sky."""
    data = ask(wall, extent=(-40, -1, 0, 1), sky_directions=4096)
    angle = np.arctan2(HIGH, -data.x.values)
    assert np.abs(data.sky_view_factor.values - (1 + np.cos(angle)) / 2).max() < 3e-3


@pytest.mark.parametrize(("measure", "level", "upright"), [
    ("sky_view_factor", 1.0, 0.5), ("sky_component", 100.0, 100 * 0.39616)])  # fmt: skip
@pytest.mark.parametrize("directions", [4096, "tregenza", "reinhart2", "reinhart4"])
def test_a_free_plane(wall, measure, level, upright, directions):
    places = [[500, 0, 50, 0, 0, 1], [500, 0, 50, 1, 0, 0], [500, 0, 50, 0, 0, -1]]
    found = ask(wall, measure, receivers="points", cell=None, points=places,
                sky_directions=directions)[measure].values  # fmt: skip
    error = 1.5e-2 if directions == "tregenza" else 3e-3  # of 145 patches
    assert found == pytest.approx([level, upright, 0], abs=error * level)


def test_points_without_a_normal_are_level(wall):
    places = np.array([[-3.0, 0, 0], [-10, 0, 2]])
    faced = np.column_stack([places, np.tile([0, 0, 1.0], (2, 1))])
    bare, level = (
        ask(wall, receivers="points", cell=None, points=points).sky_view_factor.values
        for points in (places, faced)
    )
    assert np.array_equal(bare, level)


def test_a_wall_sees_half_of_what_it_would(street):
    data = ask(street, receivers="surfaces", cell=None, spacing=1.0)
    upright = np.abs(data.normal.values[:, 2]) < 1e-6
    assert data.sky_view_factor.values[upright].max() <= 0.5 + 4e-3
    mean = data.surface_mean_sky_view_factor.values
    own = data.surface_of_sample.values
    weighed = np.bincount(own, data.area * data.sky_view_factor) / np.bincount(own, data.area)
    assert mean == pytest.approx(weighed, abs=1e-6)


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_canopies_that_transmit_all_are_not_there(street, receivers):
    clear = ask(
        street, receivers=receivers, canopy=["tree"], transmissivity=1.0, extent=(-20, -20, 40, 40)
    )
    without = ask(street, receivers=receivers, no_cast=["tree"], extent=(-20, -20, 40, 40))
    under = (clear.x > -6) & (clear.x < -3) & (clear.y > 0) & (clear.y < 3)  # topmost: the tree
    apart = np.abs(clear.sky_view_factor - without.sky_view_factor).where(~under)
    assert float(apart.max()) < 1e-12
    half = ask(
        street, receivers=receivers, canopy=["tree"], transmissivity=0.5, extent=(-20, -20, 40, 40)
    )
    solid = ask(
        street, receivers=receivers, canopy=["tree"], transmissivity=0.0, extent=(-20, -20, 40, 40)
    )
    between = (clear.sky_view_factor + solid.sky_view_factor) / 2
    assert float(np.abs(half.sky_view_factor - between).max()) < 1e-7


def test_what_a_proposal_takes(street):
    extent = (-20, -20, 40, 40)
    both = ask(street, receivers="top", proposed=["tower"], extent=extent)
    before = ask(street, receivers="top", no_cast=["tower"], extent=extent)
    after = ask(street, receivers="top", extent=extent)
    new = (both.x > 14) & (both.x < 18) & (both.y > 0) & (both.y < 6)
    assert np.array_equal(both.sky_view_factor, after.sky_view_factor, equal_nan=True)
    same = both.sky_view_factor_before == before.sky_view_factor
    assert bool(same.where(~new, True).all())
    assert bool(
        np.isnan(both.sky_view_factor_before.where(new).values[new.transpose("y", "x")]).all()
    )
    lost = both.sky_view_factor_before - both.sky_view_factor
    assert np.array_equal(both.sky_view_factor_lost, lost, equal_nan=True)
    assert float(both.sky_view_factor_lost.max()) > 0.2
    ratio = both.sky_view_factor / both.sky_view_factor_before
    assert np.allclose(both.sky_view_factor_ratio, ratio, equal_nan=True)


def test_hours_beside_a_measure_are_those_alone(street):
    site = umbra.Site(48.2, 16.4, "Europe/Vienna")
    asked = {"date": "2026-03-21", "receivers": "top", "cell": 1.0, "every": "1h"}
    alone = umbra.shadow_study(street, site, **asked).dataset
    both = umbra.shadow_study(
        street, site, measure=["sun_hours", "sky_component"], sky_directions=100, **asked
    ).dataset
    for name in ("sun_hours", "shadow_hours"):
        assert np.array_equal(alone[name], both[name], equal_nan=True)
    assert set(both) - set(alone) == {"sky_component"}


def test_a_study_without_the_sun_needs_no_date_and_no_site(street):
    data = ask(street)
    assert "sun_hours" not in data
    assert "time" not in data.dims
    assert not {"latitude", "refraction", "time_zone"} & set(data.attrs)


@pytest.mark.parametrize(("option", "given"), [
    ("measure", {"measure": "sky_view"}), ("date", {"measure": "sun_hours"}),
    ("date", {"measure": ["sky_component", "shadow_hours"]}), ("date", {}),
    ("spells", {"measure": "sky_component", "spells": True}),
    ("sky_directions", {"measure": "sky_component", "sky_directions": 0}),
    ("sky_directions", {"measure": "sky_component", "sky_directions": "klems"}),
    ("chunks", {"measure": "sky_component", "chunks": 10}),
])  # fmt: skip
def test_what_cannot_be_asked(street, option, given):
    with pytest.raises(InputError) as caught:
        umbra.shadow_study(street, receivers="ground", cell=1.0, **given)
    assert caught.value.option == option


@pytest.mark.parametrize("given", [1, 577, "tregenza", "reinhart2", "reinhart4"])
def test_directions_cover_the_upper_half(given):
    directions, angles = find_directions(given)
    count = {"tregenza": 145, "reinhart2": 577, "reinhart4": 2305}.get(given, given)
    assert len(directions) == count
    assert angles.sum() == pytest.approx(2 * np.pi)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(np.ones(count))
    assert (directions[:, 2] > 0).all()
    if count > 1:
        assert (angles * directions[:, 2]).sum() == pytest.approx(np.pi, rel=1e-3)


@pytest.mark.parametrize("weights", [None, "distinct"])
def test_count_takes_a_device_and_canopies(street, weights):
    directions, angles = find_directions(40)
    shares = angles if weights is None else angles * directions[:, 2]
    asked = {"weights": shares, "of": "light", "cell": 1.0, "extent": (-20, -20, 40, 40)}
    plain = umbra.count(street, "ground", directions, no_cast=["tree"], **asked)
    clear = umbra.count(street, "ground", directions, canopy=["tree"], transmissivity=1.0, **asked)
    assert np.allclose(plain, clear, atol=1e-6)
    with pytest.raises(InputError) as caught:
        umbra.count(street, "ground", directions, device="tpu", **asked)
    assert caught.value.option == "device"


def test_a_sloping_roof_sees_what_its_tilt_leaves():
    """A free plane of tilt t has (1 + cos t) / 2, from above as by its own samples."""
    roof = np.array([[0, 0, 10], [20, 0, 10], [20, 20, 30], [0, 20, 30]], float)
    scene = make_scene([Part("roof", "", Mesh(roof, np.array([[0, 1, 2], [0, 2, 3]], np.int32)))])
    wanted = (1 + np.cos(np.pi / 4)) / 2
    inside = (5, 5, 15, 15)
    for exact, error in ((False, 3e-3), (True, 1e-9)):
        above = ask(
            scene, receivers="top", ground=0.0, extent=inside, exact=exact, sky_directions=4096
        )
        own = ask(
            scene, receivers="surfaces", cell=None, spacing=2.0, exact=exact, sky_directions=4096
        )
        assert above.sky_view_factor.values == pytest.approx(np.full((10, 10), wanted), abs=error)
        assert own.sky_view_factor.values == pytest.approx(wanted, abs=error)


@pytest.mark.parametrize("receivers", ["ground", "top", "surfaces"])
def test_the_exact_sky_is_the_limit_of_directions(street, receivers):
    asked = {"receivers": receivers, "measure": ["sky_view_factor", "sky_component"],
             "proposed": ["tower"], "cell": 2.0 if receivers != "surfaces" else None}  # fmt: skip
    exact = ask(street, exact=True, **asked)
    many = ask(street, sky_directions=20_000, **asked)
    assert exact.attrs["sky_directions"] == "exact"
    for name in ("sky_view_factor", "sky_view_factor_before", "sky_view_factor_lost"):
        assert float(np.abs(exact[name] - many[name]).max()) < 2e-3
        assert np.array_equal(np.isnan(exact[name]), np.isnan(many[name]))
    assert float(np.abs(exact.sky_component - many.sky_component).max()) < 0.2


def test_the_exact_sky_is_refused_where_it_is_not_solved(street):
    for more in ({"canopy": ["tree"]}, {"measure": "probable_sun_hours"}):
        with pytest.raises(InputError) as caught:
            ask(street, **{"measure": "sky_component", "exact": True} | more)
        assert caught.value.option == "exact"


@pytest.mark.parametrize(("measure", "own"), [
    ("sky_component", 1), ("sun_hours,sky_component,sky_view_factor", 2)])  # fmt: skip
def test_progress_ends_with_the_last_light(street, measure, own):
    seen = []
    day = {"date": "2026-03-21", "every": "1h"} if "sun" in measure else {}
    options = StudyOptions(measure=measure, receivers="ground", cell=2.0, sky_directions=300, **day)
    study = run(
        street, umbra.Site(48.2, 16.4, "Europe/Vienna"), options, lambda *one: seen.append(one)
    )
    whole = own * 300 + int(study.sun.is_up.sum())
    assert seen[-1] == (whole, whole)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


@pytest.mark.parametrize("proposed", [(), ("tower",)])
def test_the_exact_sky_tells_its_progress(street, proposed):
    seen = []
    options = StudyOptions(
        measure="sky_view_factor", receivers="ground", cell=1.0, extent=(-40, -40, 40, 40),
        exact=True, sky_directions=300, proposed=proposed,
    )  # fmt: skip
    run(street, None, options, lambda *one: seen.append(one))
    assert len(seen) > 20
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert seen[-1] == (300, 300)


@pytest.mark.parametrize("receivers", ["ground", "surfaces"])
def test_what_a_proposal_takes_in_tiles_is_that_of_one_piece(street, tmp_path, receivers):
    path = tmp_path / "street.obj"
    lines, first = [], 1
    for part in street.parts:
        lines += [f"o {part.name}", *("v {} {} {}".format(*row) for row in part.mesh.vertices)]
        lines += ["f {} {} {}".format(*row) for row in (part.mesh.faces + first).tolist()]
        first += len(part.mesh.vertices)
    path.write_text("\n".join(lines))
    asked = {"measure": "sky_view_factor", "sky_directions": 200, "receivers": receivers,
             "proposed": "tower", "ground": 0.0}  # fmt: skip
    asked |= {"spacing": 1.0} if receivers == "surfaces" else {
        "cell": 1.0, "extent": (-20, -20, 40, 40)}  # fmt: skip
    whole = umbra.shadow_study(umbra.read(path, up="z"), **asked).dataset
    tiles = umbra.city_study(path, out=tmp_path / "out", tiles="16m", reading={"up": "z"}, **asked)
    for name in ("sky_view_factor", "sky_view_factor_before", "sky_view_factor_lost"):
        found = tiles.dataset[name].values
        assert np.array_equal(found, whole[name].values, equal_nan=True)
        assert np.nanmax(found) > 0


class Wide(Measure):
    """Forty sums of a few directions, of which the mean is kept."""

    name, unit, long_name = "wide", "1", "mean of many"

    def make_lights(self, asked):
        toward, _ = find_directions(16)
        return Lights.of(toward, np.random.default_rng(1).uniform(0.1, 1, (len(toward), 40)))

    def derive(self, sums, asked):
        return [sums.mean(0)]


def test_tiles_hold_what_sums_have_room_for(monkeypatch):
    monkeypatch.setitem(MEASURES._loaded, "wide", Wide())
    scene = make_scene([Part("block", "", box(0, 0, 0, 4, 5, 6))])
    asked = {"receivers": "ground", "measure": "wide", "size": (300, 300)}
    whole = umbra.shadow_study(scene, **asked).wide.values
    room = 4 * COLUMN_BYTES * 40 * LEAST_TILE
    monkeypatch.setattr("umbra.study.measures.measure.find_memory", lambda: float(room))
    assert Setup.of(scene, None, StudyOptions(**asked)).request.limit_tiles(4096) == 256
    assert np.array_equal(umbra.shadow_study(scene, **asked).wide.values, whole, equal_nan=True)
    monkeypatch.setattr("umbra.study.measures.measure.find_memory", lambda: 0.9 * room)
    monkeypatch.setitem(MEASURES._loaded, "wide", Wide())
    with pytest.raises(InputError) as caught:
        umbra.shadow_study(scene, **asked)
    assert (caught.value.option, caught.value.columns) == ("measure", 40)
