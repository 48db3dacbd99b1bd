"""The solid of heights: closed, wound outward, and as large as its boxes."""

import numpy as np
import pytest
import trimesh

from umbra.massing.plot import Plot
from umbra.massing.solid import make_solid


@pytest.mark.parametrize("size", [2, 3, 9])
@pytest.mark.parametrize("seed", range(8))
def test_any_heights_make_a_closed_solid(size, seed):
    rng = np.random.default_rng(seed)
    index = np.full((size, size), -1, np.int32)
    inside = rng.random((size, size)) < 0.8
    index[inside] = np.arange(inside.sum())
    tops = rng.integers(0, 4, inside.sum()) * 1.5
    if not tops.any():
        return
    none = np.zeros(len(tops))
    plot = Plot(3.0, -2.0, 0.5, index, none, none, None)
    mesh = make_solid(plot, tops)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    volume = tops.sum() * 0.25
    assert volume * (1 - 5e-3) <= solid.volume <= volume + 1e-9
    assert mesh.vertices[:, 0].min() >= 3.0
    assert mesh.vertices[:, 0].max() <= 3.0 + 0.5 * size


def test_two_towers_that_touch_at_an_edge_stay_apart():
    index = np.array([[0, -1], [-1, 1]], np.int32)
    none = np.zeros(2)
    plot = Plot(0.0, 0.0, 1.0, index, none, none, None)
    mesh = make_solid(plot, np.array([2.0, 3.0]))
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(5.0, abs=5e-3)
    assert solid.volume < 5.0


def test_nothing_stands_where_nothing_may():
    none = np.zeros(1)
    plot = Plot(0.0, 0.0, 1.0, np.zeros((1, 1), np.int32), none, none, None)
    assert make_solid(plot, none) is None
