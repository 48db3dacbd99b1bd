"""Outlines and hour lines: rasterised again they are the masks; every format holds them all."""

import datetime as dt
import json
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.shapes import box, moved
from support.sweeps import reduce_count

import umbra
from umbra.cpu.plane import PlaneSweep
from umbra.errors import InputError
from umbra.scene import Mesh, Part, make_scene
from umbra.scene.grid import Grid
from umbra.study import count_finer, run_study
from umbra.study.preview import Moment, find_moments
from umbra.sun import Site, find_sun
from umbra.volume.adjacency import make_caster
from umbra.writers.output_formats import Job
from umbra.writers.outputs import write_formats
from umbra.writers.vectors import find_hour_lines
from umbra.writers.vectors.outlines import trace_loops

pytest.importorskip("pyclipr")
shapely = pytest.importorskip("shapely")

from umbra.writers.vectors import make_line_layer, make_outline_layer  # noqa: E402
from umbra.writers.vectors import outlines as outlining  # noqa: E402
from umbra.writers.vectors.dxf import _unite, find_footprints, write_dxf  # noqa: E402
from umbra.writers.vectors.gis_files import write_geojson  # noqa: E402
from umbra.writers.vectors.outlines import find_outlines, resolve_shadow  # noqa: E402

HOURS = [f"{hour:02}:00" for hour in range(9, 18)]
VIENNA = Site(48.2, 16.37, "Europe/Vienna")
GRID = Grid(-19.8371, -19.9137, 0.41, 0.43, 97, 93)  # no centre on a wall
SUNS = np.array([(0.3, 0.4, 0.6), (-0.8, 0.1, 0.35), (0.01, -0.6, 0.5), (0, 0, 1.0)])


def court():
    """A block about a court with a shed in it: a shadow with a hole, and one in the hole."""
    sides = [((-6, -6), (6, -4)), ((-6, 4), (6, 6)), ((-6, -4), (-4, 4)), ((4, -4), (6, 4))]
    walls = [box((*a, 0), (*b, 3)) for a, b in sides]
    return [*walls, box((-0.5, -0.5, 0), (0.5, 0.5, 0.4))]


def flipped(mesh):
    return mesh[0], np.asarray(mesh[1])[:, ::-1]


def without(mesh, n):
    return mesh[0], np.asarray(mesh[1])[n:]


TOWNS = {
    "box": [box((-2, -3, 0), (4, 1, 5))],
    "court": court(),
    "overlapping": [box((-4, -4, 0), (2, 2, 6)), box((-1, -1, 0), (5, 5, 3))],
    "nested": [box((-4, -4, 0), (4, 4, 6)), box((-2, -2, 1), (2, 2, 3))],
    "inside out": [flipped(box((-4, -4, 0), (4, 4, 6)))],
    "open": [without(box((-4, -4, 0), (4, 4, 6)), 3), box((5, 5, 0), (7, 7, 2))],
    "below the ground": [box((-4, -4, -3), (4, 4, 4)), flipped(box((-6, -1, -1), (6, 1, 2)))],
    "floating": [box((-4, -4, 2), (4, 4, 3)), box((-1, -1, 0), (1, 1, 9))],
    "touching": [
        box((-4, -4, 0), (0, 0, 4)),
        box((0, 0, 0), (4, 4, 4)),
        box((0, -4, 0), (4, 0, 4)),
    ],
}


def soup(meshes):
    vertices, faces, before = [], [], 0
    for mesh_vertices, mesh_faces in meshes:
        vertices.append(np.asarray(mesh_vertices, float))
        faces.append(np.asarray(mesh_faces) + before)
        before += len(mesh_vertices)
    groups = np.repeat(np.arange(len(meshes)), [len(f) for _, f in meshes])
    return np.concatenate(vertices), np.concatenate(faces), groups


