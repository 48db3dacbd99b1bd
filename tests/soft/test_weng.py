"""Scaled layers: solved by hand, and where they are wrong."""

import numpy as np
import pytest
from support.shapes import box, merge, sheet, turned
from support.soft import at, look, look_at_floor

from umbra.cpu.frame import FrameCounter
from umbra.errors import InputError
from umbra.rays.depth import GROUND
from umbra.scene import Camera, Mesh, Part, directional_light, make_scene, point_light
from umbra.scene.lights import Light
from umbra.soft import ball_light, find_method
from umbra.soft.weng import Layers, _pair_off, find_layer_opacities, find_visibility_by_layers

NOON = ball_light(directional_light((0, 0, 1)), 1.0)
PLATE = sheet([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
# A U of three bars, 3 x 3 m, one metre wide: open to the north.
U = (
    np.array(
        [(-1.5, -1.5, 1), (1.5, -1.5, 1), (1.5, 1.5, 1), (0.5, 1.5, 1),
         (0.5, -0.5, 1), (-0.5, -0.5, 1), (-0.5, 1.5, 1), (-1.5, 1.5, 1)]
    ),
    np.array([(0, 1, 4), (0, 4, 5), (1, 2, 4), (2, 3, 4), (0, 5, 7), (5, 6, 7)], np.int32),
)  # fmt: skip


def test_opacities_make_an_even_stack():
    found = find_layer_opacities(6, 0.7)[::-1]
    np.testing.assert_allclose(found, 0.7 / np.array([7, 6.3, 5.6, 4.9, 4.2, 3.5, 2.8]))
    assert np.round(found, 3).tolist() == [0.1, 0.111, 0.125, 0.143, 0.167, 0.2, 0.25]
    for n, darkness in ((1, 1.0), (6, 0.7), (10, 1.0)):
        stacked = np.cumprod(1 - find_layer_opacities(n, darkness)[::-1])
        even = 1 - darkness * np.arange(1, n + 2) / (n + 1)
        np.testing.assert_allclose(stacked, even, atol=1e-15)


def test_a_plate_at_noon_has_nested_squares():
    # Radius 1 where it is nearest, so layer m reaches 1 + 0.05 m; ten of them.
    seen = look_at_floor(PLATE, half=2.0, pixels=160)
    found = find_visibility_by_layers(*seen, NOON, length=5.0, gap=0.5)
    across = np.abs(seen[2].position[..., :2]).max(-1)
    layer = np.maximum(np.ceil((across - 1) / 0.05 - 1e-9), 0)
    np.testing.assert_allclose(found, np.minimum(layer, 11) / 11, atol=1e-6)
    assert {*layer.ravel()} >= set(range(11))


def test_a_layer_is_the_shadow_of_the_enlarged_caster():
    # From outside, from below the caster in its shadow, from below the floor; along the light.
    views = [
        Camera((-6, -7, 6), (0, 0, 0.5), size=(80, 60)),
        Camera((0.3, 0.4, 0.3), (1, 1, 0), size=(80, 60), near=0.01),
        Camera((-6, -7, 6), (0, 0, 0.5), size=(80, 60), height=12.0),
        Camera((-6, -7, -6), (0, 0, 0.5), size=(80, 60)),
    ]
    some = 0
    for view in views:
        lights = [
            point_light((1, 2, 8)),
            directional_light((1, 2, 4)),
            directional_light(view.eye - view.target),
            directional_light(view.target - view.eye),
            Light(np.append(view.eye, 1.0)),
        ]
        for light in lights:
            counter, shown, frame, _ = look(box((-1, -1, 1), (1, 1, 2)), view)
            layer = Layers.of(counter, light).scaled(1.3)
            found = counter.with_caster(layer).count_undrawn(shown, view, light)
            drawn = (layer.vertices + counter.scene.origin, layer.faces)
            counter, shown, other, _ = look(drawn, view)
            floor = (frame.part == GROUND) & (other.part == GROUND)
            expected = counter.count(shown, view, light)
            np.testing.assert_array_equal(found[floor], expected[floor])
            some += (expected[floor] > 0).any()
    assert some > 10


def test_layers_need_their_caps():
    # Between the eye and this point is the layer's cap and none of its sides.
    counter, view, _, camera = look(
        sheet([(-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2)]),
        Camera((0, 0.5, 9), (1.35, 0, 0), size=(41, 41), fov=10, near=0.01),
    )
    light = point_light((0, 0, 10))
    assert counter.count(view, camera, light)[20, 20] == 0
    layer = counter.with_caster(Layers.of(counter, light).scaled(1.25))
    assert layer.count_undrawn(view, camera, light)[20, 20] == 1


def test_each_component_grows_about_its_own_middle():
    left, right = (box((x - 1, -1, 1), (x + 1, 1, 2)) for x in (-3, 3))
    seen = look_at_floor(merge(left, right), half=5.0, pixels=100)
    found = find_visibility_by_layers(*seen, NOON, length=1.0, gap=1.0)
    alone = look_at_floor(right, half=5.0, pixels=100)
    east = seen[2].position[..., 0] > 0
    np.testing.assert_array_equal(
        found[east], find_visibility_by_layers(*alone, NOON, length=1.0, gap=1.0)[east]
    )
    assert at(seen[2], found, 3, 1.05, 0) == at(seen[2], found, -3, 1.05, 0) == 0.5


def test_any_receiver_has_the_penumbra():
    # A plate over a table: the same squares on the table's top and on the floor.
    mesh = merge(PLATE, box((0, -1.5, 0), (1.7, 1.5, 0.5)))
    seen = look(mesh, Camera((6, -7, 0.99), (0, 0, 0.5), size=(200, 150), fov=30))
    frame = seen[2]
    found = find_visibility_by_layers(*seen, NOON, length=5.0, gap=0.5)
    top = np.isclose(frame.position[..., 2], 0.5) & (frame.normal[..., 2] > 0.9)
    across = np.abs(frame.position[..., :2]).max(-1)
    layer = np.maximum(np.ceil((across[top] - 1) / 0.05 - 1e-9), 0)
    alone = np.minimum(layer, 11) / 11
    np.testing.assert_allclose(found[top], alone, atol=1e-6)
    assert ((alone > 0) & (alone < 1)).sum() > 20


def test_no_layer_falls_on_its_own_caster():
    # An enlarged box encloses much of its own lit faces.
    seen = look(
        turned(box((-1, -1, 0), (1, 1, 1)), 20), Camera((4, 5, 5), (0, 0, 0), size=(80, 60))
    )
    counter, view, frame, camera = seen
    light = ball_light(point_light((5, 2, 6)), 0.5)
    hard = counter.count(view, camera, light.light) == 0
    own = frame.part == 0
    assert (own & hard).sum() > 200
    layer = counter.with_caster(Layers.of(counter, light.light).scaled(1.25))
    assert (layer.count_undrawn(view, camera, light.light)[own & hard] != 0).sum() > 50
    np.testing.assert_array_equal(find_visibility_by_layers(*seen, light)[own], hard[own])


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 9])
def test_each_component_casts_on_every_other_and_on_what_is_none(n):
    shown = np.arange(-1, n)[None]
    casts = np.zeros((n, n + 1), bool)
    for chosen, receives in _pair_off(n, shown):
        casts |= chosen[:, None] & receives
    np.testing.assert_array_equal(casts[:, 0], True)
    np.testing.assert_array_equal(casts[:, 1:], ~np.eye(n, dtype=bool))


