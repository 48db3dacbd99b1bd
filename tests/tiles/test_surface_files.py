"""Files of surfaces in tiles hold what a study in memory of the same objects writes."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pyproj
import pytest
from support.cities import DAY, make_houses, write_city
from support.glb_files import hold, read_glb

import umbra
from umbra.writers.pixels import shade_ramp


def make_alone(city):
    """Return the city's files as one scene without the objects that two files hold."""
    scene = umbra.read(*city)
    left_out = {("b_east", f"east {n}") for n in range(3)}
    parts = tuple(p for p in scene.parts if (p.layer, p.name) not in left_out)
    return replace(scene, parts=parts)


def test_surfaces_in_tiles_have_the_rows_of_a_study_in_memory(city, tmp_path, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    # Few rows at a time, so that a file is made of several groups.
    monkeypatch.setattr("umbra.writers.city.city_surfaces.ROWS", 70)
    options = {**DAY, "date": "2026-12-21,2026-06-21", "receivers": "surfaces", "spacing": 4.0}
    made = umbra.city_study(city, out=tmp_path / "tiles", tiles=100, **options)
    assert made.write("geoparquet") == [tmp_path / "tiles" / "surfaces.parquet"]
    alone = make_alone(city)
    study = umbra.shadow_study(alone, umbra.find_site(alone), **options)
    study.write(tmp_path / "whole", "geoparquet", pictures=False)
    found, whole = (
        parquet.read_table(tmp_path / name / "surfaces.parquet") for name in ("tiles", "whole")
    )
    assert found.num_rows == 5 * (60 + 60 + 4)
    assert found.schema.equals(whole.schema)
    # Parts of a city are always named with their layer.
    labels = {part.name: part.full_name for part in alone.parts}
    assert found["part"].to_pylist() == [labels[name] for name in whole["part"].to_pylist()]
    for name in whole.column_names[1:]:
        np.testing.assert_array_equal(found[name], whole[name], name)
    assert found.schema.metadata[b"geo"] == whole.schema.metadata[b"geo"]
    assert "mean_sun_hours_2026-06" in found.column_names


def read_texts(tree, binary, values):
    """Return the texts of a property table's column."""
    views = [tree["bufferViews"][values[key]] for key in ("values", "stringOffsets")]
    data, starts = (binary[v["byteOffset"] : v["byteOffset"] + v["byteLength"]] for v in views)
    starts = np.frombuffer(starts, "<u4")
    return [data[a:b].decode() for a, b in pairwise(starts)]


def test_each_sample_of_a_city_has_its_colour_and_figures_in_3d_tiles(city, tmp_path, monkeypatch):
    monkeypatch.setattr("umbra.writers.city.models.MOST_SAMPLES", 1500)
    made = umbra.city_study(
        city,
        out=tmp_path,
        tiles=200,
        receivers="surfaces",
        spacing=3.0,
        on=["west*", "far*"],
        **DAY,
    )
    paths = made.write("3dtiles")
    data = made.dataset.load()
    assert paths[0] == tmp_path / "3dtiles" / "tileset.json"
    assert len(paths) > 6
    ramp, checked = np.rint(shade_ramp() * 255), 0
    up = float(data.shadow_hours[0] + data.sun_hours[0])
    names = data.part.values[data.surface_part.values[data.surface_of_sample.values]]
    for path in paths[1:]:
        tree, get, picture = read_glb(path)
        pixels = np.asarray(picture.convert("RGB"))
        [primitive] = tree["meshes"][0]["primitives"]
        attributes = primitive["attributes"]
        origin = np.array(tree["asset"]["extras"]["origin"])
        corners = get(attributes["POSITION"]).astype(float)[:, [0, 2, 1]] * (1, -1, 1) + origin
        triangles = corners.reshape(-1, 3, 3)
        where = get(attributes["TEXCOORD_0"]).reshape(-1, 3, 2)
        feature = get(attributes["_FEATURE_ID_0"]).reshape(-1, 3)[:, 0].astype(int)
        [table] = tree["extensions"]["EXT_structural_metadata"]["propertyTables"]
        assert table["count"] == feature.max() + 1
        binary = path.read_bytes()[28 + len_of_tree(path) :]
        own = read_texts(tree, binary, table["properties"]["part"])
        view = tree["bufferViews"][table["properties"]["mean_sun_hours"]["values"]]
        assert view["byteOffset"] % 8 == 0
        low, high = corners.min(0) - 1e-3, corners.max(0) + 1e-3
        near = np.flatnonzero(((data.position > low) & (data.position < high)).all("xyz"))
        for sample in near.tolist():
            inside, weights = hold(triangles, data.position[sample].values)
            for k in np.flatnonzero(inside)[:1]:
                if own[feature[k]] != names[sample]:
                    continue
                u, v = weights[k] @ where[k]
                found = pixels[int(v * pixels.shape[0]), int(u * pixels.shape[1])]
                expected = ramp[int(float(data.shadow_hours[sample]) / up * 255 + 0.5)]
                assert np.abs(found - expected).max() <= 1
                checked += 1
    assert checked == len(data.sample)


def len_of_tree(path):
    """Return the length of the tree of a GLB [byte]."""
    return int.from_bytes(path.read_bytes()[12:16], "little")


def test_3d_tiles_of_a_city_stand_where_its_files_do(city, tmp_path):
    options = {**DAY, "receivers": "surfaces", "spacing": 20.0}
    made = umbra.city_study(city, out=tmp_path, tiles=100, **options)
    tree, *models = made.write("3dtiles")
    scene = umbra.read(tree)
    assert len(scene.parts) == len(models) == len({path.name for path in models})
    low, high = umbra.read(*city).bounds()
    middle = (low + high) / 2
    to_earth = pyproj.Transformer.from_crs("EPSG:28992", "EPSG:4979", always_xy=True)
    to_here = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    placed = np.array(to_here.transform(*to_earth.transform(*middle)))
    root = json.loads(tree.read_text())["root"]
    centre, radius = np.split(np.array(root["boundingVolume"]["sphere"]), [3])
    assert np.linalg.norm(centre - placed) < 100
    assert radius < np.linalg.norm(high - low)
    soup = scene.triangles()
    x, y, z = (soup.vertices[soup.faces].reshape(-1, 3) + scene.origin).T
    back = pyproj.Transformer.from_crs(scene.crs, "EPSG:28992", always_xy=True)
    found = np.array([*back.transform(x, y), z])
    np.testing.assert_allclose([found.min(1), found.max(1)], [low, high], atol=0.05)
    before = [path.stat().st_mtime_ns for path in models]
    made.write("3dtiles")
    assert [path.stat().st_mtime_ns for path in models] == before  # none is made twice


def test_cityjson_of_a_city_has_the_hours_of_a_study_in_memory(tmp_path):
    houses = make_houses(5, 12, (85000, 447000), (85100, 447100))
    files = [
        write_city(tmp_path / "one.city.json", houses[:7]),
        write_city(tmp_path / "two.city.json", houses[7:]),
    ]
    options = {**DAY, "receivers": "surfaces", "spacing": 2.0}
    made = umbra.city_study(files, out=tmp_path / "tiles", tiles=40, **options)
    paths = made.write("cityjson")
    scene = umbra.read(*files)
    study = umbra.shadow_study(scene, umbra.find_site(scene), **options)
    study.write(tmp_path / "whole", "cityjson", pictures=False)
    assert [path.name for path in paths] == ["hours_one.city.json", "hours_two.city.json"]
    for path in paths:
        found, whole = (
            json.loads(one.read_text()) for one in (path, tmp_path / "whole" / path.name)
        )
        assert found == whole
        assert all("mean_sun_hours" in o["attributes"] for o in found["CityObjects"].values())
