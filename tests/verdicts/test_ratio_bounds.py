"""What a ratio to before may be off by: the extremes of all that before and lost may be."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from umbra.verdicts.doubt import bound_ratio, doubt_share


@pytest.mark.parametrize("before_off", [0.0, 0.5, 3.0])
@pytest.mark.parametrize("lost_off", [0.0, 0.2, 2.0])
@pytest.mark.parametrize("lost", [0.0, 1.0, 30.0, -4.0])
def test_a_ratio_is_off_by_no_more_than_its_extremes_and_no_less(lost, lost_off, before_off):
    before = 60.0
    after = before - lost
    steps = np.linspace(-1, 1, 41)
    ratios = [
        1 - (lost + s * lost_off) / (before + t * before_off)
        for s, t in itertools.product(steps, steps)
    ]
    extreme = np.abs(np.array(ratios) - after / before).max()
    assert bound_ratio(after, before, before_off, lost_off) == pytest.approx(extreme, abs=1e-12)


def test_before_and_after_share_their_errors():
    """Where nothing is lost the ratio is 1 for sure, however rough before is."""
    assert bound_ratio(50.0, 50.0, 20.0, 0.0) == 0.0
    # Taken as independent, 5 of 50 before and 5 of 40 after would be 0.18.
    assert bound_ratio(40.0, 50.0, 5.0, 0.0) == pytest.approx(10 / 50 * 5 / 45)


def test_a_ratio_to_nearly_nothing_may_be_any():
    assert bound_ratio(0.0, 0.0, 1.0, 1.0) == 0.0
    assert bound_ratio(0.5, 1.0, 2.0, 0.5) == 1.0
    assert bound_ratio(1.0, 1.0, 2.0, 0.0) == 0.0


def test_the_edge_in_a_cell_moves_where_the_next_cell_changes():
    """Four cells in a row; the last two have sun enough, and the proposal takes it of the third."""
    near = np.array([[1, 1], [0, 2], [1, 3], [2, 2]])
    row = SimpleNamespace(near=near, average=lambda values: np.array([values.mean()]))
    none = np.zeros(4, bool)
    before = doubt_share(row, np.array([False, False, True, True]), none)
    after = doubt_share(row, np.array([False, False, False, True]), none)
    np.testing.assert_array_equal(before.doubt, [0, 0.5, 0.5, 0])
    np.testing.assert_array_equal(after.doubt, [0, 0, 0.5, 0.5])
    changed = np.array([False, False, True, False])
    # Up: half of the second, before; half of the fourth, after. Down: half of the third, twice.
    assert after.bound_lost(row, before, changed) == pytest.approx((0.5 + 0.5) / 4)
    assert after.bound_lost(row, before, none) == 0.0
    # The change of the fourth moves the edges within the third; of the first, those in the second.
    fourth, first = np.arange(4) == 3, np.arange(4) == 0
    assert after.bound_lost(row, before, fourth) == pytest.approx((0.5 + 0.5) / 4)
    assert after.bound_lost(row, before, first) == pytest.approx(0.5 / 4)
