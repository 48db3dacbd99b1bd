"""glTF and GLB: nodes, instances, strips, sparse and packed numbers, missing buffers."""

import base64

import numpy as np
import pytest
from support.gltf_files import Document

import umbra
from umbra import InputError

HALF = float(np.sqrt(0.5))


@pytest.fixture
def made(box):
    """A box of 2 x 4 (up) x 3 m in glTF's axes, as one primitive."""
    vertices, faces = box
    document = Document()
    points = np.array([[x, z, -y] for x, y, z in vertices], "f4")
    triangles = np.array([[(a, b, c), (a, c, d)] for a, b, c, d in faces], "u2").reshape(-1)
    document.primitive = {
        "attributes": {"POSITION": document.accessor(points)},
        "indices": document.accessor(triangles),
        "material": 0,
    }
    return document


@pytest.fixture
def save(tmp_path):
    def write(content, name="m.glb"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_glb_turns_y_up_to_z_up(made, save, measure):
    made.node(mesh=made.mesh(made.primitive), name="house")
    scene = umbra.read(save(made.glb()))
    (part,) = scene.parts
    assert (part.name, part.kind, part.color) == ("house", "brick", (0.5, 0.25, 0.1))
    assert scene.bounds().tolist() == [[0, 0, 0], [2, 3, 4]]
    assert measure.volume(scene) == pytest.approx(24.0)
    assert scene.sources[0].format == "GLB 2.0"


def test_up_is_honoured(made, save):
    made.node(mesh=made.mesh(made.primitive))
    assert umbra.read(save(made.glb()), up="z").bounds().tolist() == [[0, 0, -3], [2, 4, 0]]


def test_instances_share_one_mesh(made, save, measure):
    mesh = made.mesh(made.primitive)
    made.node(mesh=mesh, name="one")
    made.node(mesh=mesh, name="two", translation=[10, 1, -20], scale=[2, 1, 1])
    scene = umbra.read(save(made.glb()))
    one, two = scene.parts
    assert one.mesh is two.mesh
    assert measure.corners(scene, [1]).min((0, 1)).tolist() == [10, 20, 1]
    assert measure.corners(scene, [1]).max((0, 1)).tolist() == [14, 23, 5]
    assert measure.volume(scene) == pytest.approx(24 + 48)


def test_transforms_compose_from_parent_to_child(made, save, measure):
    # The child stands 5 m along the parent's x; the parent turns 90 degrees about
    # glTF's y (up), which takes x to -z, that is to +y here.
    child = made.node(root=False, mesh=made.mesh(made.primitive), translation=[5, 0, 0])
    made.node(children=[child], rotation=[0, HALF, 0, HALF], name="turned")
    scene = umbra.read(save(made.glb()))
    assert scene.bounds() == pytest.approx(np.array([[-3, 5, 0], [0, 7, 4]]), abs=1e-6)
    assert measure.volume(scene) == pytest.approx(24.0)


def test_matrix_is_read_column_by_column(made, save):
    matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1]
    made.node(mesh=made.mesh(made.primitive), matrix=matrix)
    assert umbra.read(save(made.glb())).bounds()[0].tolist() == [7, -9, 8]


def test_mirrored_node_keeps_its_outside(made, save, measure):
    made.node(mesh=made.mesh(made.primitive), scale=[-1, 1, 1])
    assert measure.volume(umbra.read(save(made.glb()))) == pytest.approx(24.0)


def test_names_fall_back_on_mesh_and_number(made, save):
    made.node(mesh=made.mesh(made.primitive, name="Cube.001"))
    plain = made.primitive | {"material": 1}
    made.node(mesh=made.mesh(plain, {**plain, "material": 0}))
    names = [(p.name, p.kind) for p in umbra.read(save(made.glb())).parts]
    assert names == [("Cube.001", "brick"), ("node 1", "material 1"), ("node 1", "brick")]


