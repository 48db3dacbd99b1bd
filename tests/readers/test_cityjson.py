"""CityJSON of every version: places, kinds, the best geometry once."""

import json

import numpy as np
import pytest

import umbra
from umbra import InputError

SURFACES = [{"type": "GroundSurface"}, {"type": "RoofSurface"}, {"type": "WallSurface"}]
VALUES = [0, 1, 2, 2, 2, 2]


@pytest.fixture
def save(tmp_path):
    def write(objects, vertices, *, name="model.city.json", **members):
        document = {
            "type": "CityJSON",
            "version": "2.0",
            "CityObjects": objects,
            "vertices": vertices,
            **members,
        }
        path = tmp_path / name
        path.write_text(json.dumps({k: v for k, v in document.items() if v is not None}))
        return path

    return write


def solid(faces, lod="2.2", **semantics):
    geometry = {"type": "Solid", "lod": lod, "boundaries": [[[face] for face in faces]]}
    if semantics:
        geometry["semantics"] = {"surfaces": SURFACES, "values": [VALUES]}
    return geometry


def surfaces(faces, lod="2.2", *, semantics=False, kind="MultiSurface"):
    geometry = {"type": kind, "lod": lod, "boundaries": [[face] for face in faces]}
    if semantics:
        geometry["semantics"] = {"surfaces": SURFACES, "values": VALUES}
    return geometry


def building(*geometries, **more):
    return {"type": "Building", "geometry": list(geometries), **more}


@pytest.mark.parametrize("version", ["1.0", "1.1", "2.0"])
def test_box_of_each_version(save, box, measure, version):
    vertices, faces = box
    millimetres = [[1000 * c for c in v] for v in vertices]
    lod = 2 if version == "1.0" else "2.2"
    path = save(
        {"house": building(solid(faces, lod, semantics=True))},
        millimetres,
        version=version,
        transform={"scale": [0.001, 0.001, 0.001], "translate": [100.0, 200.0, 5.0]},
    )
    scene = umbra.read(path)
    assert measure.volume(scene) == pytest.approx(24.0)
    assert measure.area(scene) == pytest.approx(52.0)
    assert measure.open_edges(scene) == []
    assert scene.bounds().tolist() == [[100, 200, 5], [102, 203, 9]]
    assert {(p.name, p.kind, p.triangles) for p in scene.parts} == {
        ("house", "GroundSurface", 2),
        ("house", "RoofSurface", 2),
        ("house", "WallSurface", 8),
    }
    roof = next(i for i, p in enumerate(scene.parts) if p.kind == "RoofSurface")
    assert measure.area(scene, [roof]) == pytest.approx(6.0)
    assert scene.sources[0].format == f"CityJSON {version}"


def test_1_0_without_transform_has_plain_coordinates(save, box, measure):
    vertices, faces = box
    path = save({"a": building(solid(faces))}, vertices, version="1.0")
    scene = umbra.read(path)
    assert measure.volume(scene) == pytest.approx(24.0)
    assert [p.kind for p in scene.parts] == ["Building"]


def test_meshes_share_one_array_of_vertices(save, box):
    vertices, faces = box
    scene = umbra.read(save({"a": building(solid(faces, semantics=True))}, vertices))
    assert len({id(p.mesh.vertices) for p in scene.parts}) == 1
    assert len(scene.triangles().vertices) == 8


def test_far_coordinates_keep_their_digits(save, box):
    vertices, faces = box
    millimetres = [[1000 * x + 1, 1000 * y + 2, 1000 * z + 3] for x, y, z in vertices]
    transform = {"scale": [0.001] * 3, "translate": [2677116.375, 1241839.025, 0.0]}
    scene = umbra.read(save({"a": building(solid(faces))}, millimetres, transform=transform))
    lowest = np.array([1, 2, 3]) * 0.001 + transform["translate"]
    assert (scene.bounds()[0] == lowest).all()
    assert np.abs(scene.parts[0].mesh.vertices).max() < 100


def test_sequence_has_a_transform_for_all_and_vertices_for_each(tmp_path, box, measure):
    vertices, faces = box
    head = {
        "type": "CityJSON",
        "version": "2.0",
        "CityObjects": {},
        "vertices": [],
        "transform": {"scale": [0.5, 0.5, 0.5], "translate": [10, 20, 30]},
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/28992"},
    }
    lines = [head]
    for k in range(3):
        moved = [[2 * x + 20 * k, 2 * y, 2 * z] for x, y, z in vertices]
        lines.append(
            {
                "type": "CityJSONFeature",
                "id": f"f{k}",
                "CityObjects": {f"f{k}": building(solid(faces))},
                "vertices": moved,
            }
        )
    path = tmp_path / "town.city.jsonl"
    path.write_text("\n".join(json.dumps(line) for line in lines) + "\n\n")
    scene = umbra.read(path)
    assert [p.name for p in scene.parts] == ["f0", "f1", "f2"]
    assert measure.volume(scene) == pytest.approx(72.0)
    assert scene.bounds().tolist() == [[10, 20, 30], [32, 23, 34]]
    assert scene.crs == "EPSG:28992"
    assert scene.sources[0].format == "CityJSONSeq 2.0"


