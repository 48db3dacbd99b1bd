"""Real models: what is known of them, and that no polygon lost an edge."""

import json
from collections import Counter

import numpy as np
import pytest

import umbra
from umbra.readers import cityjson as cityjson_module
from umbra.readers import triangulate as triangulate_module
from umbra.readers.triangulate import triangulate

CITYJSON = [
    "vienna_lod2.city.jsonl",
    "delft.city.json",
    "zurich_lod2.city.json",
    "denhaag.city.json",
]


def find_changed_boundaries(vertices, indices, lengths, rings, result):
    """Polygons whose triangles' signed edges are not those of their rings."""
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    place = place.ravel()
    starts = np.cumsum(lengths) - lengths
    following = np.arange(1, len(indices) + 1)
    filled = lengths > 0
    following[(starts + lengths - 1)[filled]] = starts[filled]
    corners = place[indices]
    owner = np.repeat(np.repeat(np.arange(len(rings)), rings), lengths)
    faces = place[result.faces]
    a = np.concatenate([corners, faces.T.ravel()])
    b = np.concatenate([corners[following], np.roll(faces, -1, axis=1).T.ravel()])
    owner = np.concatenate([owner, np.tile(result.polygon, 3)])
    sign = np.where(a < b, 1, -1)
    sign[len(corners) :] *= -1
    sign[a == b] = 0
    keys = np.stack([owner, np.minimum(a, b), np.maximum(a, b)], axis=1)
    edges, inverse = np.unique(keys, axis=0, return_inverse=True)
    return np.unique(edges[np.bincount(inverse.ravel(), sign) != 0][:, 0])


@pytest.mark.parametrize("name", [*CITYJSON, "engel_house.obj", "urban_block.obj"])
def test_every_polygon_keeps_its_edges(real_file, monkeypatch, name):
    calls = []

    def watched(vertices, corners, lengths, rings=None, budget=None):
        result = triangulate(vertices, corners, lengths, rings, budget=budget)
        rings = np.ones(len(lengths), np.int64) if rings is None else rings
        calls.append((vertices, corners, lengths, rings, result))
        return result

    monkeypatch.setattr(cityjson_module, "triangulate", watched)
    monkeypatch.setattr(triangulate_module, "triangulate", watched)
    umbra.read(real_file(name))
    ((vertices, corners, lengths, rings, result),) = calls
    assert find_changed_boundaries(vertices, corners, lengths, rings, result).tolist() == []
    assert result.crossed == 0
    # The polygons' own area, by Newell's rule, is that of the triangles.
    assert len(np.unique(result.polygon)) == len(rings) - result.degenerate


def test_vienna_solids_are_closed_and_carry_semantics(real_file, measure):
    scene = umbra.read(real_file("vienna_lod2.city.jsonl"))
    assert scene.sources[0].format == "CityJSONSeq 1.1"
    assert (scene.crs, scene.latitude) == (None, None)
    assert Counter(p.kind for p in scene.parts) == {
        "GroundSurface": 490,
        "RoofSurface": 490,
        "WallSurface": 490,
    }
    by_name = {}
    for index, part in enumerate(scene.parts):
        by_name.setdefault(part.name, []).append(index)
    opened = [name for name, parts in by_name.items() if measure.open_edges(scene, parts)]
    # Eight parts have walls in the file that do not meet their neighbours.
    assert len(by_name) == 490
    assert len(opened) == 8
    volumes = [measure.volume(scene, by_name[name]) for name in by_name if name not in opened]
    assert min(volumes) > 0


def test_delft_stands_in_delft(real_file, measure):
    scene = umbra.read(real_file("delft.city.json"))
    assert scene.sources[0].format == "CityJSON 2.0"
    assert scene.crs == "EPSG:7415"
    assert (scene.latitude, scene.longitude) == pytest.approx((52.0132, 4.3661), abs=1e-3)
    assert scene.true_north == pytest.approx(0.806, abs=0.01)
    assert Counter(p.kind for p in scene.parts)["Building"] == 160
    extent = [[84616.468, 447422.999, -0.452], [85140.839, 447750.636, 16.846]]
    assert scene.bounds() == pytest.approx(np.array(extent), abs=1e-9)


def test_zurich_stands_in_zurich(real_file):
    scene = umbra.read(real_file("zurich_lod2.city.json"))
    assert scene.crs == "EPSG:2056"
    # By swisstopo's approximation for WGS 84, good to 1 m.
    assert (scene.latitude, scene.longitude) == pytest.approx((47.378151, 8.535211), abs=2e-5)
    # West of 7.44 degrees the grid leans one way, east of it the other.
    assert scene.true_north == pytest.approx(-0.80, abs=0.02)
    assert len({p.name for p in scene.parts}) == 161


def test_denhaag_has_no_crs_and_closed_solids(real_file, measure):
    scene = umbra.read(real_file("denhaag.city.json"))
    assert scene.crs is None
    names = {p.name for p in scene.parts}
    assert len(names) == 9
    assert measure.open_edges(scene) == []
    assert measure.volume(scene) > 0


def test_obj_files_count_as_their_lines_do(real_file):
    for name in ("engel_house.obj", "urban_block.obj"):
        path = real_file(name)
        lengths = Counter(
            len(line.split()) - 1 for line in path.read_text().splitlines() if line.startswith("f ")
        )
        scene = umbra.read(path)
        faces = scene.triangles().faces
        assert set(lengths) == {3, 4}
        folded = sum(int(note.rsplit(": ")[-1]) for note in scene.notes if "polygons" in note)
        assert len(faces) == lengths[3] + 2 * (lengths[4] - folded)


def test_cut_real_file_says_where(real_file, tmp_path):
    for name in ("delft.city.json", "vienna_lod2.city.jsonl"):
        data = real_file(name).read_bytes()
        path = tmp_path / name
        path.write_bytes(data[: len(data) // 2])
        with pytest.raises(umbra.InputError, match=r"ends too early at line \d+, column \d+, byte"):
            umbra.read(path)


def test_vienna_object_by_hand(real_file, measure):
    # One building's walls, roofs and grounds against its polygons' Newell areas.
    path = real_file("vienna_lod2.city.jsonl")
    lines = path.read_text().splitlines()
    scale = json.loads(lines[0])["transform"]["scale"]
    feature = json.loads(lines[1])
    vertices = np.array(feature["vertices"]) * scale
    scene = umbra.read(path)
    compared = 0
    for name, item in feature["CityObjects"].items():
        for geometry in item.get("geometry", ()):
            if geometry["type"] != "MultiSurface":
                continue
            areas = Counter()
            for surface, value in zip(geometry["boundaries"], geometry["semantics"]["values"]):
                rings = [vertices[ring] - vertices[surface[0][0]] for ring in surface]
                vector = sum(np.cross(r, np.roll(r, -1, axis=0)).sum(0) / 2 for r in rings)
                kind = geometry["semantics"]["surfaces"][value]["type"]
                areas[kind] += np.linalg.norm(vector)
            for index, part in enumerate(scene.parts):
                if part.name == name:
                    assert measure.area(scene, [index]) == pytest.approx(areas[part.kind], rel=1e-4)
                    compared += 1
    assert compared >= 3
