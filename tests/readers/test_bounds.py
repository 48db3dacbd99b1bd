"""Small files that ask for much: refused before memory or time is spent, with the limit."""

import json
import tracemalloc

import numpy as np
import pytest
from support.gltf_files import Document

import umbra
from umbra import InputError

TRIANGLE = np.array([[0, 0, 0], [2, 0, 0], [0, 0, 3]], "<f4")


@pytest.fixture
def refuse(tmp_path):
    """Read a file that has to be refused, in little memory."""

    def run(name, data, match):
        path = tmp_path / name
        path.write_bytes(data)
        tracemalloc.start()
        try:
            with pytest.raises(InputError, match=match):
                umbra.read(path)
            assert tracemalloc.get_traced_memory()[1] < 700e6
        finally:
            tracemalloc.stop()

    return run


def test_accessors_without_a_view_are_zeros_of_a_bounded_number(refuse, tmp_path):
    document = Document()
    zeros = {"componentType": 5126, "count": 2_000_000_000, "type": "MAT4"}
    document.tree["accessors"].append(zeros)
    document.node(mesh=document.mesh({"attributes": {"POSITION": 0}}))
    limit = r"mesh 0, primitive 0: 128\.00 GB .* files of 0\.0 MB may take \(0\.51 GB"
    refuse("a.glb", document.glb(), limit)
    zeros["type"] = "VEC3"
    zeros["count"] = 3
    (tmp_path / "b.glb").write_bytes(document.glb())
    assert umbra.read(tmp_path / "b.glb").parts[0].triangles == 1


def test_primitives_that_name_one_accessor_again_and_again(refuse):
    document = Document()
    points = document.accessor(np.tile(TRIANGLE, (10_000, 1)))
    document.node(mesh=document.mesh(*[{"attributes": {"POSITION": points}}] * 3000))
    refuse("a.glb", document.glb(), r"more than files of 0\.\d MB may take")


def test_morph_targets_that_name_one_accessor_again_and_again(refuse):
    document = Document()
    points = document.accessor(np.tile(TRIANGLE, (10_000, 1)))
    attributes = {"POSITION": points}
    document.node(mesh=document.mesh({"attributes": attributes, "targets": [attributes] * 3000}))
    refuse("a.glb", document.glb(), r"more than files of 0\.\d MB may take")


def test_primitives_that_many_nodes_show_are_bounded_before_they_are_parts(refuse):
    document = Document()
    points = document.accessor(TRIANGLE)
    mesh = document.mesh(*[{"attributes": {"POSITION": points}}] * 1000)
    for _ in range(3000):
        document.node(mesh=mesh)
    refuse("a.glb", document.glb(), r"3,000,000 parts, each primitive at each node")


def test_instances_that_multiply_to_billions(refuse):
    document = Document()
    points = document.accessor(np.tile(TRIANGLE, (100_000, 1)))
    mesh = document.mesh({"attributes": {"POSITION": points}})
    for _ in range(20_000):
        document.node(mesh=mesh)
    refuse("a.glb", document.glb(), r"20,000 parts.* have 2,000,000,000 triangles .* need \d+ GB")


def test_templates_that_multiply_to_billions(refuse):
    surface = [[[0, 1, 2]]] * 50_000
    shape = {"type": "MultiSurface", "lod": "2", "boundaries": surface}
    instance = {"type": "GeometryInstance", "template": 0, "boundaries": [0]}
    tree = {
        "type": "CityJSON",
        "version": "2.0",
        "CityObjects": {
            str(n): {"type": "CityFurniture", "geometry": [instance]} for n in range(50_000)
        },
        "vertices": [[0, 0, 0]],
        "geometry-templates": {
            "templates": [shape],
            "vertices-templates": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        },
    }
    refuse("a.json", json.dumps(tree).encode(), r"have 2,500,000,000 triangles")


def test_children_named_by_every_parent_are_looked_at_once(tmp_path):
    roof = [[[0, 1, 2]], [[0, 2, 3]]]
    shape = {"type": "MultiSurface", "lod": "2", "boundaries": roof * 2000}
    parent = {"type": "MultiSurface", "lod": "2", "boundaries": [[[1, 2, 3]]]}
    objects = {
        f"p{n}": {"type": "Building", "geometry": [parent], "children": ["c"] * 300}
        for n in range(300)
    }
    objects["c"] = {"type": "BuildingPart", "geometry": [shape]}
    tree = {
        "type": "CityJSON",
        "version": "2.0",
        "CityObjects": objects,
        "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    }
    path = tmp_path / "a.json"
    path.write_text(json.dumps(tree))
    assert len(umbra.read(path).parts) == 301  # 90,000 pairs of 4,000 surfaces took minutes
