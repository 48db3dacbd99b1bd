"""Streets, green and water under plans: cut at buildings, told, and never counted."""

import json

import numpy as np
import pytest
from support.days import parts
from support.shapes import box

import umbra
from umbra import InputError
from umbra.readers.context_table import name_context_kind
from umbra.scene import Mesh, Part, make_scene
from umbra.writers.folder.drawn_context import cut_line, find_context

shapely = pytest.importorskip("shapely")
VIENNA = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
DAY = {"date": "2026-03-21", "every": "2h", "cell": 1.0}
STREET = [[-500.0, 5.0], [500.0, 5.0]]  # through the house
PARK = [[-30.0, 15.0], [-8.0, 15.0], [-8.0, 30.0], [-30.0, 30.0], [-30.0, 15.0]]
HOLE = [[-20.0, 18.0], [-14.0, 18.0], [-14.0, 24.0], [-20.0, 24.0], [-20.0, 18.0]]
LAKE = [[20.0, -20.0], [40.0, -20.0], [40.0, -10.0], [20.0, -20.0]]
FEATURES = [
    ({"highway": "residential"}, {"type": "LineString", "coordinates": STREET}),
    ({"leisure": "park"}, {"type": "Polygon", "coordinates": [PARK, HOLE]}),
    ({"natural": "water"}, {"type": "MultiPolygon", "coordinates": [[LAKE]]}),
    ({"natural": "tree"}, {"type": "Point", "coordinates": [0, 0]}),
]


@pytest.fixture
def house():
    return parts(house=box((0, 0, 0), (10, 10, 8)))


def write_geojson(path, features=FEATURES, **more):
    found = [{"type": "Feature", "properties": p, "geometry": g} for p, g in features]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": found, **more}))
    return path


@pytest.mark.parametrize("seed", range(4))
def test_a_line_keeps_what_lies_in_the_frame_and_over_no_building(seed):
    """Its length is that of the exact difference, to a cell at each end."""
    rng = np.random.default_rng(seed)
    x, y = np.arange(60) + 0.5, np.arange(40) + 0.5
    built = np.zeros((40, 60), np.bool_)
    built[10:20, 15:30] = built[25:35, 40:44] = True
    houses = shapely.union_all([shapely.box(15, 10, 30, 20), shapely.box(40, 25, 44, 35)])
    line = rng.uniform((-20, -20), (80, 60), (12, 2)) * (1 if seed else 1e6)
    whole = shapely.difference(
        shapely.intersection(shapely.linestrings(line), shapely.box(-1, -1, 61, 41)), houses
    )
    pieces = cut_line(line, x, y, built)
    length = sum(np.hypot(*np.diff(piece, axis=0).T).sum() for piece in pieces)
    ends = 2 * max(len(shapely.get_parts(whole)), len(pieces))
    assert length == pytest.approx(whole.length, abs=1.1 * ends)
    for piece in pieces:
        assert shapely.linestrings(piece).intersection(houses.buffer(-1.1)).is_empty


def test_a_picture_has_its_context_and_the_result_has_none(house, tmp_path):
    file = write_geojson(tmp_path / "context.geojson")
    study = umbra.shadow_study(house, VIENNA, **DAY)
    study.write(tmp_path / "bare", "svg", report=True)
    study.write(tmp_path / "drawn", "svg", report=True, context=file)
    pairs = [[tmp_path / of / name for of in ("bare", "drawn")] for name in ("hours", "profile")]
    for bare, drawn in pairs:
        told = drawn.with_suffix(".svg").read_text()
        for words in ("streets", "green lines", "water", "context.geojson", "never counted"):
            assert words in told
            assert words not in bare.with_suffix(".svg").read_text()
        assert bare.with_suffix(".png").read_bytes() != drawn.with_suffix(".png").read_bytes()
    page = (tmp_path / "drawn" / "report.html").read_text()
    assert "never counted" in page
    import xarray as xr  # noqa: PLC0415

    bare, drawn = (xr.load_dataset(tmp_path / of / "study.nc") for of in ("bare", "drawn"))
    xr.testing.assert_identical(bare.drop_attrs(), drawn.drop_attrs())


