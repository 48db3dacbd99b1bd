"""Land far away: suns and directions of the sky below a horizon reach no receiver."""

import json
import math
import warnings

import numpy as np
import pandas as pd
import pytest
from support.shapes import box
from support.weather_files import make_values, save_epw

import umbra
from umbra.errors import InputError
from umbra.lights import read_horizon
from umbra.study.shadow_study import run_study
from umbra.sun import find_sun

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna", elevation=200.0)
TURNED = umbra.Site(48.2, 16.37, "Europe/Vienna", elevation=200.0, true_north=30.0)
ASKED = {"date": "2026-03-21", "start": "00:00", "end": "24:00", "receivers": "points"}
ASKED |= {"points": [(-20.0, 0.0, 0.0), (0.0, 12.0, 0.0)], "ground": 0.0}
SKY = {"receivers": "points", "ground": 0.0, "points": [(0, -500, 0, 0, 0, 1)]}


@pytest.fixture(scope="module")
def scene():
    """A house of 10 m."""
    return umbra.make_scene(*box((-5, -5, 0), (5, 5, 10)), name="house")


def save(tmp_path, elevations, azimuths=None, name="land.csv"):
    turns = np.arange(len(elevations)) * 360 / len(elevations) if azimuths is None else azimuths
    rows = [f"{a:g},{e:g}" for a, e in zip(turns, elevations, strict=True)]
    path = tmp_path / name
    path.write_text("\n".join(["azimuth,elevation", *rows]) + "\n")
    return path


