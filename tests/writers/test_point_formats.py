"""Files of surfaces and points: what is read back is what the study found."""

import json

import numpy as np
import pyproj
import pytest
import trimesh
from support.glb_files import hold, read_glb
from support.shapes import box, moved, turned

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.writers.coloured_tileset import find_tileset_placement
from umbra.writers.output_formats import Job
from umbra.writers.outputs import write_formats
from umbra.writers.pixels import shade_ramp

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
HOUSES = {
    "house": turned(box((-6, -4, 0), (4, 6, 14)), 25),
    "shed": moved(box((0, 0, 0), (6, 3, 4)), (14, -9, 0)),
    "bar": moved(box((0, 0, 0), (3, 3, 25)), (-20, -12, 0)),
}


def run(**options):
    parts = [Part(name, "", Mesh(*mesh)) for name, mesh in HOUSES.items()]
    east = np.array([(3000.0, 340000.0, 170.0)])
    parts = [Part(p.name, "", Mesh(p.mesh.vertices + east, p.mesh.faces)) for p in parts]
    scene = make_scene(parts, crs="EPSG:31256")
    chosen = {"date": "2026-09-18", "start": "06:00", "end": "20:00", "every": "1h",
              "receivers": "surfaces"} | options  # fmt: skip
    return run_study(scene, VIENNA, **chosen)


def test_each_sample_has_its_colour_on_the_model(tmp_path):
    study = run(spacing=1.0, on=["house", "bar"])
    assert write_formats(Job(study, tmp_path), ["glb"]) == ["hours.glb"]
    tree, get, picture = read_glb(tmp_path / "hours.glb")
    assert [node["name"] for node in tree["nodes"]] == ["bar", "house", "not sampled"]
    pixels = np.asarray(picture.convert("RGB"))
    origin = np.array(tree["asset"]["extras"]["origin"])
    ramp = np.rint(shade_ramp() * 255)
    checked = 0
    for node in tree["nodes"][:2]:
        attributes = tree["meshes"][node["mesh"]]["primitives"][0]["attributes"]
        corners = get(attributes["POSITION"]).astype(float)[:, [0, 2, 1]] * (1, -1, 1) + origin
        triangles, where = (
            corners.reshape(-1, 3, 3),
            get(attributes["TEXCOORD_0"]).reshape(-1, 3, 2),
        )
        for point, hours in zip(study.places.points, study.shadow_hours):
            inside, weights = hold(triangles, point)
            for k in np.flatnonzero(inside)[:1]:
                u, v = weights[k] @ where[k]
                found = pixels[int(v * pixels.shape[0]), int(u * pixels.shape[1])]
                expected = ramp[int(hours / study.up_hours * 255 + 0.5)]
                assert np.abs(found - expected).max() <= 1
                checked += 1
        extras = node["extras"]
        part = np.asarray(study.more["part"][1]).tolist().index(node["name"])
        mean = float(study.more["part_mean_sun_hours"][1][part])
        assert extras["mean_sun_hours"] == pytest.approx(mean, abs=1e-3)
    assert checked == len(study.shadow_hours)
    assert len(np.unique(study.shadow_hours)) > 5
    legend = tree["asset"]["extras"]["legend"]
    assert legend[0]["shadow_hours"] == 0
    assert legend[-1]["shadow_hours"] == pytest.approx(study.up_hours)


def test_the_model_loads_elsewhere_and_stands_where_it_did(tmp_path):
    study = run(spacing=2.0)
    write_formats(Job(study, tmp_path), ["glb"])
    scene = trimesh.load(tmp_path / "hours.glb")
    assert set(scene.geometry) == set(HOUSES)
    low, high = scene.bounds
    size = study.model.scene.bounds()
    np.testing.assert_allclose(
        (high - low)[[0, 2, 1]], size[1] - size[0], atol=1e-3
    )  # glTF's y is up


def test_points_go_into_maps(tmp_path):
    pytest.importorskip("shapely", reason="the extra gis is not installed")
    pytest.importorskip("pyogrio", reason="the extra gis is not installed")
    points = np.array([(3000, 339991, 171), (3014, 339989, 172), (2995, 340012, 171.0)])
    study = run(receivers="points", points=points, names=["a", "b", "c"], spells=True)
    names = write_formats(Job(study, tmp_path), ["geojson", "gpkg", "csv"])
    assert names == ["points.geojson", "study.gpkg", "points.csv"]
    found = json.loads((tmp_path / "points.geojson").read_text())
    assert [f["properties"]["name"] for f in found["features"]] == ["a", "b", "c"]
    for feature, hours, z in zip(found["features"], study.sun_hours, points[:, 2]):
        assert feature["properties"]["sun_hours"] == pytest.approx(hours, abs=1e-4)
        assert feature["properties"]["receiver_z"] == z
        assert feature["properties"]["first_sun"].endswith("Z")
        longitude, latitude = feature["geometry"]["coordinates"]
        assert (longitude, latitude) == pytest.approx((16.37, 48.2), abs=0.02)
    import pyogrio.raw  # noqa: PLC0415

    info, _, shapes, fields = pyogrio.raw.read(tmp_path / "study.gpkg", layer="points")
    assert "31256" in info["crs"]
    hours = fields[list(info["fields"]).index("sun_hours")]
    np.testing.assert_allclose(hours, study.sun_hours, atol=1e-4)
    import shapely  # noqa: PLC0415

    np.testing.assert_allclose(shapely.get_coordinates(shapely.from_wkb(shapes)), points[:, :2])