def test_the_profile_s_bare_paper_is_tinted_but_not_in_a_hole(house, tmp_path):
    from umbra.writers.context_lines import tint_context  # noqa: PLC0415
    from umbra.writers.folder.drawn_context import cut_shapes  # noqa: PLC0415
    from umbra.writers.paper import Leaf, Panel  # noqa: PLC0415
    from umbra.writers.picture_content import Plan  # noqa: PLC0415

    x, y = np.arange(-40, 41.0), np.arange(0, 41.0)
    shapes = find_context(house, write_geojson(tmp_path / "context.geojson"))
    context = cut_shapes(shapes, x, y, np.zeros((41, 81), np.bool_))
    panel = Panel(Leaf(4, 4), Plan(x, y, context=context), (0, 0, 8.1, 4.1), (410, 810))
    image = np.ones((410, 810, 3), np.float32)
    image[:, 200:] = 0.5  # in shadow from x = -20.5 on
    tint_context(image, panel)

    def at(east, north):
        return image[round((north + 0.5) * 10), round((east + 40.5) * 10)].tolist()

    assert at(-28, 20) != [1, 1, 1]  # in the park
    assert at(-35, 20) == [1, 1, 1]
    assert at(-17, 26) == [0.5, 0.5, 0.5]  # its shadow keeps its colour
    changed = (image != np.where(np.arange(810)[None, :, None] < 200, 1, 0.5)).any(-1)
    assert changed.sum() == pytest.approx(100 * 9.5 * 15, rel=0.02)


@pytest.mark.filterwarnings("ignore:.crs. was not provided")
@pytest.mark.parametrize("ending", ["gpkg", "shp", "dxf"])
def test_every_format_gives_the_same_lines(house, tmp_path, ending):
    expected = find_context(house, write_geojson(tmp_path / "all.geojson"))
    path = tmp_path / f"context.{ending}"
    lines, areas = [STREET], [[PARK, HOLE], [LAKE]]
    if ending == "dxf":
        ezdxf = pytest.importorskip("ezdxf")
        drawing = ezdxf.new(units=ezdxf.units.M)
        space = drawing.modelspace()
        space.add_lwpolyline(STREET, dxfattribs={"layer": "STREETS"})
        hatch = space.add_hatch(dxfattribs={"layer": "Park 1"})
        for ring in areas[0]:
            hatch.paths.add_polyline_path(ring, is_closed=True)
        space.add_lwpolyline(LAKE[:-1], close=True, dxfattribs={"layer": "water"})
        drawing.saveas(path)
    else:
        pytest.importorskip("pyogrio")
        import geopandas  # noqa: PLC0415

        polygons = [shapely.Polygon(rings[0], rings[1:]) for rings in areas]
        both = [
            (geopandas.GeoDataFrame({"kind": ["park", "lake"]}, geometry=polygons), "areas"),
            (geopandas.GeoDataFrame({"kind": ["road"]}, geometry=[shapely.LineString(lines[0])]),
             "ways"),
        ]  # fmt: skip
        if ending == "shp":  # holds one kind of geometry
            both = both[:1]
            expected = [shape for shape in expected if shape[0] != "street"]
        for frame, layer in both:
            frame.to_file(path, **({"layer": layer} if ending == "gpkg" else {}))
    found = find_context(house, path)

    def measure(shapes):
        return sorted(
            (kind, round(sum(shapely.Polygon(r).area for r in rings)),
             round(sum(shapely.LineString(line).length for line in lines)))
            for kind, rings, lines in shapes
        )  # fmt: skip

    assert measure(found) == measure(expected)


