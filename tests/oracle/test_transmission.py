"""Glass and leaves against rays through every pixel; on gl in ``tests/gl``."""

import numpy as np
import pytest
from support.glass import SCENES, judge

import umbra
from umbra.scene import make_scene


@pytest.mark.parametrize("name", SCENES)
def test_arrays_are_those_of_rays(name):
    make, camera, lights = SCENES[name]
    scene = make()
    picture = umbra.render(scene, camera, lights, device="cpu", arrays=True)
    differing, wrong = judge(scene, camera, lights, picture)
    assert wrong == 0
    assert differing <= 4  # within 1/64 pixel of an edge


def test_the_judge_sees_what_is_wrong():
    make, camera, lights = SCENES["garden"]
    scene = make()
    picture = umbra.render(scene, camera, lights, arrays=True)
    for name, at in (("lit", 0), ("transmission", 1)):
        array = getattr(picture, name)
        kept = array.copy()
        array[at, 60:64] = 0.5 if name == "transmission" else ~array[at, 60:64]
        assert judge(scene, camera, lights, picture)[1] > 100
        array[:] = kept
    without = make_scene([part for part in scene.parts if part.name != "leaf"])
    picture = umbra.render(without, camera, lights, arrays=True)
    assert judge(scene, camera, lights, picture)[1] > 100


def test_what_transmits_nothing_is_counted_as_before():
    make, camera, lights = SCENES["garden"]
    scene = make_scene([part for part in make().parts if not part.material.transmits])
    picture = umbra.render(scene, camera, lights, arrays=True)
    assert picture.transmission is None
    assert "transmission" not in picture.arrays()
    assert np.unique(picture.count).tolist() == [0, 1]
