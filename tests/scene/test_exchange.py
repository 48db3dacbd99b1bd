"""Scenes made from arrays, trimesh, PyVista and GeoPandas, and turned back."""

import sys

import numpy as np
import pytest
from support.shapes import box

import umbra

BOX = box((0, 0, 0), (2, 3, 4))
FAR = np.array([2.6e6, 1.2e6, 400.0])


def compare(scene, other):
    """Compare the triangles of two scenes, part by part, in the model's own coordinates."""
    assert [part.name for part in scene] == [part.name for part in other]
    for n in range(len(scene)):
        soups = [(one.triangles([n]), one.origin) for one in (scene, other)]
        one, two = (soup.vertices[soup.faces] + origin for soup, origin in soups)
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-9)


def test_arrays_make_parts():
    vertices, faces = BOX
    scene = umbra.Scene.from_arrays(vertices, faces, ground=-1.0, latitude=48.0)
    assert len(scene) == 1
    assert (scene.ground, scene.latitude) == (-1.0, 48.0)
    np.testing.assert_array_equal(scene.bounds(), [(0, 0, 0), (2, 3, 4)])
    labels = np.where(np.arange(len(faces)) < 4, "wall", "roof")
    named = umbra.Scene.from_arrays(vertices, faces, labels)
    assert [(part.name, part.triangles) for part in named] == [
        ("roof", len(faces) - 4),
        ("wall", 4),
    ]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([(0, 0)], [(0, 0, 0)]), r"vertices are an array \(n, 3\); got \(1, 2\)"),
        ((BOX[0], [0, 1, 2]), r"faces are an array \(n, 3\); got \(3,\)"),
        ((BOX[0], np.array(BOX[1], float)), "faces are whole numbers"),
        ((BOX[0], [(0, 1, 99)]), "a vertex that does not exist"),
        ((BOX[0], BOX[1], ["a"]), r"one name or number for each of 12 faces; got \(1,\)"),
        ((BOX[0], "ab"), "arrays of numbers|faces are an array"),
    ],
)
def test_slips_in_arrays_are_told(arguments, words):
    with pytest.raises(umbra.InputError, match=words):
        umbra.Scene.from_arrays(*arguments)


@pytest.mark.parametrize("shift", [np.zeros(3), FAR])
def test_trimesh_there_and_back(shift):
    trimesh = pytest.importorskip("trimesh")
    vertices, faces = np.array(BOX[0]) + shift, np.array(BOX[1])
    scene = umbra.Scene.from_trimesh(
        trimesh.Trimesh(vertices, faces, process=False), crs="EPSG:2056"
    )
    assert scene.crs == "EPSG:2056"
    compare(scene, umbra.make_scene(vertices, faces))
    parts = [
        umbra.Part(name, "", umbra.Mesh(vertices + (move, 0, 0), faces))
        for name, move in (("a", 0), ("b", 5), ("a", 9))
    ]
    city = umbra.make_scene(parts)
    back = umbra.Scene.from_trimesh(city.to_trimesh())
    assert [part.name for part in back] == ["a", "b", "a (2)"]
    for one, two in zip(city, back, strict=True):
        np.testing.assert_allclose(one.bounds + city.origin, two.bounds + back.origin, atol=1e-9)


def test_nodes_of_a_trimesh_scene_are_moved_into_place():
    trimesh = pytest.importorskip("trimesh")
    shape = trimesh.Trimesh(*map(np.array, BOX), process=False)
    city = trimesh.Scene()
    move = np.eye(4)
    move[:3, 3] = 10, 0, 1
    city.add_geometry(shape, node_name="here", geom_name="house")
    city.add_geometry(shape, node_name="there", geom_name="house", transform=move)
    scene = umbra.Scene.from_trimesh(city)
    assert [part.name for part in scene] == ["here", "there"]
    np.testing.assert_array_equal(scene["there"].bounds(), [(10, 0, 1), (12, 3, 5)])


@pytest.mark.parametrize("shift", [np.zeros(3), FAR])
def test_pyvista_there_and_back(shift):
    pytest.importorskip("pyvista")
    vertices, faces = np.array(BOX[0]) + shift, np.array(BOX[1])
    parts = [
        umbra.Part(name, "", umbra.Mesh(vertices + (move, 0, 0), faces))
        for name, move in (("a", 0), ("b", 5))
    ]
    city = umbra.make_scene(parts)
    blocks = city.to_pyvista()
    assert blocks["b"].n_cells == len(faces)
    compare(city, umbra.Scene.from_pyvista(blocks))
    assert umbra.Scene.from_pyvista(blocks[0]).bounds().tolist() == city["a"].bounds().tolist()


def test_a_volume_of_pyvista_casts_by_its_surface():
    pyvista = pytest.importorskip("pyvista")
    scene = umbra.Scene.from_pyvista(pyvista.ImageData(dimensions=(3, 4, 5)))
    np.testing.assert_array_equal(scene.bounds(), [(0, 0, 0), (2, 3, 4)])
    assert sum(part.triangles for part in scene) == 2 * 2 * (2 * 3 + 2 * 4 + 3 * 4)


def test_geopandas_is_read_as_a_file_of_footprints():
    geopandas = pytest.importorskip("geopandas")
    shapely = pytest.importorskip("shapely")
    table = geopandas.GeoDataFrame(
        {"h": [10.0, 20.0], "called": ["hall", "tower"]},
        geometry=[shapely.box(x, 1.2e6, x + 3, 1.2e6 + 3) for x in (2.6e6, 2.6e6 + 9)],
        crs="EPSG:2056",
    )
    scene = umbra.Scene.from_geopandas(table, height="h", name_column="called")
    assert [part.name for part in scene] == ["hall", "tower"]
    assert scene.crs == "EPSG:2056"
    assert scene.latitude == pytest.approx(46.95, abs=0.01)
    np.testing.assert_allclose(np.ptp(scene["tower"].bounds(), axis=0), (3, 3, 20))
    with pytest.raises(umbra.InputError, match="no heights"):
        umbra.Scene.from_geopandas(table.drop(columns="h"))


def test_what_is_of_no_such_library_is_told():
    for make in (umbra.Scene.from_trimesh, umbra.Scene.from_pyvista, umbra.Scene.from_geopandas):
        with pytest.raises(umbra.InputError, match="is a str, not a"):
            make("tower")


@pytest.mark.parametrize(
    ("method", "package"), [("to_trimesh", "trimesh"), ("to_pyvista", "pyvista")]
)
def test_a_missing_package_is_named(monkeypatch, method, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(umbra.InputError, match=f"{method} needs {package}.*pip install {package}"):
        getattr(umbra.make_scene(*BOX), method)()
