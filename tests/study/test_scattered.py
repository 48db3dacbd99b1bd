"""Models whose objects stand far apart, and cells that are too coarse for them."""

import numpy as np
import pytest
from support.shapes import box, moved

from umbra.receivers.scattered import LEAST_CELLS, find_dense
from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.sun import Site

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
NOON = {"date": "2026-06-21", "start": "12:00", "end": "13:00", "every": "1h"}


def place(spots):
    house = box((0, 0, 0), (10, 10, 6))
    return make_scene(
        [
            Part(f"house {k}", "Building", Mesh(*moved(house, (x, y, 0))))
            for k, (x, y) in enumerate(spots)
        ]
    )


CLUSTER = [(20.0 * k, 15.0 * (k % 2)) for k in range(6)]
AFAR = [(5000.0, 9000.0), (-4000.0, 2000.0), (5040.0, 9000.0)]


def test_a_plan_of_a_scattered_model_begins_where_most_of_it_stands():
    study = run_study(place([*AFAR, *CLUSTER]), VIENNA, **NOON)
    alone = run_study(place(CLUSTER), VIENNA, **NOON)
    assert "extent_note" in study.facts
    assert "6 of them" in study.facts["extent_note"]
    np.testing.assert_array_equal(study.x, alone.x)
    np.testing.assert_array_equal(study.shadow_hours, alone.shadow_hours)
    assert "extent_note" not in alone.facts
    asked = run_study(place([*AFAR, *CLUSTER]), VIENNA, extent=(0, 0, 9000, 9000), **NOON)
    assert "extent_note" not in asked.facts
    assert asked.x[-1] > 8900


@pytest.mark.parametrize("count", [3, 7])
def test_a_few_objects_have_no_most(count):
    spots = [*AFAR, *CLUSTER][:count]
    boxes = np.array([[(x, y, 0), (x + 10, y + 10, 0)] for x, y in spots])
    assert find_dense(boxes) is None


def test_cells_too_coarse_for_buildings_are_told():
    just = 10 / np.sqrt(LEAST_CELLS)
    for cell, is_coarse in ((1.02 * just, True), (0.98 * just, False)):
        study = run_study(place(CLUSTER), VIENNA, cell=cell, **NOON)
        assert ("cell_note" in study.facts) == is_coarse
