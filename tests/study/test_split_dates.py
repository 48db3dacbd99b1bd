"""What a date's study holds: that date's figures, and nothing that adds up over several dates."""

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.study import split_dates
from umbra.study.loop import Accumulator
from umbra.study.setup import Setup
from umbra.writers.csv_tables import write_cells

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAYS = ["2026-03-21", "2026-06-21", "2026-12-21"]


def part(name, shape):
    return Part(name, "", Mesh(np.array(shape[0], float), np.array(shape[1], np.int32)))


@pytest.fixture(scope="module")
def scene():
    return make_scene(
        [
            part("old", box((0, 0, 0), (10, 10, 8))),
            part("new", box((20, 0, 0), (25, 5, 5))),
            part("tree", box((30, 0, 0), (35, 5, 5))),
        ]
    )


class OwnSums(Accumulator):
    """How many instants are in shadow, and where a receiver is, in an accumulator of one's own."""

    of_any_date = frozenset({"own_number"})

    def __init__(self, shape):
        self.count = np.zeros(shape, np.int32)

    def begin(self, run, lights):
        self.where = run.where

    def add(self, lights, some, masks):
        self.count[self.where] += masks[0].sum(0, dtype=np.int32)

    def variables(self, laid):
        number = np.arange(self.count.size).reshape(self.count.shape)
        return {"own_count": (laid.dims, self.count), "own_number": (laid.dims, number)}


def test_a_sum_of_ones_own_is_of_no_single_date(scene, monkeypatch, tmp_path):
    make = Setup.make_accumulators
    monkeypatch.setattr(
        Setup, "make_accumulators",
        lambda setup, arrays, laid: [*make(setup, arrays, laid), OwnSums(laid.shape)],
    )  # fmt: skip
    plan = {"extent": (-5, -5, 40, 25), "cell": 5.0, "every": "2h"}
    study = umbra.shadow_study(scene, SITE, date=DAYS, **plan)
    assert study.own_count.values.max() > 4  # of all dates; a date has four instants
    dates = split_dates(study.result)
    assert len(dates) == 3
    for date in dates:
        assert "own_count" not in date.more
        np.testing.assert_array_equal(date.more["own_number"][1], study.own_number)
    # The whole is left whole, and a study of one date has it.
    alone = umbra.shadow_study(scene, SITE, date=DAYS[0], **plan)
    (one,) = split_dates(alone.result)
    assert one.more["own_count"][1].max() <= 4
    # A table by date has it once, for all dates.
    write_cells(tmp_path / "cells.csv", study.result)
    head = (tmp_path / "cells.csv").read_text().splitlines()[0].split(",")
    assert [name for name in head if name.startswith("own_count")] == ["own_count"]


@pytest.mark.parametrize(
    ("receivers", "more"),
    [
        ("ground", {"extent": (-5, -5, 40, 25), "cell": 5.0}),
        ("surfaces", {"spacing": 3.0}),
        ("points", {"points": [[15.0, 5, 0], [5, 15, 0]], "names": ["a", "b"]}),
    ],
)
def test_each_date_equals_a_study_of_that_date_alone(scene, receivers, more):
    options = {
        "every": "2h", "receivers": receivers, "spells": True, "min_spell": "1h", "by": "part",
        "canopy": "tree", "transmissivity": "0.1:0.5", "leaf_on": "05-01..10-01", **more,
    }  # fmt: skip
    study = umbra.shadow_study(scene, SITE, date=DAYS, **options)
    for day, one in zip(DAYS, split_dates(study.result), strict=True):
        alone = umbra.shadow_study(scene, SITE, date=day, **options).result
        lacking = {name for name in alone.more if "time" not in alone.more[name][0]} - {*one.more}
        assert not lacking
        for name, (dims, values) in one.more.items():
            assert dims == alone.more[name][0]
            np.testing.assert_array_equal(values, alone.more[name][1], err_msg=name)
