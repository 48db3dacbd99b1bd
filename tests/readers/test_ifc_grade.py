"""An IFC's ground is its storey at grade, its site or a slab, not the foot of its foundations."""

import pytest

import umbra

pytest.importorskip("ifcopenshell", reason="ifcopenshell is not installed")

from support.ifc_files import IfcFile


def read(file, tmp_path):
    path = tmp_path / "house.ifc"
    file.write(path)
    return umbra.read(path)


def make_house(prefix="MILLI"):
    """Make a house on foundations that begin at -1.55 m."""
    file = IfcFile(prefix=prefix)
    file.box("IfcFooting", "strip", (10, 8, 1.2), (0, 0, -1.55))
    file.box("IfcSlab", "floor", (10, 8, 0.3), (0, 0, -0.3))
    file.box("IfcWall", "wall", (10, 0.3, 6), (0, 0, 0))
    return file


def place(file, storey, z, elevation):
    storey.Elevation = elevation * file.scale
    storey.ObjectPlacement = file.file.createIfcLocalPlacement(None, file.axes(z=z * file.scale))


@pytest.mark.parametrize("prefix", ["MILLI", None])
def test_the_storey_nearest_zero_is_at_grade(tmp_path, prefix):
    file = make_house(prefix)
    place(file, file.storeys[0], 0.1, 0.0)
    place(file, file.storeys[1], 3.1, 3.0)
    scene = read(file, tmp_path)
    assert scene.ground == pytest.approx(0.1, abs=1e-9)
    assert any("ground floor" in note for note in scene.notes)


def test_a_storey_of_foundations_is_not(tmp_path):
    file = make_house()
    place(file, file.storeys[0], -1.25, -1.25)
    place(file, file.storeys[1], 0.0, 0.0)
    assert read(file, tmp_path).ground == pytest.approx(0.0, abs=1e-9)


def test_the_site_comes_next(tmp_path):
    file = make_house()
    site = file.site()
    site.ObjectPlacement = file.file.createIfcLocalPlacement(None, file.axes(z=-0.4 * file.scale))
    place(file, file.storeys[0], 30.0, 30.0)
    place(file, file.storeys[1], 33.0, 33.0)
    assert read(file, tmp_path).ground == pytest.approx(-0.4, abs=1e-9)


def test_then_a_slab(tmp_path):
    assert read(make_house(), tmp_path).ground == pytest.approx(0.0, abs=1e-9)


def test_a_slab_without_foundations_states_nothing(tmp_path):
    file = IfcFile()
    file.box("IfcSlab", "floor", (10, 8, 0.3), (0, 0, 0))
    file.box("IfcWall", "wall", (10, 0.3, 6), (0, 0, 0.3))
    assert read(file, tmp_path).ground is None


def test_a_site_with_a_body_comes_first(tmp_path):
    file = make_house()
    place(file, file.storeys[0], 0.0, 0.0)
    file.site(size=(40, 40, 0.25))
    assert read(file, tmp_path).ground == pytest.approx(0.25, abs=1e-9)


def test_a_map_moves_it(tmp_path):
    file = make_house()
    place(file, file.storeys[0], 0.0, 0.0)
    file.map_conversion("EPSG:25832", 500000, 5400000, 212.5)
    assert read(file, tmp_path).ground == pytest.approx(212.5, abs=1e-6)


def test_shadows_begin_at_grade(tmp_path):
    file = make_house()
    place(file, file.storeys[0], 0.0, 0.0)
    scene = read(file, tmp_path)
    site = umbra.Site(48.2, 16.37, "Europe/Vienna")
    study = umbra.shadow_study(scene, site, date="2026-03-21", cell=0.5)
    assert study.dataset.attrs["ground_z"] == 0.0
