"""Sun that neighbours lose: sums of areas of any size, or of none."""

import warnings

import numpy as np
import pytest

import umbra
from umbra.study.compare import SunLosses


def sum_up(area, hours=(3.0, 1.0, 0.0, 5.0)):
    """Sum up four receivers of two neighbours: the first three of a, the last of b."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return SunLosses(
            np.float32(hours), np.int16([1, 0, 0, 1]), np.zeros(4, bool), np.array([0, 0, 0, 1]),
            ["a", "b"], area,
        ).sum_up().variables()  # fmt: skip


@pytest.mark.parametrize("area", [np.nan, 0.0, np.inf, np.full(4, np.nan)])
def test_receivers_without_an_area_have_hours_and_no_mean(area):
    found = sum_up(area)
    assert found["neighbour"][1].tolist() == ["a", "b"]
    assert found["neighbour_most_hours_lost"][1].tolist() == [3.0, 5.0]
    assert np.isnan(found["neighbour_mean_hours_lost"][1]).all()
    for name in ("area", "area_touched", "area_newly_under"):
        assert not found[f"neighbour_{name}"][1].any()


def test_the_mean_weighs_those_with_an_area():
    found = sum_up(np.array([2.0, np.nan, 2.0, 1.0]))
    assert dict(
        zip(*(found[n][1].tolist() for n in ("neighbour", "neighbour_mean_hours_lost")))
    ) == {"a": 1.5, "b": 5.0}


def test_areas_that_a_sum_cannot_hold_are_refused():
    assert sum_up(1e11)["neighbour_area"][1].tolist() == [1e11, 3e11]  # most first
    for large in (1e13, 1e20, 1e300):
        with pytest.raises(umbra.InputError, match="metres"):
            sum_up(large)