def test_degrees_are_brought_to_the_model(house, tmp_path):
    scene = make_scene(
        [Part("house", "", Mesh(*box((0, 0, 0), (10, 10, 8))))], latitude=48.2, longitude=16.37
    )
    line = {"type": "LineString", "coordinates": [[16.37, 48.2], [16.371, 48.2]]}
    ((kind, _, (street,)),) = find_context(
        scene, write_geojson(tmp_path / "streets.geojson", [({}, line)])
    )
    assert kind == "street"  # by the file's name
    np.testing.assert_allclose(street[0], 0, atol=1e-6)
    assert street[1][0] == pytest.approx(74.3, abs=0.2)  # a thousandth of a degree at 48.2 N


def test_parts_of_the_model_are_context_by_their_kind(tmp_path):
    flat = [Part("lane", "Road", Mesh(*box((-40, -9, 0), (40, -5, 0.1)))),
            Part("pond", "WaterBody", Mesh(*box((15, 0, 0), (25, 8, 0.1)))),
            Part("house", "", Mesh(*box((0, 0, 0), (10, 10, 8))))]  # fmt: skip
    scene = make_scene(flat)
    found = find_context(scene, ["Road", "WaterBody"])
    assert [(kind, len(rings)) for kind, rings, _ in found] == [("street", 1), ("water", 1)]
    assert abs(shapely.Polygon(found[0][1][0]).area - 320) < 1e-6
    study = umbra.shadow_study(scene, VIENNA, receivers="top", **DAY)
    study.write(tmp_path, "svg", context="Road")
    told = (tmp_path / "hours.svg").read_text()
    assert "parts of the model" in told
    assert "never counted" not in told  # roads of the model are receivers


@pytest.mark.parametrize(
    ("columns", "names", "kind"),
    [
        ({"highway": "footway", "name": "Lake Road"}, (), "street"),
        ({"waterway": "ditch"}, (), "water"),
        ({"highway": None, "landuse": "Forest"}, (), "green"),
        ({"fclass": "riverbank"}, (), "water"),
        ({"highway": "no"}, ("Straßen_2024",), "street"),
        ({}, ("layer 0", "GREEN-AREAS"), "green"),
        ({"name": "Park Lane"}, ("plan",), "other"),
        ({"type": "roadside hedge"}, (), "green"),
    ],
)
def test_columns_then_names_say_what_a_feature_is(columns, names, kind):
    assert name_context_kind(columns, *names) == kind


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("x,y\n1,2\n", "is not a file of streets"),
        ('{"type": "Topology"}', "no GeoJSON"),
        ('{"type": "Point", "coordinates": [0, 0]}', "no GeoJSON"),
        ('{"type": "FeatureCollection", "features": []}', "holds no line and no polygon"),
        ('{"type": "LineString", "coordinates": [[0, 0], [1, "x"]]}', "not a pair of numbers"),
        ('{"type": "LineString", "coordinates": [[0], [1]]}', "damaged coordinates"),
        ('{"type": "LineString", "coordinates": [[1e6, 1e6], [1e6, 2e6]]}', "from the model"),
    ],
)
def test_what_is_no_context_is_refused_in_a_line(house, tmp_path, text, words):
    file = tmp_path / "context.geojson"
    file.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        find_context(house, file)
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value)


def test_context_is_refused_where_there_is_no_plan(house, tmp_path):
    file = write_geojson(tmp_path / "context.geojson")
    with pytest.raises(InputError, match="lies under plans"):
        umbra.shadow_study(house, VIENNA, receivers="south", **DAY).write(tmp_path, context=file)
    with pytest.raises(InputError, match="no such file"):
        umbra.shadow_study(house, VIENNA, **DAY).write(tmp_path, context=tmp_path / "no.geojson")
    with pytest.raises(InputError, match="matches no part"):
        umbra.shadow_study(house, VIENNA, **DAY).write(tmp_path, context="Road")
