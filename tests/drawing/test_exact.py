"""Drawings as vectors beside the counter: every pixel but those on an edge."""

import numpy as np
import pytest
from support.model_files import DATA, FILES
from support.paint import NEAR, judge_drawing, opaque
from support.shapes import aligned_boxes, box, city, jumble, merge, soup, three_walls, torus_knot
from support.sweeps import sample_cases

import umbra
from umbra.drawing.overlay import unite
from umbra.scene import Part, Scene
from umbra.scene.mesh import Mesh

SUN = umbra.directional_light((-0.75, -0.25, 0.5))
LOW = umbra.directional_light((0.5, -0.6, 0.15))
SIZE = (200, 150)


def make(mesh):
    return Scene((Part("it", "", Mesh(*mesh)),), np.zeros(3))


def views(scene):
    """Give cameras around, within and below a scene, near walls, and both kinds of light."""
    low, high = scene.bounds()
    middle, size = (low + high) / 2, high - low
    yield umbra.make_camera(scene, size=SIZE), SUN, low[2]
    yield umbra.make_camera(scene, size=SIZE), LOW, low[2] - 0.1 * size[2]
    inside = middle + 0.03 * size
    yield umbra.Camera(inside, middle + size * (1, 0.3, 0), size=SIZE, fov=80), SUN, low[2]
    yield (
        umbra.Camera(inside, middle - size * (0.2, 1, 0.4), size=SIZE, fov=80),
        umbra.point_light(middle + size * (0.1, -0.2, 0.4)), None,
    )  # fmt: skip
    street = np.append(low[:2] - 0.1 * size[:2], low[2] + 0.05 * size[2])
    yield umbra.Camera(street, middle, size=SIZE), LOW, low[2]
    yield (
        umbra.Camera(middle - size * 3, middle, size=SIZE, height=1.2 * size.max()),
        umbra.point_light(high + 0.2 * size), low[2],
    )  # fmt: skip
    flat = umbra.Camera(middle + (0, 0, 3 * size[2]), middle, (0, 1, 0), SIZE, height=size[1])
    yield flat, LOW, low[2]
    yield (
        umbra.Camera(
            middle - (0, 2 * size[1], 0), middle, size=SIZE, near=1.9 * size[1], far=2.1 * size[1]
        ), SUN, None,
    )  # fmt: skip
    yield umbra.Camera(middle - (0, 0, 2 * size[2]), middle, (0, 1, 0), SIZE), LOW, None


@pytest.mark.parametrize(
    "mesh",
    [
        box((0, 0, 0), (2, 3, 4)),
        aligned_boxes(),
        three_walls(),
        city(4),
        torus_knot(24, 5),
        merge(box((0, 0, 0), (2, 2, 2)), box((1, 1, 1), (3, 3, 3)), box((0, 0, 2), (1, 1, 5))),
        soup(np.random.default_rng(1), 60),
        soup(np.random.default_rng(2), 60),
        jumble(np.random.default_rng(3)),
    ],
    ids=["box", "aligned", "walls", "city", "knot", "crossing", "soup", "soup2", "jumble"],
)
def test_every_pixel_is_that_of_the_counter(mesh):
    scene = make(mesh)
    shown = 0
    for number, (camera, light, ground) in enumerate(views(scene)):
        found = judge_drawing(scene, camera, light, ground)
        assert found.farthest <= NEAR, (number, found)
        shown += found.shadows > 0
    assert shown >= 4


@pytest.mark.parametrize("name", [*sample_cases(FILES[3:], 2, 1), FILES[0], "fzk_haus.ifc"])
def test_real_models_are_drawn_exactly(name):
    if not (DATA / name).exists():
        pytest.skip(f"no real model {name}")
    if name.endswith("ifc"):
        pytest.importorskip("ifcopenshell")
    scene = opaque(umbra.read(DATA / name))
    low, high = scene.bounds()
    middle, size = (low + high) / 2, high - low
    street = np.append(low[:2] - 0.1 * size[:2], low[2] + 1.7)
    # In Vienna's a shadow 4 cm wide is seen 1 km away: the end of a needle.
    views = [(umbra.make_camera(scene, size=(320, 240)), SUN)]
    if name != FILES[0]:  # a quarter through its streets takes a minute
        views.append((umbra.Camera(street, middle, size=(320, 240), fov=20), LOW))
    for camera, light in views:
        found = judge_drawing(scene, camera, light, low[2])
        assert found.farthest <= NEAR, found
        assert found.wrong < 3e-4 * found.pixels
        assert found.shadows > 5


def test_a_needle_is_left_out_only_if_no_disc_has_room():
    head = [(14, -1e-4), (14.03, -0.03), (14.06, 0), (14.03, 0.03), (14, 1e-4)]
    needle = np.array([(0, 0), *head])
    for ring in (needle, needle[::-1]):
        assert len(unite([ring])) == 1
    assert not unite([np.array([(0, 0), (300, 0), (300, 1e-3)])])
