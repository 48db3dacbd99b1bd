"""The map of a report: hours in finer steps, lines along them, exact outlines."""

import base64
import zlib

import numpy as np
import pytest
from support.shapes import box

from umbra.scene import Mesh, Part, make_scene
from umbra.study import count_finer, run_study
from umbra.sun import Site
from umbra.writers.picture_content import Plan
from umbra.writers.report.vector_map import outline_buildings, pack_regions, pack_vector_map

SITE = Site(48.2, 16.37, "Europe/Vienna")
EXTENT = (-40, -20, 40, 60)


def unpack(text):
    """Give whole numbers as the page's script reads them."""
    return np.cumsum(np.frombuffer(zlib.decompress(base64.b64decode(text)), "<i4"))


def unpack_lines(packed, unit):
    x, y = unpack(packed["points"]).reshape(2, -1) * unit
    ends = np.cumsum(unpack(packed["counts"]))
    return np.split(np.stack([x, y], 1), ends[:-1])


def find_area(rings):
    return abs(sum(0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) for x, y in (r.T for r in rings)))


@pytest.fixture(scope="module")
def study():
    scene = make_scene([Part("tower", "", Mesh(*box((-8, -8, 0), (8.3, 8, 25))))])
    return run_study(scene, SITE, date="2026-03-21", every="1h", cell=0.5, extent=EXTENT)


@pytest.mark.parametrize("show", ["sun", "shadow"])
def test_hours_are_those_of_the_finer_steps_and_lines_run_along_them(study, show):
    finer = count_finer(study)
    plan = Plan(study.x, study.y, (study.heights - study.ground).astype(np.float32))
    packed = pack_vector_map(plan, [finer], [-finer.shadow_hours], show)
    (date,) = packed["dates"]
    hours = unpack(date["hours"]).reshape(packed["rows"], packed["cols"]) / packed["per_hour"]
    np.testing.assert_allclose(hours, finer.shadow_hours, atol=6e-4)
    assert packed["seconds"] < 3600
    shown = finer.up_hours - hours if show == "sun" else hours
    assert [one["level"] for one in date["lines"]] == list(range(1, 9))
    assert min(one["level"] for one in date["lost_lines"]) == -7  # what is won has lines, too
    for one in date["lines"]:
        points = np.concatenate(unpack_lines(one, packed["unit"]))
        cells = np.clip(np.floor(points).astype(int), 2, np.array(shown.shape[::-1]) - 3)
        near = np.array([shown[r - 2 : r + 3, c - 2 : c + 3] for c, r in cells])
        assert (near.min((1, 2)) <= one["level"]).all()
        assert (near.max((1, 2)) >= one["level"] - 1e-3).all()


def test_outlines_of_buildings_are_exact(study):
    packed = outline_buildings(study)
    ends = np.array(unpack_lines(packed, packed["unit"])) * 0.5 + EXTENT[:2]
    corners = np.unique(ends.reshape(-1, 2).round(1), axis=0)
    expected = [(-8, -8), (-8, 8), (8.3, -8), (8.3, 8)]
    np.testing.assert_allclose(corners, expected, atol=0.5 * packed["unit"])


def test_a_region_keeps_its_area_and_its_hole():
    mask = np.zeros((60, 80), bool)
    mask[10:50, 0:70] = True
    mask[20:40, 20:40] = False
    packed = pack_regions(mask)
    rings = unpack_lines(packed, packed["unit"])
    assert len(rings) == 2
    assert all((ring[0] == ring[-1]).all() for ring in rings)
    assert find_area(rings) == pytest.approx(mask.sum(), rel=0.01)
