"""glTF with Draco, meshopt and instances in arrays, against the same model plain."""

import importlib

import numpy as np
import pytest
from support.gltf_files import Document
from support.packed_files import CORNERS, POINTS, draco_packed, meshopt_packed, plain

import umbra
from umbra import InputError, packages


@pytest.fixture
def read(tmp_path):
    def run(document, name="m.glb"):
        path = tmp_path / name
        path.write_bytes(document.glb())
        return umbra.read(path)

    return run


def corners(scene):
    soup = scene.triangles()
    return soup.vertices[soup.faces] + scene.origin


@pytest.mark.parametrize("mode", ["TRIANGLES", "INDICES"])
def test_meshopt_gives_every_vertex_as_it_was(read, mode):
    expected = read(plain())
    scene = read(
        meshopt_packed(plain(), {0: (12, "ATTRIBUTES"), 1: (8, "ATTRIBUTES"), 3: (4, mode)})
    )
    mesh, other = scene.parts[0].mesh, expected.parts[0].mesh
    # An index codec may begin a triangle at another of its corners.
    assert {frozenset(map(tuple, t)) for t in corners(scene).tolist()} == {
        frozenset(map(tuple, t)) for t in corners(expected).tolist()
    }
    assert (mesh.vertices == other.vertices).all()
    assert (mesh.uv == other.uv).all()
    assert (mesh.colors == other.colors).all()


def test_meshopt_with_a_filter_and_quantized_positions(read):
    meshopt = pytest.importorskip("meshopt")
    document = Document()
    whole = np.round(POINTS * 8000).astype("i2")
    rows = np.concatenate([whole, np.zeros((5, 1), "i2")], axis=1)
    number = document.view(rows.tobytes(), byteStride=8)
    document.tree["accessors"].append(
        {
            "bufferView": number,
            "componentType": 5122,
            "count": 5,
            "type": "VEC3",
            "normalized": True,
        }
    )
    places = meshopt.encode_filter_exp(np.array([[0.0, 5, 0], [10, 0, 0]], "f4"), 15)
    moved = document.accessor(np.zeros((2, 3), "f4"))
    index = document.accessor(CORNERS)
    mesh = document.mesh({"attributes": {"POSITION": 0}, "indices": index})
    attributes = {"attributes": {"TRANSLATION": moved}}
    document.node(
        mesh=mesh, scale=[32767 / 8000] * 3, extensions={"EXT_mesh_gpu_instancing": attributes}
    )
    modes = {0: (8, "ATTRIBUTES"), 1: (12, "ATTRIBUTES"), 2: (4, "TRIANGLES")}
    packed = meshopt_packed(
        document,
        modes,
        view1=meshopt.encode_gltf_buffer(places, "ATTRIBUTES"),
        more1={"filter": "EXPONENTIAL"},
    )
    scene = read(packed)
    assert [part.triangles for part in scene.parts] == [6, 6]
    scale = 32767 / 8000
    low = scene.bounds()[0]
    assert low == pytest.approx([0, -4, 0], abs=1e-3)
    assert scene.bounds()[1] == pytest.approx([10 * scale + 2, 0, 5 * scale + 3], abs=1e-3)


def test_damaged_meshopt_is_named(read, refuse):
    packed = meshopt_packed(plain(), {0: (12, "ATTRIBUTES"), 1: (8, "ATTRIBUTES")}, view0=b"\xa0no")
    said = refuse(read, packed, facts={"where": "mesh 0, primitive 0"})
    assert "its meshopt data is damaged" in said
    huge = meshopt_packed(
        plain(), {0: (12, "ATTRIBUTES"), 1: (8, "ATTRIBUTES")}, more0={"count": 1 << 30}
    )
    with pytest.raises(InputError, match=r"may take"):
        read(huge)


def test_draco_gives_every_vertex_as_it_was(read):
    expected, scene = read(plain()), read(draco_packed())
    mesh, other = scene.parts[0].mesh, expected.parts[0].mesh
    assert (mesh.faces == other.faces).all()
    assert mesh.vertices == pytest.approx(other.vertices, abs=4 / 2**20)
    assert (mesh.uv == other.uv).all()
    assert (mesh.colors == other.colors).all()
    assert scene.notes == ()


