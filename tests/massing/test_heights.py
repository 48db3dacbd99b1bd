"""Heights over a plot: closed forms, all choices of small problems, and tightness."""

import itertools

import numpy as np
import pytest
import shapely

from umbra.massing.piece_choice import fill_up
from umbra.massing.problem import ReceiverGroup, pose_problem
from umbra.massing.search import _count
from umbra.massing.solid import make_solid
from umbra.massing.upper_bounds import bound_cells, bound_sum
from umbra.sun import find_sun

from .conftest import VIENNA, Quarter

CAP = 60.0


def find_clear(quarter, point, sun):
    """Return for each cell the height up to which it leaves a ray free, by plane geometry."""
    level = np.hypot(*sun[:2])
    start = np.asarray(point, float) - quarter.scene.origin
    ray = shapely.LineString([start[:2], start[:2] + 500 * sun[:2] / level])
    found = np.full(len(quarter.plot.ground), np.inf)
    for k, cell in enumerate(quarter.list_cells()):
        met = ray.intersection(cell)
        if met.length > 1e-9:
            found[k] = start[2] + met.distance(shapely.Point(start[:2])) * sun[2] / level
    return found - quarter.plot.ground


def list_suns(ask):
    return ask.lights.directions


def test_a_window_that_needs_each_step_of_an_hour_leaves_the_least_of_its_planes(quarter):
    window = (1.3, 9.2, 2.5)
    ask = quarter.ask(window, 1.0, "11:00", "12:00", "5min")
    found = quarter.search(ask, highest=CAP)
    planes = np.min([find_clear(quarter, window, sun) for sun in list_suns(ask)], axis=0)
    expected = np.minimum(planes, CAP)
    assert (expected < CAP).sum() == 24  # cells between the window and the sun
    assert np.all(found.heights <= expected + 1e-9)
    assert np.all(found.heights >= expected - 2.1e-3)
    assert found.volume == pytest.approx(expected.sum(), abs=2.1e-3 * len(expected))
    assert found.bound == pytest.approx(expected.sum(), abs=1e-6)  # nothing to choose: it is tight
    assert not found.violations
    assert found.shrunk == 0


def test_between_instants_the_swept_sun_counts(quarter):
    window = (0.4, 9.7, 1.0)
    ask = quarter.ask(window, 1.0, "12:30", "13:30", "30min", is_continuous=True)
    found = quarter.search(ask, highest=CAP)
    first = ask.period.starts[0]
    seconds = (first + np.arange(3601) * 1_000_000).view("datetime64[us]")
    suns = find_sun(VIENNA, seconds).direction
    dense = np.minimum(np.min([find_clear(quarter, window, sun) for sun in suns], axis=0), CAP)
    assert np.all(found.heights <= dense + 1e-6)  # lower than under any second's sun
    corner = dense < CAP
    assert corner.sum() > 20
    assert np.max(dense[corner] - found.heights[corner]) < 0.02  # a second's turn at a corner
    assert not found.violations
    assert found.shrunk == 0  # the planes alone are low enough
    stepped = quarter.search(quarter.ask(window, 1.0, "12:30", "13:30", "30min"), highest=CAP)
    assert stepped.volume > found.volume + 100  # two instants leave gaps that the sweep does not


def make_choice(quarter, rng, receivers):
    """Pose a problem of few steps: each receiver keeps 2 of 4 hours."""
    points = np.column_stack([rng.uniform(-6, 6, receivers), rng.uniform(5, 9, receivers),
                              rng.uniform(0.5, 2, receivers)])  # fmt: skip
    return quarter.ask(points, 2.0, "10:00", "14:00", "1h")


@pytest.mark.parametrize("seed", range(6))
def test_all_choices_of_hours_are_no_better(quarter, seed):
    ask = make_choice(quarter, np.random.default_rng(seed), 4)
    found = quarter.search(ask, highest=CAP)
    suns = list_suns(ask)
    lit = ask.find_masks(None).T == 0
    points = ask.places.points + quarter.scene.origin
    planes = [[find_clear(quarter, point, sun) for sun in suns] for point in points]
    assert lit.all()
    best = 0.0
    for choice in itertools.product(itertools.combinations(range(4), 2), repeat=len(points)):
        kept = [planes[r][t] for r, some in enumerate(choice) for t in some]
        best = max(best, float(np.minimum(np.min(kept, axis=0), CAP).clip(0).sum()))
    assert found.bound >= best - 1e-6
    assert found.volume <= best + 1e-6
    assert found.volume >= best - 2e-3 * 64  # millimetres: the best choice was found
    assert not found.violations


def test_raising_any_cell_by_five_centimetres_breaks_a_rule(quarter):
    ask = make_choice(quarter, np.random.default_rng(11), 3)
    found = quarter.search(ask, highest=CAP)
    raised_cells = 0
    for cell in range(len(found.heights)):
        if found.heights[cell] > CAP - 0.01:
            continue
        heights = found.heights.copy()
        heights[cell] += 0.05
        mesh = make_solid(quarter.plot, quarter.plot.ground + heights)
        hours = [_count(ask, quarter.scene, [0], mesh, 1)]
        assert len(found.problem.find_unmet(hours)) > 0, cell
        raised_cells += 1
    assert raised_cells > 15


