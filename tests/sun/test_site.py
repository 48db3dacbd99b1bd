from types import SimpleNamespace

import numpy as np
import pytest

from umbra.errors import InputError
from umbra.scene import make_scene
from umbra.sun import Site, find_site
from umbra.sun.site import tell_moved
from umbra.sun.zones import find_local_zone, find_zone

TRIANGLE = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def scene(**facts):
    return make_scene(*TRIANGLE, **facts)


@pytest.mark.parametrize(
    ("latitude", "longitude", "zone"),
    [
        (48.2, 16.37, "Europe/Vienna"),
        (-33.87, 151.21, "Australia/Sydney"),
        (40.71, -74.01, "America/New_York"),
        (69.65, 18.96, "Europe/Oslo"),
        (-13.83, -171.77, "Pacific/Apia"),
        (35.68, 139.69, "Asia/Tokyo"),
    ],
)
def test_zone_comes_from_the_coordinates(latitude, longitude, zone):
    assert Site(latitude, longitude).zone == zone


def test_every_corner_of_the_earth_has_a_zone():
    for latitude in (-90, -45, 0, 45, 90):
        for longitude in (-180, -90, 0, 90, 180):
            find_zone(Site(latitude, longitude).zone)


def test_a_given_zone_stands():
    assert Site(48.2, 16.37, "Asia/Tokyo").zone == "Asia/Tokyo"


def test_numbers_become_floats():
    site = Site(np.float32(48), 16, "UTC", elevation="171", true_north=np.int64(7))
    assert site == Site(48.0, 16.0, "UTC", 171.0, 7.0)
    values = (site.latitude, site.longitude, site.elevation, site.true_north)
    assert all(type(v) is float for v in values)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"latitude": 90.001}, "the latitude 90.001 is outside -90 to 90"),
        ({"latitude": -91}, "the latitude -91 is outside"),
        ({"latitude": 116.4, "longitude": 39.9}, "are latitude and longitude swapped"),
        ({"longitude": 180.5}, "the longitude 180.5 is outside -180 to 180; give it in degrees"),
        ({"longitude": -181}, "the longitude -181 is outside"),
        ({"latitude": float("nan")}, "the latitude nan is not a finite number"),
        ({"longitude": float("inf")}, "the longitude inf is not a finite number"),
        ({"latitude": "north"}, "the latitude 'north' is not a finite number; give it in degrees"),
        ({"latitude": None}, "the latitude None is not"),
        ({"true_north": float("nan")}, "the true north nan is not"),
        ({"true_north": float("inf")}, "the true north inf is not a finite number"),
        ({"elevation": 1e5}, "the elevation 100000 is outside -500 to 20000; give it in metres"),
        ({"elevation": -501}, "the elevation -501 is outside"),
    ],
)
def test_wrong_numbers(numbers, message):
    with pytest.raises(InputError, match=message) as caught:
        Site(**{"latitude": 0, "longitude": 0, "zone": "UTC", **numbers})
    assert "\n" not in str(caught.value)


def test_the_ends_of_the_ranges_are_in():
    for latitude, longitude in ((90, 180), (-90, -180)):
        assert Site(latitude, longitude, "UTC").latitude == latitude


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("Europe/Wien", "Europe/Vienna"),
        ("vienna", "Europe/Vienna"),
        ("New York", "America/New_York"),
        ("Europe/Zurch", "Europe/Zurich"),
        ("CEST", "Europe/Vienna"),
        ("BST", "Europe/London"),
    ],
)
def test_an_unknown_zone_names_the_nearest(wrong, meant):
    with pytest.raises(
        InputError, match=f"no time zone '{wrong}'; did you mean .*{meant}"
    ) as caught:
        Site(48.2, 16.37, wrong)
    assert meant in caught.value.nearest


@pytest.mark.parametrize(
    "wrong",
    [
        *("", ".", "Europe", "../../etc/passwd", "/etc/localtime", "right/UTC", "posix/UTC"),
        *("localtime", "Factory", "Europe/Vienna\0", "a\nb", "qqqqqqqq", 7),
    ],
)
def test_names_that_are_no_place(wrong):
    with pytest.raises(InputError, match="no time zone") as caught:
        find_zone(wrong)
    assert "\n" not in str(caught.value)
    assert not any(n.startswith(("right/", "posix/", "local")) for n in caught.value.nearest)


def test_no_zone_at_the_coordinates(monkeypatch):
    import tzfpy  # noqa: PLC0415

    monkeypatch.setattr(tzfpy, "get_tz", lambda *_: "")
    with pytest.raises(InputError, match=r"no time zone is known at latitude 48\.2.*give zone="):
        Site(48.2, 16.37)


def test_no_time_zone_database(monkeypatch):
    monkeypatch.setattr("zoneinfo.available_timezones", set)
    with pytest.raises(InputError, match="pip install tzdata"):
        find_zone("Europe/Wien")


def test_what_the_file_says_is_the_default():
    facts = {"latitude": 48.2, "longitude": 16.37, "true_north": 12.5}
    assert find_site(scene(**facts)) == Site(48.2, 16.37, "Europe/Vienna", true_north=12.5)


