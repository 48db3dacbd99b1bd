"""Lights that share the stencil give the picture that each of them alone gives."""

from dataclasses import replace
from unittest.mock import patch

import numpy as np
from support.shapes import city

from umbra.gl.lighting import LightPasses
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, directional_light, make_scene, point_light
from umbra.scene.lights import spot_light


def make_lights():
    """Make lamps near and far from each other, two spots, one lamp that lights nothing, a sun."""
    rng = np.random.default_rng(3)
    lamps = [
        replace(point_light((x, y, z)), range=reach, color=tuple(rng.uniform(0.3, 1.0, 3)))
        for x, y, z, reach in rng.uniform([-12, -12, 1, 3], [12, 12, 9, 9], (40, 4)).tolist()
    ]
    spots = [spot_light((x, -5, 12), (x, 0, 0), half_angle=12) for x in (-6.0, 6.0)]
    return [*lamps, *spots, replace(point_light((500, 0, 3)), range=2.0),
            directional_light((0.4, 0.3, 0.7))]  # fmt: skip


def test_lights_together_are_their_sum(device):
    scene = make_scene(*city(5))
    camera = Camera((14, -22, 15), (0, 0, 1), size=(120, 90))
    lights = make_lights()
    with SceneRenderer(scene, 0.0, device=device) as renderer:
        found = []
        find = LightPasses._find_alike

        def keep(*given):
            found.extend(find(*given))
            return find(*given)

        with patch.object(LightPasses, "_find_alike", keep):
            together = renderer.render(camera, lights)
        with patch.object(LightPasses, "_find_alike", lambda *_: []):
            apart = renderer.render(camera, lights)
    assert np.abs(together.astype(int) - apart).max() <= 1
    assert together.std() > 10
    counted = [group for group in found if len(group) > 1]
    assert len(counted) >= 3
    assert any(renderer.plans[group[0]].draws for group in counted)