def test_solid_before_surfaces_and_never_both(save, box, measure):
    vertices, faces = box
    loose = surfaces(faces[:5], semantics=False)
    for pair in ([loose, solid(faces)], [solid(faces), loose]):
        scene = umbra.read(save({"a": building(*pair)}, vertices))
        assert measure.area(scene) == pytest.approx(52.0)
        assert scene.triangles().faces.shape == (12, 3)


def test_highest_level_of_detail_wins_over_a_solid(save, box, measure):
    vertices, faces = box
    low = [[2 * c for c in v] for v in vertices]
    low_faces = [[c + 8 for c in face] for face in faces]
    for fine, coarse in [("2.2", "2"), ("2", "1.3"), (2, 1), ("3", "2.2")]:
        geometries = [solid(low_faces, coarse), surfaces(faces, fine)]
        scene = umbra.read(save({"a": building(*geometries)}, vertices + low))
        assert measure.area(scene) == pytest.approx(52.0)


@pytest.mark.parametrize("shift", [0, 8])
def test_solid_borrows_semantics_from_surfaces_in_the_same_places(save, box, measure, shift):
    # As in Vienna's file: the semantics are on the MultiSurface only. With a shift,
    # its corners stand in the same places under other indices, in another order.
    vertices, faces = box
    lender = surfaces([[c + shift for c in face] for face in faces], semantics=True)
    if shift:
        lender["boundaries"].reverse()
        lender["semantics"]["values"] = VALUES[::-1]
    scene = umbra.read(save({"a": building(lender, solid(faces))}, vertices + vertices))
    assert measure.open_edges(scene) == []
    areas = {p.kind: measure.area(scene, [i]) for i, p in enumerate(scene.parts)}
    assert areas == pytest.approx({"GroundSurface": 6, "RoofSurface": 6, "WallSurface": 40})


def test_inner_shells_make_a_hollow(save, box, measure):
    vertices, faces = box
    inner = [[0.5 + x / 2, 0.5 + y / 2, 1 + z / 2] for x, y, z in vertices]
    shells = [[[f] for f in faces], [[[c + 8 for c in f[::-1]]] for f in faces]]
    geometry = {"type": "Solid", "lod": "3", "boundaries": shells}
    scene = umbra.read(save({"a": building(geometry)}, vertices + inner))
    assert measure.volume(scene) == pytest.approx(24 - 3)
    assert measure.area(scene) == pytest.approx(52 * 1.25)


@pytest.mark.parametrize("kind", ["MultiSolid", "CompositeSolid"])
def test_several_solids_with_partial_semantics(save, box, measure, kind):
    vertices, faces = box
    moved = [[x + 10, y, z] for x, y, z in vertices]
    geometry = {
        "type": kind,
        "lod": "2",
        "boundaries": [
            [[[f] for f in faces]],
            [[[[c + 8 for c in f]] for f in faces]],
        ],
        # The second solid has none at all.
        "semantics": {"surfaces": SURFACES, "values": [[[0, 1, None, 2, 2, 2]], None]},
    }
    scene = umbra.read(save({"a": building(geometry)}, vertices + moved))
    assert measure.volume(scene) == pytest.approx(48.0)
    kinds = {p.kind: p.triangles for p in scene.parts}
    assert kinds == {"GroundSurface": 2, "RoofSurface": 2, "WallSurface": 6, "Building": 14}


def test_composite_surface_with_a_window(save, measure):
    vertices = [[0, 0, 0], [4, 0, 0], [4, 0, 3], [0, 0, 3]]
    vertices += [[1, 0, 1], [2, 0, 1], [2, 0, 2], [1, 0, 2]]
    geometry = {
        "type": "CompositeSurface",
        "lod": "3",
        "boundaries": [[[0, 1, 2, 3], [7, 6, 5, 4]], [[4, 5, 6, 7]]],
        "semantics": {
            "surfaces": [{"type": "WallSurface", "children": [1]}, {"type": "Window", "parent": 0}],
            "values": [0, 1],
        },
    }
    scene = umbra.read(save({"a": building(geometry)}, vertices))
    areas = {p.kind: measure.area(scene, [i]) for i, p in enumerate(scene.parts)}
    assert areas == pytest.approx({"WallSurface": 11.0, "Window": 1.0})


