"""Files of drawings: SVG and PDF, their layers, colours and words."""

import re
import sys
import xml.etree.ElementTree as ET
import zlib
from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.drawing.drawn_page import list_losses
from umbra.scene import Material, Part, Scene
from umbra.scene.material import Image
from umbra.scene.mesh import Mesh

SVG = "{http://www.w3.org/2000/svg}"
LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
SUN = umbra.directional_light((-1, -1, 1))
PAINT = Material((0.6, 0.3, 0.2))
GLASS = Material((0.5, 0.6, 0.7), opacity=0.25)


@pytest.fixture
def scene():
    parts = (
        Part("tower & <co>", "Building", Mesh(*box((0, 0, 0), (2, 2, 6))), material=PAINT),
        Part("pane", "Window", Mesh(*box((-3, -6, 0), (5, -5.9, 3))), material=GLASS),
    )
    return Scene(parts, np.zeros(3))


@pytest.fixture
def camera(scene):
    return umbra.make_camera(scene, eye=(-6, -20, 9), target=(1, 1, 1), size=(200, 150))


def layers(text):
    tree = ET.fromstring(text)
    return {one.get(LABEL): one for one in tree.iter(f"{SVG}g") if one.get(LABEL)}


def test_svg_has_layers_and_parts_by_name(scene, camera):
    with pytest.warns(UserWarning, match="leave out light through transparent parts of 1 part"):
        drawing = umbra.draw_vectors(scene, camera, SUN, ground=0, caption="a & b")
    text = drawing._repr_svg_()
    found = layers(text)
    assert {"Sky", "Faces", "Shadows", "Transparent", "Lines", "Caption"} <= set(found)
    assert {"tower & <co>", "ground", "pane"} <= set(found)
    assert [one.get(LABEL) for one in found["Transparent"]] == ["pane"]
    assert {one.get("fill-opacity") for one in found["Transparent"].iter(f"{SVG}path")} == {"0.25"}
    assert found["Caption"].find(f"{SVG}text").text == "a & b"
    assert "a perspective view has no scale" in text
    numbers = np.array(re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", text), float)
    assert (numbers >= 0).all()
    assert (numbers <= (200, 150)).all()


def test_a_shadow_on_the_ground_is_where_it_is_by_hand():
    # From straight above, 10 pixels a metre: a roof of 2 x 2 m, 1 m up; the sun moves its
    # shadow by 1 m to +x, so half of it shows.
    corners = np.array([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], float)
    faces = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    roof = Scene((Part("roof", "", Mesh(corners, faces)),), np.zeros(3))
    above = umbra.Camera((0, 0, 9), (0, 0, 0), (0, 1, 0), (100, 100), height=10)
    drawing = umbra.draw_vectors(roof, above, umbra.directional_light((-1, 0, 1)), ground=0)
    (ground,) = [one for one in drawing.page.parts if one.name == "ground"]
    (shadow,) = ground.shadows
    (ring,) = shadow.rings
    assert {tuple(spot) for spot in ring.tolist()} == {(60, 40), (70, 40), (70, 60), (60, 60)}
    assert "the scale is 1:377.953" in drawing.page.about  # a pixel of 0.1 m, 96 to the inch


def test_colours_are_those_of_the_picture(scene, camera):
    solid = Scene(scene.parts[:1], scene.origin)
    drawing = umbra.draw_vectors(solid, camera, SUN, ground=0, style="plain")
    image = umbra.render(solid, camera, SUN, ground=0, style="plain", samples=1)
    shown = {one.color for part in drawing.page.parts for one in [*part.faces, *part.shadows]}
    drawn = {tuple(rgb) for rgb in np.unique(image.reshape(-1, 3), axis=0).tolist()}
    assert all(min(np.abs(np.subtract(rgb, one)).max() for one in drawn) <= 1 for rgb in shown)


def test_two_lights_are_hatched_in_two_directions(scene, camera):
    lights = [SUN, umbra.directional_light((1, -1, 1))]
    drawing = umbra.draw_vectors(
        scene, camera, lights, shadows="hatched", ground=0, style="architectural"
    )
    text = drawing._repr_svg_()
    assert 'id="hatch1"' in text
    assert "url(#hatch0)" in text
    assert "url(#hatch1)" in text
    masks = {mask for one in drawing.seen.surfaces for mask, _ in one.shadows}
    assert {(True, False), (False, True)} <= masks


@pytest.mark.parametrize("ending", ["svg", "pdf"])
def test_the_same_drawing_gives_the_same_bytes(scene, camera, tmp_path, ending):
    for name in "ab":
        drawing = umbra.draw_vectors(scene, camera, SUN, caption="21 March · 48° (N)")
        drawing.write(tmp_path / f"{name}.{ending}")
    assert (tmp_path / f"a.{ending}").read_bytes() == (tmp_path / f"b.{ending}").read_bytes()


def test_pdf_has_layers_text_and_a_sound_table(scene, camera, tmp_path):
    drawing = umbra.draw_vectors(scene, camera, SUN, shadows="hatched", caption="48° (N)")
    drawing.write(tmp_path / "a.pdf")
    data = (tmp_path / "a.pdf").read_bytes()
    assert data.startswith(b"%PDF-1.5")
    assert b"/MediaBox[0 0 150 112.5]" in data
    assert data.count(b"/Type/OCG") == 6
    table = int(re.search(rb"startxref\n(\d+)", data)[1])
    places = re.findall(rb"(\d{10}) 00000 n", data[table:])
    for number, place in enumerate(places, 1):
        assert data[int(place) :].startswith(f"{number} 0 obj".encode())
    streams = re.findall(rb"stream\n(.*?)\nendstream", data, re.DOTALL)
    content = max((zlib.decompress(one) for one in streams), key=len).decode("cp1252")
    assert r"(48° \(N\)) Tj" in content
    assert "/H0 scn" in content
    assert "/O0 gs" in content


def test_pdf_draws_letters_that_its_typeface_lacks(scene, camera, tmp_path):
    umbra.draw_vectors(scene, camera, SUN, caption="Ωμέγα").write(tmp_path / "a.pdf")
    assert (tmp_path / "a.pdf").stat().st_size > 1000


def test_a_long_caption_fits_into_a_drawing(scene, camera, tmp_path):
    size = []
    for text in ("48° (N)", "a long line about what is to be seen here, when and why " * 3):
        drawing = umbra.draw_vectors(scene, camera, SUN, caption=text)
        for ending in ("svg", "pdf"):
            drawing.write(tmp_path / f"a.{ending}")
        told = re.search(r'<text [^>]*font-size="([\d.]+)"[^>]*>', (tmp_path / "a.svg").read_text())
        size.append((float(told[1]), "textLength" in told[0]))
    assert size[0] == (10, False)
    assert size[1][0] < 5
    assert size[1][1]


def test_faces_of_one_colour_are_one_path_and_seams_one_pixel_wide(camera):
    # Two level squares in steps of 1 mm: two planes, one colour.
    corners = np.array([(x, y, z) for z in (0, 1e-3) for y in (0, 2) for x in (0, 2)], float)
    corners[4:, 0] += 2
    faces = np.array([(0, 1, 3), (0, 3, 2), (4, 5, 7), (4, 7, 6)], np.int32)
    drawing = umbra.draw_vectors(
        Scene((Part("", "", Mesh(corners, faces)),), np.zeros(3)), camera, SUN
    )
    (part,) = [one for one in drawing.page.parts if one.name != "ground"]
    (fill,) = part.faces
    assert len(fill.rings) == 2
    text = drawing._repr_svg_()
    assert "vector-effect:non-scaling-stroke" in text
    assert text.count('class="seam"') == sum(
        len(one.faces) + len(one.shadows) for one in drawing.page.parts
    )


def test_textures_that_are_left_out_are_told(scene):
    image = Image("x", lambda: np.zeros((1, 1, 3), np.uint8), is_data=True)
    images = dict.fromkeys(("normal_image", "occlusion_image", "emission_image"), image)
    parts = [replace(part, material=replace(part.material, **images)) for part in scene.parts]
    (line,) = list_losses(replace(scene, parts=tuple(parts)), [SUN])
    for what in ("normal", "occlusion", "emissive"):
        assert f"{what} textures of 2 parts" in line


def test_python_refuses_too(scene, camera, monkeypatch, tmp_path):
    with pytest.raises(umbra.InputError, match="shadows 'soft' is not one of solid, hatched"):
        umbra.draw_vectors(scene, camera, SUN, shadows="soft")
    monkeypatch.setattr("umbra.calls.vectors.MOST", 10)
    with pytest.raises(umbra.InputError, match="at most 10 triangles, and this model 24; read a"):
        umbra.draw_vectors(scene, camera, SUN)
    monkeypatch.undo()
    drawing = umbra.draw_vectors(scene, camera, SUN)
    with pytest.raises(umbra.InputError, match="a drawing is SVG or PDF; name"):
        drawing.write(tmp_path / "a.dxf")


def test_a_near_plane_in_the_model_and_an_empty_view_are_told(scene):
    solid = Scene(scene.parts[:1], scene.origin)
    close = umbra.make_camera(solid, eye=(1, -4, 3), target=(1, 1, 3), near=5.0, size=(40, 30))
    with pytest.warns(UserWarning, match="the near plane, 5 m before the eye, cuts the model"):
        umbra.draw_vectors(solid, close, SUN)
    away = umbra.make_camera(solid, eye=(1, -4, 3), target=(1, -9, 3), size=(40, 30))
    with pytest.warns(UserWarning, match="nothing of the model is seen; leave out eye="):
        assert umbra.draw_vectors(solid, away, SUN, ground=0).seen.lines.segments.size == 0


def test_a_missing_package_is_named_by_its_extra(scene, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyclipr", None)
    with pytest.raises(umbra.InputError, match=r"needs pyclipr.*pip install .*\[vectors\]"):
        umbra.draw_vectors(scene, umbra.make_camera(scene), SUN)
