"""Names that would be one in a written file stay two."""

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.scene import Source
from umbra.writers.cityjson_hours import name_targets
from umbra.writers.vectors import Layer

TOWER = umbra.Mesh(*box((0, 0, 0), (4, 4, 5)))


def test_files_of_layers_differ_whatever_a_file_system_tells_apart():
    layers = ["Town", "town", "TOWN", "a:b", "a?b", "a_b", "a_b (2)", "a\nb", "ä" * 300, "ä" * 301]
    sources = [Source(f"{k}.json", "", "CityJSON 2.0", layer=one) for k, one in enumerate(layers)]
    names = name_targets(sources)
    assert len({name.casefold() for name in names}) == len(layers)
    assert max(len(name.encode()) for name in names) <= 255
    assert names[:2] == ["hours_Town.city.json", "hours_town (2).city.json"]
    assert not any(set(name) & set('\n/\\:*?"<>|') for name in names)


def test_columns_of_a_geopackage_differ_by_more_than_case(tmp_path):
    pyogrio = pytest.importorskip("pyogrio")
    shapely = pytest.importorskip("shapely")
    from umbra.writers.vectors.gis_files import write_geopackage  # noqa: PLC0415

    values = {name: [float(k)] for k, name in enumerate(("hours", "Hours", "fid", "GEOM", "name"))}
    path = tmp_path / "points.gpkg"
    write_geopackage(path, [Layer("points", "Point", [shapely.Point(1, 2)], values)])
    read = pyogrio.raw.read(path)
    assert read[0]["fields"].tolist() == ["hours", "Hours (2)", "fid (2)", "GEOM (2)", "name"]
    assert [float(column[0]) for column in read[3]] == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_objects_that_are_called_as_others_with_their_layer_are_two():
    named = [("x", "t"), ("y", "t"), ("z", "x/t"), ("z", "u"), ("z", "u")]
    moved = [umbra.Mesh(TOWER.vertices + (20 * k, 0, 0), TOWER.faces) for k in range(5)]
    scene = umbra.make_scene(
        [umbra.Part(name, "", mesh, layer=layer) for (layer, name), mesh in zip(named, moved)]
    )
    assert scene.labels() == ["x/t", "y/t", "z/x/t", "u", "u"]
    study = umbra.shadow_study(
        scene, umbra.Site(48, 16, "UTC"), date="2026-03-21", every="4h", receivers="surfaces",
        spacing=4, device="cpu",
    )  # fmt: skip
    found = study.dataset
    assert sorted(found.part.values.tolist()) == ["u", "x/t", "y/t", "z/x/t"]
    np.testing.assert_allclose(sorted(found.part_area.values), [96, 96, 96, 192])