def test_damaged_draco_is_named(read, refuse):
    where = "mesh 0, primitive 0"
    facts = {"where": where, "attribute": 77}
    said = refuse(read, draco_packed(names={"TEXCOORD_0": 77}), facts=facts)
    assert "has no attribute 77 (TEXCOORD_0)" in said
    damaged = draco_packed(data=b"DRACO\2\2\1\1\0\0" + bytes(30))
    assert "its Draco data is damaged" in refuse(read, damaged, facts={"where": where})


def test_draco_beside_plain_arrays_needs_no_package(read, monkeypatch):
    monkeypatch.setattr(packages, "import_module", _fail)
    document = plain()
    primitive = document.tree["meshes"][0]["primitives"][0]
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}
    assert read(document).parts[0].triangles == 6


def _fail(name):
    if name.startswith("umbra."):
        return importlib.import_module(name)
    msg = f"No module named {name!r}"
    raise ModuleNotFoundError(msg)


def test_a_missing_package_is_named_with_its_extra(read, refuse, monkeypatch):
    draco, meshopt = draco_packed(), meshopt_packed(plain(), {0: (12, "ATTRIBUTES")})
    monkeypatch.setattr(packages, "import_module", _fail)
    for document, package in ((draco, "DracoPy"), (meshopt, "meshopt")):
        said = refuse(read, document, facts={"package": package, "extra": "gltf"})
        assert packages.write_install("gltf") in said


def test_instances_stand_where_nodes_would(read):
    half = np.sqrt(0.5)
    document = plain(name="tree", translation=[0, 0, 100], scale=[2, 2, 2])
    node = document.tree["nodes"][0]
    columns = {
        "TRANSLATION": np.array([[0, 0, 0], [10, 0, 0], [0, 0, 5]], "f4"),
        "ROTATION": np.array([[0, 0, 0, 1], [0, half, 0, half], [0, 0, 0, 1]], "f4"),
        "SCALE": np.array([[1, 1, 1], [1, 1, 1], [3, 1, 1]], "f4"),
        "_ID": np.array([7, 8, 9], "u4"),
    }
    numbers = {name: document.accessor(values) for name, values in columns.items()}
    node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": numbers}}
    scene = read(document, "instances.glb")
    written = plain()
    written.tree["scenes"][0]["nodes"].clear()
    inner = [
        written.node(
            root=False,
            mesh=0,
            **{
                key: columns[name][k].tolist()
                for name, key in (
                    ("TRANSLATION", "translation"),
                    ("ROTATION", "rotation"),
                    ("SCALE", "scale"),
                )
            },
        )
        for k in range(3)
    ]
    written.node(children=inner, translation=[0, 0, 100], scale=[2, 2, 2])
    expected = read(written, "nodes.glb")
    assert (corners(scene) == corners(expected)).all()
    assert [part.name for part in scene.parts] == ["tree 1", "tree 2", "tree 3"]
    assert len({id(part.mesh) for part in scene.parts}) == 1


@pytest.mark.parametrize(
    ("columns", "facts", "said"),
    [
        ({"TRANSLATION": 3, "SCALE": 2}, {"counts": [2, 3]}, "their arrays have [2, 3] rows"),
        ({"ROTATION": 3}, {"attribute": "ROTATION", "count": 3}, "ROTATION has 3 numbers, not 4"),
    ],
)
def test_damaged_instances_are_named(read, refuse, columns, facts, said):
    document = plain()
    numbers = {name: document.accessor(np.ones((n, 3), "f4")) for name, n in columns.items()}
    document.tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": numbers}}
    assert said in refuse(read, document, facts={"where": "node 0, instances", **facts})


def test_instances_of_millions_are_bounded(read):
    document = plain()
    zeros = {"componentType": 5126, "count": 2_000_000, "type": "VEC3"}
    document.tree["accessors"].append(zeros)
    number = len(document.tree["accessors"]) - 1
    given = {"attributes": {"TRANSLATION": number}}
    document.tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": given}
    with pytest.raises(InputError, match=r"node 0, instances: .* may take"):
        read(document)


def test_what_an_unknown_extension_says_is_noted(read):
    document = plain()
    document.tree["extensionsRequired"] = ["KHR_gaussian_splatting", "KHR_mesh_quantization"]
    notes = read(document).notes
    assert notes == ("m.glb: properties of the extension KHR_gaussian_splatting left out: 1",)
