"""Files of named areas: formats, coordinates, names, and what is refused."""

import json

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.readers.area_file import load_areas, read_areas

shapely = pytest.importorskip("shapely")

AT = (600_000.0, 5_340_000.0)  # in Vienna, UTM 33N
CORNERS = [(0, 0), (20, 0), (20, 10), (0, 10)]
HOLE = [(5, 2), (15, 2), (15, 8), (5, 8)]


def make_model(at=AT, crs="EPSG:32633", **facts):
    """Make a tower at a place of a CRS."""
    x, y = at
    scene = umbra.make_scene(*box((x, y, 100), (x + 10, y + 10, 120)), name="tower")
    return scene.with_facts(crs=crs, **facts)


def write(path, polygons, **more):
    """Write GeoJSON: names and their rings."""
    features = [
        {"type": "Feature", "properties": {"name": name, "flat": "3"}, "geometry":
         {"type": "Polygon", "coordinates": [[*ring, ring[0]] for ring in rings]}}
        for name, rings in polygons
    ]  # fmt: skip
    document = {"type": "FeatureCollection", "features": features, **more}
    path.write_text(json.dumps(document))
    return path


def shift(ring, at=AT):
    return [(x + at[0], y + at[1]) for x, y in ring]


def to_degrees(ring):
    from pyproj import Transformer  # noqa: PLC0415

    there = Transformer.from_crs("EPSG:32633", "EPSG:4326", always_xy=True)
    return [there.transform(*corner) for corner in shift(ring)]


def check(area, at=AT):
    assert area.area_m2 == pytest.approx(200 - 60, rel=1e-6)
    low = np.array(shapely.bounds(area.polygon)[:2]) - at
    assert low == pytest.approx([0, 0], abs=1e-3)


def test_geojson_in_the_models_coordinates(tmp_path):
    file = write(tmp_path / "a.geojson", [("garden", [shift(CORNERS), shift(HOLE)])])
    (area,), notes = read_areas(file, make_model())
    check(area)
    assert (area.name, area.properties["flat"]) == ("garden", "3")
    assert notes == ["a.geojson: areas are taken in the model's own coordinates"]


def test_geojson_in_degrees(tmp_path):
    file = write(tmp_path / "a.geojson", [("garden", [to_degrees(CORNERS), to_degrees(HOLE)])])
    (area,), notes = read_areas(file, make_model())
    check(area)
    assert len(notes) == 1
    assert "WGS 84" in notes[0]


def test_small_numbers_are_metres_of_a_small_model(tmp_path):
    """They could be degrees; they lie at the model when they are not."""
    file = write(tmp_path / "a.geojson", [("garden", [CORNERS, HOLE])])
    (area,), notes = read_areas(file, make_model((0.0, 0.0), None, latitude=48.2, longitude=16.4))
    check(area, (0, 0))
    assert "own coordinates" in notes[0]


def test_degrees_about_the_site_of_a_model_without_a_crs(tmp_path):
    """Its plan is turned: what lies north of the site lies along x. As metres it were a speck."""
    north = 1000 / 111_200
    ring = [(16.4, 48.2 + north), (16.4001, 48.2 + north), (16.4001, 48.2001 + north)]
    file = write(tmp_path / "a.geojson", [("garden", [ring])])
    scene = make_model((0.0, 0.0), None, latitude=48.2, longitude=16.4, true_north=90.0)
    (area,), _ = read_areas(file, scene)
    west, south, _, north = shapely.bounds(area.polygon)
    assert west == pytest.approx(1000, abs=5)  # true north lies at an azimuth of 90 degrees
    assert (south, north) == (pytest.approx(-7.4, abs=1), pytest.approx(0, abs=0.1))


@pytest.mark.parametrize("ending", ["gpkg", "shp"])
def test_gis_files_with_another_crs(tmp_path, ending):
    geopandas = pytest.importorskip("geopandas")
    pytest.importorskip("pyogrio")
    polygon = shapely.Polygon(to_degrees(CORNERS), [to_degrees(HOLE)])
    frame = geopandas.GeoDataFrame({"name": ["garden"]}, geometry=[polygon], crs="EPSG:4326")
    file = tmp_path / f"a.{ending}"
    frame.to_file(file)
    (area,), _ = read_areas(file, make_model())
    check(area)
    assert area.name == "garden"
    from umbra.receivers.area_search import find_areas  # noqa: PLC0415

    (same,), _ = find_areas(make_model(), frame)
    assert shapely.equals_exact(same.polygon.normalize(), area.polygon.normalize(), 1e-6)