def find_area(ring):
    """Give a ring's area, above 0 if counter-clockwise; it may touch itself."""
    x, y = ring.T
    return (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def check(caster, suns, grid=GRID, height=0.0):
    """Rasterise every outline at the cells' centres; tell how many were compared."""
    sweep = PlaneSweep(caster, grid, height)
    masks = sweep.masks(suns / np.linalg.norm(suns, axis=1)[:, None]).view(bool)
    low = np.array([grid.x0 - grid.dx / 2, grid.y0 - grid.dy / 2])
    high = low + (grid.dx * grid.cols, grid.dy * grid.rows)
    x, y = np.meshgrid(grid.x, grid.y)
    compared = 0
    for sun, mask in zip(suns, masks, strict=True):
        polygons = resolve_shadow(sweep.caster, sun, height, (low, high))
        shapes = [shapely.Polygon(rings[0], rings[1:]) for rings in polygons]
        whole = shapely.union_all([shapely.make_valid(shape) for shape in shapes])
        shapely.prepare(whole)
        inside = shapely.contains_xy(whole, x, y)
        edges = shapely.boundary(whole)
        wrong = np.flatnonzero((inside != mask).ravel())
        for k in wrong:  # only a centre on an edge may differ, by the lattice
            assert edges.distance(shapely.Point(x.flat[k], y.flat[k])) <= 2 * outlining.LATTICE
        compared += mask.size - len(wrong)
        for rings in polygons:
            assert [find_area(ring) > 0 for ring in rings] == [True] + [False] * (len(rings) - 1)
    return compared, masks


@pytest.mark.parametrize("name", TOWNS)
def test_an_outline_holds_just_the_cells_in_shadow(name):
    compared, masks = check(make_caster(*soup(TOWNS[name])), SUNS)
    assert masks.any((1, 2)).all()
    assert compared == masks.size


@settings(deadline=None, max_examples=reduce_count(60, 2))
@given(st.integers(0, 10**6))
def test_an_outline_of_any_soup(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 25))
    vertices = rng.uniform(-6, 6, (n + 2, 3))
    faces = np.array([rng.choice(n + 2, 3, replace=False) for _ in range(n)])
    suns = np.column_stack([rng.uniform(-1, 1, (3, 2)), rng.uniform(0.2, 1, 3)])
    check(make_caster(vertices, faces, np.zeros(n, int)), suns)


def test_a_boxs_shadow_has_the_area_done_by_hand():
    # 6 x 4 m, 5 m high, sun at (0, 0.6, 0.8): the roof falls 3.75 m south.
    caster = make_caster(*soup([box((0, 0, 0), (6, 4, 5))]))
    sweep = PlaneSweep(caster, GRID, 0.0)
    box_ = (np.full(2, -50.0), np.full(2, 50.0))
    ((outer,),) = resolve_shadow(sweep.caster, np.array([0, 0.6, 0.8]), 0.0, box_)
    assert shapely.Polygon(outer).area == pytest.approx(6 * (4 + 3.75), abs=1e-4)
    # Cut to a plan that ends a metre south of the house.
    cut = (np.array([-50.0, -1]), np.full(2, 50.0))
    ((outer,),) = resolve_shadow(sweep.caster, np.array([0, 0.6, 0.8]), 0.0, cut)
    assert shapely.Polygon(outer).area == pytest.approx(6 * (4 + 1), abs=1e-4)


def test_loops_use_every_edge_as_often_as_its_multiplicity():
    edges = np.array([(5, 7), (7, 9), (9, 5), (9, 11), (11, 9)], np.int32)
    multiplicity = np.array([2, 2, 2, 1, 1])
    walked = {}
    for loop in trace_loops(edges, multiplicity):
        for a, b in zip(loop, np.roll(loop, -1), strict=True):
            walked[int(a), int(b)] = walked.get((int(a), int(b)), 0) + 1
    expected = {tuple(e): m for e, m in zip(edges.tolist(), multiplicity.tolist(), strict=True)}
    assert {k: v for k, v in walked.items() if expected[k] == v} == {
        (5, 7): 2, (7, 9): 2, (9, 5): 2, **{k: 1 for k in walked if k in {(9, 11), (11, 9)}},
    }  # fmt: skip
    assert trace_loops(np.zeros((0, 2), np.int32), np.zeros(0, int)) == []


