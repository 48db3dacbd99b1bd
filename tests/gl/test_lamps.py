"""Lamps on faces, on edges and at corners, on the gl device by the rule of the cpu's."""

import numpy as np
import pytest
from support.gl_judge import Judge
from support.judge import Verdicts
from support.lamps import PLACES, hang, look_at

APART = [0.0, 1e-3]


@pytest.mark.parametrize("apart", APART)
@pytest.mark.parametrize("place", PLACES)
def test_every_pixel_under_a_lamp_on_a_turned_box(device, place, apart):
    verdicts = Verdicts()
    for seed in range(6):
        mesh, lamp = hang(np.random.default_rng(seed), place, apart)
        with Judge(device, mesh) as judge:
            for height in None, 14.0:
                verdicts += judge.judge(look_at(seed, height), lamp, "auto", "z-fail", "mcguire")[0]
    verdicts.check(most_on_edges=0.01)
