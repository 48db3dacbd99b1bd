"""Footprints: prisms by hand, their heights in columns, and what cannot be used."""

import json

import numpy as np
import pytest

import umbra
from umbra import InputError
from umbra.packages import write_install
from umbra.readers.footprint_table import parse_numbers

# 10 x 6 m in metres of a national grid, without a CRS in degrees.
GRID = "urn:ogc:def:crs:EPSG::31256"
SQUARE = [[1000, 342000], [1010, 342000], [1010, 342006], [1000, 342006], [1000, 342000]]
HOLE = [[1002, 342001], [1004, 342001], [1004, 342003], [1002, 342003], [1002, 342001]]
BOW_TIE = [[0, 0], [4, 4], [4, 0], [0, 4], [0, 0]]


def shift(ring, x=0, y=0):
    return [[a + x, b + y] for a, b in ring]


def feature(*rings, properties=None, kind="Polygon", **more):
    coordinates = [[ring] for ring in rings] if kind == "MultiPolygon" else list(rings)
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry, **more}


@pytest.fixture
def write(tmp_path):
    def write(*features, crs=GRID, name="f.geojson"):
        document = {"type": "FeatureCollection", "features": list(features)}
        if crs:
            document["crs"] = {"type": "name", "properties": {"name": crs}}
        path = tmp_path / name
        path.write_text(json.dumps(document))
        return path

    return write


@pytest.mark.parametrize("turned", [False, True])
def test_a_footprint_with_a_hole_becomes_a_closed_prism(write, measure, turned):
    rings = [ring[::-1] if turned else ring for ring in (SQUARE, HOLE)]
    scene = umbra.read(write(feature(*rings, properties={"height": 5})))
    assert measure.volume(scene) == pytest.approx(5 * (60 - 4))
    # Roof and floor, the walls outside and those of the yard.
    assert measure.area(scene) == pytest.approx(2 * 56 + 5 * 32 + 5 * 8)
    assert measure.open_edges(scene) == []
    np.testing.assert_allclose(scene.bounds(), [[1000, 342000, 0], [1010, 342006, 5]], atol=1e-9)
    assert scene.crs == "EPSG:31256"
    assert [part.kind for part in scene.parts] == ["Building"]


@pytest.mark.parametrize(
    ("bases", "lowest"),
    [({"base": 20, "Base": 9}, 20), ({"base_z": "7.5 m"}, 7.5), ({"base_ft": 100}, 30.48), ({}, 0)],
)
def test_a_base_is_found_by_its_usual_name(write, bases, lowest):
    scene = umbra.read(write(feature(SQUARE, properties={"height": 5, **bases})))
    np.testing.assert_allclose(scene.bounds()[:, 2], [lowest, lowest + 5])
    assert any("base" in note for note in scene.notes) == bool(bases)


def test_a_base_that_some_lack_is_told_and_not_taken(write):
    known, unknown = {"height": 5, "base": 20}, {"height": 5}
    scene = umbra.read(
        write(feature(SQUARE, properties=known), feature(SQUARE, properties=unknown))
    )
    assert scene.bounds()[1, 2] == 5
    assert any("'base'" in note for note in scene.notes)


def test_a_multipolygon_is_one_part_and_has_its_own_base(write, measure):
    path = write(
        feature(
            SQUARE, shift(SQUARE, x=50), kind="MultiPolygon",
            properties={"id": "twins", "h": 3, "floor": 100.5},
        )
    )  # fmt: skip
    scene = umbra.read(path, base_column="floor")
    assert [part.name for part in scene.parts] == ["twins"]
    assert measure.volume(scene) == pytest.approx(2 * 60 * 3)
    assert scene.bounds()[:, 2] == pytest.approx([100.5, 103.5])


def test_the_minimum_height_of_openstreetmap_counts_from_the_ground(write):
    bridge = feature(SQUARE, properties={"height": "12", "min_height": 5})
    house = feature(shift(SQUARE, x=50), properties={"height": 4})
    scene = umbra.read(write(bridge, house), base_column="min_height")
    spans = [
        np.ptp(scene.triangles([i]).vertices[scene.parts[i].mesh.faces][..., 2]) for i in (0, 1)
    ]
    assert spans == pytest.approx([7, 4])