@pytest.fixture(scope="module")
def town():
    meshes = [moved(mesh, (2500, 340000, 180)) for mesh in court()]
    parts = [Part(f"wall{k}", "", Mesh(*mesh)) for k, mesh in enumerate(meshes)]
    return make_scene(parts, crs="EPSG:31256")


@pytest.fixture(scope="module")
def study(town):
    return run_study(
        town, VIENNA, date="2026-09-18", start="08:00", end="20:00", every="1h", cell=0.25,
        masks=True,
    )  # fmt: skip


def find_midpoints(study):
    """Give the moments at which the study was counted."""
    zone = ZoneInfo(study.site.zone)
    return [
        Moment(
            (instant := study.period.instants[k].tolist().replace(tzinfo=dt.UTC)),
            instant.astimezone(zone), study.sun.altitude[k], study.sun.azimuth[k],
            study.sun.direction[k],
        )
        for k in np.flatnonzero(study.sun.is_up)
    ]  # fmt: skip


def test_outlines_of_a_study_are_its_masks(study):
    found = list(find_outlines(study, find_midpoints(study)))
    up = np.flatnonzero(study.sun.is_up)
    assert len(found) == len(up)
    x, y = np.meshgrid(study.x, study.y)
    for k, outline in zip(up, found, strict=True):
        assert np.datetime64(outline.instant.replace(tzinfo=None)) == study.period.instants[k]
        assert outline.local.utcoffset().total_seconds() == 7200
        layer = make_outline_layer([outline])
        shapely.prepare(layer.geometries[0])
        np.testing.assert_array_equal(
            shapely.contains_xy(layer.geometries[0], x, y), study.masks[int(k)] > 0
        )
    assert max(len(rings) for outline in found for rings in outline.polygons) > 1  # the court


def test_outlines_want_level_ground(town):
    top = run_study(town, VIENNA, date="2026-09-18", every="4h", cell=1, receivers="top")
    with pytest.raises(InputError, match="receivers='top'"):
        list(find_outlines(top))


def test_hour_lines_part_the_cells(study):
    lines = list(find_hour_lines(study))
    assert [line.shadow_hours for line in lines][:3] == [1, 2, 3]
    is_open = study.heights <= study.ground
    finer = count_finer(study, longest=None)
    assert finer.shadow_hours.shape == study.shadow_hours.shape
    assert finer.seconds <= 300  # a third of the study's steps
    for line in lines:
        assert line.seconds == finer.seconds
        assert line.sun_hours == pytest.approx(study.up_hours - line.shadow_hours)
        # Between two neighbours of which one has the hours, a line passes.
        deep = finer.shadow_hours >= line.shadow_hours - 1e-3
        both = is_open[:, 1:] & is_open[:, :-1]
        rows, cols = np.nonzero((deep[:, 1:] != deep[:, :-1]) & both)
        whole = shapely.MultiLineString(line.lines)
        shapely.prepare(whole)
        for row, col in list(zip(rows, cols, strict=True))[::7]:
            link = [(study.x[col], study.y[row]), (study.x[col + 1], study.y[row])]
            assert whole.distance(shapely.LineString(link)) < 1e-9


