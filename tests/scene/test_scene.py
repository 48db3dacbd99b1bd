"""Scenes: a local origin, instances, and which parts cast."""

import numpy as np
import pytest
from support.shapes import box

from umbra.errors import InputError
from umbra.scene import Mesh, Part, directional_light, make_scene, point_light, spot_light
from umbra.scene.mesh import transform_points

VERTICES, FACES = box((0, 0, 0), (1, 2, 3))


def volume(triangles):
    a, b, c = (triangles.vertices[triangles.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def test_near_coordinates_stay_and_far_ones_get_an_origin():
    near = make_scene(VERTICES, FACES)
    assert not near.origin.any()
    far = make_scene(VERTICES + [2.6e6, 1.2e6, 40], FACES)
    assert (far.origin % 1 == 0).all()
    assert far.origin[0] == pytest.approx(2.6e6, abs=5)
    np.testing.assert_array_equal(
        far.triangles().vertices + far.origin, VERTICES + [2.6e6, 1.2e6, 40]
    )
    np.testing.assert_array_equal(far.bounds(), [[2.6e6, 1.2e6, 40], [2.6e6 + 1, 1.2e6 + 2, 43]])


def test_instances_stand_where_they_are_put_and_mirrors_are_rewound():
    mesh = Mesh(VERTICES, FACES)
    moved = np.eye(4)
    moved[:3, 3] = 10, 0, 0
    mirrored = np.diag([-1.0, 1, 1, 1])
    scene = make_scene(
        [Part("a", "", mesh), Part("b", "", mesh, moved), Part("c", "", mesh, mirrored)]
    )
    assert volume(scene.triangles()) == pytest.approx(18)
    for part in range(3):
        assert volume(scene.triangles([part])) == pytest.approx(6)
    np.testing.assert_array_equal(scene.bounds(), [[-1, 0, 0], [11, 2, 3]])
    assert scene.triangles().part.tolist() == [0] * 12 + [1] * 12 + [2] * 12


def test_each_of_very_many_vertices_moves_by_itself():
    points = np.random.default_rng(3).uniform(-5, 5, (40_000, 3))
    turn = np.array([[0, -1, 0, 100], [2, 0, 0, -7], [0, 0, 1, 0.5], [0, 0, 0, 1]])
    x, y, z = points.T
    np.testing.assert_allclose(
        transform_points(turn, points), np.column_stack([100 - y, 2 * x - 7, z + 0.5])
    )


def test_an_origin_moves_instances_too():
    mesh = Mesh(VERTICES, FACES)
    moved = np.eye(4)
    moved[:3, 3] = 5e6, 5e6, 0
    scene = make_scene([Part("a", "", mesh, moved)])
    assert scene.origin.any()
    np.testing.assert_allclose(scene.bounds(), [[5e6, 5e6, 0], [5e6 + 1, 5e6 + 2, 3]])
    assert np.abs(scene.triangles().vertices).max() < 10


def test_parts_that_share_vertices_weld():
    half = [Part(name, "", Mesh(VERTICES, FACES[k::2])) for k, name in enumerate("ab")]
    shared = make_scene([Part(p.name, "", Mesh(half[0].mesh.vertices, p.mesh.faces)) for p in half])
    assert len(shared.triangles().vertices) == 8


def test_patterns_choose_who_casts():
    mesh = Mesh(VERTICES, FACES)
    parts = [("tower", "WallSurface"), ("tower", "RoofSurface"), ("shed", "WallSurface")]
    scene = make_scene([Part(name, kind, mesh) for name, kind in parts])
    assert scene.select() == [0, 1, 2]
    assert scene.select(cast=["tower"]) == [0, 1]
    assert scene.select(cast=["*Surface"], no_cast=["Roof*"]) == [0, 2]
    assert scene.select(no_cast=["shed"]) == [0, 1]
    assert scene.groups().tolist() == [0, 0, 1]
    with pytest.raises(InputError, match="'barn' matches no part; the file has RoofSurface"):
        scene.select(cast=["barn"])
    for none in ("Tower", ""):
        with pytest.raises(InputError, match=f"no_cast='{none}' matches no part"):
            scene.select(no_cast=[none])


def test_what_is_no_mesh_is_refused():
    with pytest.raises(InputError, match="no triangles"):
        make_scene(VERTICES, np.zeros((0, 3), int))
    with pytest.raises(InputError, match=r"1 of 2 faces name a vertex that does not exist"):
        make_scene(VERTICES, [[0, 1, 2], [0, 1, 8]])
    wrong = VERTICES.copy()
    wrong[5] = np.nan, 0, np.inf
    with pytest.raises(InputError, match=r"not finite: 1 in all \(first: vertex 5\)") as error:
        make_scene(wrong, FACES, name="roof")
    assert error.value.vertex == 5
    # A vertex that no face uses may be anything.
    assert make_scene(np.vstack([VERTICES, [np.nan] * 3]), FACES)


def test_a_scene_is_made_of_a_mesh_or_a_part():
    mesh = Mesh(VERTICES, FACES)
    scene = make_scene(mesh, name="barn")
    assert [(part.name, part.mesh.faces.shape) for part in scene.parts] == [("barn", FACES.shape)]
    assert make_scene(Part("roof", "", mesh)).parts[0].name == "roof"
    for other, kind in (([mesh], "Mesh"), (7, "int"), ("a.obj", "str")):
        with pytest.raises(InputError, match=f"made of parts.* got a {kind} "):
            make_scene(other)


def test_lights_are_homogeneous_and_local():
    lamp = point_light((2.6e6, 1.2e6, 9))
    np.testing.assert_array_equal(lamp.local((2.6e6, 1.2e6, 0)), (0, 0, 9, 1))
    sun = directional_light((0, 3, 4))
    assert not sun.is_point
    local = sun.local((2.6e6, 1.2e6, 0))
    np.testing.assert_allclose(local / np.linalg.norm(local), (0, 0.6, 0.8, 0))
    spot = spot_light((0, 0, 5), (0, 0, 1), 30)
    np.testing.assert_array_equal(spot.axis, (0, 0, -1))
    for wrong in ((0, 0, 0),), ((0, np.inf, 1),):
        with pytest.raises(InputError):
            directional_light(*wrong)
    for target, angle in ((0, 0, 5), 30), ((0, 0, 1), 0), ((0, 0, 1), 181):
        with pytest.raises(InputError, match="spot light"):
            spot_light((0, 0, 5), target, angle)


@pytest.mark.parametrize("stray", [1e5, np.nan, np.inf])
def test_only_vertices_that_a_face_uses_are_the_model(stray):
    vertices = np.insert(VERTICES, 3, stray, axis=0)
    mesh = Mesh(vertices, FACES + (FACES > 2), colors=np.arange(27).reshape(9, 3))
    shared = Mesh(mesh.vertices, mesh.faces[:6])
    scene = make_scene([Part("a", "", mesh), Part("b", "", shared), Part("c", "", mesh)])
    np.testing.assert_array_equal(scene.bounds(), [[0, 0, 0], [1, 2, 3]])
    soup = scene.triangles()
    np.testing.assert_array_equal(soup.vertices, VERTICES)
    np.testing.assert_array_equal(soup.faces, np.concatenate([FACES, FACES[:6], FACES]))
    assert scene.parts[0].mesh is scene.parts[2].mesh
    np.testing.assert_array_equal(scene.parts[0].mesh.colors[:, 0], [0, 3, 6, 12, 15, 18, 21, 24])


def test_a_scene_counts_and_gives_its_parts():
    roof = Part("tower", "RoofSurface", Mesh(VERTICES, FACES[2:4]))
    walls = Part("tower", "WallSurface", Mesh(VERTICES, FACES[4:]))
    shift = np.eye(4)
    shift[:3, 3] = 10, 0, 0
    shed = Part("shed", "", Mesh(VERTICES, FACES), shift)
    far = [Part(p.name, p.kind, p.mesh.moved(p.mesh.vertices + 5e6), shift) for p in (roof, shed)]
    scene = make_scene([roof, walls, shed])
    assert len(scene) == 3
    assert [part.name for part in scene] == ["tower", "tower", "shed"]
    np.testing.assert_array_equal(roof.bounds, [[0, 0, 3], [1, 2, 3]])
    np.testing.assert_array_equal(shed.bounds, [[10, 0, 0], [11, 2, 3]])
    assert [part.kind for part in scene["tower"]] == ["RoofSurface", "WallSurface"]
    np.testing.assert_array_equal(scene["shed"].bounds(), shed.bounds)
    # Of a scene about an origin: a part's bounds are relative to it, a scene's are not.
    scene = make_scene(far)
    np.testing.assert_array_equal(scene.parts[1].bounds + scene.origin, scene["shed"].bounds())
    np.testing.assert_array_equal(
        scene["shed"].bounds(), [[5e6 + 10, 5e6, 5e6], [5e6 + 11, 5e6 + 2, 5e6 + 3]]
    )


def test_an_unknown_name_lists_those_near_it():
    scene = make_scene([Part(f"tower {n}", "", Mesh(VERTICES, FACES)) for n in range(9)])
    with pytest.raises(InputError, match="no part is called 'Tower 3'; the nearest are tower 3, "):
        scene["Tower 3"]
    with pytest.raises(
        InputError, match=r"no part is called 'zzz'; there are tower 0, .* and 3 more"
    ):
        scene["zzz"]
    with pytest.raises(InputError, match="no part is called 0"):
        scene[0]


def test_a_scene_shows_itself_in_ten_lines():
    many = [
        Part(f"wall {n}\x1b[2J", "Wall<b>", Mesh(*box((n, 0, 0), (n + 1, 1, 2))))
        for n in range(3000)
    ]
    scene = make_scene(many, crs="EPSG:31256")
    shown = repr(scene).splitlines()
    assert len(shown) <= 10
    assert shown[0] == "Scene: 3,000 parts, 36,000 triangles"
    assert shown[1] == "3000.00 x 1.00 x 2.00 m, from 0.00, 0.00, 0.00 (EPSG:31256)"
    assert shown[2].split() == ["name", "kind", "triangles"]
    assert shown[-1] == "and 2,994 more in scene.parts"
    assert "\x1b" not in repr(scene)
    page = scene._repr_html_()
    assert "<td>Wall&lt;b&gt;</td>" in page
    assert "\x1b" not in page
    assert repr(scene.parts[0].mesh) == "Mesh(8 vertices, 12 triangles)"
    assert repr(scene.parts[0]) == r"Part('wall 0\x1b[2J', Wall<b>, 12 triangles)"
    assert len(repr(scene["wall 7\x1b[2J"]).splitlines()) == 4
