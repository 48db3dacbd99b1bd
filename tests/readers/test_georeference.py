"""Where on earth: CRS names, latitude, longitude, north, degrees and feet."""

import json

import numpy as np
import pyproj
import pytest
from pyproj import Geod, Proj

import umbra
from umbra import InputError
from umbra.readers.georeference import name_crs, show_crs


@pytest.fixture
def save(tmp_path, box):
    def write(crs, place, scale=(1.0, 1.0, 1.0), *, name="m.city.json"):
        vertices, faces = box
        document = {
            "type": "CityJSON",
            "version": "2.0",
            "transform": {"scale": list(scale), "translate": list(place)},
            "metadata": {"referenceSystem": crs},
            "vertices": vertices,
            "CityObjects": {
                "a": {
                    "type": "Building",
                    "geometry": [
                        {"type": "Solid", "lod": "2", "boundaries": [[[f] for f in faces]]}
                    ],
                }
            },
        }
        path = tmp_path / name
        path.write_text(json.dumps(document))
        return path

    return write


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("https://www.opengis.net/def/crs/EPSG/0/7415", "EPSG:7415"),
        ("http://www.opengis.net/def/crs/EPSG/9.9.1/7415/", "EPSG:7415"),
        ("urn:ogc:def:crs:EPSG::7415", "EPSG:7415"),
        ("urn:ogc:def:crs:EPSG:6.12:28992", "EPSG:28992"),
        ("urn:ogc:def:crs,crs:EPSG::2056,crs:EPSG::5728", "EPSG:2056+5728"),
        ("EPSG:7415", "EPSG:7415"),
        ("epsg:7415", "EPSG:7415"),
        (7415, "EPSG:7415"),
        ("https://www.opengis.net/def/crs/OGC/1.3/CRS84", "OGC:CRS84"),
        ("https://www.opengis.net/def/crs/OGC/0/CRS84h", "OGC:CRS84h"),
        ("Rijksdriehoek", "Rijksdriehoek"),
        ("", None),
        (None, None),
        ([7415], None),
    ],
)
def test_names(text, name):
    assert name_crs(text) == name


def test_amersfoort_is_where_the_dutch_say(save):
    # The origin of EPSG:28992 in WGS 84 (Schreutelkamp and Strang van Hees 2001), on Bessel's
    # ellipsoid 110 m to the north and 30 m to the east; there the grid's north is true north.
    scene = umbra.read(save("EPSG:28992", (155000 - 1, 463000 - 1.5, 0)))
    assert scene.latitude == pytest.approx(52.1551744, abs=1e-5)
    assert scene.longitude == pytest.approx(5.38720621, abs=1e-5)
    assert scene.true_north == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("east", [300000.0, 700000.0])
@pytest.mark.parametrize(("code", "north"), [(32633, 5300000.0), (32733, 6200000.0)])
def test_true_north_is_the_meridian_convergence(save, east, code, north):
    scene = umbra.read(save(f"EPSG:{code}", (east, north, 0)))
    # PROJ's own convergence: grid north's azimuth from true north.
    factors = Proj(f"EPSG:{code}").get_factors(scene.longitude, scene.latitude)
    assert scene.true_north == pytest.approx(-factors.meridian_convergence, abs=1e-6)
    # West of the central meridian, in the north, the meridian leans east (clockwise).
    assert (scene.true_north > 0) == ((east < 500000) == (code == 32633))


def test_southward_axes_turn_north_round(save):
    # South Africa's Lo29 counts west and south.
    scene = umbra.read(save("EPSG:2053", (0, 2900000, 0)))
    assert -27 < scene.latitude < -25
    assert abs(scene.true_north) == pytest.approx(180, abs=0.1)


def test_degrees_become_metres(save, measure):
    # 1e-4 degrees near Vienna: a box of 2 x 3 of them, 4 m tall.
    scene = umbra.read(save("EPSG:4979", (16.37, 48.2, 170), (1e-4, 1e-4, 1.0)))
    assert scene.crs == "EPSG:32633"
    assert any("converted from EPSG:4979 to EPSG:32633" in note for note in scene.notes)
    assert (scene.latitude, scene.longitude) == pytest.approx((48.20015, 16.3701), abs=1e-6)
    geod = Geod(ellps="WGS84")
    wide = geod.inv(16.37, 48.2, 16.3702, 48.2)[2]
    deep = geod.inv(16.37, 48.2, 16.37, 48.2003)[2]
    # UTM shrinks lengths by at most 0.04 percent.
    assert measure.volume(scene) == pytest.approx(wide * deep * 4, rel=1e-3)
    assert measure.open_edges(scene) == []
    assert scene.bounds()[:, 2].tolist() == [170, 174]


