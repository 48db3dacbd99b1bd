"""OBJ's textures: coordinates from either end, split only where a texture is used."""

import numpy as np
import PIL.Image
import pytest

import umbra
from umbra import InputError
from umbra.volume.inspection import inspect_scene

PIXELS = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]], np.uint8)

# Two squares side by side: the left one has a texture, the right one has none.
HEAD = """mtllib colours.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
vt 0 0
vt 1 0
vt 1 0.75
vt 0 1
"""
LIBRARY = "newmtl brick\nKd 0.5 1 1\nmap_Kd bricks.png\nnewmtl plain\nKd 0.1 0.2 0.3\n"


@pytest.fixture
def save(tmp_path):
    PIL.Image.fromarray(PIXELS).save(tmp_path / "bricks.png")
    PIL.Image.fromarray(PIXELS).save(tmp_path / "red bricks.png")

    def write(text, library=LIBRARY):
        (tmp_path / "colours.mtl").write_text(library)
        path = tmp_path / "wall.obj"
        path.write_text(HEAD + text)
        return path

    return write


def corners(part):
    """Give the corners' places in x and y with their coordinates, in order."""
    mesh = part.mesh
    return [
        (*mesh.vertices[v, :2].tolist(), *mesh.uv[v].tolist()) for v in mesh.faces.ravel().tolist()
    ]


SPLIT = [(0, 0, 0, 1), (1, 0, 1, 1), (1, 1, 1, 0.25), (0, 0, 0, 1), (1, 1, 1, 0.25), (0, 1, 0, 0)]


@pytest.mark.parametrize(
    "faces", ["f 1/1 2/2 3/3\nf 1/1 3/3 4/4", "f 1/1/9 2/2/9 3/3/9\nf -6/-4 -4/-2 -3/-1"]
)
def test_coordinates_count_from_either_end_and_v_runs_down(save, faces):
    scene = umbra.read(save(f"usemtl brick\n{faces}\nusemtl plain\nf 2 5 6\n"))
    brick, plain = scene.parts
    assert corners(brick) == SPLIT
    assert len(brick.mesh.vertices) == 4
    np.testing.assert_array_equal(brick.material.texture[..., :3], PIXELS)
    assert brick.color == (0.5, 1, 1)
    # What has no texture keeps the file's own vertices, those that it uses.
    assert plain.mesh.uv is None
    assert len(plain.mesh.vertices) == 3
    assert plain.color == (0.1, 0.2, 0.3)
    assert scene.notes == ()


def test_polygons_take_their_coordinates_along(save):
    scene = umbra.read(save("usemtl brick\nf 2 5 6\nf 1/1 2/2 3/3 4/4\n"))
    (brick,) = scene.parts
    found = {corner[:2]: corner[2:] for corner in corners(brick)[3:]}
    assert found == {(0, 0): (0, 1), (1, 0): (1, 1), (1, 1): (1, 0.25), (0, 1): (0, 0)}
    assert {corner[2:] for corner in corners(brick)[:3]} == {(0, 0)}  # it has none


def test_coordinates_that_change_at_a_place_split_it_and_the_weld_joins_it(save):
    # A closed tetrahedron whose faces each have the whole picture.
    faces = "f 1/1 3/2 2/3\nf 1/1 2/2 7/3\nf 2/1 3/2 7/3\nf 3/1 1/2 7/3\n"
    scene = umbra.read(save("v 0.5 0.5 2\nusemtl brick\n" + faces))
    assert len(scene.parts[0].mesh.vertices) > 4
    assert inspect_scene(scene).total.closed


def test_coordinates_that_are_not_there_are_noted(save):
    scene = umbra.read(save("usemtl brick\nf 1/1 2/99 3/-7\n"))
    assert corners(scene.parts[0]) == [(0, 0, 0, 1), (1, 0, 0, 0), (1, 1, 0, 0)]
    assert scene.notes == ("wall.obj: corners without their texture coordinates: 2",)


@pytest.mark.parametrize(
    ("line", "wrap"),
    [
        ("map_Kd red bricks.png", "repeat"),
        ("map_Kd -s 1 1 1 -clamp on red bricks.png", "clamp"),
        ("map_Kd -o 0.5 -mm 0 1 -bm 0.2 red bricks.png", "repeat"),
    ],
)
def test_names_with_spaces_after_options(save, line, wrap):
    library = f"newmtl brick\n{line}\n"
    (part,) = umbra.read(save("usemtl brick\nf 1/1 2/2 3/3\n", library)).parts
    np.testing.assert_array_equal(part.material.texture[..., :3], PIXELS)
    assert part.material.image.wrap == (wrap, wrap)
    assert part.color == (1, 1, 1)  # no colour: the picture's own


def test_textures_that_are_not_there_are_noted_and_plain(save):
    library = "newmtl brick\nKd 0.5 0.25 0\nmap_Kd lost.png\nnewmtl unused\nmap_Kd lost.png\n"
    scene = umbra.read(save("usemtl brick\nf 1/1 2/2 3/3\n", library))
    (part,) = scene.parts
    assert part.material.image is None
    assert part.mesh.uv is None
    assert part.color == (0.5, 0.25, 0)
    assert scene.notes == ("wall.obj: missing textures left out: 1",)


def test_a_damaged_picture_is_named_when_it_is_drawn(save, tmp_path):
    path = save("usemtl brick\nf 1/1 2/2 3/3\n")
    (tmp_path / "bricks.png").write_bytes(b"nothing")
    scene = umbra.read(path)
    with pytest.raises(InputError, match=r"texture '.*\.obj: bricks\.png' cannot be read"):
        _ = scene.parts[0].material.texture


def test_opacity_glow_and_black_under_a_picture(save):
    library = "newmtl brick\nKd 0 0 0\nd 0.25\nKe 0.5 0 0\nmap_Kd bricks.png\n"
    material = umbra.read(save("usemtl brick\nf 1 2 3\n", library)).parts[0].material
    assert material.color == (1, 1, 1)
    assert material.opacity == 0.25
    assert material.emission == (0.5, 0, 0)
    for line in ("d 0", "d 1", "d glass"):
        library = f"newmtl brick\nKd 0 0 0\n{line}\n"
        material = umbra.read(save("usemtl brick\nf 1 2 3\n", library)).parts[0].material
        assert (material.opacity, material.color) == (1, (0, 0, 0))
