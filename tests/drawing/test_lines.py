"""Visible lines of drawings, solved by hand."""

import numpy as np
import pytest
from support.shapes import box, merge

import umbra
from umbra.drawing import see_model
from umbra.scene import Part, Scene
from umbra.scene.mesh import Mesh

SUN = umbra.directional_light((-1, -2, 2))


def look(mesh, eye, height=10.0, up=(0, 0, 1)):
    scene = Scene((Part("it", "", Mesh(*mesh)),), np.zeros(3))
    camera = umbra.Camera(eye, (0, 0, 0), up, (100, 100), height=height)
    return see_model(scene, camera, [SUN], [0])


def measure(lines):
    return float(np.linalg.norm(np.diff(lines.segments, axis=1), axis=2).sum())


def test_a_box_from_above_has_four_outlines():
    # 4 x 2 m at 10 pixels a metre; the edges of the floor lie behind those of the roof.
    seen = look(box((-2, -1, 0), (2, 1, 3)), (0, 0, 50), up=(0, 1, 0))
    assert seen.lines.is_outline.all()
    covered = {tuple(np.round(np.sort(one, 0).ravel(), 6)) for one in seen.lines.segments}
    assert covered == {
        (29.5, 39.5, 69.5, 39.5), (29.5, 59.5, 69.5, 59.5),
        (29.5, 39.5, 29.5, 59.5), (69.5, 39.5, 69.5, 59.5),
    }  # fmt: skip


def test_a_box_from_a_corner_has_six_outlines_and_three_creases():
    seen = look(box((-1, -1, -1), (1, 1, 1)), (30, 30, 30))
    assert int(seen.lines.is_outline.sum()) == 6
    assert int((~seen.lines.is_outline).sum()) == 3
    # A cube along its diagonal is a hexagon whose sides are sqrt(2/3) of an edge.
    assert measure(seen.lines) == pytest.approx(9 * 20 * np.sqrt(2 / 3))


def test_what_stands_before_a_line_cuts_a_piece_out_of_it():
    wall, post = box((-3, 0, 0), (3, 0.5, 2)), box((-0.5, -3, 0), (0.5, -2, 4))
    alone, both = look(wall, (0, -50, 0)), look(merge(wall, post), (0, -50, 0))
    top = [one for one in both.lines.segments if np.allclose(one[:, 1], 49.5 - 20)]
    spans = {tuple(np.sort(one[:, 0]).round(6).tolist()) for one in top}
    assert spans == {(19.5, 44.5), (54.5, 79.5)}
    assert measure(alone.lines) == pytest.approx(2 * (60 + 20))


def test_triangles_of_one_plane_have_no_line_between_them():
    seen = look(box((-2, -1, 0), (2, 1, 3)), (0, -50, 0))
    assert not (~seen.lines.is_outline).any()
    assert len(seen.surfaces) == 1
    assert len(seen.surfaces[0].rings[0]) == 4