@pytest.mark.parametrize(
    "column", ["height", "Height", "HEIGHT", "building:height", "measuredHeight", "h"]
)
def test_columns_of_heights_are_known_by_name_and_said(write, column):
    scene = umbra.read(write(feature(SQUARE, properties={"floors": 2, column: 7})))
    assert scene.bounds()[1, 2] == 7
    assert f"heights come from the column '{column}'" in scene.notes[0]


def test_a_column_can_be_chosen(write):
    path = write(feature(SQUARE, properties={"height": 7, "eaves": 5}))
    scene = umbra.read(path, height_column="eaves")
    assert scene.bounds()[1, 2] == 5
    assert scene.notes == ()


def test_degrees_become_metres_of_the_zone(write, measure):
    # 0.001° by 0.001° at 48° north: 74.6 by 111.2 m.
    ring = [[16, 48], [16.001, 48], [16.001, 48.001], [16, 48.001], [16, 48]]
    scene = umbra.read(write(feature(ring, properties={"height": 10}), crs=None))
    assert scene.crs == "EPSG:32633"
    assert measure.volume(scene) == pytest.approx(10 * 74.61 * 111.19, rel=1e-3)
    assert (scene.latitude, scene.longitude) == pytest.approx((48.0005, 16.0005), abs=1e-4)


def test_metres_without_a_crs_are_taken_as_they_are(write):
    scene = umbra.read(write(feature(SQUARE, properties={"height": 1}), crs=None))
    assert scene.crs is None
    assert any("taken as metres" in note for note in scene.notes)


def test_heights_as_text_are_read_where_they_are_numbers():
    column = ["12.5", "12,5", " 7 m", "about 20", "", None, 3, True, "1e1", "12'", float("nan")]
    numbers = parse_numbers(column)
    np.testing.assert_array_equal(
        numbers.values, [12.5, 12.5, 7, np.nan, np.nan, np.nan, 3, np.nan, 10, np.nan, np.nan]
    )
    assert numbers.from_text == 4
    assert numbers.odd == [(3, "about 20"), (9, "12'")]


def test_feet_become_metres_where_the_column_or_the_value_says_so():
    numbers = parse_numbers([30, "30", "30 m", "30 ft", "10 feet", None, "1 FOOT"], "height_ft")
    found = [9.144, 9.144, 30, 9.144, 3.048, np.nan, 0.3048]
    np.testing.assert_allclose(numbers.values, found, rtol=1e-15)
    assert numbers.in_feet == 5
    numbers = parse_numbers([30, "30", "30 m", "30 ft"], "height")
    np.testing.assert_allclose(numbers.values, [30, 30, 30, 9.144], rtol=1e-15)
    assert numbers.in_feet == 1


@pytest.mark.parametrize(
    ("column", "metres"),
    [
        ("height_ft", 9.144), ("Height (ft)", 9.144), ("building_height_feet", 9.144),
        ("height_m", 30), ("height", 30),
    ],
)  # fmt: skip
def test_a_column_in_feet_is_found_and_said(write, column, metres):
    scene = umbra.read(write(feature(SQUARE, properties={column: 30, "left": 1})))
    assert scene.bounds()[1, 2] == pytest.approx(metres)
    said = [note for note in scene.notes if "feet" in note and column in note and "metres" in note]
    assert len(said) == (metres != 30)
    chosen = umbra.read(write(feature(SQUARE, properties={column: 30})), height_column=column)
    assert chosen.bounds()[1, 2] == pytest.approx(metres)


def test_metres_go_before_feet(write):
    scene = umbra.read(write(feature(SQUARE, properties={"height_ft": 30, "height_m": 9})))
    assert scene.bounds()[1, 2] == 9


def test_what_has_no_height_is_left_out_and_counted(write):
    heights = [5, None, "tall", "6", 0, -2]
    path = write(
        *(feature(shift(SQUARE, x=20 * i), properties={"height": h}) for i, h in enumerate(heights))
    )
    scene = umbra.read(path)
    assert [part.name for part in scene.parts] == ["1", "4"]
    notes = " | ".join(scene.notes)
    assert "not numbers of metres: 1 (first: 'tall' of '3')" in notes
    assert "written as text: 1" in notes
    assert "without a height in 'height' left out: 2 (first: '2')" in notes
    assert "not above 0 in 'height' left out: 2 (first: '5')" in notes