def test_a_drawing_of_400_named_plots_is_read(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new(units=ezdxf.units.M)
    space = drawing.modelspace()
    for k in range(400):
        x, y = 20 * (k % 20), 20 * (k // 20)
        corners = [(x, y), (x + 15, y), (x + 15, y + 15), (x, y + 15)]
        space.add_lwpolyline(corners, close=True)
        space.add_text(f"plot {k}").set_placement((x + 3, y + 3))
    space.add_lwpolyline([(-1, -1), (400, -1), (400, 400), (-1, 400)], close=True)
    drawing.saveas(tmp_path / "plots.dxf")
    areas = load_areas(tmp_path / "plots.dxf").areas
    assert [area.name for area in areas] == [*(f"plot {k}" for k in range(400)), "0"]


def test_dxf_in_millimetres_named_by_text_and_layer(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new(units=ezdxf.units.MM)
    space = drawing.modelspace()
    space.add_lwpolyline([(1e3 * x, 1e3 * y) for x, y in CORNERS], close=True,
                         dxfattribs={"layer": "GARDENS"})  # fmt: skip
    space.add_text("Hof 1").set_placement((3000, 3000))
    hatch = space.add_hatch(dxfattribs={"layer": "LAWN"})
    for ring in (CORNERS, HOLE):
        hatch.paths.add_polyline_path([(1e3 * x + 30e3, 1e3 * y) for x, y in ring])
    space.add_lwpolyline([(0, 0), (1, 1)], dxfattribs={"layer": "GARDENS"})
    drawing.saveas(tmp_path / "a.dxf")
    (yard, lawn), notes = read_areas(tmp_path / "a.dxf", make_model((0.0, 0.0), None))
    assert (yard.name, yard.area_m2) == ("Hof 1", pytest.approx(200))
    assert (lawn.name, lawn.area_m2) == ("LAWN", pytest.approx(140))
    assert any("not closed" in note for note in notes)


def test_features_without_names_are_numbered(tmp_path):
    file = write(tmp_path / "a.geojson", [("", [CORNERS]), (None, [HOLE])])
    areas, _ = read_areas(file, make_model((0.0, 0.0), None))
    assert [area.name for area in areas] == ["area 1", "area 2"]
    (alone,), _ = read_areas(write(tmp_path / "back yard.geojson", [("", [CORNERS])]),
                             make_model((0.0, 0.0), None))  # fmt: skip
    assert alone.name == "back yard"  # the file's


@pytest.mark.parametrize(
    ("polygons", "words"),
    [
        ([], "holds no polygon"),
        ([("a", [CORNERS]), ("b", [HOLE]), ("a", [HOLE])], r"called 'a' .*features 1 and 3"),
        ([("bow", [[(0, 0), (4, 4), (4, 0), (0, 4)]])], r"'bow' is not a valid polygon"),
        ([("flat", [[(0, 0), (4, 4)]])], r"'flat' has a ring of fewer than three"),
        ([("far", [shift(CORNERS, (9e6, 9e6))])], r"'far' lies .* km from the model"),
    ],
)
def test_what_is_refused(tmp_path, polygons, words):
    file = write(tmp_path / "a.geojson", polygons)
    with pytest.raises(umbra.InputError, match=words) as caught:
        read_areas(file, make_model((0.0, 0.0), None))
    assert caught.value.option == "areas"
    assert str(file) in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"  \n", b"x,y\n1,2\n", b'{"type": "CityJSON"}', b"{"])
def test_files_of_something_else(tmp_path, content):
    file = tmp_path / "a.geojson"
    file.write_bytes(content)
    with pytest.raises(umbra.InputError) as caught:
        read_areas(file, make_model())
    assert caught.value.option == "areas"
    with pytest.raises(umbra.InputError, match="no such file"):
        read_areas(tmp_path / "b.geojson", make_model())
