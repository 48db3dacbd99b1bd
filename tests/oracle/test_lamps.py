"""Lamps on faces, on edges and at corners of what casts, and as near to them as you like."""

import numpy as np
import pytest
from support.judge import Verdicts, judge_frame
from support.lamps import PLACES, hang, look_at
from support.shapes import HOUSE, box, merge, rewound, sheet

from umbra.cpu.frame import FrameCounter
from umbra.rays.depth import NOTHING
from umbra.rays.holding import HOLDS, find_holders
from umbra.scene import Camera, make_scene, point_light
from umbra.volume.silhouette import METHODS, find_silhouette_edges, prepare_tree

APART = [0.0, 1e-12, 1e-9, 1e-6, 1e-3]


@pytest.mark.parametrize("apart", APART)
@pytest.mark.parametrize("place", PLACES)
def test_every_pixel_under_a_lamp_on_a_turned_box(place, apart):
    verdicts = Verdicts()
    for seed in range(20):
        mesh, lamp = hang(np.random.default_rng(seed), place, apart)
        for height in None, 14.0:
            verdicts += judge_frame(mesh, look_at(seed, height), lamp)[0]
    verdicts.check(most_on_edges=0.002)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("kind", ["inward", "open", "in company", "far away"])
def test_other_casters_that_hold_a_lamp(kind, place):
    verdicts = Verdicts()
    for seed in range(8):
        (vertices, faces), lamp = hang(np.random.default_rng(seed), place)
        camera, ground = look_at(seed), 0.0
        if kind == "inward":
            mesh = rewound((vertices, faces))
        elif kind == "open":
            mesh = vertices, faces[np.arange(len(faces)) != seed]
        elif kind == "in company":
            mesh = merge(
                (vertices, faces), HOUSE, sheet([(-9, -9, 9), (9, -9, 9), (9, 9, 10), (-9, 9, 10)])
            )
        else:
            far = np.array([2.6e6, 1.2e6, 400.0])
            corner = np.argmin(np.abs(vertices - lamp.position[:3]).sum(1))
            mesh, ground = (vertices + far, faces), far[2]
            lamp = point_light(mesh[0][corner])  # a place that a file can say
            camera = look_at(seed, about=far)
        verdicts += judge_frame(mesh, camera, lamp, ground)[0]
    verdicts.check(most_on_edges=0.002)


def test_a_lamp_at_a_corner_leaves_three_quarters_of_the_ground_in_light():
    # Behind the far faces lies what the corner's quarter holds: one of them is on each way.
    mesh = box((0, 0, 1), (2, 2, 3))
    camera = Camera((0, 0, 30), (0, 0, 0), up=(0, 1, 0), size=(8, 8), height=8.0)
    counter = FrameCounter(make_scene(*mesh), ground=0.0)
    view, frame = counter.see(camera)
    for method in "auto", "z-fail":
        counts = counter.count(view, camera, point_light((0, 0, 3)), method)
        expected = np.zeros((8, 8), int)
        expected[:4, 4:] = 1
        expected[2:4, 4:6] = 0  # its roof, which the lamp lies in
        np.testing.assert_array_equal(counts, expected)
        lit = frame.lit(counts, point_light((0, 0, 3)))
        np.testing.assert_array_equal(lit, (expected == 0) & (view.face < 0))


@pytest.mark.parametrize("place", PLACES)
def test_faces_that_hold_the_lamp_are_not_lit_by_it(place):
    for seed in range(10):
        mesh, lamp = hang(np.random.default_rng(seed), place)
        counter, camera = FrameCounter(make_scene(*mesh), ground=0.0), look_at(seed)
        view, frame = counter.see(camera)
        held = find_holders(counter.caster, counter.blocks, lamp.local(counter.scene.origin), 0.0)
        walls = counter.caster.source[held] // 2  # two triangles each
        lit = frame.lit(counter.count(view, camera, lamp), lamp)
        assert not lit[(view.face != NOTHING) & np.isin(view.face // 2, walls)].any()


def test_what_holds_a_lamp_is_told_by_the_digits_of_float64():
    counter = FrameCounter(make_scene(*box((0, 0, 0), (8, 8, 8))))

    def count_holders(*place, origin=0.0):
        return len(find_holders(counter.caster, counter.blocks, np.array([*place, 1.0]), origin))

    assert count_holders(5, 3, 8) == 1
    assert count_holders(5, 5, 8) == 2  # on the diagonal
    assert count_holders(5, 3, 8 + 8 * HOLDS) == 1
    assert count_holders(5, 3, 8 + 16 * HOLDS) == 0
    assert count_holders(5, 3, 8 + 16 * HOLDS, origin=1e6) == 1  # there digits are coarser
    assert count_holders(8, 8, 3) == 2  # on an edge
    assert count_holders(8, 0, 8) == 4  # a corner of four triangles
    assert count_holders(9, 3, 8) == 0  # in its plane, beside it
    assert count_holders(4, 4, 4) == 0


@pytest.mark.parametrize("place", PLACES)
def test_no_silhouette_runs_through_the_lamp_and_all_chains_close(place):
    for seed in range(10):
        mesh, lamp = hang(np.random.default_rng(seed), place)
        counter = FrameCounter(make_scene(*mesh))
        caster, light = counter.caster, lamp.local(counter.scene.origin)
        prepare_tree(caster)  # of all faces: it must serve those that are left as well
        casting = caster.without(find_holders(caster, counter.blocks, light, counter.scene.origin))
        assert not casting.is_closed.any()
        found = [find_silhouette_edges(casting, light, method) for method in METHODS]
        for edges, multiplicity in found:
            np.testing.assert_array_equal(edges, found[0][0])
            np.testing.assert_array_equal(multiplicity, found[0][1])
        edges, multiplicity = found[0]
        ends = caster.vertices[edges] - light[:3]
        along = ends[:, 1] - ends[:, 0]
        aside = np.linalg.norm(np.cross(ends[:, 0], along), axis=1) / np.linalg.norm(along, axis=1)
        between = np.einsum("ij,ij->i", ends[:, 0], ends[:, 1]) <= 0
        assert not (between & (aside < 1e-9)).any()
        sums = np.zeros(len(caster.vertices), int)
        np.add.at(sums, edges[:, 0], multiplicity)
        np.add.at(sums, edges[:, 1], -multiplicity)
        assert not sums.any()