def test_no_heights_at_all_name_the_columns(write, refuse):
    path = write(feature(SQUARE, properties={"hight": 5, "use": "flat"}))
    facts = {"columns": ["hight", "use"], "option": "height_column"}
    said = refuse(umbra.read, path, facts=facts)
    assert "has no heights: no column is called height or similar" in said
    facts = {"columns": ["hight", "use"], "column": "higt"}
    assert "did you mean 'hight'" in refuse(umbra.read, path, height_column="higt", facts=facts)
    refuse(umbra.read, path, height_column="use", facts={"option": "height_column"})
    assert "no columns" in refuse(umbra.read, write(feature(SQUARE)), facts={"columns": []})


def test_invalid_rings_are_repaired_and_counted(write, measure):
    pytest.importorskip("shapely")
    bow = feature(shift(BOW_TIE, 1000, 342000), properties={"height": 3})
    scene = umbra.read(write(feature(shift(SQUARE, x=50), properties={"height": 1}), bow))
    assert measure.volume(scene, [1]) == pytest.approx(3 * 8)
    assert measure.open_edges(scene) == []
    assert "footprints repaired: 1 (first: feature 2, self-intersection)" in scene.notes[1]


def test_without_shapely_crossing_rings_are_said(write, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "shapely", None)
    bow = [[0, 0], [4, 4], [4, 0], [1, 5], [-1, 2], [0, 0]]
    scene = umbra.read(write(feature(shift(bow, 1000, 342000), properties={"height": 3})))
    assert write_install("gis") in " ".join(scene.notes)


def test_points_and_lines_are_counted_and_nothing_else_is_an_error(write):
    point = {
        "type": "Feature",
        "properties": {},
        "geometry": {"type": "Point", "coordinates": [1, 2]},
    }
    with pytest.raises(InputError, match=r"has no polygons \(points among the footprints"):
        umbra.read(write(point))
    scene = umbra.read(write(point, feature(SQUARE, properties={"height": 3})))
    assert "points among the footprints left out: 1" in scene.notes[0]
    with pytest.raises(InputError, match="has no polygons"):
        umbra.read(write())


@pytest.mark.parametrize(
    "geometry",
    [
        {"type": "Polygon", "coordinates": [[[0, 0], [1, "a"], [1, 1]]]},
        {"type": "Polygon", "coordinates": [[1, 2, 3]]},
        {"type": "Polygon", "coordinates": 5},
        {"type": "MultiPolygon", "coordinates": [[[]]]},
        {"coordinates": []},
        [],
        "Polygon",
    ],
)
def test_damaged_coordinates_are_an_error_of_one_line(write, geometry):
    damaged = {"type": "Feature", "properties": {"height": 3}, "geometry": geometry}
    with pytest.raises(InputError, match=r"f\.geojson: ") as caught:
        umbra.read(write(feature(SQUARE, properties={"height": 3}), damaged))
    assert "\n" not in str(caught.value)


def test_a_feature_a_line_is_read(tmp_path):
    path = tmp_path / "f.geojson"
    lines = [feature(shift(SQUARE, x=20 * i), properties={"height": 3}, id=i) for i in range(3)]
    path.write_text("\n".join(map(json.dumps, lines)))
    assert [part.name for part in umbra.read(path).parts] == ["0", "1", "2"]


def write_tables(path, tables):
    """Tables of (x, y) squares of 10 x 6 m with a column, into a GeoPackage or a Shapefile."""
    pyogrio = pytest.importorskip("pyogrio")
    shapely = pytest.importorskip("shapely")
    for number, (name, column, values, crs) in enumerate(tables):
        shapes = [
            shapely.Polygon(shift(SQUARE, x=20 * i), [HOLE] if i == 0 else [])
            for i in range(len(values))
        ]
        pyogrio.raw.write(
            path, shapely.to_wkb(shapes), [np.array(values)], [column], layer=name, crs=crs,
            geometry_type="Polygon", append=number > 0,
        )  # fmt: skip
    return path


