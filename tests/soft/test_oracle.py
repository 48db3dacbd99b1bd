"""Visibility against the ray caster, with rays spread over the light as each point sees it."""

import numpy as np
import pytest
from support.raycaster import RayCaster
from support.shapes import box, turned
from support.soft import look

from umbra.rays.depth import GROUND
from umbra.scene import Camera, directional_light, point_light
from umbra.soft import ball_light, find_method, rectangle_light

CAMERA = Camera((-6, -7, 6), (0, 0, 0.5), size=(160, 120))
BOX = turned(box((-1, -1, 0), (1, 1, 1.5)), 25)
TRIANGLE = np.array([(-1, -1, 1), (1.3, -0.6, 2), (-0.3, 1, 3.0)]), np.array([[0, 1, 2]], np.int32)
STEPS = (np.arange(64) + 0.5) / 64
U, V = (grid.ravel() for grid in np.meshgrid(STEPS, STEPS))


def spread_over_disc(way):
    """Give evenly spread offsets in the unit disc across a way."""
    way = way / np.linalg.norm(way)
    one = np.cross(way, (0.3, 0.5, -0.8))
    one /= np.linalg.norm(one)
    turn = 2 * np.pi * V
    return np.sqrt(U)[:, None] * (
        np.cos(turn)[:, None] * one + np.sin(turn)[:, None] * np.cross(way, one)
    )


def see_ball(point):
    """Give the ends of ways to a ball of 0.6 m: on its tangent cone, about its middle."""
    way = np.array((3, 1.7, 8)) - point
    away = np.linalg.norm(way)
    return point + way + 0.6 * away / np.sqrt(away**2 - 0.36) * spread_over_disc(way)


def see_rectangle(point):
    edges = np.outer(U - 0.5, (1.2, 0.3, 0)) + np.outer(V - 0.5, (-0.2, 1.1, 0.5))
    return np.array((3, 1.7, 8)) + edges


def see_sky(point):
    way = np.array((3, 1.7, 6)) / np.linalg.norm((3, 1.7, 6))
    return point + 1e3 * (way + np.tan(np.radians(2.5)) * spread_over_disc(way))


LIGHTS = {
    "ball": (ball_light(point_light((3, 1.7, 8)), 0.6), see_ball),
    "rectangle": (
        rectangle_light(point_light((3, 1.7, 8)), (1.2, 0.3, 0), (-0.2, 1.1, 0.5)),
        see_rectangle,
    ),
    "sky": (ball_light(directional_light((3, 1.7, 6)), 2.5), see_sky),
}


@pytest.mark.parametrize("mesh", [BOX, TRIANGLE])
@pytest.mark.parametrize("name", LIGHTS)
def test_rays_say_the_same(mesh, name):
    light, see = LIGHTS[name]
    seen = look(mesh, CAMERA)
    frame = seen[2]
    wedges = find_method("wedges")(*seen, light)
    samples = find_method("samples")(*seen, light, samples=1024)
    rays = RayCaster(*mesh)
    floor = frame.part == GROUND
    partial = np.argwhere(floor & (samples > 0.01) & (samples < 0.99))
    whole = np.argwhere(floor & ((samples == 0) | (samples == 1)))
    some = [*partial[:: max(len(partial) // 30, 1)], *whole[:: len(whole) // 10]]
    assert len(some) >= 35
    for r, c in some:
        ends = see(frame.position[r, c])
        place = np.append(frame.position[r, c], 1.0)
        none = np.full(len(ends), -1)
        # Asked from the light's side: what is between is the same.
        found = rays.count(ends, none, place, place, np.zeros(len(mesh[1]), bool)).any
        truth = 1 - found.mean()
        assert wedges[r, c] == pytest.approx(truth, abs=0.01)
        assert samples[r, c] == pytest.approx(truth, abs=0.025)
