"""IFC: what a part is called, what is cut, and where the file stands."""

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from support.ifc_files import IfcFile

import umbra
from umbra import InputError
from umbra.sun import find_site

VIENNA = (48, 12, 30), (16, 22, 15)
VIENNA_DEGREES = 48 + 12 / 60 + 30 / 3600, 16 + 22 / 60 + 15 / 3600


@pytest.fixture(params=["IFC2X3", "IFC4", "IFC4X3"])
def schema(request):
    return request.param


def names(scene, pattern):
    return sorted({scene.parts[i].name for i in scene.select([pattern])})


def test_a_wall_is_in_metres_with_its_storey_type_and_material(tmp_path, schema, measure):
    model = IfcFile(schema)
    wall = model.box("IfcWall", "north wall", (4, 0.5, 3), at=(10, 20, 1), ObjectType="thick")
    model.material(wall, "brick")
    model.box("IfcSlab", "Dach", (4, 4, 0.25), storey=1)
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert [(part.name, part.kind) for part in scene.parts] == [
        ("north wall", "IfcWall"),
        ("Dach", "IfcSlab"),
    ]
    first = scene.triangles([0])
    np.testing.assert_allclose(first.vertices[first.faces].min((0, 1)), [10, 20, 1], atol=1e-9)
    assert measure.volume(scene, [0]) == pytest.approx(6)
    assert measure.open_edges(scene) == []
    for pattern in ("IfcWall", "brick", "thick", "ground*", wall.GlobalId, "north*"):
        assert names(scene, pattern) == ["north wall"], pattern
    for pattern in ("attic", "*Dach*", "IfcSlab"):
        assert names(scene, pattern) == ["Dach"], pattern
    assert scene.sources[0].format == f"IFC ({schema})"
    assert scene.notes == ()


def test_openings_are_cut_and_they_and_rooms_cast_nothing(tmp_path, measure):
    model = IfcFile()
    wall = model.box("IfcWall", "wall", (4, 0.5, 3))
    model.opening(wall, (1, 0.5, 1), at=(1, 0, 1))
    model.box("IfcSpace", "room", (4, 4, 3), storey=None)
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert {part.kind for part in scene.parts} == {"IfcWall"}
    assert measure.volume(scene) == pytest.approx(4 * 0.5 * 3 - 0.5)
    assert measure.open_edges(scene) == []


def test_rooms_of_two_flats_that_are_called_alike_are_two(tmp_path, schema):
    model = IfcFile(schema)
    spaces = [("A102", "Living"), ("B102", "Living"), ("A103", "Kitchen"), ("Bath", None)]
    spaces += [("Bed", None), ("Bed", None)]
    ends = []
    for k, (number, name) in enumerate(spaces):
        space = model.root("IfcSpace", number, LongName=name)
        window = model.box("IfcWindow", f"w{k}", (1, 0.1, 1), at=(2 * k, 0, 0))
        model.root("IfcRelSpaceBoundary", None, RelatingSpace=space, RelatedBuildingElement=window)
        ends.append(space.GlobalId)
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    rooms = [tag[6:] for part in scene.parts for tag in part.tags if tag.startswith("space=")]
    assert rooms == ["Living (A102)", "Living (B102)", "Kitchen", "Bath", f"Bed ({ends[4]})",
                     f"Bed ({ends[5]})"]  # fmt: skip


def test_a_curtain_wall_is_one_thing_with_its_pieces(tmp_path):
    model = IfcFile()
    whole = model.root("IfcCurtainWall", "facade")
    plate = model.box("IfcPlate", "pane", (1, 0.1, 3), storey=None)
    mullion = model.box("IfcMember", "mullion", (0.1, 0.1, 3), at=(1, 0, 0), storey=None)
    model.aggregate(whole, [plate, mullion])
    model.root(
        "IfcRelContainedInSpatialStructure",
        None,
        RelatingStructure=model.storeys[1],
        RelatedElements=[whole],
    )
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert [(part.name, part.kind) for part in scene.parts] == [("facade", "IfcCurtainWall")] * 2
    assert len(scene.select(["attic"])) == 2
    assert len(scene.select(["pane"])) == len(scene.select(["IfcMember"])) == 1


