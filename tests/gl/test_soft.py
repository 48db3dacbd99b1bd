"""Soft shadows on OpenGL: the CPU's answers, in frames and in pictures."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box, city, merge, sheet, turned

from umbra.cpu.frame import FrameCounter
from umbra.cpu.shade import shade
from umbra.errors import InputError
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.soft.complexity_pictures import find_digits
from umbra.gl.soft.weng_pictures import ScaledLayers
from umbra.methods import SOFT, Softness
from umbra.rays.depth import GROUND
from umbra.scene import (
    Camera,
    Material,
    Mesh,
    Part,
    directional_light,
    make_scene,
    point_light,
    spot_light,
)
from umbra.soft import ball_light, rectangle_light

SIZE = (160, 120)
SAMPLES = 24
COARSE = Softness(samples=SAMPLES)
TOWN_VIEWS = {
    "from above": Camera((-30, -40, 45), (25, 25, 0), size=SIZE),
    "parallel": Camera((-30, -40, 45), (25, 25, 0), size=SIZE, height=60.0),
    "in a street": Camera((30, 4, 2), (20, 40, 3), size=SIZE),
}
LIGHTS = {
    "lamp": ball_light(point_light((20, 22, 60)), 2.0),
    "low lamp": ball_light(point_light((-12, 24, 6)), 1.0),
    "sun": ball_light(directional_light((0.3, -0.6, 0.8)), 2.0),
    "panel from behind": rectangle_light(point_light((0, 30, 40)), (0, 3, 1), (5, 0, 0)),
    "panel": rectangle_light(point_light((24, 20, 50)), (6, 0, 0), (0, 4, 1)),
}


@pytest.fixture(scope="module")
def town():
    return make_scene(*city(4, seed=5))


def part(mesh, name="a", transform=None):
    return Part(name, "", Mesh(*mesh), transform=transform)


def find_on_cpu(counter, camera, light, method, softness=COARSE):
    view, _ = counter.see(camera)
    return view, *counter.find_visibility(view, camera, [light], method, softness)


def find_on_gl(device, scene, camera, lights, method, casters=None, ground=0.0):
    with GlFrameCounter(scene, casters, ground, device=device) as counter:
        view, _ = counter.see(camera)
        return view, counter.find_visibility(view, camera, lights, method, COARSE)


def count_apart(one, other, view_one, view_other):
    """Count pixels that differ, of those that see the same face."""
    same = view_one.face == view_other.face
    assert same.mean() > 0.99
    return int((np.abs(one - other)[same] > 0.5 / SAMPLES).sum())


@pytest.mark.parametrize("seen", TOWN_VIEWS)
@pytest.mark.parametrize("method", SOFT)
def test_visibility_is_the_cpus(device, town, seen, method):
    camera = TOWN_VIEWS[seen]
    view, found = find_on_gl(device, town, camera, list(LIGHTS.values()), method)
    counter = FrameCounter(town, ground=0.0)
    _, frame = counter.see(camera)
    partial = 0
    for light, ours in zip(LIGHTS.values(), found, strict=True):
        theirs_view, theirs = find_on_cpu(counter, camera, light, method)
        if method == "wedges":  # where a surface is turned from the light its own edges are at 0 m
            turned_away = ~frame.lit(np.zeros(theirs.shape, np.int32), light.light)
            ours[turned_away] = theirs[turned_away] = 0.0
        inside = (theirs > 0) & (theirs < 1)
        partial += int(inside.sum())
        assert ours.dtype == np.float32
        # A pixel on an edge of a layer, or of a sample's shadow, may see either side of it.
        most = 1 if method in {"wedges", "complexity"} else 4 + 0.02 * inside.sum()
        assert count_apart(ours, theirs, view, theirs_view) <= most
    assert partial > 100


def test_edges_that_come_near_to_what_is_seen_keep_their_digits(device, town):
    camera = replace(TOWN_VIEWS["from above"], size=(480, 360))
    view, (found,) = find_on_gl(device, town, camera, [LIGHTS["sun"]], "wedges")
    counter = FrameCounter(town, ground=0.0)
    theirs_view, theirs = find_on_cpu(counter, camera, LIGHTS["sun"], "wedges")
    faces = counter.see(camera)[1].lit(np.zeros(found.shape, np.int32), LIGHTS["sun"].light)
    assert ((theirs > 0) & (theirs < 1) & faces).sum() > 2000
    assert count_apart(found * faces, theirs * faces, view, theirs_view) <= 6


@pytest.mark.parametrize("method", ["wedges", "complexity"])
def test_no_speck_of_light_lies_at_the_foot_of_a_wall(device, method):
    wrong = partial = 0
    for seed in (16, 44, 47, 73, *range(8)):
        rng = np.random.default_rng(seed)
        houses = [box((0, 0, 0), rng.uniform(1, 5, 3)) for _ in range(3)]
        places = np.append(rng.uniform(-6, 6, (3, 2)), np.zeros((3, 1)), 1)
        scene = make_scene(*merge(*((v + p, f) for (v, f), p in zip(houses, places, strict=True))))
        # Every other lamp is in the plane of the first house's western wall.
        x = places[0, 0] if seed % 2 else rng.uniform(-9, 9)
        lamp = ball_light(point_light((x, *rng.uniform(-9, 9, 1), rng.uniform(7, 14))), 0.6)
        camera = Camera((*rng.uniform(-16, 16, 2), 12), (0, 0, 1), size=(128, 96))
        view, (ours,) = find_on_gl(device, scene, camera, [lamp], method)
        counter = FrameCounter(scene, ground=0.0)
        theirs_view, theirs = find_on_cpu(counter, camera, lamp, method)
        frame = counter.see(camera)[1]
        # Walls in whose plane the lamp stands get no light of it.
        away = (frame.normal * (lamp.light.position[:3] - frame.position)).sum(-1)
        same = (away > 1e-6) & (view.face == theirs_view.face)
        wrong += int((same & (np.abs(ours - theirs) > 0.1)).sum())
        partial += int((same & (theirs > 0) & (theirs < 1)).sum())
    assert partial > 2000
    assert wrong == 0


@pytest.mark.parametrize("method", ["wedges", "complexity"])
@pytest.mark.parametrize("shift", [0.0, 1e-6, -1e-6])
def test_where_the_middle_is_just_hidden_half_is_seen(device, shift, method):
    # The plate's edges end over the middles of pixels, where count and edge may disagree.
    reach = 1.0 + shift
    corners = [(-reach, -reach), (reach, -reach), (reach, reach), (-reach, reach)]
    plate = make_scene([part(sheet([(x, y, 2.0) for x, y in corners]))])
    camera = Camera((0, 0, 1.9), (0, 0, 0), up=(0, 1, 0), size=(161, 161), height=4.025, near=1e-3)
    noon = ball_light(directional_light((0, 0, 1)), 5.0)
    _, (found,) = find_on_gl(device, plate, camera, [noon], method)
    # Columns are 0.025 m apart: the edge at 1 m is 40 from the middle one.
    for line in (found[60:101, 120], found[60:101, 40], found[40, 60:101], found[120, 60:101]):
        np.testing.assert_allclose(line, 0.5, atol=0.01)


@pytest.mark.parametrize("method", ["wedges", "complexity"])
def test_a_wall_in_whose_plane_the_middle_stands(device, method):
    # By hand as in tests/soft: the panel's far part is hidden, up to x / 2 beyond its middle.
    wall = make_scene([part(sheet([(0, -500, 0), (0, 500, 0), (0, 500, 2), (0, -500, 2)]))])
    camera = Camera((0, 0, 1.9), (0, 0, 0), up=(0, 1, 0), size=(160, 8), height=0.19, near=1e-3)
    panel = rectangle_light(point_light((0, 0, 3)), (2, 0, 0), (0, 2, 0))
    _, (found,) = find_on_gl(device, wall, camera, [panel], method)
    x = np.abs(np.arange(160) - 79.5) * 0.19 / 8
    np.testing.assert_allclose(found, np.tile(0.5 + x / 4, (8, 1)), atol=2e-3)


def test_layers_of_a_plate_are_nested_squares(device):
    plate = make_scene([part(sheet([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]))])
    camera = Camera((0, 0, 0.9), (0, 0, 0), up=(0, 1, 0), size=(160, 160), height=4.0, near=1e-3)
    noon = ball_light(directional_light((0, 0, 1)), 1.0)
    with GlFrameCounter(plate, ground=0.0, device=device) as counter:
        view, frame = counter.see(camera)
        plans = counter.planner.plan(counter._seen[1], [noon.light], choices=counter.choices)
        layers = ScaledLayers(counter.planner, counter.counter, length=5.0, gap=0.5)
        counter.soft._made["weng"] = layers
        (found,) = counter.find_visibility(view, camera, [noon], "weng")
        assert len(plans) == 1
    across = np.abs(frame.position[..., :2]).max(-1)
    layer = np.clip(np.ceil((across - 1) / 0.05 - 1e-9), 0, 11)
    np.testing.assert_allclose(found, layer / 11, atol=1e-6)
    assert {*layer.ravel()} == set(range(12))


def test_no_layer_falls_on_its_own_caster(device):
    scene = make_scene([part(turned(box((-1, -1, 0), (1, 1, 1)), 20))])
    camera = Camera((4, 5, 5), (0, 0, 0), size=SIZE)
    light = ball_light(point_light((5, 2, 6)), 0.5)
    with GlFrameCounter(scene, ground=0.0, device=device) as counter:
        view, frame = counter.see(camera)
        hard = counter.count(view, camera, light.light) == 0
        (found,) = counter.find_visibility(view, camera, [light], "weng")
    own = frame.part == 0
    assert (own & hard).sum() > 500
    np.testing.assert_array_equal(found[own], hard[own])
    assert ((found < 1) & hard)[~own].sum() > 100


@pytest.mark.parametrize(("layers", "spots", "digits"), [(8, 150, 4), (18, 90, 3), (66, 60, 2)])
def test_spots_are_counted_in_so_many_digits_and_passes(device, layers, spots, digits):
    heights = 1 + 3 * np.arange(layers) / layers
    plates = [
        sheet([(-1 + 0.4 * z, -1, z), (1, -1, z), (1, 1, z), (-1 + 0.4 * z, 1, z)]) for z in heights
    ]
    scene = make_scene([part(merge(*plates))])
    camera = Camera((-5, -6, 0.9), (0, 0, 0), size=SIZE)
    lights = [ball_light(point_light((2, 1, 9)), 0.6), LIGHTS["panel"], LIGHTS["sun"]]
    softness = Softness(spots=spots)
    with GlFrameCounter(scene, ground=0.0, device=device) as counter:
        view, _ = counter.see(camera)
        found = counter.find_visibility(view, camera, lights, "complexity", softness)
        plans = counter.soft.choose("complexity")._plans
        assert {find_digits(plan.statistics.deepest) for plan in plans} == {digits}
    counter = FrameCounter(scene, ground=0.0)
    theirs_view, frame = counter.see(camera)
    theirs = counter.find_visibility(theirs_view, camera, lights, "complexity", softness)
    floor = frame.part == GROUND
    for one, other in zip(found, theirs, strict=True):
        assert ((other > 0) & (other < 1))[floor].sum() > 40
        same = view.face == theirs_view.face
        # A spot that an edge passes within rounding may be on either side of it.
        assert (np.abs(one - other)[same & floor] > 1.5 / spots).sum() <= 6


@pytest.mark.parametrize("method", ["weng", "complexity"])
def test_instances_grow_each_about_its_own_middle(device, method):
    turn = np.array([[0.8, -0.6, 0, 0], [0.6, 0.8, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    transforms = [turn.copy() for _ in range(4)]
    for number, transform in enumerate(transforms):
        transform[:2, 3] = 4 * number - 6, 1.5 * number
    transforms[1] = transforms[1] @ np.diag([-1, 1, 1, 1])  # mirrored
    transforms[2] = transforms[2] @ np.diag([1.5, 0.6, 1.2, 1])
    mesh = Mesh(*merge(box((-1, -1, 1), (1, 1, 2)), box((-0.5, -0.5, 2.5), (0.5, 0.8, 3))))
    parts = [Part(f"p{k}", "", mesh, transform=t) for k, t in enumerate(transforms)]
    scene = make_scene([*parts, part(box((-9, 5, 0), (9, 6, 4)), "wall")])
    camera = Camera((-2, -16, 12), (0, 2, 0), size=SIZE)
    lights = [ball_light(point_light((-3, -9, 9)), 0.5), LIGHTS["sun"]]
    view, found = find_on_gl(device, scene, camera, lights, method)
    counter = FrameCounter(scene, ground=0.0)
    for light, ours in zip(lights, found, strict=True):
        theirs_view, theirs = find_on_cpu(counter, camera, light, method)
        inside = ((theirs > 0) & (theirs < 1)).sum()
        assert inside > 100
        assert count_apart(ours, theirs, view, theirs_view) <= 0.02 * inside


def test_parts_that_do_not_cast_receive(device):
    scene = make_scene([part(box((-2, -2, 0), (2, 2, 0.5))), part(box((-1, -1, 1), (1, 1, 1.5)))])
    camera = Camera((-6, -7, 2), (0, 0, 0.5), size=SIZE, fov=40)
    sun = ball_light(directional_light((0.1, -0.2, 1)), 1.0)
    found = [
        find_on_gl(device, scene, camera, [sun], "weng", casters)[1][0]
        for casters in (None, [1], [1, 0])
    ]
    _, theirs = find_on_cpu(FrameCounter(scene, casters=[1], ground=0.0), camera, sun, "weng")
    assert (np.abs(found[1] - theirs) > 0.02).sum() <= 4
    top = ((theirs > 0) & (theirs < 1)).sum()
    assert top > 100
    np.testing.assert_array_equal(found[0], found[2])


@pytest.mark.parametrize("mirrored", [False, True])
def test_parallel_rays_that_end_in_layers(device, mirrored):
    # The lamp is level with the caster: its volume has no end, and rays run along it.
    turn = np.diag([1.0, -1.0 if mirrored else 1.0, 1.0, 1.0])
    turn[:3, 3] = 0.0, 0.2, 0.0
    caster = part(turned(box((1, -0.3, 1.2), (1.3, 0.3, 1.8)), 10), "caster", turn)
    scene = make_scene([caster, part(box((12, -8, 0), (13, 8, 8)), "wall")])
    light = ball_light(point_light((0, 0, 1.5)), 0.1)
    counter = FrameCounter(scene, ground=0.0)
    for eye in ((3, 0, 1.5), (4, -6, 2)):
        camera = Camera(eye, (12, 0, 1.3), size=SIZE, height=9.0)
        view, (found,) = find_on_gl(device, scene, camera, [light], "weng")
        theirs_view, theirs = find_on_cpu(counter, camera, light, "weng")
        inside = ((theirs > 0) & (theirs < 1)).sum()
        assert inside > 500
        assert count_apart(found, theirs, view, theirs_view) <= 0.03 * inside


def test_layers_beyond_255_are_counted_in_floats(device):
    # The stack's own shadow is 256 deep, which a stencil takes for light.
    boxes = [box((-1, -1, z), (1, 1, z + 0.01)) for z in np.linspace(1, 6, 256)]
    scene = make_scene([part(merge(*boxes))])
    camera = Camera((-5, -6, 4), (0, 0, 0), size=SIZE)
    noon = ball_light(directional_light((0, 0, 1)), 1.0)
    view, (found,) = find_on_gl(device, scene, camera, [noon], "weng")
    _, theirs = find_on_cpu(FrameCounter(scene, ground=0.0), camera, noon, "weng")
    floor = view.face == GROUND
    assert ((theirs > 0) & (theirs < 1))[floor].sum() > 40
    assert (theirs == 0)[floor].sum() > 300
    assert (np.abs(found - theirs) > 0.02)[floor].sum() <= 12


def soften_on_cpu(scene, camera, lights, method, ground=0.0):
    """Shade a picture whose lights are hard or have a size."""
    counter = FrameCounter(scene, ground=ground)
    view, frame = counter.see(camera)
    none = np.zeros(frame.part.shape, np.int32)
    middles, reached = [], []
    for light in lights:
        middles.append(getattr(light, "light", light))
        if middles[-1] is light:
            reached.append(frame.lit(counter.count(view, camera, light), light))
        else:
            _, share = find_on_cpu(counter, camera, light, method)
            reached.append(share * frame.lit(none, middles[-1]))
    return shade(scene, frame, middles, reached, view)


@pytest.mark.parametrize("method", SOFT)
def test_the_picture_is_the_cpus(device, town, method):
    camera = TOWN_VIEWS["from above"]
    lights = [
        ball_light(replace(LIGHTS["lamp"].light, color=(1.0, 0.8, 0.6)), 2.0),
        directional_light((-0.5, -0.3, 0.5), (0.3, 0.3, 0.5)),
        ball_light(point_light((10, 5, 25), range=40.0, attenuation=(1, 0.02, 0.001)), 1.5),
        ball_light(spot_light((10, 10, 50), (20, 20, 0), 25, (0.2, 1, 0.3), inner_angle=12), 1.0),
    ]
    with SceneRenderer(town, 0.0, device=device, softness=COARSE) as renderer:
        ours = renderer.render(camera, lights, soft=method)
        assert len(renderer.plans) == len(lights)
        hard = renderer.render(camera, [getattr(light, "light", light) for light in lights])
    theirs = soften_on_cpu(town, camera, lights, method)
    assert (np.abs(ours.astype(int) - theirs).max(-1) > 3).sum() <= 40
    assert (np.abs(hard.astype(int) - theirs).max(-1) > 3).sum() > 150


def test_what_is_seen_through_keeps_the_shadow_behind(device, monkeypatch):
    pane = replace(
        part(sheet([(-3, -3, 0.2), (3, -3, 0.2), (3, -3, 3), (-3, -3, 3)]), "pane"),
        material=Material(opacity=0.3),
    )
    table = part(box((-1, -1, 1), (1, 1, 1.3)), "table")
    camera = Camera((0.5, -9, 3), (0, 0, 0.8), size=SIZE, fov=40)
    light = ball_light(point_light((2, -2, 6)), 0.5)
    pictures = []
    for parts in ([table, pane], [table]):
        with SceneRenderer(make_scene(parts), 0.0, device=device) as renderer:
            monkeypatch.setattr(renderer.layers, "blend", lambda *_: iter(()))  # the pane's own
            renderer.render(camera, [light], soft="weng")
            pictures.append(renderer.soft.choose("weng")._stack.picture.target.read())
    np.testing.assert_array_equal(*pictures)
    assert ((pictures[0] > 0) & (pictures[0] < 1)).sum() > 200


@pytest.mark.parametrize("method", SOFT)
def test_nothing_is_left_of_the_frame_before(device, town, method):
    cameras = [TOWN_VIEWS["from above"], TOWN_VIEWS["in a street"]]
    moved = replace(LIGHTS["lamp"], light=point_light((14, 22, 60)))
    frames = [
        (cameras[0], [LIGHTS["lamp"]]),
        (cameras[1], [LIGHTS["lamp"]]),
        (cameras[1], [moved, LIGHTS["sun"]]),
        (cameras[1], [LIGHTS["sun"]]),
        (replace(cameras[0], size=(80, 60)), [moved]),
        (cameras[0], [LIGHTS["lamp"]]),
    ]
    with SceneRenderer(town, 0.0, device=device, softness=COARSE) as renderer:
        kept = [renderer.render(camera, lights, soft=method) for camera, lights in frames]
        again = renderer.render(*frames[-1], soft=method)
    for (camera, lights), picture in zip(frames, kept, strict=True):
        with SceneRenderer(town, 0.0, device=device, softness=COARSE) as renderer:
            np.testing.assert_array_equal(renderer.render(camera, lights, soft=method), picture)
    np.testing.assert_array_equal(again, kept[-1])


@pytest.mark.parametrize("method", SOFT)
def test_what_moves_takes_its_soft_shadow_along(device, method):
    def pose(x):
        transform = np.eye(4)
        transform[0, 3] = x
        return make_scene(
            [part(box((-1, -1, 1), (1, 1, 2)), "mover", transform), part(box((4, 0, 0), (5, 1, 1)))]
        )

    camera = Camera((-4, -9, 7), (0, 0, 0), size=SIZE)
    light = ball_light(point_light((1, -2, 8)), 0.5)
    with SceneRenderer(pose(0.0), 0.0, device=device, softness=COARSE) as renderer:
        first = renderer.render(camera, [light], soft=method)
        renderer.move(pose(1.5))
        found = renderer.render(camera, [light], soft=method)
    with SceneRenderer(pose(1.5), 0.0, device=device, softness=COARSE) as renderer:
        np.testing.assert_array_equal(found, renderer.render(camera, [light], soft=method))
    assert (found != first).any(-1).sum() > 500


def test_the_methods_are_the_cpus(device, town):
    with (
        SceneRenderer(town, 0.0, device=device) as renderer,
        pytest.raises(InputError, match=r"by 'fog'; it has samples, wedges, complexity, weng"),
    ):
        renderer.render(TOWN_VIEWS["from above"], [LIGHTS["lamp"]], soft="fog")


def test_lights_alone_or_nothing_that_casts(device, town):
    camera = TOWN_VIEWS["from above"]
    with SceneRenderer(town, 0.0, device=device, casters=[], softness=COARSE) as renderer:
        plain = renderer.render(camera, [LIGHTS["lamp"].light], shadows=False)
        for method in SOFT:
            found = renderer.render(camera, [LIGHTS["lamp"]], soft=method)
            np.testing.assert_allclose(found, plain.astype(int), atol=1)
            assert (renderer.render(camera, [], soft=method) != plain).any()


def test_length_and_gap_are_taken_on_both_devices(device, town):
    camera = Camera((-30, -40, 35), (0, 0, 5), size=SIZE)
    light = ball_light(point_light((10, -12, 40)), 1.5)
    found = []
    with GlFrameCounter(town, ground=0.0, device=device) as counter:
        view, _ = counter.see(camera)
        for softness in (Softness(), Softness(length=4.0, gap=2.0)):
            (shares,) = counter.find_visibility(view, camera, [light], "weng", softness)
            seen, expected = find_on_cpu(
                FrameCounter(town, ground=0.0), camera, light, "weng", softness
            )
            assert count_apart(shares, expected, view, seen) < 60
            found.append(shares)
    np.testing.assert_allclose(np.unique(found[1].round(4)), [0, 1 / 3, 2 / 3, 1], atol=1e-4)
    assert (found[0] != found[1]).mean() > 0.02


def test_the_steps_are_the_cpus(device, town):
    with GlFrameCounter(town, ground=0.0, device=device) as counter:
        for steps in ((0, 0.4), (5, 0.001)):
            with pytest.raises(InputError, match=r"2\.5 and 0\.4 make 6"):
                ScaledLayers(counter.planner, counter.counter, length=steps[0], gap=steps[1])
        layers = ScaledLayers(counter.planner, counter.counter)
        assert len(layers._steps) == Softness().layers == 6
        layers.release()
