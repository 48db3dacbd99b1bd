"""A packed model is the geometry that it was packed from."""

import numpy as np
import pytest
from support.shapes import SCENES
from support.web import unpack

from umbra.errors import InputError
from umbra.scene import make_scene
from umbra.scene.mesh import Mesh, Part
from umbra.scene.scene import Scene
from umbra.web.pack import pack_model, quantise


@pytest.mark.parametrize("name", ["one box", "soup", "jumble", "far away", "flipped windings"])
def test_a_browser_reads_back_every_triangle(picture, name):
    scene = make_scene(*SCENES[name]())
    picture.load(scene, (64, 48))
    places, faces = unpack(picture)
    rounded = quantise(scene)
    soup = rounded.triangles()
    expected = soup.vertices[soup.faces].reshape(-1, 9)
    found = places[faces].reshape(-1, 9)
    assert np.array_equal(expected[np.lexsort(expected.T)], found[np.lexsort(found.T)])
    assert np.abs(rounded.bounds() - scene.bounds()).max() <= 2.0**-14


def test_float32_holds_every_position():
    rng = np.random.default_rng(1)
    scene = make_scene(
        rng.uniform(-9000, 9000, (300, 3)) + [4e5, 5e6, 0], np.arange(300).reshape(-1, 3)
    )
    places = quantise(scene).triangles().vertices
    assert np.array_equal(places.astype(np.float32), places)


def test_vertices_that_parts_share_are_packed_once():
    rng = np.random.default_rng(2)
    vertices = rng.uniform(0, 50, (900, 3))
    normals = rng.normal(size=(900, 3)).astype(np.float32)
    rows = np.arange(900, dtype=np.int32).reshape(30, 10, 3)
    turned = np.diag([1.0, -1.0, 1.0, 1.0])

    def make(is_shared):
        kept = Mesh(vertices, rows[0]).vertices
        parts = []
        for k, faces in enumerate(rows):
            own = kept if is_shared else kept.copy()
            mesh = Mesh(own, faces, normals)
            parts.append(Part(str(k), "", mesh, transform=turned if k % 7 == 3 else None))
        return Scene(tuple(parts), np.zeros(3))

    soup = quantise(make(is_shared=True)).triangles()
    assert len(soup.vertices) == 900 * 5  # four are turned
    assert pack_model(make(is_shared=True)) == pack_model(make(is_shared=False))


def test_a_scene_without_triangles_is_refused():
    with pytest.raises(InputError, match="no triangles"):
        pack_model(Scene((), np.zeros(3)))