def test_geojson_is_in_degrees_where_the_crs_is_known(study, tmp_path):
    from pyproj import Transformer  # noqa: PLC0415

    layer = make_outline_layer(find_outlines(study))
    write_geojson(tmp_path / "a.geojson", layer, "EPSG:31256")
    document = json.loads((tmp_path / "a.geojson").read_text())
    assert "crs" not in document  # RFC 7946, section 4
    assert "EPSG:31256" in document["coordinates_note"]
    assert len(document["features"]) == len(layer.geometries)
    back = Transformer.from_crs(4326, 31256, always_xy=True)
    for feature, geometry in zip(document["features"], layer.geometries, strict=True):
        shape = shapely.from_geojson(json.dumps(feature["geometry"]))
        assert shape.is_valid
        lon, lat = shape.centroid.coords[0]
        assert (lon, lat) == pytest.approx((16.367, 48.2), abs=0.01)
        here = shapely.transform(shape, lambda p: np.column_stack(back.transform(*p.T)))
        assert here.symmetric_difference(geometry).area < 1e-3 * geometry.area
        assert feature["properties"]["local_time"].endswith("+02:00")
        for rings in feature["geometry"]["coordinates"]:
            assert rings[0][0] == rings[0][-1]
            assert shapely.LinearRing(rings[0]).is_ccw


def test_geojson_without_a_crs_says_so(study, tmp_path):
    write_geojson(tmp_path / "a.geojson", make_line_layer(find_hour_lines(study)))
    document = json.loads((tmp_path / "a.geojson").read_text())
    assert "not longitude and latitude" in document["coordinates_note"]
    first = np.array(document["features"][0]["geometry"]["coordinates"][0])
    assert abs(first[:, 0] - 2500).max() < 60


@pytest.mark.parametrize("crs", ["EPSG:31256", None])
def test_a_geopackage_holds_both_layers(study, tmp_path, crs):
    pyogrio = pytest.importorskip("pyogrio")
    from umbra.writers.vectors.gis_files import write_geopackage  # noqa: PLC0415

    layers = [make_outline_layer(find_outlines(study)), make_line_layer(find_hour_lines(study))]
    path = tmp_path / "a.gpkg"
    write_geopackage(path, layers, crs)
    assert {name for name, _ in pyogrio.list_layers(path)} == {"shadow_outlines", "hour_lines"}
    for layer in layers:
        meta, _, geometries, fields = pyogrio.raw.read(path, layer=layer.name)
        assert meta["crs"] == crs or (crs is None and "EPSG" not in str(meta["crs"]))
        assert list(meta["fields"]) == list(layer.values)
        for wkb, geometry in zip(geometries, layer.geometries, strict=True):
            assert shapely.from_wkb(wkb).equals(geometry)
        np.testing.assert_array_equal(fields[-1], list(layer.values.values())[-1])


