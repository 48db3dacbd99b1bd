"""Suns counted in groups of neighbours: which these are, and that each is counted as if alone."""

from itertools import pairwise

import numpy as np
import pytest
from support.patches import FLOOR, make_suns, prepare
from support.shapes import city, jumble, merge, soup, turned

from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.sun_groups import find_groups
from umbra.lights.sky_directions import spread_directions
from umbra.rays.hidden import find_hidden


def find_widths(suns, order, first):
    """Give the angle of each group from its mean to its farthest sun, and the mean's altitude."""
    widths = []
    for a, b in pairwise(first):
        own = suns[order[a:b]]
        middle = own.mean(0) / np.linalg.norm(own.mean(0))
        cosine = np.clip((own @ middle).min(), -1, 1)
        widths.append((np.arccos(cosine), np.arcsin(middle[2])))
    return np.array(widths).T


@pytest.mark.parametrize("in_order", [False, True])
@pytest.mark.parametrize("count", [1, 2, 33, 577])
def test_groups_hold_each_sun_once_and_low_ones_are_narrow(count, in_order):
    suns = spread_directions(count)
    order, first = find_groups(suns, in_order=in_order)
    np.testing.assert_array_equal(np.sort(order), np.arange(count))
    assert not in_order or (np.diff(order) == 1).all()
    assert first[0] == 0
    assert first[-1] == count
    assert np.diff(first).min() > 0
    assert np.diff(first).max() <= 32
    width, altitude = find_widths(suns, order, first)
    assert (width <= np.minimum(np.radians(20), 0.8 * altitude) + 1e-6).all()


def test_a_sky_is_divided_into_far_fewer_groups_than_directions():
    suns = spread_directions(577)
    assert len(find_groups(suns)[1]) < 577 / 3
    assert len(find_groups(np.zeros((0, 3)))[0]) == 0
    opposite = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    np.testing.assert_array_equal(find_groups(opposite)[1], [0, 1, 2])


@pytest.mark.parametrize("make", [soup, jumble, lambda _: turned(city(4, seed=3), 17)])
def test_a_sky_on_walls_agrees_with_rays_and_sums_with_masks(make):
    rng = np.random.default_rng(4)
    samples, _, counter, tree, _ = prepare(merge(FLOOR, make(rng)), 0.7)
    suns = np.concatenate([spread_directions(150), make_suns(rng, 5, 0.01)])
    truth = find_hidden(tree, samples.points, samples.normals, suns)
    np.testing.assert_array_equal(counter.masks(suns), truth)
    weights = rng.integers(1, 1000, (len(suns), 2)).astype(np.int32)
    sums = np.ones((2, counter.size), np.int32)
    counter.add_weights(suns, weights, sums)
    np.testing.assert_array_equal(sums, 1 + weights.T @ truth.astype(np.int32))


def test_a_group_is_binned_once(monkeypatch):
    _, _, counter, _, _ = prepare(merge(FLOOR, city(2, seed=3)), 1.0)
    made = []
    bins = EdgeBinner._bin
    monkeypatch.setattr(EdgeBinner, "_bin", lambda *args: made.append(bins(*args)) or made[-1])
    suns = spread_directions(300)
    counter.masks(suns[suns[:, 2] > 0.5])
    groups, counted = sum(len(each.basis) for each in made), sum(len(each.suns) for each in made)
    assert counted == (suns[:, 2] > 0.5).sum()
    assert groups <= counted / 5