def test_a_building_on_the_antimeridian_is_not_as_wide_as_the_earth(tmp_path):
    ring = [[179.9999, -16.8], [-179.9999, -16.8], [-179.9999, -16.7999], [179.9999, -16.7999]]
    footprint = {
        "type": "Feature",
        "properties": {"height": 10},
        "geometry": {"type": "Polygon", "coordinates": [[*ring, ring[0]]]},
    }
    path = tmp_path / "fiji.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [footprint]}))
    scene = umbra.read(path)
    assert scene.crs in {"EPSG:32701", "EPSG:32760"}
    assert abs(scene.longitude) == pytest.approx(180, abs=1e-5)
    low, high = scene.bounds()
    geod = Geod(ellps="WGS84")
    assert (high - low)[:2] == pytest.approx(
        [geod.inv(*ring[0], *ring[1])[2], geod.inv(*ring[0], *ring[3])[2]], abs=0.4
    )
    assert abs(scene.true_north) < 1


@pytest.mark.parametrize("code", [3857, 3395])
def test_metres_of_a_web_map_become_true_ones(save, measure, code):
    """At 48 degrees north Mercator's metres are 0.67 m: walls would be half as high again."""
    x, y = Proj(code)(16.37, 48.2)
    scene = umbra.read(save(f"EPSG:{code}", (x, y, 170)))
    assert scene.crs == "EPSG:32633"
    assert any(f"converted from EPSG:{code} to EPSG:32633" in note for note in scene.notes)
    assert (scene.latitude, scene.longitude) == pytest.approx((48.2, 16.37), abs=1e-4)
    assert measure.volume(scene) == pytest.approx(24 * np.cos(np.radians(48.2)) ** 2, rel=0.01)


def test_degrees_keep_their_datum_where_it_has_zones(save):
    scene = umbra.read(save("EPSG:4269", (-74, 40.7, 0), (1e-4, 1e-4, 1.0)))
    assert scene.crs == "EPSG:26918"
    scene = umbra.read(save("EPSG:4258", (4.4, 52.0, 0), (1e-4, 1e-4, 1.0)))
    assert scene.crs == "EPSG:25831"


def test_feet_with_heights_in_feet_become_metres(save, measure):
    # The false easting, 300,000 m or 984,250 US survey feet, is on 74 degrees west.
    scene = umbra.read(save("EPSG:2263+6360", (984249, 212000, 100)))
    foot = 1200 / 3937
    assert scene.crs == "EPSG:26918"
    assert measure.volume(scene) == pytest.approx(24 * foot**3, rel=2e-3)
    assert scene.bounds()[:, 2] == pytest.approx([100 * foot, 104 * foot])
    assert scene.longitude == pytest.approx(-74.0, abs=1e-6)
    # North of 40 deg 10' by 212,000 feet, at 111,037 m a degree.
    assert scene.latitude == pytest.approx(40 + 10 / 60 + 212000 * foot / 111037, abs=1e-3)


def test_feet_without_the_heights_unit_are_feet_in_all_axes(save, measure):
    scene = umbra.read(save("EPSG:2263", (984249, 212000, 100)))
    foot = 1200 / 3937
    assert scene.crs == "EPSG:26918"
    assert measure.volume(scene) == pytest.approx(24 * foot**3, rel=2e-3)
    assert scene.bounds()[:, 2] == pytest.approx([100 * foot, 104 * foot])
    assert "EPSG:2263 does not say the unit of heights: taken as feet" in scene.notes[-1]
    assert umbra.read(save("EPSG:2263+5703", (984249, 212000, 100))).bounds()[1, 2] == 104


