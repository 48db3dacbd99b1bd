"""Peaks between rays: no square that holds one is passed over."""

import numpy as np
import pytest

from umbra.land.march import find_land_slope
from umbra.land.peaks import PARTS, raise_peaks, sift_peaks

SIDE, CELL, RADIUS, EYE = 16, 30.0, 7.4e6, 100.0
SHAPE = (40, 52)  # the last squares are cut


def make_spots(corner, turn):
    """Return the corners of squares, places from the eye, of a raster turned about its corner."""
    rows, cols = (np.arange(-(-n // SIDE) + 1) * SIDE * CELL for n in SHAPE)
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    return corner + cols[:, None] * along + rows[:, None, None] * across


def find_slope(height, away):
    return find_land_slope(height, away, EYE, RADIUS)


@pytest.mark.parametrize("rays", [24, 720, 3600])
@pytest.mark.parametrize("reach", [0.0, 300.0, 5000.0, 60_000.0])
def test_a_lone_peak_just_above_the_rays_beside_it_is_raised(rays, reach):
    """Wherever it lies in its square, whatever the land may reach; one just below them is not."""
    rng = np.random.default_rng(int(rays + reach))
    radii = np.full(rays, RADIUS)
    raised = []
    for _ in range(250):
        turn = rng.uniform(0, 2 * np.pi)
        corner = reach * np.array([np.sin(turn), np.cos(turn)]) - rng.uniform(0, 1500, 2)
        spots = make_spots(corner, rng.uniform(0, 2 * np.pi))
        spots += rng.uniform(-90, 90, spots.shape)  # of any projection
        # In a corner of its square, on a side, or anywhere.
        edges = np.array([0, 1, SIDE - 1, rng.integers(SIDE)])
        j, i = rng.integers(3), rng.integers(4)
        j, i = j * SIDE + rng.choice(edges), i * SIDE + rng.choice(edges)
        if j >= SHAPE[0] or i >= SHAPE[1]:
            continue
        square = spots[j // SIDE : j // SIDE + 2, i // SIDE : i // SIDE + 2]
        b, a = j % SIDE / SIDE, i % SIDE / SIDE
        north, south = ((1 - a) * square[k, 0] + a * square[k, 1] for k in (0, 1))
        x, y = (1 - b) * north + b * south
        away = float(np.hypot(x, y))
        height = EYE + away**2 / (2 * RADIUS) + rng.uniform(50, 900)
        at = np.arctan2(x, y) / (2 * np.pi) * rays % rays
        if away < 30 or abs(at - round(at)) < 1e-3:
            continue
        heights = np.full(SHAPE, rng.choice([-50.0, np.nan]), np.float32)
        heights[j, i] = height
        slope = find_slope(float(heights[j, i]), away)
        is_above = bool(rng.integers(2))
        # Of the two rays beside it one is lower and one higher: the line between them passes just
        # below it, or above. All others stand above everything.
        high = float(np.degrees(np.arctan(slope)))
        slopes, share = np.full(rays, 100.0), at - int(at)
        target = high + (-0.003 if is_above else 0.003)
        tilt = 0.4 * min(high, 90.0 - high)
        if rng.integers(2):
            ends = target - tilt * share, target + tilt * (1 - share)
        else:
            ends = target + tilt * share, target - tilt * (1 - share)
        slopes[[int(at), (int(at) + 1) % rays]] = np.tan(np.radians(ends))
        # The land begins right before it or near the eye, and ends right behind it or far away.
        within = np.array([
            rng.choice([away * (1 - 1e-9), 20.0]), rng.choice([away * (1 + 1e-9), 2e5])
        ])  # fmt: skip
        peaks = np.full((rays * PARTS, 3), -np.inf)
        raise_peaks(heights, spots, SIDE, EYE, radii, slopes, within, peaks)
        found = sift_peaks(peaks, np.degrees(np.arctan(slopes)))
        assert len(found) == is_above
        if is_above:
            wanted = [at * 360 / rays, high, away]
            np.testing.assert_allclose(found[0], wanted, rtol=1e-9)
        raised.append(is_above)
    assert min(sum(raised), len(raised) - sum(raised)) > 40


@pytest.mark.parametrize("within", [(0.0, 999.0), (1001.0, 1e5)])
def test_land_out_of_reach_has_no_peak(within):
    heights = np.full(SHAPE, np.nan, np.float32)
    heights[20, 20] = 900.0
    spots = make_spots(np.array([-600.0, 400.0]), 0.0)
    spots[..., 1] += 1000.0 - 400.0 - 20 * CELL  # the peak lies due north, but for a little
    spots[..., 0] += 3.0
    peaks = np.full((720 * PARTS, 3), -np.inf)
    raise_peaks(
        heights, spots, SIDE, EYE, np.full(720, RADIUS), np.full(720, -1.0), np.array(within), peaks
    )
    assert (peaks[:, 0] == -np.inf).all()
