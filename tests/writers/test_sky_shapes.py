"""Polygons of what takes the sky, in diagrams whose areas are light."""

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.sky.projections import find_projection
from umbra.writers.sky_pictures import _cut_name
from umbra.writers.sky_shapes import join_bands

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna", true_north=12.0)


def find_area(shape):
    x, y = shape.T
    return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.6, 0.8, 0)])
def test_areas_of_a_waldram_diagram_are_the_shares_of_light(normal):
    blocks = {"north": ((-8, 9, 0), (11, 12, 14)), "east": ((7, -9, 0), (10, 5, 8)),
              "low": ((-14, -3, 0), (-9, 6, 3))}  # fmt: skip
    scene = umbra.make_scene(
        [umbra.Part(name, "", umbra.Mesh(*box(*ends))) for name, ends in blocks.items()]
    )
    view = umbra.sky_view(scene, (0, 0, 1), normal, SITE)
    projection = find_projection("waldram", view.normal, SITE.true_north)
    ends = (-1.0, 1.0) if projection.facing is None else None
    taken, count = dict.fromkeys(view.blocked_by, 0.0), 0
    for owner, shape in join_bands(*view.trace_bands(), projection.project, ends):
        assert ends is None or np.ptp(shape[:, 0]) < 1.0  # none lies across the cut
        taken[view.names[owner]] += find_area(shape) / 2.0
        count += 1
    assert count <= len(view.trace_bands()[0])
    if normal[2] == 1:
        assert set(taken) == set(blocks)
    for name, share in view.blocked_by.items():
        assert taken[name] == pytest.approx(share, abs=0.002)


def test_long_names_are_whole_in_three_lines_or_lose_their_middle():
    name = "UUID_LOD2_011533-19d66b36-5611-48d4-a4e8_2"
    assert "".join(_cut_name(name, 20, 3)) == name
    short = "".join(_cut_name(name, 20, 1))
    assert len(short) == 20
    assert (short[:9], short[-9:]) == (name[:9], name[-9:])
