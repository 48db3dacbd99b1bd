"""Honeybee models: rooms, openings, shades, units, and what is left out."""

import json

import numpy as np
import pytest

import umbra
from umbra import InputError

FLOOR = [[0, 0, 0], [0, 4, 0], [6, 4, 0], [6, 0, 0]]
FRONT = [[0, 0, 0], [6, 0, 0], [6, 0, 3], [0, 0, 3]]
PANE = [[1, 0, 1], [3, 0, 1], [3, 0, 2], [1, 0, 2]]
DOOR = [[4, 0, 0], [5, 0, 0], [5, 0, 2], [4, 0, 2]]


def shape(kind, corners, name, holes=(), **more):
    geometry = {"type": "Face3D", "boundary": corners, "holes": list(holes)}
    return {"type": kind, "identifier": name, "geometry": geometry, "properties": {}, **more}


def model(**more):
    pane = shape("Aperture", PANE, "pane", outdoor_shades=[shape("Shade", PANE, "fin")],
                 indoor_shades=[shape("Shade", PANE, "curtain")])  # fmt: skip
    front = shape("Face", FRONT, "front", face_type="Wall", apertures=[pane],
                  doors=[shape("Door", DOOR, "door")])  # fmt: skip
    faces = [front, shape("Face", FLOOR, "floor", face_type="Floor"),
             shape("Face", FLOOR, "gap", face_type="AirBoundary")]  # fmt: skip
    room = {"type": "Room", "identifier": "r1", "display_name": "Kitchen", "faces": faces}
    return {"type": "Model", "identifier": "m", "properties": {}, "units": "Meters",
            "rooms": [room], **more}  # fmt: skip


@pytest.fixture
def read(tmp_path):
    def from_tree(tree, **options):
        path = tmp_path / "house.hbjson"
        path.write_text(json.dumps(tree))
        return umbra.read(path, **options)

    return from_tree


def areas(scene):
    found = {}
    for part in scene.parts:
        a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
        found[part.name, part.kind] = pytest.approx(float(area))
    return found


def test_openings_are_cut_out_of_their_walls(read):
    scene = read(model())
    assert scene.sources[0].format == "HBJSON"
    assert areas(scene) == {
        ("Kitchen", "Wall"): 18 - 2 - 2, ("Kitchen", "Aperture"): 2, ("Kitchen", "Door"): 2,
        ("Kitchen", "Floor"): 24, ("fin", "Shade"): 2,
    }  # fmt: skip
    assert [note.partition(": ")[2] for note in scene.notes[:2]] == [
        "shades left out (indoors): 1 (first: 'pane')",
        "air boundaries left out (open): 1 (first: 'gap')",
    ]


def test_what_stands_alone_is_read_too(read):
    mesh = {"type": "ShadeMesh", "identifier": "tree", "properties": {},
            "geometry": {"type": "Mesh3D", "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0],
                                                        [0, 0, 2]],
                         "faces": [[0, 1, 2, 3], [0, 1, 4]]}}  # fmt: skip
    hole = [[1, 1, 0], [1, 2, 0], [2, 2, 0], [2, 1, 0]]
    scene = read(
        model(
            rooms=None, shade_meshes=[mesh],
            orphaned_shades=[shape("Shade", FLOOR, "roof", [hole])],
            orphaned_doors=[shape("Door", DOOR, "glass", is_glass=True)],
        )
    )  # fmt: skip
    assert areas(scene) == {("tree", "Shade"): 2, ("roof", "Shade"): 23, ("glass", "Aperture"): 2}


def test_units_become_metres(read):
    scene = read(model(units="Feet"))
    assert scene.bounds()[1] == pytest.approx([6 * 0.3048, 4 * 0.3048, 3 * 0.3048])
    assert any("from feet to metres" in note for note in scene.notes)
    with pytest.raises(InputError, match="unit 'Cubits'"):
        read(model(units="Cubits"))


def test_dragonfly_says_how_to_translate_it(read):
    with pytest.raises(InputError, match="dragonfly translate"):
        read({"type": "Model", "properties": {}, "buildings": []})


def test_a_mesh_that_names_no_vertex_is_named(read):
    mesh = {"identifier": "tree", "geometry": {"vertices": [[0, 0, 0]], "faces": [[0, 1, 2]]}}
    with pytest.raises(InputError, match="'tree' names a vertex"):
        read(model(shade_meshes=[mesh]))
