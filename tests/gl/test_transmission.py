"""Glass and leaves on OpenGL: arrays against rays, pictures against the CPU's."""

from dataclasses import replace

import numpy as np
import pytest
from support.glass import BLUE, FLOOR, LAMP, SCENES, garden, judge, leaf_image, level_card

import umbra
from umbra.errors import InputError
from umbra.gl import transmitters
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, Material, Part, directional_light, make_scene, point_light
from umbra.soft import ball_light

ABOVE = Camera((0, 0, 50), (0, 0, 0), (0, 1, 0), size=(60, 60), height=20.0)
MOST = 4  # pixels within 1/64 of an edge


@pytest.fixture(scope="module", params=SCENES, name="case")
def _case(request):
    make, camera, lights = SCENES[request.param]
    return make(), camera, lights


def render(scene, camera, lights, **options):
    """Draw a picture of one sample a pixel."""
    return umbra.render(scene, camera, lights, samples=1, style="plain", **options)


def count_differences(one, two, tolerance=1):
    return int((np.abs(one.astype(int) - two).max(-1) > tolerance).sum())


def test_arrays_are_those_of_rays_and_pictures_the_cpus(device, case):
    scene, camera, lights = case
    picture = render(scene, camera, lights, device="gl", arrays=True)
    differing, wrong = judge(scene, camera, lights, picture)
    assert wrong == 0
    assert differing <= MOST
    theirs = render(scene, camera, lights, device="cpu")
    assert count_differences(picture.image, theirs, 0) <= MOST
    with SceneRenderer(scene, device=device) as renderer:
        drawn = renderer.render(camera, lights)
    assert count_differences(drawn, theirs) <= MOST


def test_smooth_edges_are_those_of_layers(device):
    make, camera, lights = SCENES["garden"]
    scene = make()
    fine = replace(camera, size=tuple(4 * n for n in camera.size))
    many = render(scene, fine, lights).reshape(camera.size[1], 4, camera.size[0], 4, 3)
    levels = np.where(many <= 10, many / 255 / 12.92, ((many / 255 + 0.055) / 1.055) ** 2.4)
    mean = levels.mean((1, 3))
    truth = 255 * np.where(mean <= 0.0031308, 12.92 * mean, 1.055 * mean ** (1 / 2.4) - 0.055)
    for name in ("cpu", "gl"):
        rough, smooth = (
            np.abs(
                umbra.render(scene, camera, lights, device=name, samples=n, style="plain") - truth
            ).mean()
            for n in (1, 8)
        )
        assert smooth < 0.4 * rough


@pytest.mark.parametrize("method", ["z-fail", "alpha", "max"])
def test_any_method_counts_beside_glass(device, method):
    make, camera, lights = SCENES["garden"]
    with SceneRenderer(make(), device=device) as renderer:
        ours, theirs = (renderer.render(camera, lights, name) for name in ("auto", method))
    assert count_differences(ours, theirs) <= MOST


@pytest.mark.parametrize("soft", ["samples", "wedges", "weng"])
def test_soft_shadows_are_softer_and_alike(device, soft):
    make, camera, _ = SCENES["garden"]
    scene, light = make(), ball_light(LAMP, 0.4)
    picture = render(scene, camera, light.light, soft=soft, light_size=0.4, arrays=True)
    shares = np.unique(picture.transmission[0, ..., 0])
    assert ((shares > 0.05) & (shares < 0.95)).sum() > 8  # of the holed leaf's penumbra
    with SceneRenderer(scene, device=device) as renderer:
        drawn = renderer.render(camera, [light], soft=soft)
    assert count_differences(drawn, picture.image, 12) <= 60


def test_a_masks_scale_leaves_leaves_sharp(device):
    make, camera, lights = SCENES["garden"]
    whole, small = (
        render(make(), camera, lights, device="gl", mask_scale=scale, arrays=True)
        for scale in (1, 2)
    )
    assert (whole.transmission == small.transmission).all()
    assert (whole.lit != small.lit).mean() < 0.02


def test_leaves_and_panes_that_move_take_their_shadow_along(device):
    leaf = Material((1, 1, 1), leaf_image(), alpha_mode="mask")
    sun, place = directional_light((1, 0, 1)), np.eye(4)
    place[:3, 3] = (2.013, 3.017, 0.5)
    scenes = [
        make_scene([FLOOR, Part("leaf", "", level_card(-3, -3, 2, 3), placed, leaf),
                    Part("pane", "", level_card(-3, 3, 1, 3), placed, BLUE)])
        for placed in (np.eye(4), place)
    ]  # fmt: skip
    with SceneRenderer(scenes[0], device=device) as renderer:
        renderer.render(ABOVE, [sun])
        renderer.move(scenes[1])
        moved = renderer.render(ABOVE, [sun])
    assert count_differences(moved, render(scenes[1], ABOVE, sun)) == 0
    assert count_differences(moved, render(scenes[0], ABOVE, sun), 20) > 100


def test_a_part_that_does_not_cast_is_still_seen_through(device):
    scene, sun = garden(), directional_light((0.4, -0.7, 1.2))
    camera = SCENES["garden"][1]
    names = [part.name for part in scene.parts]
    casters = [k for k, name in enumerate(names) if name != "faded"]
    bare = replace(scene, parts=tuple(scene.parts[k] for k in casters))
    with SceneRenderer(scene, device=device, casters=casters) as renderer:
        drawn = renderer.render(camera, [sun])
    with SceneRenderer(bare, device=device) as renderer:
        without = renderer.render(camera, [sun])
    leaf = np.isin(render(scene, camera, sun, arrays=True).position[..., 2].round(6), [3.0])
    assert count_differences(drawn[~leaf], without[~leaf]) == 0
    assert count_differences(drawn, without, 20) > 50


def test_many_lights_and_the_ones_beyond_a_range(device):
    scene, camera = garden(), SCENES["garden"][1]
    lamps = [point_light((4 * np.cos(k), 4 * np.sin(k) - 2, 6), (1, 0.3 * (k % 3), 0.2 * (k % 5)),
                         range=8.0) for k in range(9)]  # fmt: skip
    with SceneRenderer(scene, device=device) as renderer:
        drawn = renderer.render(camera, lamps)
    assert count_differences(drawn, render(scene, camera, lamps), 2) <= MOST


def test_more_than_a_driver_holds_is_refused(device, monkeypatch):
    monkeypatch.setattr(transmitters, "_MOST_WHOLE", 8 * 20)
    with pytest.raises(InputError, match=r"30 triangles .* are too many .* use device='cpu'"):
        SceneRenderer(garden(), device=device)