def test_a_building_that_is_a_piece_of_itself_does_not_end_the_reading(tmp_path):
    model = IfcFile()
    model.aggregate(model.storeys[0], [model.storeys[0]])
    model.box("IfcWall", "wall", (4, 0.5, 3), storey=0)
    model.storeys[0] = model.root("IfcBuilding", "ring", CompositionType="ELEMENT")
    model.aggregate(model.storeys[0], [model.storeys[0]])
    model.box("IfcSlab", "roof", (4, 4, 0.2), storey=0)
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert {part.name for part in scene.parts} == {"wall", "roof"}


def test_a_name_that_comes_twice_gets_its_number(tmp_path):
    model = IfcFile()
    one, two = (model.box("IfcWall", "wall", (1, 1, 1), at=(3 * i, 0, 0)) for i in range(2))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert {part.name for part in scene.parts} == {f"wall {w.GlobalId}" for w in (one, two)}
    assert len(scene.select(["wall"])) == 2


def test_standard_walls_are_walls(tmp_path):
    model = IfcFile("IFC2X3")
    model.box("IfcWallStandardCase", "wall", (1, 1, 1))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert len(scene.select(["IfcWall"])) == 1


def test_styles_give_colour_name_and_opacity(tmp_path, schema):
    model = IfcFile(schema)
    model.box("IfcWindow", "pane", (1, 0.1, 1), color=(1.0, 0.5, 0.0), style="glass")
    (part,) = umbra.read(model.write(tmp_path / "a.ifc")).parts
    # 0.5 in sRGB is 0.214 of the light.
    np.testing.assert_allclose(part.color, [1, 0.2140, 0], atol=1e-4)
    assert part.material.opacity == pytest.approx(0.5)
    assert part.matches("glass")


def test_the_site_says_where_it_is(tmp_path, schema):
    # True north lies 30° clockwise from y: its direction is (sin 30°, cos 30°).
    model = IfcFile(schema, true_north=(0.5, 0.75**0.5))
    model.site("site", *VIENNA, elevation=171000.0)
    model.box("IfcWall", "wall", (1, 1, 1))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert (scene.latitude, scene.longitude) == pytest.approx(VIENNA_DEGREES)
    assert scene.elevation == pytest.approx(171)
    assert scene.true_north == pytest.approx(30)
    assert scene.crs is None


def test_the_south_and_millionths_of_seconds_count(tmp_path):
    model = IfcFile()
    model.site("site", (-33, -51, -24, -500000), (151, 12, 54, 0))
    model.box("IfcWall", "wall", (1, 1, 1))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.latitude == pytest.approx(-(33 + 51 / 60 + 24.5 / 3600), abs=1e-12)


def test_the_level_top_of_the_site_is_the_ground(tmp_path):
    model = IfcFile()
    model.site("site", *VIENNA, size=(20, 20, 0.5))
    model.box("IfcWall", "wall", (1, 1, 3), at=(5, 5, 0.5))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.ground == pytest.approx(0.5)
    assert any("ground=" in note for note in scene.notes)


def test_without_a_site_the_options_are_named(tmp_path):
    model = IfcFile()
    model.box("IfcWall", "wall", (1, 1, 1))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert (scene.latitude, scene.longitude) == (None, None)
    with pytest.raises(InputError, match="latitude= and longitude="):
        find_site(scene)


def test_sites_that_disagree_are_named_and_none_is_taken(tmp_path):
    model = IfcFile()
    model.site("here", *VIENNA)
    model.site("there", (52, 31, 0), (13, 24, 0))
    model.box("IfcWall", "wall", (1, 1, 1))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.latitude is None
    (note,) = scene.notes
    assert "2 sites disagree" in note
    assert "'there' at 52.5167°" in note
    assert "latitude=" in note


def test_a_site_at_zero_zero_says_nothing(tmp_path):
    model = IfcFile()
    model.site("site", (0, 0, 0), (0, 0, 0))
    model.box("IfcWall", "wall", (1, 1, 1))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.latitude is None
    assert "left out" in scene.notes[0]


