"""Named views: every corner of the model lies in the picture, and fills it one way."""

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene


@pytest.mark.parametrize("view", ["isometric", "plan", "street", "bird"])
@pytest.mark.parametrize("size", [(300, 200), (150, 260)])
def test_the_model_fills_the_picture(view, size):
    scene = make_scene([
        Part("low", "", Mesh(*box((100, 50, 3), (160, 80, 12)))),
        Part("tall", "", Mesh(*box((120, 90, 3), (130, 100, 60)))),
    ])  # fmt: skip
    camera = umbra.make_camera(scene, view=view, size=size)
    points = scene.triangles().vertices + scene.origin
    x, y, w, _ = (np.column_stack([points, np.ones(len(points))]) @ camera.matrix().T).T
    assert (w > 0).all()
    places = (np.column_stack([x, y]) / w[:, None] + 0.5) / size
    room = min(places.min(), 1 - places.max())  # between the model and the nearest side
    assert 0.055 < room < (0.1 if view == "street" else 0.065)
    if view == "street":
        assert camera.eye[2] == pytest.approx(3 + 1.7)
    if view != "plan":  # the tower's edges are upright
        tower = places[points[:, 0] == 120].reshape(-1, 2)
        assert len(np.unique(tower[:, 0].round(9))) == 2


def test_a_named_view_and_an_eye_are_refused():
    with pytest.raises(umbra.InputError) as caught:
        umbra.make_camera(make_scene([Part("a", "", Mesh(*box((0, 0, 0), (1, 1, 1))))]),
                          view="plan", eye=(0, 0, 9), target=(0, 0, 0))  # fmt: skip
    assert caught.value.option == "view"
