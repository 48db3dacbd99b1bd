"""Embree's packets answer as one ray a call does, for any number of rays."""

import numpy as np
import pytest

from umbra_benchmarks.packets import EmbreePackets, sort_along_curve
from umbra_benchmarks.scenes import make_boxes

pytest.importorskip("embreex")


def make_cube():
    return EmbreePackets(*make_boxes([[0.0, 0.0, 1.0]], [[1.0, 1.0, 1.0]]))


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 250])
def test_the_rays_under_a_cube_are_hidden(count):
    x = np.linspace(-3.1, 2.9, count)
    origins = np.stack([x, np.full(count, 0.1), np.full(count, -1.0)], -1).astype(np.float32)
    is_hidden = make_cube().find_occluded(origins, np.array([[0, 0, 1]], np.float32))
    assert is_hidden.dtype == bool
    assert (is_hidden == (np.abs(x) < 1.0)).all()


def test_each_ray_has_its_direction_and_reach():
    origins = np.tile(np.array([0.1, 0.2, -1.0], np.float32), (40, 1))
    directions = np.tile(np.array([0, 0, 1], np.float32), (40, 1))
    directions[::3] *= -1
    reach = np.where(np.arange(40) % 2, 0.99, 1.01).astype(np.float32)
    is_hidden = make_cube().find_occluded(origins, directions, reach)
    assert (is_hidden == ((np.arange(40) % 3 > 0) & (np.arange(40) % 2 == 0))).all()


def test_sixteen_points_along_the_curve_are_a_square_of_four_by_four():
    x, y = np.meshgrid(np.arange(16.0), np.arange(16.0))
    points = np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3)
    order = sort_along_curve(points)
    assert (np.sort(order) == np.arange(256)).all()
    packets = points[order].reshape(16, 16, 3)
    assert (np.ptp(packets, axis=1) == [3.0, 3.0, 0.0]).all()