def test_heights_of_footprints_are_metres_in_a_plan_of_feet(tmp_path):
    corners = [[984249, 212000], [984349, 212000], [984349, 212100], [984249, 212000]]
    path = tmp_path / "a.geojson"
    feature = {
        "type": "Feature",
        "properties": {"height": 12},
        "geometry": {"type": "Polygon", "coordinates": [corners]},
    }
    named = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::2263"}}
    whole = {"type": "FeatureCollection", "crs": named, "features": [feature]}
    path.write_text(json.dumps(whole))
    scene = umbra.read(path)
    assert scene.bounds()[:, 2].tolist() == [0, 12]
    assert "taken as metres" in scene.notes[-1]
    named["properties"]["name"] = "EPSG:2263+6360"
    path.write_text(json.dumps(whole))
    assert umbra.read(path).bounds()[1, 2] == 12


def test_geocentric_coordinates_are_refused_by_name(save):
    with pytest.raises(InputError, match="geocentric"):
        umbra.read(save("EPSG:4978", (4e6, 1e6, 4.7e6)))


@pytest.mark.parametrize("crs", ["EPSG:99999", "our own grid", "EPSG:5773"])
def test_unknown_crs_is_read_as_metres_with_a_note(save, measure, crs):
    scene = umbra.read(save(crs, (1000, 2000, 0)))
    assert measure.volume(scene) == pytest.approx(24.0)
    assert scene.crs == crs
    assert (scene.latitude, scene.longitude, scene.true_north) == (None, None, None)
    assert "latitude= and longitude=" in scene.notes[0]


def test_crs_that_does_not_fit_its_coordinates_gives_no_site(save):
    scene = umbra.read(save("EPSG:7415", (0, 0, 0)))
    assert scene.latitude is None
    assert "outside the area where EPSG:7415" in scene.notes[0]


def test_degrees_that_are_none_are_refused(save):
    with pytest.raises(InputError, match="do not fit their CRS EPSG:4326"):
        umbra.read(save("EPSG:4326", (84616, 447422, 0)))


def test_files_merge_about_one_origin(save, measure):
    one = save("EPSG:28992", (155000, 463000, 0), name="one.json")
    two = save("EPSG:28992", (155100, 463000, 0), name="two.json")
    scene = umbra.read(one, two)
    assert [p.name for p in scene.parts] == ["a", "a"]
    assert measure.volume(scene) == pytest.approx(48.0)
    assert scene.bounds().tolist() == [[155000, 463000, 0], [155102, 463003, 4]]
    assert [s.name for s in scene.sources] == ["one.json", "two.json"]
    assert scene.origin[0] == 155051
    assert np.abs(scene.triangles().vertices).max() < 100


def test_files_in_two_reference_systems_are_refused_if_one_is_not_known(save):
    one = save("EPSG:28992", (155000, 463000, 0), name="one.json")
    two = save("EPSG:99999", (2682811, 1248058, 0), name="two.json")
    with pytest.raises(
        InputError, match=r"one\.json is in EPSG:28992 but .*two\.json is in EPSG:99999"
    ):
        umbra.read(one, two)


def test_a_crs_in_well_known_text_is_shown_by_its_title(save):
    text = (
        'PROJCS["site grid",GEOGCS["ETRS89",DATUM["European_Terrestrial_Reference_System_1989",'
        'SPHEROID["GRS 1980",6378137,298.257222101]],PRIMEM["Greenwich",0],'
        'UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
        'PARAMETER["latitude_of_origin",48],PARAMETER["central_meridian",9],'
        'PARAMETER["scale_factor",1],PARAMETER["false_easting",1000],'
        'PARAMETER["false_northing",5000],UNIT["metre",1]]'
    )
    scene = umbra.read(save(text, (1000, 5000, 0)))
    assert scene.latitude == pytest.approx(48, abs=1e-3)
    assert show_crs(scene.crs) == "site grid"
    assert show_crs("EPSG:31256") == "EPSG:31256"
    other = save("EPSG:25832", (500000, 5316000, 0), name="b.json")
    assert "from EPSG:25832 to site grid" in " ".join(
        umbra.read(save(text, (1000, 5000, 0)), other).notes
    )


@pytest.mark.parametrize("form", ["WKT1_GDAL", "WKT1_ESRI"])
def test_a_projection_that_no_one_knows_is_an_unknown_crs(save, form):
    known = pyproj.CRS("EPSG:31256").to_wkt(form)
    text = known.replace("Transverse Mercator", "Guess").replace("Transverse_Mercator", "Guess")
    assert text != known
    scene = umbra.read(save(text, (1000, 342000, 0)))
    assert scene.latitude is None
    assert "is not known, so coordinates are taken as metres" in scene.notes[-1]
