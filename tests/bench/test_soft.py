"""The errors of soft shadows by rays: what they are measured against, and what they say."""

import numpy as np
import pytest
from support.bench import run_both
from support.shapes import sheet
from support.soft import look_at_floor

from umbra.scene import point_light
from umbra.soft import ball_light
from umbra_benchmarks.soft import find_share_by_rays, spread_over_disc


def test_errors_are_told_by_scene_and_method():
    found, _ = run_both("soft")
    assert (found["benchmark"], found["rays"]) == ("soft", 4096)
    scenes = {each["scene"]: each for each in found["scenes"]}
    assert len(scenes) == 5
    for name, each in scenes.items():
        assert each["points"] > 50
        errors = {(one["name"], *one["fineness"].values()): one["l1"] for one in each["methods"]}
        assert len(errors) == 12
        overlaps = name in {"two plates", "stack of eight", "fence"}
        assert (errors["wedges",] > 0.03) == overlaps
        assert (errors["complexity", 1] > 0.03) == overlaps
        assert errors["complexity", 256] < 0.004
        assert errors["complexity", 64] < 0.5 * errors["samples", 64]
        for one in each["methods"]:
            assert abs(one["bias"]) <= one["l1"] <= one["rms"] <= one["most"]


def test_the_table_has_a_column_for_each_scene():
    lines = [line for line in run_both("soft")[1].splitlines() if line.startswith("|")]
    assert len(lines) == 2 + 12
    assert {line.count("|") for line in lines} == {7}


def test_rays_see_half_of_a_lamp_over_an_edge():
    # A half plane at half the height: at x = 0 its edge is before the lamp's middle.
    half = sheet([(-500, -500, 1), (0, -500, 1), (0, 500, 1), (-500, 500, 1)])
    counter = look_at_floor(half)[0]
    places = np.array([(0, 0, 0), (-3, 0, 0), (3, 0, 0), (0, 0.4, 0.0)])
    normals = np.tile((0.0, 0.0, 1.0), (4, 1))
    found = find_share_by_rays(counter, places, normals, ball_light(point_light((0, 0, 2)), 0.5))
    assert found == pytest.approx([0.5, 0, 1, 0.5], abs=0.001)


def test_rays_are_spread_evenly():
    spread = spread_over_disc(4096)
    assert spread.shape == (4096, 2)
    away = np.linalg.norm(spread, axis=1)
    assert [(away < r).mean() for r in (0.5, 0.8)] == pytest.approx([0.25, 0.64], abs=0.01)
    assert np.abs(spread.mean(0)).max() < 1e-9