def test_one_of_two_alternatives_is_enough(quarter):
    low = quarter.ask((0, 9, 0.5), 1.0, "10:00", "11:00", "1h")
    high = quarter.ask((0, 9, 0.5), 1.0, "12:00", "13:00", "1h")
    both = quarter.search(low, high, highest=CAP)
    group = ReceiverGroup("either", np.array([0, 1]), np.array([0, 0]), np.ones(2), 1.0)
    either = quarter.search(low, high, groups=[group], highest=CAP)
    alone = [quarter.search(one, highest=CAP).volume for one in (low, high)]
    assert both.volume < min(alone)
    assert either.volume == pytest.approx(max(alone), abs=0.2)
    assert either.bound >= either.volume


def test_half_of_an_area_is_enough(quarter):
    points = [(x, 9.0, 0.5) for x in (-3, -1, 1, 3)]
    ask = quarter.ask(points, 1.0, "11:30", "12:30", "30min")
    weight = np.array([1.0, 1.0, 1.0, 1.0])
    members = np.zeros(4, int), np.arange(4), weight
    half = quarter.search(ask, groups=[ReceiverGroup("garden", *members, 2.0)], highest=CAP)
    whole = quarter.search(ask, groups=[ReceiverGroup("garden", *members, 4.0)], highest=CAP)
    assert half.volume > whole.volume + 20
    met = half.hours[0] >= 1.0 - 1e-4
    assert met.sum() >= 2
    one = ReceiverGroup.one
    each = [quarter.search(ask, groups=[one("a", 0, i), one("b", 0, j)], highest=CAP)
            for i, j in itertools.combinations(range(4), 2)]  # fmt: skip
    assert half.volume == pytest.approx(max(one.volume for one in each), abs=0.2)


def test_unbroken_sun_is_kept_in_one_piece(quarter):
    window = (0.0, 9.0, 1.0)
    spread = quarter.search(quarter.ask(window, 2.0, every="30min"), highest=CAP)
    whole = quarter.search(quarter.ask(window, 2.0, every="30min", measure=1), highest=CAP)
    spells = quarter.search(
        quarter.ask(window, 2.0, every="30min", measure=2, least=1.0), highest=CAP
    )
    assert whole.volume <= spells.volume + 1e-6 <= spread.volume + 2e-6
    assert whole.hours[0][0] >= 2.0 - 1e-4
    suns = list_suns(quarter.ask(window, 2.0, every="30min"))
    planes = np.array([find_clear(quarter, window, sun) for sun in suns])
    runs = [np.minimum(planes[k : k + 4].min(0), CAP).sum() for k in range(len(suns) - 3)]
    assert whole.volume == pytest.approx(max(runs), abs=0.2)


def test_who_has_too_little_before_loses_nothing(quarter):
    ask = quarter.ask((0, 9, 1.0), 9.0, every="30min")  # 6 h are asked about: 9 cannot be
    found = quarter.search(ask, highest=CAP)
    assert found.problem.broken.tolist() == [True]
    assert found.hours[0][0] == pytest.approx(found.problem.before[0][0])
    assert not found.violations


def test_bounds_fall_with_what_may_be_given_up(quarter):
    rng = np.random.default_rng(5)
    points = np.column_stack([rng.uniform(-6, 6, 8), rng.uniform(5, 9, 8), rng.uniform(0.5, 2, 8)])
    volumes, bounds = [], []
    for limit in (1.0, 3.0, 5.0):
        found = quarter.search(quarter.ask(points, limit, every="30min"), highest=CAP)
        volumes.append(found.volume)
        bounds.append(found.bound)
        assert found.bound >= found.volume
        assert found.ceiling.sum() >= found.bound - 1e-6
    assert volumes == sorted(volumes, reverse=True)
    assert bounds == sorted(bounds, reverse=True)


def test_more_steps_of_the_bound_are_no_worse(quarter):
    ask = make_choice(quarter, np.random.default_rng(3), 6)
    groups = [ReceiverGroup.one(label, 0, k) for k, label in enumerate(ask.labels)]
    needs = pose_problem(quarter.plot, [ask], groups, None).needs
    top = quarter.plot.ground + CAP
    ceiling = bound_cells(needs, top)
    few, many = (bound_sum(needs, ceiling, quarter.plot.ground, steps)[0] for steps in (5, 200))
    assert many <= few <= float((ceiling - quarter.plot.ground).sum()) + 1e-9


def test_smaller_cells_hold_at_least_as_much():
    volumes = []
    for cell in (2.0, 1.0, 0.5):
        quarter = Quarter(cell=cell)
        ask = quarter.ask((0.3, 9.1, 1.0), 1.0, "11:00", "12:00", "15min")
        volumes.append(quarter.search(ask, highest=30.0).volume)
    assert volumes == sorted(volumes)


def test_cells_are_filled_up_until_none_can_rise(quarter):
    ask = make_choice(quarter, np.random.default_rng(2), 3)
    groups = [ReceiverGroup.one(label, 0, k) for k, label in enumerate(ask.labels)]
    problem = pose_problem(quarter.plot, [ask], groups, None)
    top = quarter.plot.ground + CAP
    filled = fill_up(problem.needs, quarter.plot.ground.copy(), top)
    best = quarter.search(ask, highest=CAP)
    assert 0.5 * best.volume < (filled - quarter.plot.ground).sum() <= best.bound + 1e-6
    assert np.array_equal(fill_up(problem.needs, filled, top), filled)
