"""Lights with weights: sums by hand, the same by masks and by integers, and lamps by rays."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box, city

import umbra
from umbra.lights import Lights
from umbra.rays.hidden import find_hidden
from umbra.receivers.kind import Request
from umbra.study.light_sums import add_up
from umbra.study.loop import Accumulator, TileRun, count_passes, pass_lights
from umbra.study.options import StudyOptions
from umbra.study.shadow_study import count_lights

LEANING = np.array([(0.6, 0.0, 0.8), (-0.6, 0.0, 0.8), (0.0, 0.6, 0.8), (0.0, 0.0, 1.0)])


def ask(**more):
    return StudyOptions(date="2026-03-21", **more)


@pytest.fixture(scope="module")
def town():
    return umbra.make_scene(*city(3, seed=5), name="town")


class Fixed:
    """A counter of three receivers that knows its masks."""

    def __init__(self, masks):
        self.known = np.array(masks, np.uint8)

    def masks(self, suns):
        return self.known[np.argmax(suns @ LEANING.T, 1)]

    def add_weights(self, suns, weights, sums, progress=lambda _: None):
        sums += weights.T @ self.masks(suns).astype(np.int32)
        progress(len(suns))


MASKS = [[1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 1]]


@pytest.mark.parametrize(
    ("weights", "sums"),
    [
        (None, [[3, 2, 1]]),
        ([0.25] * 4, [[0.75, 0.5, 0.25]]),
        ([1, 2, 4, 8], [[11, 6, 8]]),
        ([[1, 0], [2, 0], [0, 4], [0, 8]], [[3, 2, 0], [8, 4, 8]]),
    ],
)
def test_weights_are_added_up_where_a_light_is_hidden(weights, sums):
    lights = Lights.of(LEANING, weights)
    np.testing.assert_array_equal(add_up(Fixed(MASKS), (3,), lights), sums)


def test_many_unequal_weights_give_what_equal_ones_would():
    rng = np.random.default_rng(3)
    which = rng.integers(0, 4, 100)
    weights = rng.random((100, 2))
    told = []
    found = add_up(Fixed(MASKS), (3,), Lights.of(LEANING[which], weights), told.append)
    expected = weights.T @ np.array(MASKS)[which]
    np.testing.assert_allclose(found, expected, rtol=2.0**-24, atol=100 * 2.0**-32 * 100)
    assert sum(told) == 100


def test_sums_of_distinct_weights_do_not_depend_on_the_order():
    rng = np.random.default_rng(4)
    which, weights = rng.integers(0, 4, 2305), rng.normal(size=(2305, 3))
    found = []
    for order in (np.arange(2305), rng.permutation(2305)):
        lights = Lights.of(LEANING[which[order]], weights[order])
        found.append(add_up(Fixed(MASKS), (3,), lights))
    np.testing.assert_array_equal(*found)
    expected = weights.T @ np.array(MASKS)[which]
    whole = np.abs(weights).sum(0)[:, None]
    assert (np.abs(found[0] - expected) / whole).max() < 1e-6


class Watch(Accumulator):
    """Writes down what it is told."""

    def __init__(self):
        self.told = []

    def add(self, lights, some, masks):
        self.told.append(("add", some.start, some.stop, len(masks)))

    def end_run(self, lights, some):
        self.told.append(("end run", some.stop))

    def end_day(self, day):
        self.told.append(("end day", day))


def test_lights_pass_run_by_run_and_days_without_any_end_too():
    lights = Lights.of(np.tile(LEANING, (3, 1)))
    days = ((slice(0, 10),), (), (slice(10, 11), slice(11, 12)))
    watch, told = Watch(), []
    run = TileRun((3,), [Fixed(MASKS), Fixed(MASKS)])
    pass_lights(run, type(lights)(**{**vars(lights), "days": days}), [watch], told.append)
    assert watch.told == [
        ("add", 0, 8, 2), ("add", 8, 10, 2), ("end run", 10), ("end day", 0), ("end day", 1),
        ("add", 10, 11, 2), ("end run", 11), ("add", 11, 12, 2), ("end run", 12), ("end day", 2),
    ]  # fmt: skip
    assert sum(told) == 12


class Sums(Accumulator):
    """Adds all lights up at once."""

    is_streamed = False

    def add_sums(self, run, lights, progress):
        add_up(run.counters[0], run.shape, lights, progress)


class Single(Watch):
    """Asks for single casters, no masks, and for as much again at the end."""

    needs_masks, more_passes = False, 1

    def end(self, progress):
        progress(4)


@pytest.mark.parametrize(
    ("accumulators", "passes"),
    [([Sums], 1), ([Watch, Watch], 1), ([Sums, Watch], 2), ([Watch, Single], 3), ([Sums, Sums], 2)],
)
def test_progress_ends_at_its_total_whatever_is_kept(accumulators, passes):
    made, told = [one() for one in accumulators], []
    pass_lights(TileRun((3,), [Fixed(MASKS)]), Lights.of(LEANING), made, told.append)
    assert count_passes(made) == passes
    assert sum(told) == 4 * passes


@pytest.mark.parametrize(
    "options",
    [
        {"receivers": "ground", "size": (40, 30)},
        {"receivers": "top", "size": (40, 30)},
        {"receivers": "south", "size": (40, 20)},
        {"receivers": "surfaces", "spacing": 2.0},
        {"receivers": "points", "points": [(0.5, 0.5, 0.25), (3.5, 2.5, 0.25)]},
    ],
)
def test_any_lights_on_any_receivers_are_those_of_rays(town, options):
    rng = np.random.default_rng(1)
    vectors = np.zeros((9, 4))
    vectors[:5, :3] = LEANING[[0, 1, 2, 3, 0]] + rng.normal(0, 0.05, (5, 3))
    vectors[5, :3] = (0.3, 0.2, -0.9)
    vectors[:6, :3] /= np.linalg.norm(vectors[:6, :3], axis=1)[:, None]
    vectors[6:, :3] = rng.uniform((0, 0, 2), (9, 9, 12), (3, 3))
    vectors[6:, 3] = 1
    weights = rng.random((9, 2))
    laid, sums = count_lights(town, Lights.of(vectors, weights), ask(**options))
    places, casting = [], laid.casting
    asked = Request(town, ask(**options), list(range(len(town.parts))), 1)
    for _, make in laid.make_tiles(asked):
        tile = make()
        places.append((tile.places.points, tile.places.normals))
    points, normals = (np.concatenate(one) for one in zip(*places))
    masks = find_hidden(casting.tree, points, normals, vectors)
    expected = (weights.T @ masks).reshape(sums.shape)
    is_there = np.isfinite(sums)
    assert is_there.mean() > 0.2
    differ = ~np.isclose(sums, expected, rtol=1e-5, atol=1e-6)[is_there]
    assert differ.mean() < 2e-3  # cells that an edge of a shadow crosses at their centre
    assert 0 < expected.mean() < weights.sum()


def test_a_lamp_under_a_table_lights_the_floor_beneath_it():
    scene = umbra.make_scene(*box((-1, -1, 1.0), (1, 1, 1.1)), name="table")
    lamps = np.array([(0, 0, 0.5, 1.0), (0, 0, 3.0, 1.0)])
    options = ask(receivers="ground", ground=0.0, extent=(-0.9, -0.9, 0.9, 0.9), size=(5, 5))
    _, sums = count_lights(scene, Lights.of(lamps, np.eye(2)), options)
    assert (sums[0] == 0).all()
    assert (sums[1] == 1).all()


def test_canopies_hide_what_they_do_not_transmit(town):
    lights = Lights.of(LEANING)
    parts = (*town.parts, replace(town.parts[0], name="again"))
    both = replace(town, parts=parts)
    asked = {"receivers": "ground", "extent": (-30, -30, 30, 30), "cell": 1.0, "ground": -5.0}
    _, solid = count_lights(both, lights, ask(**asked, no_cast="again"))
    leafy = {"cast": "again", "canopy": "again", "transmissivity": 0.5}
    _, half = count_lights(both, lights, ask(**asked, **leafy))
    assert solid.max() > 0
    assert np.allclose(half, solid / 2, atol=1e-5)