def test_the_map_conversion_brings_the_house_onto_the_map(tmp_path):
    # The plan's x axis points to the map's north: (x, y) goes to (-y, x).
    model = IfcFile(true_north=(1.0, 0.0))
    model.site("site", *VIENNA)
    model.map_conversion("EPSG:31256", 2500, 340500, 170, along=0.0, across=1.0, scale=0.001)
    model.box("IfcWall", "wall", (4, 0.5, 3))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    np.testing.assert_allclose(
        scene.bounds(), [[2499.5, 340500, 170], [2500, 340504, 173]], atol=1e-6
    )
    assert scene.crs == "EPSG:31256"
    assert scene.latitude == pytest.approx(48.2, abs=0.05)
    # The map's y axis is its own meridian's north, here to some hundredths of a degree.
    assert scene.true_north == pytest.approx(0, abs=0.1)
    assert scene.notes == ()


def test_a_scale_that_forgets_millimetres_is_noticed(tmp_path):
    model = IfcFile()
    model.map_conversion("EPSG:31256", 2500, 340500)
    model.box("IfcWall", "wall", (4, 0.5, 3))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.bounds()[1] == pytest.approx([2504, 340500.5, 3])
    assert "1 is taken instead" in scene.notes[0]


def test_a_map_conversion_of_ifc2x3_is_a_property_set(tmp_path):
    model = IfcFile("IFC2X3")
    site = model.site("site", *VIENNA)
    model.property_set(
        site, "ePset_MapConversion", Eastings=2500.0, Northings=340500.0, Scale=0.001
    )
    model.property_set(site, "ePset_ProjectedCRS", Name="EPSG:31256", MapUnit="METRE")
    model.box("IfcWall", "wall", (4, 0.5, 3))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.crs == "EPSG:31256"
    assert scene.bounds()[1] == pytest.approx([2504, 340500.5, 3])


def test_an_unknown_map_leaves_the_house_where_it_is(tmp_path):
    model = IfcFile()
    model.site("site", *VIENNA)
    model.map_conversion("the surveyor's own grid", 2500, 340500)
    model.box("IfcWall", "wall", (4, 0.5, 3))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.crs is None
    assert scene.bounds()[1] == pytest.approx([4, 0.5, 3])
    assert scene.latitude == pytest.approx(VIENNA_DEGREES[0])
    assert "the surveyor's own grid" in scene.notes[0]


def test_a_site_far_from_its_map_is_said(tmp_path):
    model = IfcFile()
    model.site("site", (42, 21, 0), (-71, -3, 0))
    model.map_conversion("EPSG:31256", 2500, 340500, scale=0.001)
    model.box("IfcWall", "wall", (4, 0.5, 3))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.latitude == pytest.approx(48.2, abs=0.05)
    assert "its site says 42.3500°" in scene.notes[0]


def test_elements_without_a_shape_are_counted(tmp_path):
    model = IfcFile()
    model.box("IfcWall", "wall", (1, 1, 1))
    model.box("IfcWall", "flat", (1, 1, 0))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.notes == (
        "a.ifc: elements without a usable shape left out: 1 (first: IfcWall 'flat')",
    )


def test_an_opening_that_is_not_there_is_counted(tmp_path, measure):
    model = IfcFile()
    wall = model.box("IfcWall", "wall", (4, 0.5, 3))
    model.opening(wall, (1, 0.5, 1), at=(1, 0, 1))
    (hole,) = model.file.by_type("IfcOpeningElement")
    path = model.write(tmp_path / "a.ifc")
    text = path.read_text().replace(f"#{hole.id()}=", "#999999=")
    path.write_text(text)
    scene = umbra.read(path)
    assert measure.volume(scene) == pytest.approx(6)
    assert "openings left out that are missing from the file: 1" in " ".join(scene.notes)


