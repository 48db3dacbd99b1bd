"""OBJ: every way to name a corner, groups, materials, damage."""

import numpy as np
import pytest

import umbra
from umbra import InputError

BOX = """\
# a box
mtllib colours.mtl
v 0 0 0
v 2.0 0 0
v 2 3e0 0
v 0 30e-1 0
v 0 0 4
v 2 0 4
v 2 3 4 1.0
v 0 3 4 0.5 0.5 0.5
"""


@pytest.fixture
def save(tmp_path):
    def write(text, name="box.obj"):
        path = tmp_path / name
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write


def faces_text(faces, form="{0}"):
    return "".join("f " + " ".join(form.format(c + 1) for c in f) + "\n" for f in faces)


@pytest.mark.parametrize("form", ["{0}", "{0}/1", "{0}//2", "{0}/3/4", "{0}/"])
def test_corner_forms(save, box, measure, form):
    scene = umbra.read(save(BOX + faces_text(box[1], form)))
    assert measure.volume(scene) == pytest.approx(24.0)
    assert measure.open_edges(scene) == []
    assert scene.parts[0].name == "box"
    assert scene.sources[0].format == "OBJ"


def test_indices_from_the_end_count_from_where_they_stand(save, measure):
    text = """\
v 0 0 0
v 1 0 0
v 0 1 0
f -3 -2 -1
v 5 5 5
v 7 5 5
v 5 7 5
f -3/-3/-3 -2/-2/-2 -1/-1/-1
f 1 2 -1
"""
    corners = measure.corners(umbra.read(save(text)))
    assert corners[0].tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert corners[1].tolist() == [[5, 5, 5], [7, 5, 5], [5, 7, 5]]
    assert corners[2].tolist() == [[0, 0, 0], [1, 0, 0], [5, 7, 5]]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_continuation_comments_tabs_and_line_ends(save, measure, end):
    lines = ["v 0 0 0", "v\t4 0 0", "  v 1 1 \\", "0", "v 0 4 0 # last", "f 1 2 \\", " 3 \\", "4"]
    lines += ["f 1 2 3 # again", "", "#f 1 2 3", "s off", "vn 0 0 1", "vt 0 0", "l 1 2", "p 1"]
    scene = umbra.read(save(end.join(lines)))
    # The dart is concave: a fan from its first corner would be right, one from its
    # second would not.
    assert scene.triangles().faces.shape == (3, 3)
    assert measure.area(scene) == pytest.approx(4.0 + 2.0)


def test_concave_polygon_is_not_fanned(save, measure):
    ring = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
    for turn in range(6):
        text = "".join(f"v {x} {y} 0\n" for x, y in ring[turn:] + ring[:turn])
        scene = umbra.read(save(text + "f 1 2 3 4 5 6\n"))
        assert measure.area(scene) == pytest.approx(5.0)


def test_groups_and_materials_make_parts(save):
    text = BOX + (
        "f 1 2 3\no tower\nusemtl glass\nf 1 2 4\ng north wall\nf 1 2 5\nusemtl stone\n"
        "f 1 2 6\no tower\nf 1 2 7\ng x\ng\nusemtl glass\nf 1 2 8 3\n"
    )
    scene = umbra.read(save(text))
    assert [(p.name, p.kind, p.triangles) for p in scene.parts] == [
        ("box", "", 1),
        ("tower", "glass", 3),
        ("north wall", "glass", 1),
        ("north wall", "stone", 1),
        ("tower", "stone", 1),
    ]
    assert scene.parts[1].mesh.faces[0].tolist() == [0, 1, 3]
    assert "colours.mtl" in scene.notes[0]


def test_material_colours(save, box):
    save("newmtl glass\nKd 0.1 0.2 1.5\nnewmtl stone\nKa 1 1 1\nKd 0.5\n", "colours.mtl")
    scene = umbra.read(
        save(BOX + "usemtl glass\nf 1 2 3\nusemtl stone\nf 1 2 4\nusemtl x\nf 1 2 5")
    )
    assert [p.color for p in scene.parts[:2]] == [(0.1, 0.2, 1.0), (0.5, 0.5, 0.5)]
    assert scene.parts[2].color == umbra.Part("", "", scene.parts[0].mesh).color
    assert scene.notes == ()