def test_templates_share_a_mesh_and_stand_at_their_point(save, box, measure):
    vertices, faces = box
    tree = {
        "type": "SolitaryVegetationObject",
        "geometry": [
            {
                "type": "GeometryInstance",
                "template": 0,
                "boundaries": [0],
                # Twice as tall, and a metre along x.
                "transformationMatrix": [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1],
            }
        ],
    }
    other = json.loads(json.dumps(tree))
    other["geometry"][0]["boundaries"] = [1]
    path = save(
        {"oak": tree, "elm": other},
        [[100, 0, 0], [0, 500, 10]],
        transform={"scale": [0.1, 0.1, 0.1], "translate": [1000, 0, 0]},
        **{
            "geometry-templates": {
                "templates": [solid(faces)],
                "vertices-templates": [[float(c) for c in v] for v in vertices],
            }
        },
    )
    scene = umbra.read(path)
    oak, elm = scene.parts
    assert oak.mesh is elm.mesh
    assert (oak.name, oak.kind) == ("oak", "SolitaryVegetationObject")
    assert measure.volume(scene, [0]) == pytest.approx(48.0)
    assert measure.corners(scene, [0]).min((0, 1)).tolist() == [1011, 0, 0]
    assert measure.corners(scene, [1]).max((0, 1)).tolist() == [1003, 53, 9]


# Parents and their parts


def test_part_and_parent_with_different_surfaces_are_both_taken(save, box, measure):
    # CityGML lets a building with parts carry its central part itself.
    vertices, faces = box
    moved = [[x + 2, y, z] for x, y, z in vertices]
    path = save(
        {
            "a": building(solid(faces), children=["a1"]),
            "a1": {
                "type": "BuildingPart",
                "parents": ["a"],
                "geometry": [solid([[c + 8 for c in f] for f in faces])],
            },
        },
        vertices + moved,
    )
    assert measure.volume(umbra.read(path)) == pytest.approx(48.0)


def test_parent_that_repeats_its_parts_is_left_out(save, box, measure):
    vertices, faces = box
    again = [[c + 8 for c in f] for f in faces]
    path = save(
        {
            "a": building(surfaces(again), children=["a1"]),
            "a1": {"type": "BuildingPart", "parents": ["a"], "geometry": [solid(faces)]},
        },
        vertices + vertices,
    )
    scene = umbra.read(path)
    assert [p.name for p in scene.parts] == ["a1"]
    assert "repeat" in scene.notes[0]
    assert scene.notes[0].startswith("model.city.json: ")


def test_footprint_of_a_building_with_finer_parts_is_left_out(save, box, measure):
    # As in the Dutch 3D BAG: LoD 0 on the building, 2.2 on its part.
    vertices, faces = box
    footprint = [[-1, -1, 0], [3, -1, 0], [3, 4, 0], [-1, 4, 0]]
    path = save(
        {
            "a": building(surfaces([[8, 9, 10, 11]], "0"), children=["a1"]),
            "a1": {"type": "BuildingPart", "parents": ["a"], "geometry": [solid(faces)]},
        },
        vertices + footprint,
    )
    assert measure.area(umbra.read(path)) == pytest.approx(52.0)


def test_finer_installation_does_not_replace_its_building(save, box, measure):
    vertices, faces = box
    chimney = [[x / 4, y / 4, 4 + z / 4] for x, y, z in vertices]
    path = save(
        {
            "a": building(solid(faces, "2"), children=["c"]),
            "c": {
                "type": "BuildingInstallation",
                "parents": ["a"],
                "geometry": [solid([[i + 8 for i in f] for f in faces], "3")],
            },
        },
        vertices + chimney,
    )
    assert measure.volume(umbra.read(path)) == pytest.approx(24 * (1 + 1 / 64))


def test_installation_that_repeats_the_buildings_surfaces_is_left_out(save, box, measure):
    vertices, faces = box
    path = save(
        {
            "a": building(solid(faces), children=["c"]),
            "c": {"type": "BuildingInstallation", "geometry": [surfaces(faces[2:4])]},
        },
        vertices,
    )
    scene = umbra.read(path)
    assert [p.name for p in scene.parts] == ["a"]
    assert measure.open_edges(scene) == []


# Damage