def test_parts_that_do_not_cast_receive():
    low, high = box((-2, -2, 0), (2, 2, 0.5)), box((-1, -1, 1), (1, 1, 1.5))
    scene = make_scene([Part(name, "", Mesh(*mesh)) for name, mesh in (("a", low), ("b", high))])
    camera = Camera((-6, -7, 2), (0, 0, 0.5), size=(160, 90), fov=40)
    found = []
    for casters in (None, [1], [1, 0]):
        counter = FrameCounter(scene, casters=casters, ground=0.0)
        seen = (counter, *counter.see(camera), camera)
        top = np.isclose(seen[2].position[..., 2], 0.5) & (seen[2].part == 0)
        found.append(find_visibility_by_layers(*seen, NOON)[top])
    assert ((found[0] > 0) & (found[0] < 1)).sum() > 50
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def test_a_concave_caster_is_not_within_its_layers():
    seen = look_at_floor(U, half=2.5, pixels=100)
    counter, view, _, camera = seen
    light = NOON.light
    hard = counter.count(view, camera, light) != 0
    # The notch grows too, by 0.5 (factor - 1) on its three sides; the U has 7 m².
    for factor, bared in ((1.1, 0.255 / 7), (1.25, 0.65625 / 7)):
        layer = counter.with_caster(Layers.of(counter, light).scaled(factor))
        within = layer.count_undrawn(view, camera, light) != 0
        assert (hard & ~within).sum() / hard.sum() == pytest.approx(bared, abs=0.005)


def test_at_contact_and_for_small_lights_the_penumbra_is_wrong():
    # A box on the floor: a small light's shadow is hard at its foot, the layers are not.
    light = ball_light(point_light((6, 0, 6)), 0.1)
    seen = look(
        turned(box((-1, -1, 0), (1, 1, 1)), 20), Camera((-4, -5, 5), (0, 0, 0), size=(80, 60))
    )
    truth = find_method("samples")(*seen, light, samples=256)
    error = find_visibility_by_layers(*seen, light) - truth
    floor = seen[2].part == GROUND
    assert error[floor].min() < -0.8  # lit floor that it darkens
    assert error[floor].max() < 0.5  # the hard shadow's own inner half penumbra stays black
    assert np.abs(find_method("wedges")(*seen, light) - truth)[floor].max() < 0.05


def test_threads_change_nothing():
    seen = look(
        turned(box((-1, -1, 0), (1, 1, 1)), 20), Camera((-4, -5, 5), (0, 0, 0), size=(80, 60))
    )
    one = find_visibility_by_layers(*seen, NOON)
    seen[0].threads = 2
    np.testing.assert_array_equal(find_visibility_by_layers(*seen, NOON), one)


@pytest.mark.parametrize(
    "steps", [(0, 0.4), (2, 0), (0.1, 0.4), (np.nan, 1), (5, 0.001), (1, np.inf)]
)
def test_steps_that_make_no_layers_are_refused(steps):
    seen = look_at_floor(PLATE, pixels=4)
    with pytest.raises(InputError, match=r"2\.5 and 0\.4 make 6"):
        find_visibility_by_layers(*seen, NOON, length=steps[0], gap=steps[1])