def test_up_axis(save, box, measure, refuse):
    path = save(BOX + faces_text(box[1]))
    assert umbra.read(path).bounds().tolist() == [[0, 0, 0], [2, 3, 4]]
    assert umbra.read(path, up="z").bounds().tolist() == [[0, 0, 0], [2, 3, 4]]
    assert umbra.read(path, up="y").bounds().tolist() == [[0, -4, 0], [2, 0, 3]]
    assert umbra.read(path, up="x").bounds().tolist() == [[0, 0, 0], [3, 4, 2]]
    for up in "xyz":
        assert measure.volume(umbra.read(path, up=up)) == pytest.approx(24.0)
    assert "up axis" in refuse(umbra.read, path, up="w", facts={"up": "w"})


def test_degenerate_triangles_stay_for_inspect(save):
    scene = umbra.read(save(BOX + "f 1 2 2\nf 1 2 3\nf 1 2 1 2\n"))
    assert scene.parts[0].mesh.faces.tolist() == [[0, 1, 1], [0, 1, 2]]
    assert any("fewer than three distinct corners left out: 1" in n for n in scene.notes)


@pytest.mark.parametrize(
    ("tail", "line"),
    [
        ("f 1 2 9\n", 11),
        ("f 1 2 0\n", 11),
        ("\nf 1 2 3\nf 1 2 -9\n", 13),
        ("f 1 \\\n2 3\nf 1 2 9", 13),
        ("f 1 2 x\n", 11),
        ("f 1 2 3.5/1\n", 11),
        ("f 1 2 99999999999999999999\n", 11),
        ("v 1 2\nf 1 2 3\n", 11),
        ("v 1 2 abc\nf 1 2 3\n", 11),
    ],
)
def test_the_line_of_damage_is_named(save, refuse, tail, line):
    path = save(BOX + tail)
    said = refuse(umbra.read, path, facts={"line": line, "path": path})
    assert f"box.obj: line {line}: " in said


@pytest.mark.parametrize(
    ("tail", "said"),
    [
        ("f 1 2 9\n", "names vertex 9, but there are 8 vertices"),
        ("f 1 2 x\n", "'x' is not a vertex index"),
        ("v 1 2\nf 1 2 3\n", "a vertex needs three numbers, not 'v 1 2'"),
        ("", "has no triangles"),
        ("l 1 2\n", "has no triangles"),
    ],
)
def test_damage_is_said(save, tail, said):
    with pytest.raises(InputError, match=said):
        umbra.read(save(BOX + tail))


def test_vertices_that_are_not_finite_or_far_are_named(save):
    for tail in ("v 1 2 nan\nf 1 2 9\n", "v 1 2 inf\nf 1 2 9 4 5\n"):
        with pytest.raises(InputError, match="not finite") as caught:
            umbra.read(save(BOX + tail))
        assert (caught.value.count, caught.value.vertex) == (1, 8)
    with pytest.raises(InputError, match="coordinates reach") as caught:
        umbra.read(save(BOX + "v 1e300 2 1\nf 1 2 9\n"))
    assert caught.value.far == 1e300


def test_large_indices_and_many_faces_come_in_blocks(save):
    # More faces than one block, of mixed lengths.
    n = 70000
    text = "".join(f"v {i} 0 0\nv {i} 1 0\n" for i in range(n + 1))
    text += "".join(f"f {2 * i + 1} {2 * i + 3} {2 * i + 4} {2 * i + 2}\n" for i in range(n))
    scene = umbra.read(save(text + "f 1 3 4\n"))
    faces = scene.triangles().faces
    assert len(faces) == 2 * n + 1
    assert faces[-1].tolist() == [0, 2, 3]
    assert np.unique(faces).size == 2 * n + 2


def test_a_word_too_many_does_not_make_up_for_one_too_few(save, refuse):
    # Two faces of 4 and 2 corners have as many words as two triangles.
    scene = umbra.read(save(BOX + "f 1 2 3 4\nf 1 2\nf 5 6 7\n"))
    assert scene.triangles().faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6]]
    refuse(umbra.read, save(BOX + "v 1 2 3 4\nv 1 2\nf 1 2 3\n"), facts={"line": 12})