def test_geoparquet_has_a_row_for_each_surface_and_its_months(tmp_path, monkeypatch):
    geopandas = pytest.importorskip("geopandas")
    pytest.importorskip("pyarrow")
    monkeypatch.setattr("umbra.writers.vectors.surface_table.ROWS", 4)  # several groups
    dates = ["2026-01-10", "2026-01-20", "2026-06-21"]
    study = run(spacing=1.0, date=dates)
    assert write_formats(Job(study, tmp_path), ["geoparquet"]) == ["surfaces.parquet"]
    table = geopandas.read_parquet(tmp_path / "surfaces.parquet")
    assert len(table) == len(study.samples.part) == 15
    assert table.crs.to_epsg() == 31256
    assert sorted(set(table.part)) == ["bar", "house", "shed"]
    # Roofs and walls of three boxes, in their places: the plan of a geometry has a roof's area.
    roofs = table[table.tilt < 1].set_index("part")
    assert roofs.geometry.area.to_dict() == pytest.approx({"bar": 9, "house": 100, "shed": 18})
    np.testing.assert_allclose(roofs["area"].to_numpy(), roofs.geometry.area.to_numpy())
    west, south, *_ = table[table.part == "shed"].total_bounds
    assert (west, south) == (3014.0, 339991.0)
    assert {g.has_z for g in table.geometry} == {True}
    heights = [p[2] for g in roofs.loc[["bar"]].geometry for p in g.geoms[0].exterior.coords]
    assert set(heights) == {195.0}
    months = table["mean_sun_hours_2026-01"] + table["mean_sun_hours_2026-06"]
    np.testing.assert_allclose(months, table.mean_sun_hours_sum, rtol=1e-6)
    assert (table.least_sun_hours_sum <= table.mean_sun_hours_sum).all()
    assert table["mean_sun_hours_2026-06"].max() > table["mean_sun_hours_2026-01"].max() / 2 > 0


@pytest.mark.parametrize("receivers", ["surfaces", "ground"])
def test_a_tileset_places_the_model_on_the_earth(tmp_path, receivers):
    more = {"spacing": 1.0} if receivers == "surfaces" else {"cell": 2.0}
    study = run(receivers=receivers, **more)
    names = write_formats(Job(study, tmp_path), ["3dtiles"])
    assert names == ["tileset.json", "hours.glb"]
    tileset = json.loads((tmp_path / "tileset.json").read_text())
    assert tileset["asset"]["version"] == "1.1"
    root = tileset["root"]
    assert root["children"][0]["content"] == {"uri": "hours.glb"}
    matrix = np.array(root["transform"]).reshape(4, 4).T
    tree, _, *_ = read_tree(tmp_path / "hours.glb")
    origin = np.array(tree["asset"]["extras"]["origin"])
    place = pyproj.Transformer.from_crs(31256, 4326, always_xy=True)
    earth = pyproj.Transformer.from_crs(4979, 4978, always_xy=True)
    for offset in ([0, 0, 0], [40, -30, 25], [-35, 60, 2]):
        point = origin + offset
        expected = earth.transform(*place.transform(*point[:2]), point[2])
        np.testing.assert_allclose(matrix[:3] @ [*offset, 1], expected, atol=0.01)
    # The box holds the model, which rises 25 m.
    box = np.array(root["boundingVolume"]["box"])
    assert box[11] == pytest.approx(12.5, abs=0.1)


def test_without_a_crs_the_tileset_lies_at_the_site():
    site = umbra.Site(48.2, 16.37, "Europe/Vienna", true_north=30)
    matrix = find_tileset_placement(np.array([5.0, 6.0, 100.0]), None, site)
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1)
    back = pyproj.Transformer.from_crs(4978, 4979, always_xy=True)
    assert back.transform(*matrix[:3, 3]) == pytest.approx((16.37, 48.2, 100))
    # True north lies 30 degrees clockwise from the model's +y.
    north = matrix[:3, :3] @ [np.sin(np.radians(30)), np.cos(np.radians(30)), 0]
    longitude, latitude, _ = back.transform(*(matrix[:3, 3] + 100 * north))
    assert longitude == pytest.approx(16.37)
    assert latitude > 48.2008


def read_tree(path):
    data = path.read_bytes()
    return (json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")]), data)
