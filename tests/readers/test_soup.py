"""STL, OFF and PLY, text and binary."""

import numpy as np
import pytest

import umbra
from umbra import InputError


@pytest.fixture
def save(tmp_path):
    def write(content, name):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.fixture
def triangles(box):
    vertices, faces = box
    quads = np.array(faces)
    return np.array(vertices, float)[np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])]


def binary_stl(triangles, header=b"made by hand"):
    facets = np.zeros(
        len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")]
    )
    facets["corners"] = triangles
    return header.ljust(80, b"\0") + np.uint32(len(triangles)).tobytes() + facets.tobytes()


def text_stl(triangles):
    text = "solid box\n"
    for corners in triangles:
        text += "facet normal 0 0 0\n outer loop\n"
        text += "".join(f"  vertex {x} {y:e} {z}\n" for x, y, z in corners)
        text += " endloop\nendfacet\n"
    return text + "endsolid box\n"


def off(vertices, faces, head="OFF\n"):
    rows = [" ".join(map(str, v)) for v in vertices]
    rows += [f"{len(f)} " + " ".join(map(str, f)) for f in faces]
    return f"{head}{len(vertices)} {len(faces)} 0 # counts\n\n" + "\n".join(rows) + "\n"


PLY_HEAD = """\
ply
format {form} 1.0
comment by hand
element vertex {n}
property float x
property float y
property float z
property uchar red
element face {m}
property list uchar int {name}
property float quality
element edge 1
property int a
end_header
"""


def text_ply(vertices, faces):
    head = PLY_HEAD.format(form="ascii", n=len(vertices), m=len(faces), name="vertex_indices")
    rows = [f"{x} {y} {z} 255" for x, y, z in vertices]
    rows += [f"{len(f)} " + " ".join(map(str, f)) + " 0.5" for f in faces]
    return head + "\n".join(rows) + "\n7\n"


def binary_ply(vertices, faces, order="<"):
    form = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    data = PLY_HEAD.format(form=form, n=len(vertices), m=len(faces), name="vertex_index").encode()
    for v in vertices:
        data += np.array(v, order + "f4").tobytes() + b"\xff"
    for f in faces:
        data += bytes([len(f)]) + np.array(f, order + "i4").tobytes()
        data += np.array([0.5], order + "f4").tobytes()
    return data + np.array([7], order + "i4").tobytes()


def all_of(box, triangles):
    return {
        "b.stl": binary_stl(triangles),
        "solid.stl": binary_stl(triangles, b"solid facet but binary"),
        "t.stl": text_stl(triangles),
        "q.off": off(*box),
        "one.off": off(*box, head="OFF "),
        "t.ply": text_ply(*box),
        "l.ply": binary_ply(*box),
        "g.ply": binary_ply(*box, order=">"),
    }


def test_box_in_each_format(box, triangles, save, measure):
    for name, content in all_of(box, triangles).items():
        path = save(content, name)
        scene = umbra.read(path)
        assert measure.volume(scene) == pytest.approx(24.0), name
        assert measure.open_edges(scene) == [], name
        assert scene.bounds().tolist() == [[0, 0, 0], [2, 3, 4]], name
        assert [p.name for p in scene.parts] == [path.stem]
        assert scene.sources[0].format == path.suffix[1:].upper()
        assert umbra.read(path, up="y").bounds().tolist() == [[0, -4, 0], [2, 0, 3]], name


@pytest.mark.parametrize("make", [off, text_ply, binary_ply])
def test_concave_and_mixed_polygons(make, save, measure):
    points = [(0, 0, 0), (3, 0, 0), (3, 1, 0), (1, 1, 0), (1, 3, 0), (0, 3, 0), (9, 0, 0)]
    faces = [[3, 4, 5, 0, 1, 2], [1, 6, 2], [0, 1, 2, 3]]
    name = "m.off" if make is off else "m.ply"
    # The shortest first, too: a guess that all are as long would fit into the file.
    for order in (faces, faces[::-1], faces[1:] + faces[:1]):
        scene = umbra.read(save(make(points, order), name))
        assert measure.area(scene) == pytest.approx(5.0 + 3.0 + 2.5)


def test_triangles_alone_are_kept_as_they_are(save):
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    faces = [[0, 1, 2], [0, 1, 1], [2, 1, 0]]
    for make, name in ((off, "m.off"), (text_ply, "t.ply"), (binary_ply, "b.ply")):
        assert umbra.read(save(make(points, faces), name)).parts[0].mesh.faces.tolist() == faces


def test_cut_files_are_named(box, triangles, save):
    for name, content in all_of(box, triangles).items():
        data = content if isinstance(content, bytes) else content.encode()
        with pytest.raises(InputError, match=f"{name}: .*(cut short|header)") as caught:
            umbra.read(save(data[: len(data) * 2 // 3], name))
        assert "\n" not in str(caught.value)


PLY = (
    "ply\nformat ascii 1.0\n"
    "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
)


@pytest.mark.parametrize(
    ("name", "content", "facts"),
    [
        (
            "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
            {"face": 0, "count": 1},
        ),
        (
            "a.off", "OFF\n3 1 0\n0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n",
            {"line": 4, "element": "vertex"},
        ),
        (
            "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n",
            {"line": 6, "element": "face"},
        ),
        ("a.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n", {"lines": 2, "needed": 5}),
        ("a.ply", "ply\nformat odd 1.0\nend_header\n", {"line": 2}),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", {"line": 3}),
        ("a.ply", "ply\nformat ascii 1.0\nproperty float x\nend_header\n", {"line": 3}),
        ("a.ply", PLY + "0 0\n3 0 0 0\n", {"line": 10, "element": "vertex"}),
        ("a.ply", PLY + "0 0 0\n\n3 0 0\n", {"line": 12, "element": "face"}),
        ("a.stl", "solid a\nfacet\nvertex 0 0 z\nendsolid\n", {"line": 3, "element": "vertex"}),
        ("a.stl", "not an STL file at all", {"bytes": 22, "needed": 84}),
    ],
)  # fmt: skip
def test_the_place_of_damage_is_a_fact(save, refuse, name, content, facts):
    refuse(umbra.read, save(content, name), facts=facts)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "face 0 names vertex 3"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n", "line 4: the vertex"),
        ("a.off", "OFF\nthree\n", "line of counts"),
        ("a.off", "OFF\n", "damaged"),
        ("a.off", "OFF BINARY\n", "not an OFF file in text"),
        ("a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "no triangles"),
        ("a.ply", "ply\nformat ascii 1.0\n", "header does not end"),
        ("a.ply", "ply\nend_header\n", "no format"),
        ("a.ply", "ply\nformat odd 1.0\nend_header\n", "line 2: 'format odd 1.0'"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", "have no x"),
        ("a.stl", "solid a\nfacet\nendsolid\n", "no triangles"),
        ("a.stl", "not an STL file at all", "cut short or no STL"),
    ],
)
def test_damage_is_named(save, refuse, name, content, said):
    assert said in refuse(umbra.read, save(content, name), facts={})