def study(scene, site=VIENNA, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return umbra.shadow_study(scene, site, **{**ASKED, **options}).dataset


def find_lit(data):
    """Return by geometry which steps each receiver is in the sun without land."""
    up = data.sun_direction.values[:, 2] > 0
    return up[:, None] & (data.in_shadow.values == 0)


@pytest.mark.parametrize("site", [VIENNA, TURNED], ids=["north", "turned"])
def test_hours_by_geometry(scene, tmp_path, site):
    """Land of 10 degrees all around, and of 60 in the south-east alone."""
    open_ = study(scene, site, masks=True)
    altitude, azimuth = open_.sun_altitude.values, open_.sun_azimuth.values
    # A quarter circle from 90 to 180 degrees, with edges of a thousandth.
    turns = [0, 45, 89.999, 90, 135, 180, 180.001, 225, 270, 315]
    quarter = save(tmp_path, [0, 0, 0, 60, 60, 60, 0, 0, 0, 0], turns, "quarter.csv")
    for path, free in (
        (save(tmp_path, [10] * 36), altitude >= 10),
        (quarter, ~((azimuth >= 90) & (azimuth <= 180) & (altitude < 60))),
    ):
        land = study(scene, site, masks=True, spells=True, horizon=path)
        lit = find_lit(open_) & free[:, None]
        assert 0 < lit[:, 1].sum() < find_lit(open_)[:, 1].sum()
        assert np.allclose(land.sun_hours, lit.sum(0) / 4, atol=1e-5)
        assert np.allclose(land.sun_hours + land.shadow_hours, open_.sun_hours + open_.shadow_hours)
        assert np.array_equal(find_lit(land), lit)
        first = np.array([open_.time.values[row.argmax()] for row in lit.T])
        assert (np.abs(land.first_sun.values - first) <= np.timedelta64(450, "s")).all()


def test_level_land_is_no_land(scene, tmp_path):
    path = save(tmp_path, [0] * 8)
    for more in ({}, {"spells": True, "masks": True}, {"by": "part", "by_day": True}):
        assert study(scene, **more).equals(study(scene, horizon=path, **more))
    for measure in ("sky_view_factor", "sky_component", "probable_sun_hours"):
        asked = {**SKY, "measure": measure, "date": None}
        plain, land = study(scene, **asked), study(scene, horizon=path, **asked)
        assert plain.equals(land)


def test_result_names_the_land(scene, tmp_path):
    data = study(scene, horizon=save(tmp_path, [3, 12.5, 3, 3, 3, 3, 3, 3]))
    assert data.attrs["horizon"].startswith("land.csv sha256:")
    assert data.attrs["horizon_highest_deg"] == 12.5


def test_hours_of_land_are_no_casters(scene, tmp_path):
    """What the house casts with the sun behind the land is not its own; nor is it lost."""
    path = save(tmp_path, [10] * 8)
    plain = study(scene, masks=True, proposed="house")
    land = study(scene, proposed="house", horizon=path)
    mine = (plain.in_shadow.values == 1) & (plain.sun_altitude.values >= 10)[:, None]
    assert mine.any()
    assert np.allclose(land.hours_lost, mine.sum(0) / 4, atol=1e-5)
    assert (land.hours_lost.values < plain.hours_lost.values)[0]
    owned = study(scene, by="part", horizon=path)
    assert np.allclose(owned.cast_hours[0], mine.sum(0) / 4, atol=1e-5)
    solved = study(scene, proposed="house", horizon=path, exact=True)
    assert np.allclose(solved.hours_lost, land.hours_lost, atol=0.26)  # two edges of a shadow


def test_sky_above_a_ring_of_land(scene, tmp_path):
    """A level plane in a ring of 30 degrees has cos^2 30 of its sky; half a ring, half of it."""
    ring, sides = save(tmp_path, [30] * 8, name="ring.csv"), [0, 45, 89.999, 90, 135, 180, 225, 270]
    half = save(tmp_path, [0, 0, 0, 30, 30, 30, 30, 30, 0, 0], [*sides, 270.001, 315])
    asked = {**SKY, "points": [(0, -5000, 0, 0, 0, 1), (0, -5000, 9, 0, 1, 0)], "date": None}
    asked |= {"sky_directions": 40_000}
    found = study(scene, measure="sky_view_factor", horizon=ring, **asked).sky_view_factor
    # A wall's: (1/pi) times 2 (pi/2 - a - sin a cos a) / 2, as it faces a half of the ring.
    turn = math.radians(30)
    wall = (math.pi / 2 - turn - math.sin(turn) * math.cos(turn)) / math.pi
    assert np.allclose(found, [math.cos(turn) ** 2, wall], atol=1e-3)
    found = study(scene, measure="sky_view_factor", horizon=half, **asked).sky_view_factor
    assert np.allclose(found, [(1 + math.cos(turn) ** 2) / 2, 0.5], atol=1e-3)
    grey = study(scene, measure="sky_component", horizon=ring, **asked).sky_component
    # Of the overcast sky (1 + 2 sin) / 3: 1/3 cos^2 + 4/9 (1 - sin^3), of 7/9.
    level = (math.cos(turn) ** 2 / 3 + 4 / 9 * (1 - math.sin(turn) ** 3)) / (7 / 9)
    assert grey.values[0] == pytest.approx(100 * level, abs=0.05)


def test_energy_and_probable_sun(scene, tmp_path):
    """Land above all suns leaves no beam; the ground shines on."""
    weather = save_epw(tmp_path / "made.epw", make_values(500.0, 400.0, 100.0))
    path = save(tmp_path, [89.9] * 8)
    asked = {**SKY, "points": [(0, -5000, 5, 0, -1, 0)], "date": None}
    asked |= {"start": "09:00", "end": "17:00"}  # as without these options
    names = "irradiation,probable_sun_hours"
    plain = study(scene, measure=names, weather=weather, **asked)
    land = study(scene, measure=names, weather=weather, horizon=path, **asked)
    assert float(plain.irradiation_beam[0]) > 0
    assert float(land.irradiation_beam[0]) == 0
    assert float(land.irradiation_sky[0]) < 1e-3 * float(plain.irradiation_sky[0])
    assert float(land.irradiation_ground[0]) == pytest.approx(float(plain.irradiation_ground[0]))
    assert float(plain.probable_sun_hours[0]) > 0
    assert float(land.probable_sun_hours[0]) == 0


def test_land_stands_before_and_after_a_proposal(scene, tmp_path):
    """Before it the place has the sky that the ring leaves, after it less."""
    asked = {**SKY, "points": [(0, -12, 0, 0, 0, 1)], "date": None, "proposed": "house"}
    asked |= {"measure": "sky_view_factor", "horizon": save(tmp_path, [30] * 8)}
    found = study(scene, **asked)
    free = math.cos(math.radians(30)) ** 2
    assert float(found.sky_view_factor_before[0]) == pytest.approx(free, abs=2e-3)
    assert float(found.sky_view_factor[0]) < free - 0.01


def test_pictures_show_the_land(scene, tmp_path):
    """The page's instants and the previews are dark while the sun is behind the land."""
    from umbra.study.preview import find_moments, make_preview  # noqa: PLC0415
    from umbra.study.timeline import make_timeline  # noqa: PLC0415

    asked = {"date": "2026-03-21", "start": "06:00", "end": "18:00", "receivers": "ground"}
    asked |= {"ground": 0.0, "extent": (-30, -30, 30, 30), "cell": 2.0}
    asked["horizon"] = save(tmp_path, [20] * 8)
    found = run_study(scene, VIENNA, **asked)
    line = make_timeline(found)
    assert line.is_study
    assert line.is_summed(found)
    low = found.sun.is_up & (found.sun.altitude < 20)
    masks = line.masks(0, len(line.which))
    assert masks[low][:, ~found.model.make_tile(found.grid).nothing].all()
    shadows = make_preview(found).shadows
    assert shadows[2].mean() > 0.9  # 6:30, but for the house
    assert min(moment.altitude for moment in find_moments(found, every=None, most=48)) >= 20


def test_read_formats(tmp_path):
    """One horizon in each format: from north, from south, at equal steps."""
    heights = np.round(np.random.default_rng(3).uniform(0, 20, 24), 3)
    table = read_horizon(save(tmp_path, heights))
    bare = tmp_path / "bare.txt"
    bare.write_text("".join(f"{value:.3f}\n" for value in heights))
    turns = np.arange(24) * 15.0
    rows = [f"{turn - 180}\t{high}\t0\t0" for turn, high in zip(turns, heights, strict=True)]
    rows.append(f"180.0\t{heights[0]}\t0\t0")
    head = "Latitude (decimal degrees):\t48.2\nLongitude (decimal degrees):\t16.4\n\n"
    pvgis = tmp_path / "pvgis.csv"
    pvgis.write_text(f"{head}A\tH_hor\tA_sun(w)\tH_sun(w)\n" + "\n".join(rows) + "\n\nA: Azimuth\n")
    profile = [{"A": turn - 180, "H_hor": high} for turn, high in zip(turns, heights, strict=True)]
    profile.append({"A": 180.0, "H_hor": heights[0]})
    spoken = tmp_path / "pvgis.json"
    spoken.write_text(json.dumps({"inputs": {}, "outputs": {"horizon_profile": profile}}))
    series = pd.Series(heights, index=pd.Index(turns, name="horizon_azimuth"))
    series.rename("horizon_elevation").to_csv(tmp_path / "pvlib.csv")
    for path in (bare, pvgis, spoken, series, tmp_path / "pvlib.csv"):
        found = read_horizon(path)
        assert np.array_equal(found.azimuth, table.azimuth)
        assert np.array_equal(found.elevation, table.elevation)


def test_between_azimuths_it_is_linear_around_the_circle(tmp_path):
    land = read_horizon(save(tmp_path, [8, *[0] * 6, 4], [10, 55, 100, 145, 190, 235, 280, 325]))
    turn = math.radians(347.5)  # half way from 325 to 370: 6 degrees

    def toward(up):
        up = math.radians(up)
        return np.array(
            [[math.sin(turn) * math.cos(up), math.cos(turn) * math.cos(up), math.sin(up)]]
        )

    assert land.covers(toward(5.99), 0.0).all()
    assert land.covers(np.array([[math.sin(turn), math.cos(turn), 0.0]]), 0.0).all()
    assert not land.covers(toward(6.01), 0.0).any()


def test_what_sky_writes_is_read(scene, tmp_path):
    """The horizon of a place, as ``umbra sky`` writes it, is a horizon."""
    from umbra.writers.sky_tables import write_horizon  # noqa: PLC0415

    view = umbra.sky_view(scene, (0.0, -20.0, 0.0))
    write_horizon(tmp_path / "sky.txt", view)
    land = read_horizon(tmp_path / "sky.txt")
    assert land.azimuth.tolist() == list(range(360))
    assert land.elevation[0] == pytest.approx(math.degrees(math.atan(10 / 15)), abs=1e-3)
    assert land.elevation[180] == 0


FAULTS = {
    "gap": "azimuth,elevation\n0,1\n45,1\n200,1\n300,2\n",
    "unordered": "azimuth,elevation\n" + "".join(f"{a},1\n" for a in (0, 90, 45, 180, 270)),
    "twice": "azimuth,elevation\n" + "".join(f"{a},1\n" for a in (0, 45, 45, 90)),
    "above": "azimuth,elevation\n0,91\n",
    "below": "azimuth,elevation\n0,-3\n",
    "one column": "elevation\n1\n2\n",
    "no head": "0,1\n45,1\n",
    "few": "1\n2\n3\n",
    "word": "azimuth,elevation\n0,high\n",
    "nan": "azimuth,elevation\n0,nan\n",
    "north": "azimuth,elevation\n" + "".join(f"{a},{a / 90}\n" for a in range(0, 361, 45)),
    "turn": "azimuth,elevation\n-10,1\n",
    "empty": "",
    "head alone": "azimuth,elevation\n",
    "another object": '{"type": "FeatureCollection"}',
    "broken object": '{"outputs": {"horizon_profile": [{"A": 0}]}}',
    "grid": "ncols 4\nnrows 4\n",
}


@pytest.mark.parametrize("text", FAULTS.values(), ids=FAULTS)
def test_faults_are_told(tmp_path, text):
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_horizon(path)
    assert caught.value.option == "horizon"
    assert "\n" not in str(caught.value)


def test_land_cuts_the_suns_disc(scene, tmp_path):
    """Contacts lead and follow the middle by the radius over its speed; hours are the middle's."""
    path = save(tmp_path, [12, 14, 9, 16, 12, 10, 18, 11])
    asked = {"horizon": path, "points": [(0.0, 300.0, 0.0)]}
    middle = study(scene, exact=True, spells=True, **asked)
    disc = study(scene, disc=True, every="5min", **asked)
    assert disc.sun_hours.values == pytest.approx(middle.sun_hours.values, abs=0.01)
    for ours, theirs, sign in (("first_contact", "first_sun", 1), ("last_contact", "last_sun", -1)):
        pair = np.array([disc[ours].values[0], middle[theirs].values[0]]).astype("datetime64[us]")
        contact, sun = (find_sun(VIENNA, when) for when in (pair, pair + np.timedelta64(10, "s")))
        lead = sign * float(np.diff(pair.astype(np.int64))[0]) / 1e6
        land = read_horizon(path)
        gap = [one.altitude - land.find_edge(one.azimuth) for one in (contact, sun)]
        speed = abs(gap[1][1] - gap[0][1]) / 10.0  # over the land's edge [degrees a second]
        assert lead == pytest.approx(0.2666 / speed, rel=0.05)


def test_instants_at_the_land_are_solved(scene, tmp_path):
    """The sun comes over the land and goes behind it to a second; the hours stay up."""
    path = save(tmp_path, [12, 14, 9, 16, 12, 10, 18, 11])
    plain, land = study(scene, exact=True), study(scene, exact=True, horizon=path)
    fine = study(scene, every="1min", horizon=path)
    assert np.allclose(land.sun_hours, fine.sun_hours, atol=1.5 / 60)
    assert np.allclose(land.sun_hours + land.shadow_hours, plain.sun_hours + plain.shadow_hours)
    spells = study(scene, exact=True, spells=True, horizon=path)
    sun = find_sun(VIENNA, spells.last_sun.values[:1].astype("datetime64[us]"))  # west of the house
    assert np.allclose(sun.altitude, read_horizon(path).find_edge(sun.azimuth), atol=0.005)
    mine = study(scene, exact=True, by="part", horizon=path).cast_hours
    coarse = study(scene, every="1min", by="part", horizon=path).cast_hours
    assert np.allclose(mine, coarse, atol=1.5 / 60)


@pytest.mark.parametrize("exact", [False, True])
def test_land_takes_its_share_of_the_sky(scene, tmp_path, exact):
    """What casters take, the nearest first, the land and the free sky add up to the whole."""
    asked = {**SKY, "points": [(0, -5000, 0), (0, -12, 0)], "date": None, "exact": exact}
    asked |= {"measure": "sky_blocked_by,sky_component", "by": "part"}
    found = study(scene, horizon=save(tmp_path, [30] * 8), **asked)
    assert found.caster.values.tolist() == ["house", "land"]
    assert np.allclose(found.sky_blocked + found.sky_component, 100, atol=0.01)
    assert np.allclose(found.sky_blocked_by.sum("caster"), found.sky_blocked)
    turn = math.radians(30)
    free = (math.cos(turn) ** 2 / 3 + 4 / 9 * (1 - math.sin(turn) ** 3)) / (7 / 9)
    shares = found.sky_blocked_by.sel(caster="land").values
    assert shares[0] == pytest.approx(100 * (1 - free), abs=0.01 if exact else 0.3)
    alone = study(scene, **asked).sky_blocked_by.sel(caster="house").values
    assert found.sky_blocked_by.sel(caster="house").values == pytest.approx(alone, abs=1e-3)
    assert shares[1] < shares[0] - 1