@pytest.mark.parametrize("name", ["f.gpkg", "f.shp"])
def test_geopackage_and_shapefile(tmp_path, measure, name):
    path = write_tables(tmp_path / name, [("f", "height", [5.0, np.nan, 2.0], "EPSG:31256")])
    scene = umbra.read(path)
    assert [part.name for part in scene.parts] == ["1", "3"]
    assert measure.volume(scene) == pytest.approx(5 * 56 + 2 * 60)
    assert measure.open_edges(scene) == []
    assert scene.crs == "EPSG:31256"
    assert "left out: 1 (first: '2')" in " ".join(scene.notes)
    expected = {"f.gpkg": ["f.gpkg"], "f.shp": ["f.shp", "f.dbf", "f.shx", "f.prj", "f.cpg"]}
    assert [source.name for source in scene.sources] == expected[name]
    assert [s.name for s in scene.sources if not s.is_companion] == [name]


def test_of_several_tables_the_one_with_heights(tmp_path, refuse):
    tables = [("parcels", "owner", ["a"], "EPSG:31256"), ("houses", "height", [5.0], "EPSG:31256")]
    scene = umbra.read(write_tables(tmp_path / "f.gpkg", tables))
    assert scene.bounds()[1, 2] == 5
    assert "left out: parcels" in scene.notes[0]
    again = [(name, "height", [5.0], "EPSG:31256") for name in ("old", "new")]
    path = write_tables(tmp_path / "g.gpkg", again)
    assert "several tables" in refuse(umbra.read, path, facts={"tables": ["old", "new"]})


def test_damaged_tables(tmp_path, refuse):
    path = write_tables(tmp_path / "f.gpkg", [("f", "height", [5.0], "EPSG:31256")])
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(InputError, match="cannot be read as GeoPackage"):
        umbra.read(path)
    fake = tmp_path / "fake.shp"
    fake.write_bytes(b"not a shapefile")
    assert "does not begin as such a file" in refuse(umbra.read, fake, facts={"ending": ".shp"})


def test_without_the_package_the_extra_is_named(tmp_path, refuse, monkeypatch):
    path = write_tables(tmp_path / "f.gpkg", [("f", "height", [5.0], "EPSG:31256")])
    monkeypatch.setitem(__import__("sys").modules, "pyogrio", None)
    refuse(umbra.read, path, facts={"package": "pyogrio", "extra": "gis"})


def test_tokyo(real_file, measure):
    scene = umbra.read(real_file("tokyo_footprints.geojson"))
    assert len(scene.parts) == 1374
    assert scene.crs == "EPSG:32654"
    assert (scene.latitude, scene.longitude) == pytest.approx((35.549, 139.713), abs=1e-3)
    assert measure.open_edges(scene) == []
    assert scene.bounds()[:, 2].tolist() == [0, 96]
    assert any("repaired: 3" in note for note in scene.notes) or len(scene.notes) == 2


def test_tangled_footprints_are_not_repaired_but_named(write):
    # A repair adds a corner at each of some million crossings.
    pytest.importorskip("shapely")
    tangle = np.random.default_rng(0).uniform(0, 100, (3000, 2)).tolist()
    tangle.append(tangle[0])
    bow = [[200, 0], [210, 10], [210, 0], [200, 10], [200, 0]]
    shapes = [feature(ring, properties={"height": 10}) for ring in (tangle, bow)]
    scene = umbra.read(write(*shapes))
    notes = " ".join(scene.notes)
    assert "footprints too tangled to repair" in notes
    assert ": 1 (first: feature 1)" in notes
    assert "footprints repaired: 1 (first: feature 2" in notes


def test_features_that_share_an_id_stay_apart_and_take_their_names(write):
    houses = [
        feature(shift(SQUARE, x=20 * n), properties={"Id": 0, "height": 3, "name": name})
        for n, name in enumerate(["Town hall", "Church", "Church", None])
    ]
    scene = umbra.read(write(*houses))
    assert [part.name for part in scene.parts] == ["Town hall", "Church", "Church (2)", "4"]
    assert len(set(scene.groups().tolist())) == 4
    assert (
        "f.geojson: names come from the column 'name' (name_column=); footprints without one, "
        "named by their order: 1; footprints with a repeated name, numbered: 1"
    ) in scene.notes


