"""``umbra inspect``: what a file is."""

import numpy as np
import pytest
from support.model_files import save_city, save_obj
from support.shapes import box, duplicated, merge, moved, rewound

KEYS = {
    "parts", "vertices", "triangles", "bounds", "closed", "border_edges", "nonmanifold_edges",
    "degenerate_triangles", "crs", "latitude", "longitude", "true_north_deg",
}  # fmt: skip
HOUSE = box((0, 0, 0), (4, 3, 2))


@pytest.fixture
def inspect(umbra_here, tmp_path):
    def run(meshes, *options):
        said = umbra_here("inspect", save_obj(tmp_path / "m.obj", meshes), *options, "--json")
        assert said.status == 0
        assert not said.err
        return said.json()

    return run


def test_closed_box(inspect):
    found = inspect({"house": HOUSE})
    assert set(found) >= KEYS
    assert found["bounds"] == [[0, 0, 0], [4, 3, 2]]
    assert (found["vertices"], found["triangles"]) == (8, 12)
    assert found["closed"] is True
    assert found["border_edges"] == found["nonmanifold_edges"] == 0
    assert found["degenerate_triangles"] == 0
    assert found["crs"] is found["latitude"] is found["longitude"] is None
    (part,) = found["parts"]
    assert (part["name"], part["triangles"], part["closed"]) == ("house", 12, True)


def test_a_box_without_its_lid_has_four_border_edges(inspect):
    found = inspect({"house": (HOUSE[0], np.delete(HOUSE[1], [2, 3], 0))})
    assert found["closed"] is False
    assert found["border_edges"] == 4
    assert found["parts"][0]["border_edges"] == 4


def test_one_face_wound_the_other_way(inspect):
    found = inspect({"house": rewound(HOUSE, [4])})
    assert found["closed"] is False
    assert found["inconsistent_edges"] == 3


def test_duplicates_and_degenerate_triangles(inspect):
    vertices, faces = duplicated(HOUSE, [2, 2])
    faces = np.concatenate([faces, [[0, 1, 1]]])
    found = inspect({"house": (vertices, faces)})
    assert found["duplicate_triangles"] == 2
    assert found["degenerate_triangles"] == 1
    assert found["nonmanifold_edges"] == 3


def test_parts_are_judged_one_by_one(inspect):
    open_one = (moved(HOUSE, (9, 0, 0))[0], HOUSE[1][:10])
    found = inspect({"whole": HOUSE, "torn": open_one})
    assert {part["name"]: part["closed"] for part in found["parts"]} == {
        "whole": True, "torn": False,
    }  # fmt: skip
    assert found["closed"] is False


def test_up_turns_the_model(inspect):
    assert inspect({"house": HOUSE}, "--up", "y")["bounds"][1][2] == 3


def test_place_of_a_crs(umbra_here, tmp_path):
    path = save_city(tmp_path / "m.city.json", {"a": moved(HOUSE, (2683000, 1247000, 400))}, 2056)
    found = umbra_here("inspect", path, "--json").json()
    assert found["crs"] == "EPSG:2056"
    assert found["latitude"] == pytest.approx(47.37, abs=0.01)
    assert found["longitude"] == pytest.approx(8.54, abs=0.01)
    # East of the meridian at Bern (7.44 degrees) true north leans west in the grid.
    assert found["true_north_deg"] == pytest.approx(-0.81, abs=0.03)
    np.testing.assert_allclose(found["bounds"], [[2683000, 1247000, 400], [2683004, 1247003, 402]])
    assert {part["kind"] for part in found["parts"]} == {"WallSurface", "RoofSurface"}


def test_for_people(umbra_here, tmp_path):
    lid_off = (HOUSE[0], np.delete(HOUSE[1], [2, 3], 0))
    path = save_obj(tmp_path / "m.obj", {f"house {k}": moved(lid_off, (9 * k, 0, 0))
                                         for k in range(45)})  # fmt: skip
    said = umbra_here("inspect", path)
    assert said.status == 0
    assert not said.err
    assert "45 parts, 450 triangles, 360 vertices" in said.out
    assert "not closed: 180 border edges (first: " in said.out
    assert "--lat, --lon" in said.out
    assert "house 0 " in said.out
    assert "house 9 " in said.out
    assert "house 10 " not in said.out
    assert "and 35 more" in said.out
    assert max(map(len, said.out.splitlines())) <= 120
    every = umbra_here("inspect", path, "--all").out
    assert all(f"house {k} " in every for k in range(45))


def test_two_files(umbra_here, tmp_path):
    files = [save_obj(tmp_path / f"{k}.obj", {f"h{k}": moved(HOUSE, (9 * k, 0, 0))})
             for k in range(2)]  # fmt: skip
    found = umbra_here("inspect", *files, "--json").json()
    assert found["triangles"] == 24
    assert found["bounds"][1] == [13, 3, 2]
    merged = save_obj(tmp_path / "m.obj", {"both": merge(HOUSE, moved(HOUSE, (9, 0, 0)))})
    assert umbra_here("inspect", merged, "--json").json()["vertices"] == found["vertices"] == 16


@pytest.mark.parametrize("stray", ["100000 0 0", "0 0 nan"])
def test_a_vertex_that_no_face_uses_is_not_the_model(umbra_here, tmp_path, stray):
    path = save_obj(tmp_path / "m.obj", {"house": HOUSE})
    path.write_text(path.read_text() + f"v {stray}\n")
    found = umbra_here("inspect", path, "--json").json()
    assert found["bounds"] == [[0, 0, 0], [4, 3, 2]]
    assert found["vertices"] == 8


def test_names_that_are_cut_alike_are_told_apart(umbra_here, tmp_path):
    start, end = "Basic Wall:Exterior - Brick on Block Cavity Wall:", ":level 00"
    meshes = {f"{start}{number}": HOUSE for number in (346660, 346661)}
    meshes |= {f"{start}{number}{'x' * 30}{end}": HOUSE for number in (1, 2)}
    said = umbra_here("inspect", save_obj(tmp_path / "m.obj", meshes))
    shown = [line.rpartition("mesh")[0] or line for line in said.out.splitlines()]
    table = shown[next(i for i, line in enumerate(shown) if line.startswith("part ")) + 1 :]
    assert len(set(table)) == 4
    assert table[0].startswith("Basic Wall:Exterior - B…Block Cavity Wall:346660 ")