def test_lines_that_are_not_understood_are_counted(tmp_path):
    model = IfcFile()
    model.box("IfcWall", "wall", (1, 1, 1))
    model.box("IfcWall", "broken", (1, 1, 1))
    path = model.write(tmp_path / "a.ifc")
    head, tail = path.read_text().rsplit("IFCWALL(", 1)
    path.write_text(f"{head}IFCWELL({tail}")
    scene = umbra.read(path)
    assert [part.name for part in scene.parts] == ["wall"]
    assert "errors in the file: 2 (first: Entity with name 'IFCWELL'" in scene.notes[0]


def test_damage_is_said(tmp_path):
    model = IfcFile()
    model.box("IfcWall", "wall", (1, 1, 1))
    path = model.write(tmp_path / "a.ifc")
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match="ends too early"):
        umbra.read(path)
    path.write_bytes(b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n")
    with pytest.raises(InputError, match=r"a\.ifc: "):
        umbra.read(path)
    empty = IfcFile()
    with pytest.raises(InputError, match="has no triangles"):
        umbra.read(empty.write(tmp_path / "empty.ifc"))


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    model = IfcFile()
    model.box("IfcWall", "wall", (1, 1, 1))
    path = model.write(tmp_path / "a.ifc")
    monkeypatch.setitem(__import__("sys").modules, "ifcopenshell", None)
    with pytest.raises(InputError, match=r"pip install .*\[ifc\]"):
        umbra.read(path)


@pytest.mark.parametrize("number", [1, 28, 54, 567, 767, 150630])
def test_a_line_of_the_fzk_house_given_twice_is_refused(real_file, tmp_path, number):
    text = real_file("fzk_haus.ifc").read_bytes()
    at = text.index(b"\n#%d=" % number) + 1
    end = text.index(b"\n", at) + 1
    path = tmp_path / "twice.ifc"
    path.write_bytes(text[:end] + text[at:end] + text[end:])
    with pytest.raises(InputError, match=f"first: #{number}") as caught:
        umbra.read(path)
    assert "\n" not in str(caught.value)


def test_the_fzk_house(real_file):
    scene = umbra.read(real_file("fzk_haus.ifc"))
    kinds = {part.kind: 0 for part in scene.parts}
    for name, kind in {(part.name, part.kind) for part in scene.parts}:
        kinds[kind] += name != ""
    assert kinds == {
        "IfcBeam": 51,
        "IfcColumn": 1,
        "IfcDoor": 5,
        "IfcFurnishingElement": 21,
        "IfcRailing": 2,
        "IfcSite": 1,
        "IfcSlab": 4,
        "IfcStair": 1,
        "IfcWallStandardCase": 13,
        "IfcWindow": 11,
    }
    assert (scene.latitude, scene.longitude) == pytest.approx((52 + 31 / 60, 13.4))
    assert scene.true_north == 0
    assert scene.ground == pytest.approx(0)
    assert names(scene, "*Dach*") != []
    assert names(scene, "ROOF") == ["Dach-1", "Dach-2"]
    # 12 by 10 m, and 50 cm of eaves all round.
    walls = scene.triangles(scene.select(["IfcWall"]))
    np.testing.assert_allclose(
        np.ptp(walls.vertices[walls.faces].reshape(-1, 3), axis=0)[:2], [12, 10], atol=1e-6
    )


@pytest.mark.parametrize("count", [1, 3])
def test_numbers_that_come_twice_are_refused(tmp_path, count):
    path = IfcFile().write(tmp_path / "a.ifc")
    lines = path.read_bytes().split(b"\n")
    first = next(n for n, line in enumerate(lines) if line.startswith(b"#5="))
    lines[first + count : first + count] = lines[first : first + count]
    path.write_bytes(b"\n".join(lines))
    with pytest.raises(InputError, match=f"more than once: {count}, first: #5"):
        umbra.read(path)


def rename_schema(path, name):
    text = path.read_text()
    path.write_text(re.sub(r"FILE_SCHEMA\(\('[^']*'\)\)", f"FILE_SCHEMA(('{name}'))", text))
    return path


@pytest.mark.parametrize(
    ("made", "said", "is_noted"),
    [
        ("IFC4X3", "IFC4X3", False),
        ("IFC4X3", "IFC4X3_ADD1", False),
        ("IFC4X3", "Ifc4x3_add2", False),
        ("IFC4X3", "IFC4X3_RC2", True),
        ("IFC4X3", "IFC4X3_RC4", True),
        ("IFC4X3", "IFC4X1", True),
        ("IFC4", "IFC4_ADD2_TC1", False),
        ("IFC2X3", "IFC2X3_TC1", False),
    ],
)
def test_every_edition_of_a_schema_is_read(tmp_path, made, said, is_noted):
    model = IfcFile(made)
    model.box("IfcWall", "Außenwand", (4, 0.5, 3))
    scene = umbra.read(rename_schema(model.write(tmp_path / "a.ifc"), said))
    assert [part.name for part in scene.parts] == ["Außenwand"]
    assert scene.sources[0].format == f"IFC ({made})"
    assert [f"its schema {said} is a draft" in note for note in scene.notes] == [True] * is_noted


@pytest.mark.parametrize(
    ("said", "what"),
    [
        ("AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }", "but not IFC, of the schema 'AUTOMOTIVE_"),
        ("IFC2X2_FINAL", "IFC of the schema 'IFC2X2_FINAL', which is not read; export it as IFC4"),
        ("", "schema ''"),
    ],
)
def test_another_schema_is_named(tmp_path, said, what):
    path = IfcFile().write(tmp_path / "a.ifc")
    with pytest.raises(InputError) as caught:
        umbra.read(rename_schema(path, said))
    assert what in str(caught.value)


def test_another_schema_is_named_in_a_file_that_breaks_off(tmp_path):
    path = rename_schema(IfcFile().write(tmp_path / "a.ifc"), "AUTOMOTIVE_DESIGN")
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(InputError, match="not IFC, of the schema 'AUTOMOTIVE_DESIGN'"):
        umbra.read(path)


def test_an_opening_of_the_wrong_class_is_left_out(tmp_path, measure):
    model = IfcFile()
    wall = model.box("IfcWall", "wall", (4, 0.5, 3))
    other = model.box("IfcWall", "other", (1, 1, 1), at=(9, 0, 0))
    model.opening(wall, (1, 0.5, 1), at=(1, 0, 1))
    path = model.write(tmp_path / "a.ifc")
    # A file of this kind cannot be made by the package, which checks; it is made by hand.
    for wrong in (other, model.project, model.storeys[0]):
        text = path.read_text()
        broken = re.sub(r"(IFCRELVOIDSELEMENT\(.*),#\d+\);", rf"\1,#{wrong.id()});", text)
        assert broken != text
        (tmp_path / "b.ifc").write_text(broken)
        scene = umbra.read(tmp_path / "b.ifc")
        assert measure.volume(scene) == pytest.approx(6 + 1)
        assert scene.notes == ("b.ifc: openings left out that are missing from the file: 1",)


def test_an_opening_in_what_is_no_element_is_left_out(tmp_path, measure):
    model = IfcFile()
    wall = model.box("IfcWall", "wall", (4, 0.5, 3))
    model.opening(wall, (1, 0.5, 1), at=(1, 0, 1))
    text = model.write(tmp_path / "a.ifc").read_text()
    for wrong in (model.project, model.storeys[0]):
        relation = r"(IFCRELVOIDSELEMENT\(.*),#\d+,(#\d+)\);"
        broken = re.sub(relation, rf"\1,#{wrong.id()},\2);", text)
        assert broken != text
        (tmp_path / "b.ifc").write_text(broken)
        scene = umbra.read(tmp_path / "b.ifc")
        assert measure.volume(scene) == pytest.approx(6)
        assert scene.notes == ("b.ifc: openings left out that are missing from the file: 1",)


def write_trap(tmp_path, *, hangs):
    """Write two sound walls about one at which the engine ends, or never comes back."""
    model = IfcFile()
    model.box("IfcWall", "first", (1, 1, 1))
    wall = model.box("IfcWall", "trap", (4, 0.5, 3), at=(5, 0, 0))
    model.opening(wall, (1, 0.5, 1), at=(7, 0, 1))
    model.box("IfcWall", "last", (2, 1, 1), at=(20, 0, 0))
    path = model.write(tmp_path / "trap.ifc")
    text = path.read_text()
    if hangs:
        number = wall.ObjectPlacement.RelativePlacement.Location.id()
        begin = f"#{number}=IFCCARTESIANPOINT(("
        trap = text.replace(f"{begin}0.,", f"{begin}-inf,")
    else:  # a placement that is relative to itself
        begin = f"#{wall.ObjectPlacement.id()}="
        trap = text.replace(f"{begin}IFCLOCALPLACEMENT($", f"{begin}IFCLOCALPLACEMENT({begin[:-1]}")
    assert trap != text
    path.write_text(trap)
    return path


@pytest.mark.usefixtures("children")
@pytest.mark.parametrize(("hangs", "why"), [(False, "engine crashed"), (True, "too long")])
def test_what_ends_or_hangs_the_engine_is_named_and_the_rest_is_read(
    tmp_path, measure, monkeypatch, hangs, why
):
    monkeypatch.setattr("umbra.readers.ifc.SECONDS", 1.0)
    scene = umbra.read(write_trap(tmp_path, hangs=hangs))
    assert [part.name for part in scene.parts] == ["first", "last"]
    assert measure.volume(scene) == pytest.approx(1 + 2)
    (note,) = scene.notes
    assert why in note
    assert ": 1 (first: IfcWall 'trap')" in note


@pytest.mark.usefixtures("children")
def test_elements_after_too_many_losses_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr("umbra.readers.ifc.SECONDS", 1.0)
    monkeypatch.setattr("umbra.readers.ifc.LOSSES", 1)
    scene = umbra.read(write_trap(tmp_path, hangs=True))
    assert [part.name for part in scene.parts] == ["first"]
    assert len(scene.notes) == 2
    assert "not read after those: 1 (first: IfcWall 'last')" in scene.notes[1]


@pytest.mark.skipif(not hasattr(signal, "SIGPROF"), reason="Windows sends no SIGINT to one process")
def test_ctrl_c_ends_a_hanging_engine(tmp_path):
    path = write_trap(tmp_path, hangs=True)
    code = f"import umbra; print(1, flush=True); umbra.read({str(path)!r})"
    with subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    ) as reading:  # fmt: skip
        reading.stdout.readline()
        children = Path(f"/proc/{reading.pid}/task/{reading.pid}/children")
        while children.parent.exists() and not children.read_text():
            time.sleep(0.05)
        time.sleep(1)  # until the engine is at work; earlier, Ctrl-C ends it as well
        reading.send_signal(signal.SIGINT)
        _, said = reading.communicate(timeout=60)
    assert b"KeyboardInterrupt" in said