def test_buffer_beside_the_file_and_within(made, save, measure):
    made.node(mesh=made.mesh(made.primitive))
    save(made.bytes, "my data.bin")
    scene = umbra.read(save(made.gltf("my%20data.bin"), "m.gltf"))
    assert measure.volume(scene) == pytest.approx(24.0)
    assert [s.name for s in scene.sources] == ["m.gltf", "my data.bin"]
    inside = "data:application/octet-stream;base64," + base64.b64encode(made.bytes).decode()
    assert measure.volume(umbra.read(save(made.gltf(inside), "n.gltf"))) == pytest.approx(24.0)


def test_missing_buffer_is_named(made, save, refuse):
    made.node(mesh=made.mesh(made.primitive))
    facts = {"companion": "lost.bin", "buffer": "lost.bin"}
    said = refuse(umbra.read, save(made.gltf("lost.bin"), "m.gltf"), facts=facts)
    assert "buffer 'lost.bin' is not beside the file" in said


def test_short_buffer_is_named(made, save, refuse):
    made.node(mesh=made.mesh(made.primitive))
    save(made.bytes[:100], "cut.bin")
    facts = {"where": "mesh 0, primitive 0", "bytes": 100}
    said = refuse(umbra.read, save(made.gltf("cut.bin"), "m.gltf"), facts=facts)
    assert "mesh 0, primitive 0 needs bytes" in said
    assert "only 100 are there" in said


def test_strips_and_fans(made, save, measure):
    square = made.accessor(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "f4"))
    strip = {"attributes": {"POSITION": square}, "mode": 5}
    # Two strips joined by triangles that repeat a corner.
    joined = strip | {"indices": made.accessor(np.array([0, 1, 2, 2, 2, 1, 3], "u1"))}
    fan = {
        "attributes": {"POSITION": square},
        "mode": 6,
        "indices": made.accessor(np.array([0, 1, 3, 2], "u1")),
    }
    for primitive in (strip, joined, fan):
        mesh = made.mesh(primitive)
        made.tree["nodes"], made.tree["scenes"] = [], [{"nodes": []}]
        made.node(mesh=mesh)
        scene = umbra.read(save(made.glb()), up="z")
        a, b, c = measure.corners(scene).transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        assert len(a) == 2
        assert (normals[:, 2] == 1).all(), "every triangle faces +z"


def test_lines_and_points_are_noted(made, save):
    made.node(mesh=made.mesh(made.primitive, made.primitive | {"mode": 1}))
    scene = umbra.read(save(made.glb()))
    assert scene.notes == ("m.glb: primitives without triangles (points or lines) left out: 1",)


def test_primitive_without_indices(made, save):
    points = made.accessor(np.arange(18, dtype="f4").reshape(6, 3) ** 2)
    made.node(mesh=made.mesh({"attributes": {"POSITION": points}}))
    assert umbra.read(save(made.glb())).triangles().faces.tolist() == [[0, 1, 2], [3, 4, 5]]


def test_sparse_strided_and_normalized_numbers(made, save, measure):
    tree = made.tree
    # Positions among other numbers: 12 of every 20 bytes.
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    rows = np.concatenate([points, np.full((3, 2), 9, "<f4")], 1)
    view = made.view(rows.tobytes(), byteStride=20)
    tree["accessors"].append(
        {"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC3"}
    )
    strided = len(tree["accessors"]) - 1
    # No bytes of its own: zeros, but for the second and third.
    sparse = {
        "count": 2,
        "indices": {"bufferView": made.view(bytes([1, 2])), "componentType": 5121},
        "values": {"bufferView": made.view(points[1:].tobytes())},
    }
    tree["accessors"].append({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse})
    packed = made.accessor(
        np.array([[0, 0, 0], [32767, 0, 0], [0, 32767, 0]], "i2"), normalized=True
    )
    for accessor in (strided, packed - 1, packed):
        tree["nodes"], tree["scenes"] = [], [{"nodes": []}]
        made.node(mesh=made.mesh({"attributes": {"POSITION": accessor}}))
        corners = measure.corners(umbra.read(save(made.glb()), up="z"))
        assert corners.tolist() == [points.tolist()]


