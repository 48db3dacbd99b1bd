"""Faces between the eye and a light."""

import numpy as np
import pytest
from support.shapes import box, merge, moved

from umbra.rays.eye_count import FaceBlocks, find_around
from umbra.volume.adjacency import make_caster


@pytest.mark.parametrize("turn", [1, -1], ids=["outward", "inward"])
def test_what_is_around_a_light_encloses_it_either_way_round(turn):
    vertices, faces = merge(box((0, 0, 0), (4, 4, 4)), moved(box((0, 0, 0), (2, 2, 2)), (9, 0, 0)))
    caster = make_caster(vertices, faces[:, ::turn])
    blocks = FaceBlocks.of(caster)
    first = caster.component[np.flatnonzero(caster.source == 0)[0]]
    for place, expected in (((1, 2, 3), [first]), ((10, 1, 1), [1 - first]), ((6, 1, 1), [])):
        around = find_around(caster, blocks, np.array([*place, 1.0]))
        assert np.flatnonzero(around).tolist() == expected
