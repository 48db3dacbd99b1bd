"""A packed model is the geometry that it was packed from."""

import numpy as np
import pytest
from support.shapes import SCENES
from support.web import unpack

from umbra.errors import InputError
from umbra.scene import make_scene
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


def test_a_scene_without_triangles_is_refused():
    with pytest.raises(InputError, match="no triangles"):
        pack_model(Scene((), np.zeros(3)))