def test_a_map_in_feet_becomes_metres(tmp_path):
    model = IfcFile()
    # New York's plane in US survey feet; a project in millimetres, a map in feet.
    model.map_conversion("EPSG:2263", 981000, 196000, 10)
    (conversion,) = model.file.by_type("IfcMapConversion")
    foot = model.file.createIfcConversionBasedUnit(
        model.file.createIfcDimensionalExponents(1, 0, 0, 0, 0, 0, 0),
        "LENGTHUNIT",
        "US SURVEY FOOT",
        model.file.createIfcMeasureWithUnit(
            model.file.create_entity("IfcLengthMeasure", 1200 / 3937),
            model.file.createIfcSIUnit(None, "LENGTHUNIT", None, "METRE"),
        ),
    )
    conversion.TargetCRS.MapUnit = foot
    conversion.Scale = 0.001 * 3937 / 1200
    model.box("IfcWall", "wall", (4, 0.5, 3))
    scene = umbra.read(model.write(tmp_path / "a.ifc"))
    assert scene.crs == "EPSG:26918"  # NAD83 / UTM zone 18N
    assert (scene.latitude, scene.longitude) == pytest.approx((40.70465, -74.0117), abs=1e-4)
    # A metre of the wall is one, but for the zone's scale; feet of height are metres now.
    low, high = scene.bounds()
    assert np.ptp([low, high], axis=0) == pytest.approx([4, 0.5, 3], abs=0.05)
    assert low[2] == pytest.approx(10 * 1200 / 3937)
