"""Casters that hold the whole near rectangle are counted by z-pass from their count there."""

import numpy as np
import pytest
from support.gl_judge import Judge
from support.judge import Verdicts
from support.shapes import box, city, merge

from umbra.gl.frame_counter import GlFrameCounter
from umbra.scene import Camera, directional_light, make_scene, point_light

SUN = directional_light((0.1, 0.2, 1.0))
SIZE = (64, 48)


def plate(low, high):
    return box((-20, -20, low), (20, 20, high))


def find_plan(device, mesh, camera, light, method="auto"):
    with GlFrameCounter(make_scene(*mesh), ground=0.0, device=device) as ours:
        view, _ = ours.see(camera)
        ours.count(view, camera, light, method)
        return ours.plan


@pytest.mark.parametrize("height", [None, 2.0])
def test_z_pass_starts_below_two_plates(device, height):
    mesh = merge(plate(8, 9), plate(11, 12))
    camera = Camera((0, -3, 2), (0, 5, 4), size=SIZE, height=height)
    plan = find_plan(device, mesh, camera, SUN)
    assert plan.start == 2
    assert plan.statistics.cases[0] == 0  # as McGuire has it, both may shadow the viewport
    assert plan.statistics.sides == plan.statistics.sides_z_pass
    assert plan.statistics.light_caps == 0
    papers = find_plan(device, mesh, camera, SUN, "mcguire")
    assert papers.statistics.sides_z_pass == 0


def test_a_side_or_a_face_in_the_near_rectangle_needs_z_fail(device):
    at_the_rim = Camera((-20.5, 0, 2), (-20.5, 5, 2), size=SIZE, near=2.0)
    assert find_plan(device, plate(8, 9), at_the_rim, SUN).statistics.sides_z_pass == 0
    cut = Camera((0, -3, 8.9), (0, 5, 8.9), size=SIZE, near=0.5)
    assert find_plan(device, plate(8, 9), cut, SUN).statistics.sides_z_pass == 0


def test_counts_in_streets_are_right(device):
    rng = np.random.default_rng(4)
    verdicts, starts, fails = Verdicts(), 0, 0
    for seed in range(4):
        mesh = city(5, seed=seed)
        low, high = mesh[0].min(0), mesh[0].max(0)
        with Judge(device, mesh) as scene:
            for number in range(8):
                eye = rng.uniform(low, high) * [1, 1, 0.6] + [0, 0, 0.5]
                near = rng.choice([0.05, 2.0])
                camera = Camera(eye, rng.uniform(low, high), size=SIZE, near=near)
                light = directional_light(rng.normal(size=3) + [0, 0, 0.8])
                if number % 2:
                    light = point_light(rng.uniform(low - 10, high + 20))
                verdicts += scene.judge(camera, light, "auto")[0]
                starts += scene.counter.plan.start > 0
                fails += scene.counter.plan.statistics.dark_caps > 0
    verdicts.check(most_on_edges=0.004)
    assert starts > 5
    assert fails > 0
