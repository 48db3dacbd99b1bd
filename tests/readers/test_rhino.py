"""Rhino's 3DM: meshes, blocks in blocks, layers, units, and what is hidden."""

import numpy as np
import pytest

import umbra
from umbra import InputError

rhino = pytest.importorskip("rhino3dm", reason="rhino3dm is not installed")


def plate(width=1.0):
    mesh = rhino.Mesh()
    for x, y in ((0, 0), (width, 0), (width, 1), (0, 1)):
        mesh.Vertices.Add(x, y, 0)
    mesh.Faces.AddFace(0, 1, 2, 3)
    return mesh


@pytest.fixture
def file():
    file = rhino.File3dm()
    file.Settings.ModelUnitSystem = rhino.UnitSystem.Millimeters
    for name, color, is_shown in (
        ("walls", (255, 0, 0, 255), True),
        ("notes", (0, 0, 0, 255), False),
    ):
        layer = rhino.Layer()
        layer.Name, layer.Color, layer.Visible = name, color, is_shown
        file.Layers.Add(layer)
    return file


def told(name="", layer=0, *, shown=True):
    attributes = rhino.ObjectAttributes()
    attributes.Name, attributes.LayerIndex, attributes.Visible = name, layer, shown
    return attributes


@pytest.fixture
def read(tmp_path):
    def write_and_read(file, **options):
        path = tmp_path / "house.3dm"
        assert file.Write(str(path), 7)
        return umbra.read(path, **options)

    return write_and_read


def test_layers_are_kinds_and_units_metres(file, read):
    file.Objects.AddMesh(plate(3000), told("slab"))
    scene = read(file)
    (part,) = scene.parts
    assert (scene.sources[0].format, part.name, part.kind) == ("Rhino 3DM", "slab", "walls")
    assert part.triangles == 2
    assert part.material.color == (1, 0, 0)
    assert scene.bounds()[1] == pytest.approx([3, 0.001, 0])


def test_what_is_hidden_or_no_surface_is_counted(file, read):
    file.Objects.AddMesh(plate(), told("shown"))
    file.Objects.AddMesh(plate(), told("off", shown=False))
    file.Objects.AddMesh(plate(), told("on a layer that is off", 1))
    file.Objects.AddLine(rhino.Point3d(0, 0, 0), rhino.Point3d(1, 0, 0))
    scene = read(file)
    assert [part.name for part in scene.parts] == ["shown"]
    said = " ".join(scene.notes)
    assert "hidden objects left out: 2 (first: 'off')" in said
    assert "curves, points and texts left out: 1" in said


def test_blocks_in_blocks_are_placed_and_share_their_mesh(file, read):
    inner = file.InstanceDefinitions.Add(
        "chair", "", "", "", rhino.Point3d(0, 0, 0), (plate(),), (told("seat"),)
    )
    move = rhino.Transform.Translation(rhino.Vector3d(0, 0, 10))
    chair = rhino.InstanceReference(file.InstanceDefinitions[inner].Id, move)
    outer = file.InstanceDefinitions.Add(
        "row", "", "", "", rhino.Point3d(0, 0, 0), (chair,), (told(),)
    )
    for x in (0, 100):
        form = rhino.Transform.Translation(rhino.Vector3d(x, 0, 0))
        file.Objects.AddInstanceObject(
            rhino.InstanceReference(file.InstanceDefinitions[outer].Id, form)
        )
    scene = read(file)
    assert [part.name for part in scene.parts] == ["seat", "seat (2)"]
    assert scene.parts[0].mesh.vertices is scene.parts[1].mesh.vertices
    boxes = [part.bounds + scene.origin for part in scene.parts]
    assert boxes[1] - boxes[0] == pytest.approx(np.array([[0.1, 0, 0]] * 2))
    assert boxes[0][0] == pytest.approx([0, 0, 0.01])


def test_a_body_without_a_render_mesh_says_what_to_do(file, read):
    file.Objects.AddMesh(plate(), told("shown"))
    file.Objects.AddBrep(
        rhino.Brep.CreateFromSphere(rhino.Sphere(rhino.Point3d(0, 0, 0), 5)), told("ball")
    )
    said = " ".join(read(file).notes)
    assert "no render mesh (shade a view and save again): 1 (first: 'ball')" in said


def test_a_file_that_breaks_off_is_damaged(file, read, tmp_path):
    path = tmp_path / "cut.3dm"
    path.write_bytes(b"3D Geometry File Format " + b" " * 7 + b"7" + bytes(300))
    with pytest.raises(InputError, match="3DM"):
        umbra.read(path)


@pytest.mark.usefixtures("children")
def test_a_parser_that_never_ends_is_ended(file, read, monkeypatch):
    file.Objects.AddMesh(plate(), told("shown"))
    monkeypatch.setattr("umbra.readers.rhino.SECONDS", 0.01)
    with pytest.raises(InputError, match="does not end") as caught:
        read(file)
    assert caught.value.has_hung


@pytest.mark.parametrize("height", [4, -4])
def test_an_extrusion_that_was_never_shaded_is_a_closed_body(file, read, height):
    corners = [(0, 0), (6000, 0), (6000, 3000), (2000, 1000), (0, 3000), (0, 0)]
    ring = rhino.PolylineCurve(rhino.Point3dList([rhino.Point3d(x, y, 0) for x, y in corners]))
    file.Objects.AddExtrusion(rhino.Extrusion.Create(ring, 1000 * height, True), told("tower"))
    (part,) = read(file).parts
    a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] / 1000 for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert abs(volume) == pytest.approx(4 * 12)
    edges = np.concatenate([part.mesh.faces[:, [k, (k + 1) % 3]] for k in range(3)])
    assert {tuple(edge) for edge in edges} == {tuple(edge) for edge in edges[:, ::-1]}