def test_points_and_lines_are_noted(save, box):
    vertices, faces = box
    path = save(
        {
            "a": building(solid(faces)),
            "p": {"type": "Road", "geometry": [{"type": "MultiPoint", "boundaries": [0, 1]}]},
        },
        vertices,
    )
    (note,) = umbra.read(path).notes
    assert note == "model.city.json: objects without surfaces (points or lines) left out: 1"


@pytest.mark.parametrize(
    ("change", "said", "vertex"),
    [
        (lambda g: g["boundaries"][0][0][0].append(8), "names vertex 8", 8),
        (lambda g: g["boundaries"][0][0][0].append(-1), "names vertex -1", -1),
        (lambda g: g["boundaries"][0][0][0].append(1.5), "not a whole number (1.5)", 1.5),
        (lambda g: g["boundaries"][0][0][0].append("1"), "not a whole number", "1"),
        (lambda g: g["boundaries"][0][0][0].append(None), "not a whole number", None),
        (lambda g: g["boundaries"][0][0][0].append([1]), "not a whole number", [1]),
        (lambda g: g["boundaries"][0].append(7), "is damaged", None),
        (lambda g: g.update(boundaries=[[[0, 1, 2]]]), "is damaged", None),
        (lambda g: g.pop("type"), "is damaged", None),
        (lambda g: g["semantics"]["values"][0].append(0), "is damaged", None),
        (lambda g: g["semantics"]["values"].__setitem__(0, [9] * 6), "is damaged", None),
    ],
)
def test_damaged_object_is_named(save, box, change, said, vertex):
    vertices, faces = box
    geometry = json.loads(json.dumps(solid(faces, semantics=True)))
    change(geometry)
    good = building(solid(faces))
    with pytest.raises(InputError) as caught:
        umbra.read(save({"good": good, "a": building(geometry)}, vertices))
    assert said in str(caught.value)
    assert caught.value.object == "a"
    assert caught.value.data.get("vertex") == vertex
    assert str(caught.value.path).endswith("model.city.json")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("members", "said"),
    [
        ({"vertices": [[0, 0, 0], [1, 1]]}, "first: vertex 1, [1, 1]"),
        ({"vertices": [[0, 0, 0], [1, "a", 1]]}, "first: vertex 1"),
        ({"vertices": {"a": 1}}, "they are a dict"),
        ({"transform": {"scale": [1, 1]}}, "transform"),
        ({"CityObjects": [1]}, "no CityObjects"),
        ({"CityObjects": None}, "no CityObjects"),
        ({"CityObjects": {}}, "no triangles"),
        ({"version": "0.9"}, "is CityJSON 0.9; upgrade it"),
    ],
)
def test_damaged_document_says_what(save, box, members, said):
    vertices, faces = box
    objects = {"a": building(solid(faces))}
    members = {"objects": objects, "vertices": vertices} | members
    if "CityObjects" in members:
        members["objects"] = members.pop("CityObjects")
    with pytest.raises(InputError) as caught:
        umbra.read(save(**members))
    assert said in str(caught.value)


def test_feature_without_a_header_is_named(tmp_path, box):
    vertices, faces = box
    path = tmp_path / "one.jsonl"
    path.write_text(
        json.dumps(
            {
                "type": "CityJSONFeature",
                "CityObjects": {"a": building(solid(faces))},
                "vertices": vertices,
            }
        )
    )
    with pytest.raises(InputError, match="header line"):
        umbra.read(path)


def test_the_objects_type_chooses_its_surfaces(real_file):
    scene = umbra.read(real_file("denhaag.city.json"))
    assert {scene.parts[i].kind for i in scene.select(["Building*"])} >= {
        "RoofSurface",
        "WallSurface",
    }


def test_objects_of_one_id_in_two_lines_are_two(tmp_path, box):
    vertices, faces = box
    plain = {"scale": [1, 1, 1], "translate": [0, 0, 0]}
    head = {"type": "CityJSON", "version": "2.0", "transform": plain, "CityObjects": {}}
    lines = [head | {"vertices": []}]
    for k in range(2):
        moved = [[x + 20 * k, y, z] for x, y, z in vertices]
        objects = {"b": building(solid(faces))}
        lines.append({"type": "CityJSONFeature", "CityObjects": objects, "vertices": moved})
    path = tmp_path / "two.city.jsonl"
    path.write_text("\n".join(json.dumps(line) for line in lines))
    scene = umbra.read(path)
    assert [part.name for part in scene.parts] == ["b", "b (2)"]
    assert [part.bounds[0, 0] for part in scene.parts] == [0, 20]
    assert scene.select(["b"]) == [0, 1]
    assert "two.city.jsonl: objects with a repeated id, numbered: 1" in scene.notes
