"""Irradiation and sunshine by a weather file, and probable sun: laws and closed forms."""

import math
import warnings

import numpy as np
import pvlib
import pytest
from support.cities import make_houses, write_city
from support.shapes import box, sheet
from support.weather_files import HOURS, make_values, save_epw, save_pvgis, save_tmy3

import umbra
from umbra.errors import InputError
from umbra.lights import find_directions, find_shape, make_no_period, read_weather, sum_sky
from umbra.scene import Part
from umbra.sun import find_sun

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna", elevation=200.0)
PLANES = {"up": (0, 0, 1), "north": (0, 1, 0), "east": (1, 0, 0), "south": (0, -1, 0)}
ROOM = {"receivers": "points", "ground": 0.0}
SOURCES = ("irradiation_beam", "irradiation_sky", "irradiation_ground")


@pytest.fixture(scope="module")
def opened():
    """A place without neighbours."""
    return umbra.make_scene(*box((600, 600, 0), (601, 601, 1)), name="far")


def find_path(instants=HOURS):
    utc = instants.astype("datetime64[m]") + np.timedelta64(30 - 60, "m")
    return find_sun(VIENNA, utc.astype("datetime64[us]"))


@pytest.fixture(scope="module")
def values():
    """A year of clear and dull days, consistent: global is beam times sine, and diffuse."""
    rise = np.maximum(np.sin(np.radians(find_path().altitude)), 0.0)
    clear = np.repeat(np.random.default_rng(4).uniform(0, 1, 365), 24)
    beam = np.where(rise > 0, 900 * clear**2 * rise**0.3, 0)
    diffuse = np.where(rise > 0, (60 + 250 * (1 - clear)) * rise**0.7, 0)
    return np.stack([beam * rise + diffuse, beam, diffuse], 1)


@pytest.fixture(scope="module")
def epw(tmp_path_factory, values):
    return save_epw(tmp_path_factory.mktemp("weather") / "made.epw", values)