def test_what_the_caller_says_goes_first():
    facts = {"latitude": 48.2, "longitude": 16.37, "true_north": 12.5}
    site = find_site(scene(**facts), -33.87, 151.21, true_north=0.0, tell=[].append)
    assert site == Site(-33.87, 151.21, "Australia/Sydney", true_north=0.0)
    site = find_site(scene(), 0, 0, zone="Africa/Lagos")  # 0 is a number, not a blank
    assert site == Site(0, 0, "Africa/Lagos")
    assert site.true_north == 0.0


@pytest.mark.parametrize(
    ("facts", "given", "options"),
    [
        ({}, {}, r"latitude and longitude; give latitude= and longitude= in degrees"),
        ({}, {"latitude": 48.2}, r"its longitude; give longitude= in degrees"),
        ({"longitude": 16.37}, {}, r"its latitude; give latitude= in"),
    ],
)
def test_no_site_known(facts, given, options):
    with pytest.raises(InputError, match=f"the site is not known: .*{options}"):
        find_site(scene(**facts), **given)


def test_why_no_site_is_known_is_told():
    found = scene(site_doubt="the files' sites disagree (a; b)")
    with pytest.raises(InputError, match=r"not known: the files' sites disagree \(a; b\); give la"):
        find_site(found)


def test_a_site_is_found_for_anything_with_the_three_facts():
    place = SimpleNamespace(latitude=1.0, longitude=2.0, true_north=None)
    assert find_site(place, zone="UTC") == Site(1, 2, "UTC")


def test_a_site_far_from_the_files_is_told():
    london = scene(latitude=51.5, longitude=-0.13)
    assert tell_moved(london, find_site(london)) == []
    assert tell_moved(london, find_site(london, latitude=51.6)) == []
    assert tell_moved(scene(), Site(51.5, -0.13)) == []
    with pytest.warns(UserWarning, match=r"-0\.1300°, 51\.5000°, as given, lies 7,"):
        find_site(london, latitude=-0.13, longitude=51.5)
    lines = []
    find_site(london, latitude=-0.13, longitude=51.5, tell=lines.append)
    (told,) = lines
    # A quarter of a turn is 90 degrees, or 10,008 km.
    (quarter,) = tell_moved(scene(latitude=0.0, longitude=170.0), Site(0.0, -100.0))
    assert "-0.1300°, 51.5000°, as given, lies 7," in told
    assert "lies 10,008 km from 0.0000°, 170.0000°" in quarter


@pytest.mark.parametrize("wrong", ["GMT+1", "UTC+2", "UTC-05:00", "+01:00", "gmt -3"])
def test_a_difference_from_utc_is_not_inverted(wrong):
    # Etc/GMT+1 is an hour behind Greenwich, GMT+1 an hour ahead.
    with pytest.raises(InputError) as caught:
        find_zone(wrong)
    assert caught.value.nearest == []
    assert "Etc" not in str(caught.value)
    with pytest.raises(InputError) as caught:
        Site(48.2, 16.37, wrong)
    assert caught.value.nearest == ["Europe/Vienna"]


@pytest.mark.parametrize(
    ("wrong", "place", "meant"),
    [
        ("BST", None, ["Europe/London"]),
        ("BST", (51.5, -0.12), ["Europe/London"]),
        ("CEST", (41.9, 12.5), ["Europe/Rome"]),
        ("CST", (19.43, -99.13), ["America/Mexico_City"]),
        ("cst", None, ["Asia/Shanghai", "America/Chicago"]),
        ("IST", None, ["Europe/Dublin", "Asia/Jerusalem", "Asia/Kolkata"]),
    ],
)
def test_an_abbreviation_names_cities_whose_clocks_show_it(wrong, place, meant):
    with pytest.raises(InputError) as caught:
        find_zone(wrong, place)
    assert caught.value.nearest == meant


@pytest.mark.parametrize(
    ("site", "is_said"),
    [
        (Site(-0.12, 51.5), True),  # London, in the Indian Ocean
        (Site(-0.12, 51.5, "Europe/London"), True),
        (Site(16.37, 48.2, "Europe/Vienna"), True),  # in Yemen
        (Site(16.37, 48.2), False),  # so may be a house there
        (Site(51.5, -0.12), False),
        (Site(54.0, 4.0), False),  # a platform in the North Sea
        (Site(-33.87, 151.21), False),
    ],
)
def test_swapped_coordinates_of_a_model_without_a_place_are_told(site, is_said):
    assert len(tell_moved(scene(), site)) == is_said


def test_no_swapped_place_on_land_escapes_by_its_named_zone():
    told = swapped = 0
    for latitude, longitude in np.mgrid[-52:69:3, -88:89:3].reshape(2, -1).T.tolist():
        zone, other = find_local_zone(latitude, longitude), find_local_zone(longitude, latitude)
        if not zone.startswith("Etc/") and other != zone:
            swapped += 1
            told += len(tell_moved(scene(), Site(longitude, latitude, zone)))
    assert told == swapped > 900


def test_swapped_coordinates_are_told_with_the_right_ones():
    (told,) = tell_moved(scene(latitude=51.5, longitude=-0.13), Site(-0.12, 51.5))
    assert "latitude=51.5 longitude=-0.12" in told