def test_dxf_has_a_layer_for_each_instant(study, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    found, lines = list(find_outlines(study)), list(find_hour_lines(study))
    path = tmp_path / "a.dxf"
    write_dxf(path, found, lines, height=study.ground, up_hours=study.up_hours, note="EPSG:31256")
    drawing = ezdxf.readfile(path)
    assert not drawing.audit().errors
    assert drawing.units == 6  # metres
    for outline in found:
        polylines = drawing.modelspace().query(
            f'LWPOLYLINE[layer=="SHADOW_{outline.local:%Y-%m-%d_%H%M}"]'
        )
        rings = [ring for rings in outline.polygons for ring in rings]
        assert len(polylines) == len(rings)
        for polyline, ring in zip(polylines, rings, strict=True):
            assert polyline.closed
            assert polyline.dxf.elevation == study.ground
            np.testing.assert_allclose(polyline.get_points("xy"), ring, rtol=0, atol=1e-9)
    layers = {entity.dxf.layer for entity in drawing.modelspace()}
    assert {f"HOURS_{line.shadow_hours:02.0f}" for line in lines} < layers


def test_outlines_are_those_of_whole_hours_or_of_times_that_are_asked_for(study):
    def clock(moments):
        return [f"{moment.local:%H:%M:%S}" for moment in moments]

    assert clock(find_outlines(study)) == [f"{hour:02}:00:00" for hour in range(8, 19)]
    asked = find_moments(study, ["15:00", "09:30,12:00", "23:00"], every=60, most=100)
    assert clock(find_outlines(study, asked)) == ["09:30:00", "12:00:00", "15:00:00"]
    sun = find_sun(VIENNA, np.array(["2026-09-18T13:00"], "datetime64[us]"))
    assert asked[-1].altitude == pytest.approx(sun.altitude[0], abs=1e-9)
    np.testing.assert_allclose(asked[-1].direction, sun.direction[0], atol=1e-12)


@pytest.mark.parametrize(
    ("start", "end", "step", "every", "most", "expected"),
    [
        ("09:00", "17:00", "15min", 60, 100, " ".join(HOURS)),
        ("09:07", "10:40", "15min", 60, 100, "09:15 09:30 09:45 10:00 10:15 10:30"),
        ("09:00", "13:00", "7min", None, 100, " ".join(
            f"{9 + k // 6:02}:{k % 6}0" for k in range(25))),
        ("09:00", "17:00", "15min", None, 10, " ".join(HOURS)),
        ("09:00", "17:00", "15min", None, 5, "10:00 12:00 14:00 16:00"),
    ],
)  # fmt: skip
def test_times_that_nobody_asked_for_are_round(town, start, end, step, every, most, expected):
    some = run_study(town, VIENNA, date="2026-09-18", start=start, end=end, every=step, cell=5)
    found = find_moments(some, every=every, most=most)
    assert " ".join(f"{moment.local:%H:%M}" for moment in found) == expected


def test_of_many_dates_few_times_are_shown(town):
    days = run_study(town, VIENNA, date="2026-09", every="1h", cell=5)
    assert {f"{m.local:%H:%M}" for m in find_moments(days, every=None, most=60)} == {
        "12:00", "16:00",
    }  # fmt: skip
    assert len({m.local.date() for m in find_moments(days, every=None, most=10)}) == 10


def test_footprints_are_where_the_study_has_buildings(study):
    footprints = find_footprints(study)
    assert list(footprints) == ["BUILDINGS"]
    shapes = [shapely.Polygon(rings[0], rings[1:]) for rings in footprints["BUILDINGS"]]
    assert all(shape.is_valid for shape in shapes)
    x, y = np.meshgrid(study.x, study.y)
    whole = shapely.union_all(shapes)
    shapely.prepare(whole)
    np.testing.assert_array_equal(shapely.contains_xy(whole, x, y), study.heights > study.ground)


def test_dxf_has_the_buildings_on_a_layer_of_their_own(study, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    crowns = {"CANOPIES": [[np.array([(0.0, 0), (1, 0), (0, 1)])]]}
    footprints = find_footprints(study) | crowns
    write_dxf(tmp_path / "a.dxf", [], [], height=3.0, up_hours=8, footprints=footprints)
    drawing = ezdxf.readfile(tmp_path / "a.dxf")
    for layer, polygons in footprints.items():
        polylines = drawing.modelspace().query(f'LWPOLYLINE[layer=="{layer}"]')
        rings = [ring for rings in polygons for ring in rings]
        for polyline, ring in zip(polylines, rings, strict=True):
            assert polyline.closed
            assert polyline.dxf.elevation == 3.0
            np.testing.assert_allclose(polyline.get_points("xy"), ring, atol=1e-9)


def test_a_real_town():
    path = Path(__file__).parents[2] / "../shared/data/delft.city.json"
    if not path.exists():
        pytest.skip("no city model here")
    scene = umbra.read(path)
    delft = run_study(
        scene, Site(52.0, 4.36, "Europe/Amsterdam"), date="2026-03-21", start="09:00",
        end="17:00", every="4h", size=(300, 300), masks=True, receivers="ground",
    )  # fmt: skip
    x, y = np.meshgrid(delft.x, delft.y)
    for k, outline in enumerate(find_outlines(delft, find_midpoints(delft))):
        shape = make_outline_layer([outline]).geometries[0]
        shapely.prepare(shape)
        np.testing.assert_array_equal(shapely.contains_xy(shape, x, y), delft.masks[k] > 0)


@pytest.fixture(scope="module")
def facade():
    """Two houses seen from the south, the high one before the low one's western end."""
    shapes = {"low": box((0, 10, 0), (20, 14, 6)), "high": box((2, 0, 0), (8, 4, 12))}
    scene = make_scene(parts=[Part(name, "house", Mesh(*mesh)) for name, mesh in shapes.items()])
    return run_study(
        scene, VIENNA, receivers="south", cell=0.1, date="2026-03-21", start="13:00", end="17:00",
        every="15min",
    )  # fmt: skip


def test_lines_of_an_elevation_lie_on_it_and_cross_no_edge(facade):
    hour_lines = list(find_hour_lines(facade))
    assert 1.0 in [line.shadow_hours for line in hour_lines]
    hours = count_finer(facade, longest=None).shadow_hours
    for hour_line in hour_lines:
        for x, z in np.concatenate(hour_line.lines):
            # In the shadow of the high house on the low one's wall, off the corner at x = 8.
            assert 8.05 < x < 20
            assert 0 <= z < 6
            col, row = (x - facade.x[0]) / 0.1, (z - facade.y[0]) / 0.1
            near = hours[
                int(np.floor(row)) : int(np.ceil(row)) + 1,
                int(np.floor(col)) : int(np.ceil(col)) + 1,
            ]
            assert near.min() < hour_line.shadow_hours <= near.max()


def test_an_elevation_in_cad_is_placed_by_what_is_seen(facade, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    job = Job(facade, tmp_path, "two houses", lambda _: None)
    names = write_formats(job, ["dxf", "geojson", "csv"])
    assert {"study.dxf", "seen.geojson", "hour_lines.geojson", "cells.csv"} <= set(names)
    assert "shadow_outlines.geojson" not in names
    drawing = ezdxf.readfile(tmp_path / "study.dxf")
    assert "seen from azimuth 180" in dict(drawing.header.custom_vars)["umbra"]
    seen = [line for line in drawing.modelspace() if line.dxf.layer == "SEEN"]
    assert len(seen) == 1
    corners = np.array([point[:2] for point in seen[0].get_points()])
    np.testing.assert_allclose(corners.min(0), (0, 0), atol=0.06)
    np.testing.assert_allclose(corners.max(0), (20, 12), atol=0.06)
    assert any(line.dxf.layer == "HOURS_01" for line in drawing.modelspace())
    found = json.loads((tmp_path / "seen.geojson").read_text())
    assert found["coordinates_note"].startswith("along and z in metres, seen from azimuth 180")
    table = (tmp_path / "cells.csv").read_text().splitlines()
    assert table[0].startswith("along,z,sun_hours,shadow_hours")
    assert len(table) == 1 + facade.shadow_hours.size


def test_clipper_and_geos_unite_footprints_to_the_same_area():
    rng = np.random.default_rng(3)
    corners = rng.uniform(0, 100, (300, 1, 2)) + rng.normal(0, 4, (300, 3, 2))
    one, two = (corners[:, n] - corners[:, 0] for n in (1, 2))
    is_turned = one[:, 0] * two[:, 1] < one[:, 1] * two[:, 0]
    corners[is_turned] = corners[is_turned][:, ::-1]
    found = _unite(corners, np.zeros(2))
    whole = shapely.union_all(shapely.polygons(corners))
    ours = [shapely.Polygon(rings[0], rings[1:]) for rings in found]
    assert sum(one.area for one in ours) == pytest.approx(whole.area, rel=1e-7)
    assert shapely.union_all(ours).symmetric_difference(whole).area < 1e-6 * whole.area