@pytest.mark.parametrize(
    ("properties", "ids", "names", "of"),
    [
        ([{"Id": 0}, {"Id": 0}], None, ["1", "2"], "for the column 'Id' is the same for all"),
        ([{"Id": 7}, {"Id": 9}], None, ["7", "9"], "the column 'Id'"),
        ([{"NAME": "a"}, {"NAME": "b"}], [5, 6], ["a", "b"], "the column 'NAME'"),
        ([{"name": "a"}, {}], [5, 6], ["5", "6"], "the features' own ids"),
        ([{"gml_id": "a"}, {"gml_id": "b"}], [0, 0], ["a", "b"], "the column 'gml_id'"),
        ([{"name": "3"}, {"name": "b"}, {}], None, ["3", "b", "3 (2)"], "by their order: 1"),
    ],
)
def test_names_come_from_what_tells_most_apart(write, properties, ids, names, of):
    features = [
        feature(shift(SQUARE, x=20 * n), properties={"height": 3, **row})
        | ({} if ids is None else {"id": ids[n]})
        for n, row in enumerate(properties)
    ]
    scene = umbra.read(write(*features))
    assert [part.name for part in scene.parts] == names
    assert any(of in note and "name_column=" in note for note in scene.notes)


def test_a_column_of_names_is_chosen(write):
    rows = [{"height": 3, "name": "a", "plot": 12.0}, {"height": 3, "name": "b", "plot": 13.0}]
    path = write(*(feature(shift(SQUARE, x=20 * n), properties=p) for n, p in enumerate(rows)))
    assert [part.name for part in umbra.read(path, name_column="Plot").parts] == ["12", "13"]
    with pytest.raises(InputError, match=r"there is no column 'plots'.*did you mean 'plot'"):
        umbra.read(path, name_column="plots")


def turn_houses(*, is_swapped, angle=0.4):
    """Make houses of 20 x 9 m in Vienna in degrees, turned by an angle."""
    east, north = 1 / (111_320 * np.cos(np.radians(48.2))), 1 / 111_320
    corners = np.array([(0, 0), (20, 0), (20, 9), (0, 9), (0, 0)])
    turned = corners @ [(np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))]
    houses = []
    for k in range(5):
        ring = turned * (east, north) + (16.37 + 0.0005 * k, 48.2)
        ring = ring[:, ::-1] if is_swapped else ring
        houses.append(feature(ring.tolist(), properties={"height": 9}))
    return houses


def test_swapped_degrees_are_told_by_corners_that_are_not_square(write):
    def read(**how):
        scene = umbra.read(write(*turn_houses(**how), crs=None))
        return [note for note in scene.notes if "may be swapped" in note]

    (note,) = read(is_swapped=True)
    assert "100 % of the corners would be square if they were, and 0 % are" in note
    assert "longitude 48.2000, latitude 16.3700" in note
    assert not read(is_swapped=False)
    assert not read(is_swapped=True, angle=0.0)  # square either way: nothing tells


@pytest.mark.parametrize("crs", [None, "urn:ogc:def:crs:OGC:1.3:CRS84"])
def test_latitudes_that_can_be_none_are_refused(write, crs):
    ring = [[35.5 + y / 1e4, 139.7 + x / 1e4] for x, y in [(0, 0), (1, 0), (1, 1), (0, 0)]]
    with pytest.raises(InputError, match=r"latitudes where .* longitudes \(first: 35.5000, 139"):
        umbra.read(write(feature(ring, properties={"height": 9}), crs=crs))


@pytest.mark.parametrize(("axes", "is_told"), [((0, 1), False), ((1, 0), True)])
def test_swapped_axes_of_degrees_are_told(tmp_path, axes, is_told):
    """London swapped lies in the Indian Ocean."""
    corners = np.array([[-0.1, 51.5], [-0.0998, 51.5], [-0.0998, 51.5002], [-0.1, 51.5002]])
    ring = corners[[0, 1, 2, 3, 0]][:, axes].tolist()
    house = {"type": "Feature", "properties": {"height": 9},
             "geometry": {"type": "Polygon", "coordinates": [ring]}}  # fmt: skip
    path = tmp_path / "house.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [house]}))
    told = [note for note in umbra.read(path).notes if "swap" in note]
    assert len(told) == is_told
    assert all("London" in note for note in told)