@pytest.mark.parametrize(
    ("change", "facts", "said"),
    [
        (
            lambda t: t["nodes"][0].update(mesh=5),
            {"key": "meshes", "index": 5, "count": 1}, "names meshes[5], but there are 1",
        ),
        (
            lambda t: t["nodes"][0].update(children=[9]),
            {"key": "nodes", "index": 9, "count": 1}, "",
        ),
        (
            lambda t: t["nodes"][0].update(children=[0]),
            {"node": 0}, "node 0 stands in two places",
        ),
        (
            lambda t: t["accessors"][0].update(count=7),
            {"count": 4}, "names vertex 7, but has 7 vertices",
        ),
        (lambda t: t["accessors"][0].update(count=8000), {"needed": 96000, "bytes": 96}, "cut"),
        (lambda t: t["accessors"][0].update(count=-1), {"count": -1}, "not possible"),
        (lambda t: t["accessors"][0].update(componentType=1), {}, "damaged"),
        (lambda t: t["bufferViews"][0].update(byteOffset=-4), {"needed": 92}, "needs bytes -4"),
        (lambda t: t["asset"].update(version="1.0"), {"version": "1.0"}, "is glTF 1.0"),
        (lambda t: t.update(scene=3), {"key": "scenes", "index": 3}, ""),
        (lambda t: t.update(nodes=7), {}, "damaged"),
        (lambda t: t["scenes"][0].update(nodes=[]), {}, "has no triangles"),
    ],
)  # fmt: skip
def test_damage_is_named(made, save, refuse, change, facts, said):
    made.node(mesh=made.mesh(made.primitive))
    change(made.tree)
    assert said in refuse(umbra.read, save(made.glb()), facts=facts)


def test_coordinates_that_are_not_finite_are_counted(made, save):
    points = made.accessor(np.array([[0, 0, 0], [1, 0, np.nan], [0, np.inf, 0]], "f4"))
    made.node(mesh=made.mesh({"attributes": {"POSITION": points}}), name="roof")
    with pytest.raises(InputError, match="'roof' has vertices that are not finite: 2 in all"):
        umbra.read(save(made.glb()))


def test_cut_glb_says_how_long_it_should_be(made, save, refuse):
    made.node(mesh=made.mesh(made.primitive))
    data = made.glb()
    for cut in (4, 10, 30, len(data) // 2, len(data) - 1):
        facts = {"bytes": cut, "needed": 20 if cut < 20 else len(data)}
        assert "cut short" in refuse(umbra.read, save(data[:cut]), facts=facts)


def test_trimesh_writes_what_we_read(save, measure, box):
    import trimesh  # noqa: PLC0415 - slow to import

    vertices, faces = box
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    made = trimesh.Trimesh(vertices, triangles, process=False)
    world = trimesh.Scene()
    world.add_geometry(made, node_name="left", geom_name="box")
    move = trimesh.transformations.translation_matrix([5, 6, 7])
    world.add_geometry(made, node_name="right", geom_name="box", transform=move)
    scene = umbra.read(save(world.export(file_type="glb")), up="z")
    places = {p.name: i for i, p in enumerate(scene.parts)}
    assert set(places) == {"left", "right"}
    assert measure.volume(scene) == pytest.approx(48.0)
    assert measure.corners(scene, [places["right"]]).min((0, 1)).tolist() == [5, 6, 7]


def test_nodes_of_one_name_are_two_things(made, save):
    mesh = made.mesh(made.primitive, {**made.primitive, "material": 1})
    made.node(mesh=mesh, name="Tower")
    made.node(mesh=mesh, name="Tower", translation=[10, 0, 0])
    scene = umbra.read(save(made.glb()))
    assert [part.name for part in scene.parts] == ["Tower", "Tower", "Tower (2)", "Tower (2)"]
    assert scene.groups().tolist() == [0, 0, 1, 1]
    assert scene.select(["Tower"]) == [0, 1, 2, 3]
    assert "m.glb: nodes with a repeated name, numbered: 1" in scene.notes