def measure(scene, points, site=VIENNA, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return umbra.shadow_study(scene, site, points=points, **{**ROOM, **options}).dataset


def look(height=5.0):
    return [(0, 0, height, *normal) for normal in PLANES.values()]


def test_an_open_level_plane_gets_what_the_file_has(opened, epw, values):
    found = measure(opened, look(), measure="irradiation", weather=epw)
    assert found.irradiation[0] == pytest.approx(values[:, 0].sum() / 1000, rel=1e-6)
    assert found.irradiation_sky[0] == pytest.approx(values[:, 2].sum() / 1000, rel=1e-6)
    assert found.irradiation_ground[0] == 0
    whole = sum(found[name] for name in SOURCES)
    np.testing.assert_allclose(found.irradiation, whole, rtol=1e-12)
    assert found.irradiation.attrs["units"] == "kWh/m2"
    assert "made.epw sha256:" in found.attrs["weather"]


def test_beam_and_ground_of_open_walls_are_closed_forms(opened, epw, values):
    found = measure(opened, look(), measure="irradiation", weather=epw, albedo=0.3)
    sun = find_path()
    for k, normal in enumerate(PLANES.values()):
        cosine = np.maximum(sun.direction @ np.array(normal, float), 0) * sun.is_up
        beam = (values[:, 1] * cosine).sum() / 1000
        assert found.irradiation_beam[k] == pytest.approx(beam, rel=1e-6)
    ground = 0.5 * 0.3 * values[:, 0].sum() / 1000
    np.testing.assert_allclose(found.irradiation_ground[1:], ground, rtol=0.01)


def test_each_source_alone_is_what_it_is_among_others(opened, epw):
    whole = measure(opened, look(), measure="irradiation", weather=epw)
    for name in SOURCES:
        alone = measure(opened, look(), measure=name, weather=epw)
        np.testing.assert_allclose(alone[name], whole[name], rtol=1e-6)
        assert "irradiation" not in alone
    both = measure(opened, look(), measure=["irradiation_sky", "irradiation"], weather=epw)
    np.testing.assert_array_equal(both.irradiation, whole.irradiation)


@pytest.mark.parametrize("given", [4096, 300, "tregenza", "reinhart2"])
def test_each_hours_sky_adds_up_to_its_diffuse_irradiance(values, given):
    directions, angles = find_directions(given)
    sun = find_path()
    some = np.flatnonzero((values[:, 2] > 0) & (np.arange(8760) % 97 == 12))
    assert len(some) > 40
    shape = find_shape(
        np.radians(90 - sun.altitude[some]), values[some, 1], values[some, 2], some // 24 + 1
    )
    for k, hour in enumerate(some):
        energy = values[hour : hour + 1, 2]
        sky = sum_sky(directions, angles, sun.direction[hour][None], shape[k][None], energy)
        assert (sky >= 0).all()
        assert (sky * angles * directions[:, 2]).sum() == pytest.approx(energy[0], rel=1e-12)
        # As seen from the ground, the brightest is near the sun wherever there is any beam.
        if values[hour, 1] > 400 and sun.altitude[hour] > 20:
            assert directions[sky.argmax()] @ sun.direction[hour] > 0.95


def test_open_planes_get_about_what_pvlibs_model_of_planes_gives(opened):
    """Perez' model of planes (1990) was fitted apart from the distribution: within 4 %."""
    path = f"{pvlib.__path__[0]}/data/723170TYA.CSV"
    weather = read_weather(path)
    site = umbra.Site(weather.latitude, weather.longitude)
    found = measure(opened, look(), site, measure="irradiation_sky", weather=path)
    suns = weather.find_suns(site, make_no_period(site), "standard")
    zenith = 90 - suns.sun.altitude
    extra = pvlib.irradiance.get_extra_radiation(np.arange(8760) // 24 + 1)
    mass = pvlib.atmosphere.get_relative_airmass(np.clip(zenith, 0, 89.9))
    for k, (x, y, z) in enumerate(PLANES.values()):
        plane = pvlib.irradiance.perez(
            math.degrees(math.acos(z)), math.degrees(math.atan2(x, y)) % 360, suns.diffuse,
            suns.beam, extra, zenith, suns.sun.azimuth, mass,
        )  # fmt: skip
        assert float(found.irradiation_sky[k]) == pytest.approx(np.nansum(plane) / 1000, rel=0.04)


def test_an_epws_hour_has_its_sun_at_the_half(opened, tmp_path):
    values = make_values()
    values[np.flatnonzero(np.datetime64("2001-03-05T14") == HOURS)] = (0, 1000, 0)
    path = save_epw(tmp_path / "one.epw", values)
    found = measure(opened, look(), measure="irradiation_beam", weather=path)
    toward = find_sun(VIENNA, np.array(["2001-03-05T13:30"], "datetime64[us]")).direction[0]
    want = np.maximum(np.array(list(PLANES.values())) @ toward, 0)
    np.testing.assert_allclose(found.irradiation_beam, want, atol=1e-6)
    # On a date the hour's own steps count, by the local clock; this one is not of the year 2001.
    day = {"date": "2026-03-05", "start": "14:00", "end": "15:00", "every": "30min"}
    found = measure(opened, look(), measure="irradiation_beam", weather=path, **day)
    when = np.array(["2026-03-05T13:15", "2026-03-05T13:45"], "datetime64[us]")
    want = np.maximum(np.array(list(PLANES.values())) @ find_sun(VIENNA, when).direction.T, 0)
    np.testing.assert_allclose(found.irradiation_beam, want.mean(1), atol=1e-6)
    day |= {"start": "12:00", "end": "14:00"}
    assert not measure(opened, look(), measure="irradiation", weather=path, **day).irradiation.any()
    day |= {"date": "2026-07-05", "start": "14:00", "end": "15:00"}
    assert not measure(opened, look(), measure="irradiation", weather=path, **day).irradiation.any()


def test_formats_agree(tmp_path, epw, values):
    one = read_weather(epw)
    other = read_weather(save_tmy3(tmp_path / "a.csv", values))
    np.testing.assert_allclose(one.values, other.values)
    assert (one.utc_offset, one.sun_at) == (other.utc_offset, other.sun_at) == (1.0, 0.5)
    utc = read_weather(save_pvgis(tmp_path / "b.csv", np.roll(values, -1, 0)))
    nowhere = make_no_period(None)
    suns, same = (each.find_suns(VIENNA, nowhere, "standard") for each in (one, utc))
    np.testing.assert_allclose(suns.sun.altitude[1:], same.sun.altitude[:-1], atol=1e-9)
    np.testing.assert_allclose(suns.beam[1:], same.beam[:-1])


def test_pvlibs_own_files_are_read():
    folder = pvlib.__path__[0]
    weather = read_weather(f"{folder}/data/723170TYA.CSV")
    data, about = pvlib.iotools.read_tmy3(f"{folder}/data/723170TYA.CSV", map_variables=True)
    np.testing.assert_allclose(weather.values, data[["ghi", "dni", "dhi"]].to_numpy())
    assert (weather.latitude, weather.elevation) == (about["latitude"], about["altitude"])


def test_bright_sun_counts_from_120(opened, tmp_path):
    beam = np.where(np.arange(8760) % 2 == 0, 120, 119)
    path = save_epw(tmp_path / "a.epw", make_values(0, beam, 0))
    found = measure(opened, look(), measure="sunshine_hours", weather=path)
    sun = find_path()
    bright = sun.is_up & (beam == 120)
    want = [(bright & (sun.direction @ np.array(n, float) > 0)).sum() for n in PLANES.values()]
    np.testing.assert_allclose(found.sunshine_hours, want, rtol=1e-9)


def test_an_open_place_has_all_probable_sun(opened):
    found = measure(opened, [(0, 0, 1)], measure="probable_sun_hours")
    assert found.probable_sun_share[0] == 100
    assert 4400 < float(found.probable_sun_hours[0]) < 4500
    assert 40 < float(found.winter_probable_sun_share[0]) < 41
    assert found.attrs["sunshine"] == "1"
    assert {found[name].attrs["units"] for name in found.data_vars if "share" in name} == {"%"}


def test_a_wall_without_end_hides_the_south():
    scene = umbra.make_scene(*sheet([(-1e5, -1, 0), (1e5, -1, 0), (1e5, -1, 1e5), (-1e5, -1, 1e5)]))
    table = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2]
    found = measure(scene, [(0, 0, 0.5)], measure="probable_sun_hours", sunshine=table)
    step = np.timedelta64(15, "m")
    utc = np.arange("2001-01-01T00:00", "2002-01-01T00:00", step, "datetime64[m]")
    utc = (utc - np.timedelta64(60, "m")).astype("datetime64[us]") + np.timedelta64(450, "s")
    local = utc + np.timedelta64(60, "m")
    # Summer time shifts hours, but no step leaves its month while the sun is up.
    month = local.astype("datetime64[M]").astype(int) % 12
    sun = find_sun(VIENNA, utc)
    hours = np.array(table)[month] * sun.is_up * 0.25
    north = hours * (sun.direction[:, 1] > 0)
    assert found.probable_sun_hours[0] == pytest.approx(north.sum(), rel=1e-6)
    assert found.probable_sun_share[0] == pytest.approx(100 * north.sum() / hours.sum(), rel=1e-6)
    day = local.astype("datetime64[D]")
    is_winter = (day >= np.datetime64("2001-09-21")) | (day <= np.datetime64("2001-03-21"))
    share = 100 * (north * is_winter).sum() / hours.sum()
    assert found.winter_probable_sun_share[0] == pytest.approx(share, abs=1e-6)
    assert found.attrs["open_probable_sun_hours"] == pytest.approx(hours.sum())


def test_percents_of_sunshine_are_told_apart(opened, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("month,share\n" + "".join(f"{month},40\n" for month in range(1, 13)))
    one = measure(opened, [(0, 0, 1)], measure="probable_sun_hours", sunshine=path)
    other = measure(opened, [(0, 0, 1)], measure="probable_sun_hours", sunshine=[0.4] * 12)
    assert one.probable_sun_hours.item() == other.probable_sun_hours.item()


@pytest.mark.parametrize("kind", ["", "TINRelief"])
def test_a_wall_before_a_wall_hides_ground_and_the_ground_does_not(tmp_path, kind):
    """Free below is 1/2 (1 - sin t), t the angle at which a wall without end meets the ground."""
    wall = Part("wall", "Building", umbra.scene.Mesh(*sheet(
        [(-1e4, 4, 0), (1e4, 4, 0), (1e4, 4, 1e4), (-1e4, 4, 1e4)])))  # fmt: skip
    land = Part("land", kind, umbra.scene.Mesh(*sheet(
        [(-1e4, -1e4, 0), (1e4, -1e4, 0), (1e4, 1e4, 0), (-1e4, 1e4, 0)])))  # fmt: skip
    scene = umbra.make_scene([wall, land] if kind else [wall])
    path = save_epw(tmp_path / "a.epw", make_values(overall=100))
    points = [(0, 0, 4, 0, 1, 0), (0, 0, 4, 0, -1, 0), (0, 0, 4, 0, 0, 1)]
    options = {"measure": "irradiation_ground", "weather": path, "albedo": 1.0}
    found = measure(scene, points, **options, **({"ground": None} if kind else {}))
    share = found.irradiation_ground / 876
    assert share[0] == pytest.approx(0.5 * (1 - math.sin(math.pi / 4)), abs=0.01)
    assert share[1] == pytest.approx(0.5, abs=0.005)
    assert share[2] == 0
    assert not measure(scene, [(0, 0, 4)], **options).irradiation_ground.any()


def test_before_and_after_a_proposal(opened, epw):
    tower = Part("tower", "Building", umbra.scene.Mesh(*box((-10, -30, 0), (10, -10, 40))))
    far = Part("far", "", umbra.scene.Mesh(*box((600, 600, 0), (601, 601, 1))))
    scene = umbra.make_scene([tower, far])
    asked = {"measure": "irradiation,probable_sun_share", "weather": epw}
    found = measure(scene, look(), proposed=["tower"], **asked)
    before, after = measure(opened, look(), **asked), measure(scene, look(), **asked)
    for name in ("irradiation", *SOURCES, "probable_sun_share"):
        np.testing.assert_allclose(found[f"{name}_before"], before[name], rtol=1e-9)
        np.testing.assert_allclose(found[name], after[name], rtol=1e-9)
        lost = found[f"{name}_before"] - found[name]
        np.testing.assert_allclose(found[f"{name}_lost"], lost, atol=1e-9)
    assert 0.2 < float(found.irradiation_ratio[3]) < 0.7
    assert float(found.irradiation_ratio[1]) == 1


def test_a_plan_and_its_tiles_are_the_same(tmp_path, epw):
    houses = make_houses(1, 8, (85000, 447000), (85060, 447060))
    path = write_city(tmp_path / "a.city.json", houses)
    scene = umbra.read(path)
    options = {
        "measure": ["irradiation", "probable_sun_share"], "weather": epw, "cell": 3.0,
        "sky_directions": 145, "receivers": "top", "ground": 0.0,
    }  # fmt: skip
    low, _ = scene.bounds()
    options["extent"] = (low[0] - 6, low[1] - 6, low[0] + 48, low[1] + 48)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole = umbra.shadow_study(scene, VIENNA, **options).dataset
        cut = umbra.city_study([path], VIENNA, out=tmp_path / "out", tiles=24, **options)
    for name in ("irradiation", *SOURCES, "probable_sun_share"):
        np.testing.assert_array_equal(cut.dataset.load()[name], whole[name])
    assert float(whole.irradiation.std()) > 10


def damage(values, path, how):
    """Write a weather file with a fault; return it."""
    hours, values = HOURS.copy(), np.array(values)
    if how == "lacks":
        kept = np.r_[0:4000, 4003:8760]
        hours, values = hours[kept], values[kept]
    elif how == "twice":
        hours[700] = hours[699]
    elif how == "missing":
        values[4000, 1] = 9999
    elif how == "below":
        values[4000, 2] = -3
    elif how == "more":
        hours, values = np.r_[hours, hours[:30]], np.r_[values, values[:30]]
    save_epw(path, values, hours, **({"latitude": 148} if how == "place" else {}))
    text = path.read_text()
    if how == "words":
        path.write_text(text.replace("2001,3,5,14,60,", "2001,3,five,14,60,"))
    elif how == "head":
        path.write_text(text.replace("DATA PERIODS", "DATA"))
    elif how == "other":
        path.write_text("v 0 0 0\n")
    elif how == "empty":
        path.write_text("")
    elif how == "nan":
        path.write_text(text.replace("2001,3,5,14,60,?9,9,5,70,101000,0,0,300,", "2001,3,5,14,60,?9"
                                     ",9,5,70,101000,0,0,300,nan,inf,"))  # fmt: skip
    elif how == "bytes":
        path.write_bytes(text.encode()[:9000] + bytes(range(256)) * 40)
    elif how == "quote":
        path.write_text(text.replace("2001,3,5,14,60,", '"' + "x" * 200_000))
    return path


FAULTS = ("lacks", "twice", "missing", "below", "more", "place", "words", "head", "other", "empty",
          "nan", "bytes", "quote")  # fmt: skip


@pytest.mark.parametrize("how", FAULTS)
def test_wrong_weather_is_told_in_a_line(opened, tmp_path, values, how):
    path = damage(values, tmp_path / "a.epw", how)
    with pytest.raises(InputError) as caught:
        measure(opened, look(), measure="irradiation", weather=path)
    assert caught.value.option == "weather"
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    if how == "lacks":
        assert "3 of 8,760" in str(caught.value)
        assert "June 16" in str(caught.value)


def test_a_leap_day_is_kept_or_stands_for_another(opened, tmp_path):
    hours = np.arange(np.datetime64("2004-01-01T00"), np.datetime64("2005-01-01T00"))
    path = save_epw(tmp_path / "leap.epw", np.tile((100.0, 0.0, 100.0), (8784, 1)), hours)
    assert read_weather(path).has_leap_day
    found = measure(opened, look(), measure="irradiation", weather=path)
    assert found.irradiation[0] == pytest.approx(878.4)
    values = make_values()
    values[(31 + 27) * 24 : (31 + 28) * 24] = (100, 0, 100)
    path = save_epw(tmp_path / "common.epw", values)
    day = {"measure": "irradiation", "weather": path, "start": "00:00", "end": "24:00"}
    with pytest.warns(UserWarning, match="29 February"):
        study = umbra.shadow_study(opened, VIENNA, points=look(), date="2028-02-29", **day, **ROOM)
    assert float(study.dataset.irradiation[0]) == pytest.approx(2.4)
    assert measure(opened, look(), date="2028-03-01", **day).irradiation[0] == 0


def test_a_place_far_away_and_a_wrong_clock_are_told(opened, epw, tmp_path, values):
    options = {"points": look(), "measure": "irradiation", **ROOM}
    graz = umbra.Site(47.07, 15.44)
    with pytest.warns(UserWarning, match="144 km away"):
        umbra.shadow_study(opened, graz, weather=epw, **options)
    path = save_epw(tmp_path / "a.epw", values, offset=-7)
    with pytest.warns(UserWarning, match="time zone"):
        umbra.shadow_study(opened, VIENNA, weather=path, **options)


MONTHS = "".join(f"{month},0.5\n" for month in range(1, 13))


@pytest.mark.parametrize(
    "table",
    [MONTHS[:-7], MONTHS + "1,0.5\n", MONTHS.replace("7,0.5", "7,much"), "", "a\0,b\n",
     MONTHS.replace("7,0.5", "7,nan"), MONTHS.replace("7,0.5", "7,-1"),
     MONTHS.replace("0.5", "120"), MONTHS.replace("0.5", "0"), MONTHS.replace("7,", "13,")],
)  # fmt: skip
def test_a_wrong_table_of_sunshine_is_told(opened, tmp_path, table):
    path = tmp_path / "a.csv"
    path.write_text(table)
    with pytest.raises(InputError) as caught:
        measure(opened, look(), measure="probable_sun_hours", sunshine=path)
    assert caught.value.option == "sunshine"
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("given", "option"),
    [
        ({"measure": "irradiation"}, "weather"),
        ({"measure": "sunshine_hours", "weather": "none.epw"}, "weather"),
        ({"measure": "sky_view_factor", "weather": "EPW"}, "weather"),
        ({"measure": "sky_view_factor", "sunshine": [1] * 12}, "sunshine"),
        ({"measure": "probable_sun_hours", "sunshine": [1] * 11}, "sunshine"),
        ({"measure": "irradiation", "weather": "EPW", "albedo": 1.5}, "albedo"),
        ({"measure": "irradiation", "weather": "EPW", "start": "08:00"}, "date"),
        ({"measure": "irradiation", "weather": 3}, "weather"),
        ({"measure": "probable_sun_hours", "site": None}, "latitude"),
        ({"measure": "irradiation", "weather": "EPW", "site": None}, "latitude"),
    ],
)
def test_slips_name_their_option(opened, epw, given, option):
    given = {name: epw if value == "EPW" else value for name, value in given.items()}
    with pytest.raises(InputError) as caught:
        measure(opened, look(), **given)
    assert caught.value.option == option
