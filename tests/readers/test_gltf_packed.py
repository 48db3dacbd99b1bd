"""glTF with Draco, meshopt and instances in arrays, against the same model plain."""

import numpy as np
import pytest
from support.gltf_files import Document

import umbra
from umbra import InputError
from umbra.readers import extras

POINTS = np.array([[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 1], [1, 1, 4]], "f4")
CORNERS = np.array([0, 1, 2, 0, 2, 3, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4], "u4")
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]], "f4")
COLORS = np.array([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]] + [[51] * 4] * 2, "u1")


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


def plain(**more):
    """A document with a pyramid, and its primitive."""
    document = Document()
    primitive = {
        "attributes": {
            "POSITION": document.accessor(POINTS),
            "TEXCOORD_0": document.accessor(UV),
            "COLOR_0": document.accessor(COLORS, normalized=True),
        },
        "indices": document.accessor(CORNERS),
    }
    document.node(mesh=document.mesh(primitive, name="pyramid"), **more)
    return document


def meshopt_packed(document, modes, **more):
    """Pack views, in the modes given by their number, as EXT_meshopt_compression does."""
    meshopt = pytest.importorskip("meshopt")
    packed = Document()
    packed.tree = document.tree
    packed.tree["extensionsUsed"] = packed.tree["extensionsRequired"] = ["EXT_meshopt_compression"]
    for number, view in enumerate(document.tree["bufferViews"]):
        start, size = view["byteOffset"], view["byteLength"]
        stride, mode = modes.get(number, (4, "ATTRIBUTES"))
        data = np.frombuffer(document.bytes[start : start + size], "u1").reshape(-1, stride)
        if mode != "ATTRIBUTES":
            data = data.view("u4").ravel()
        encoded = more.get(f"view{number}") or meshopt.encode_gltf_buffer(data, mode)
        packed.bytes += b"\0" * (-len(packed.bytes) % 4)
        view["extensions"] = {
            "EXT_meshopt_compression": {
                "buffer": 0,
                "byteOffset": len(packed.bytes),
                "byteLength": len(encoded),
                "byteStride": stride,
                "mode": mode,
                "count": len(data),
            }
            | more.get(f"more{number}", {})
        }
        view["buffer"] = 7  # a fallback that is not there
        packed.bytes += encoded
    return packed


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


def test_damaged_meshopt_is_named(read):
    packed = meshopt_packed(plain(), {0: (12, "ATTRIBUTES"), 1: (8, "ATTRIBUTES")}, view0=b"\xa0no")
    with pytest.raises(InputError, match=r"mesh 0, primitive 0: its meshopt data is damaged"):
        read(packed)
    huge = meshopt_packed(
        plain(), {0: (12, "ATTRIBUTES"), 1: (8, "ATTRIBUTES")}, more0={"count": 1 << 30}
    )
    with pytest.raises(InputError, match=r"may take"):
        read(huge)


def draco_packed(**more):
    """The pyramid with its arrays in Draco alone, vertex by vertex as they were."""
    draco = pytest.importorskip("DracoPy")
    data = draco.encode(
        POINTS,
        CORNERS.reshape(-1, 3),
        quantization_bits=20,
        preserve_order=True,
        generic_attributes={3: UV, 5: COLORS},
    )
    numbers = {one["data"].shape[1]: one["unique_id"] for one in draco.decode(data).attributes}
    document = Document()
    for kind, code, count in (("VEC3", 5126, 5), ("VEC2", 5126, 5), ("VEC4", 5121, 5)):
        document.tree["accessors"].append({"componentType": code, "count": count, "type": kind})
    document.tree["accessors"][2]["normalized"] = True
    document.tree["accessors"].append({"componentType": 5125, "count": 18, "type": "SCALAR"})
    packed = {
        "bufferView": document.view(more.get("data", data)),
        "attributes": {"POSITION": numbers[3], "TEXCOORD_0": 3, "COLOR_0": 5}
        | more.get("names", {}),
    }
    primitive = {
        "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2},
        "indices": 3,
        "extensions": {"KHR_draco_mesh_compression": packed},
    }
    document.node(mesh=document.mesh(primitive, name="pyramid"))
    document.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return document


def test_draco_gives_every_vertex_as_it_was(read):
    expected, scene = read(plain()), read(draco_packed())
    mesh, other = scene.parts[0].mesh, expected.parts[0].mesh
    assert (mesh.faces == other.faces).all()
    assert mesh.vertices == pytest.approx(other.vertices, abs=4 / 2**20)
    assert (mesh.uv == other.uv).all()
    assert (mesh.colors == other.colors).all()
    assert scene.notes == ()


def test_damaged_draco_is_named(read):
    with pytest.raises(InputError, match=r"its Draco data has no attribute 77 \(TEXCOORD_0\)"):
        read(draco_packed(names={"TEXCOORD_0": 77}))
    with pytest.raises(InputError, match=r"primitive 0: its Draco data is damaged"):
        read(draco_packed(data=b"DRACO\2\2\1\1\0\0" + bytes(30)))


def test_draco_beside_plain_arrays_needs_no_package(read, monkeypatch):
    monkeypatch.setattr(extras, "import_module", _fail)
    document = plain()
    primitive = document.tree["meshes"][0]["primitives"][0]
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}
    assert read(document).parts[0].triangles == 6


def _fail(name):
    msg = f"No module named {name!r}"
    raise ModuleNotFoundError(msg)


def test_a_missing_package_is_named_with_its_extra(read, monkeypatch):
    draco, meshopt = draco_packed(), meshopt_packed(plain(), {0: (12, "ATTRIBUTES")})
    monkeypatch.setattr(extras, "import_module", _fail)
    for document, package in ((draco, "DracoPy"), (meshopt, "meshopt")):
        with pytest.raises(InputError, match=rf"{package}, .*pip install 'umbra-shadows\[gltf\]'"):
            read(document)


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
    ("columns", "match"),
    [
        ({"TRANSLATION": 3, "SCALE": 2}, r"node 0, instances: their arrays have \[2, 3\] rows"),
        ({"ROTATION": 3}, r"ROTATION has 3 numbers, not 4"),
    ],
)
def test_damaged_instances_are_named(read, columns, match):
    document = plain()
    numbers = {name: document.accessor(np.ones((n, 3), "f4")) for name, n in columns.items()}
    document.tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": numbers}}
    with pytest.raises(InputError, match=match):
        read(document)


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
    assert notes == ("m.glb: what the extension KHR_gaussian_splatting says, left out: 1",)
