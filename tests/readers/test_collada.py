"""COLLADA: nodes, units, axes, instances, archives, and what is refused."""

import zipfile

import numpy as np
import pytest
from support.dae_files import document

import umbra
from umbra import InputError

pytest.importorskip("collada", reason="pycollada is not installed")


@pytest.fixture
def read(tmp_path):
    def from_text(text, name="model.dae", **options):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return umbra.read(path, **options)

    return from_text


def test_nodes_become_parts_with_materials_and_share_their_mesh(read):
    scene = read(document())
    assert scene.sources[0].format == "COLLADA"
    assert [(part.name, part.kind, part.triangles) for part in scene.parts] == [
        ("one", "brick", 3), ("shared", "brick", 3)
    ]  # fmt: skip
    assert scene.parts[0].mesh.vertices is scene.parts[1].mesh.vertices
    assert scene.parts[0].material.color == (0.5, 0.25, 0.125)
    assert scene.parts[1].bounds + scene.origin == pytest.approx(
        np.array([[0, 0, 7], [8, 6, 7]], float)
    )
    soup = scene.parts[0].mesh
    a, b, c = (soup.vertices[soup.faces[:, k]] for k in range(3))
    assert np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(12 - 1.5)  # a concave polygon
    assert any("lines left out: 1 (first: 'plate')" in note for note in scene.notes)


@pytest.mark.parametrize(
    ("up", "high"), [("Z_UP", (8, 6, 7)), ("Y_UP", (8, 0, 6)), ("X_UP", (6, 7, 8))]
)
def test_units_and_the_up_axis_are_the_files(read, up, high):
    scene = read(document(unit="0.0254", up=up))
    assert scene.bounds()[1] / 0.0254 == pytest.approx(high, abs=1e-6)
    assert read(document(up=up), up="z").bounds()[1] == pytest.approx((8, 6, 7))


@pytest.mark.parametrize("name", ["model.zae", "model.kmz"])
def test_archives_are_read_and_kmz_says_where(read, tmp_path, name):
    path = tmp_path / name
    kml = (
        '<?xml version="1.0"?><kml><Model><Location><longitude>16.4</longitude><latitude>48.2'
        "</latitude><altitude>170</altitude></Location><Orientation><heading>30</heading>"
        "</Orientation></Model></kml>"
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("files/model.dae", document())
        if name.endswith("kmz"):
            archive.writestr("doc.kml", kml)
    scene = umbra.read(path)
    assert sum(part.triangles for part in scene.parts) == 6
    if name.endswith("kmz"):
        assert (scene.latitude, scene.longitude, scene.true_north) == (48.2, 16.4, 330)


def test_an_archive_that_grows_too_much_is_refused(tmp_path):
    path = tmp_path / "bomb.zae"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("model.dae", document() + " " * 70_000_000)
    with pytest.raises(InputError, match="unpacked data"):
        umbra.read(path)


def test_entities_and_what_is_damaged_are_refused(read):
    with pytest.raises(InputError, match="document type"):
        read(document(head='<!DOCTYPE x [<!ENTITY e SYSTEM "/etc/passwd">]>'))
    with pytest.raises(InputError, match=r"has no triangles .pieces left out"):
        read(document(last="9"))
    with pytest.raises(InputError, match=r"is damaged COLLADA .XML Parsing"):
        read(document()[:-40])


def test_nodes_that_multiply_are_refused(read):
    """Twenty levels, each of which shows the next ten times."""
    levels = [f'<node id="n{k}">' + f'<instance_node url="#n{k + 1}"/>' * 10 + "</node>"
              for k in range(20)]  # fmt: skip
    nested = "".join(reversed(levels)).replace("#n20", "#shared")
    text = document(nodes='<node id="top"><instance_node url="#n0"/></node>')
    text = text.replace("</library_nodes>", f"{nested}</library_nodes>")
    with pytest.raises(InputError, match=r"memory|nests more|no triangles"):
        read(text)
