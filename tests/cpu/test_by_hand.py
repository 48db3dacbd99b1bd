"""Shadows that anyone can work out on paper."""

import numpy as np
import pytest
from support.judge import look_down
from support.shapes import box, merge, nested_boxes, rewound, sheet
from support.weights import count_suns

from umbra.cpu.frame import FrameCounter
from umbra.cpu.height_field import HeightFieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.rays.eye_count import FaceBlocks, find_anchor, find_faces_before
from umbra.scene import Camera, directional_light, make_scene, point_light, spot_light
from umbra.scene.grid import Grid
from umbra.volume.adjacency import make_caster

SOUTH_45 = np.array([(0.0, -1, 1)])


def draw(counts):
    """Draw counts with north at the top: a dot for 0."""
    return ["".join("." if n == 0 else str(n) for n in row) for row in counts[::-1]]


def on_plane(mesh, grid, sun, height=0.0):
    return PlaneSweep(make_caster(*mesh), grid, height).counts(np.array([sun], float))[0]


def on_top(mesh, grid, sun, ground=0.0):
    heights, _ = look_down(mesh, grid, ground)
    return HeightFieldSweep(make_caster(*mesh), grid, heights).counts(np.array([sun], float))[0]


def test_a_pole_of_10_m_casts_10_m_to_the_north():
    # 0.2 m wide; cells of 0.1 m whose centres lie 0.05 m off its faces.
    pole = box((-0.1, -0.1, 0), (0.1, 0.1, 10))
    grid = Grid(-0.95, -1.95, 0.1, 0.1, 20, 150)
    counts = on_plane(pole, grid, SOUTH_45[0])
    dark = counts > 0
    assert counts.max() == 1
    assert dark.any(1).sum() * grid.dy == pytest.approx(10.2)
    assert dark.any(0).sum() * grid.dx == pytest.approx(0.2)
    y = grid.y[dark.any(1)]
    assert y[0] == pytest.approx(-0.05)
    assert y[-1] == pytest.approx(10.05)


@pytest.mark.parametrize(("sun", "mirror"), [((0, -1, 1), 0), ((0, 1, 1), 1)])
def test_named_cells_of_a_box_on_a_plane(sun, mirror):
    # A 2 x 2 x 3 m box on whole metres, cells' centres on halves.
    counts = on_plane(box((2, 2, 0), (4, 4, 3)), Grid(0.5, 0.5, 1.0, 1.0, 6, 8), sun)
    north = ["......", "..11..", "..11..", "..11..", "..11..", "..11..", "......", "......"]
    south = ["......", "......", "......", "......", "..11..", "..11..", "..11..", "..11.."]
    assert draw(counts) == (south if mirror else north)


def test_named_cells_on_top_of_what_stands_there():
    # A tower 3 m high throws 3 m north, over the ground and a step of 1 m.
    mesh = merge(box((2, 1, 0), (4, 2, 3)), box((0, 3, 0), (3, 6, 1)))
    counts = on_top(mesh, Grid(0.5, 0.5, 1.0, 1.0, 6, 7), (0, -1, 1))
    assert draw(counts) == [
        "111...",  # the step's own shadow, a metre north
        "......",
        "...1..",  # on the ground the tower's reaches 3 m north,
        "..11..",  # on the step 2 m
        "..11..",
        "......",  # the tower's roof is in the sun
        "......",
    ]


def test_counts_are_layers():
    # Three slabs, one over the other, each smaller: the zenith goes through 1, 2, 3 of them.
    mesh = merge(*[box((k, k, 2 * k + 1), (7 - k, 7 - k, 2 * k + 2)) for k in range(3)])
    counts = on_plane(mesh, Grid(0.5, 0.5, 1.0, 1.0, 7, 7), (0, 0, 1))
    assert draw(counts) == [
        "1111111",
        "1222221",
        "1233321",
        "1233321",
        "1233321",
        "1222221",
        "1111111",
    ]


@pytest.mark.parametrize("altitude", [12.0, 30.0, 60.0])
@pytest.mark.parametrize("azimuth", [0.0, 77.0, 135.0, 251.0])
def test_the_area_of_a_box_s_shadow(azimuth, altitude):
    # Its plan, and the parallelograms that its two edges across the light sweep.
    width, depth, high = 6.0, 4.0, 5.0
    a, h = np.radians(azimuth), np.radians(altitude)
    sun = (np.sin(a) * np.cos(h), np.cos(a) * np.cos(h), np.sin(h))
    cell = 0.05
    reach = high / np.tan(h) + 4
    n = int(2 * reach / cell)
    grid = Grid(-reach, -reach, cell, cell, n, n)
    counts = on_plane(box((-3, -2, 0), (3, 2, high)), grid, sun)
    area = width * depth + high / np.tan(h) * (width * abs(np.cos(a)) + depth * abs(np.sin(a)))
    assert counts.max() == 1
    assert counts.sum() * cell**2 == pytest.approx(area, abs=0.02 * area)


def test_a_box_of_whole_cells_shadows_its_area_exactly():
    # Centres on its very edges: half open, so each cell once.
    grid = Grid(0.0, 0.0, 1.0, 1.0, 30, 30)
    counts = on_plane(box((4, 5, 0), (10, 8, 6)), grid, (-1, -1, 1))
    assert counts.sum() == 6 * 3 + 6 * 6 + 6 * 3


def test_a_house_wound_inward_shadows_the_same_cells():
    house = box((2, 2, -1), (4, 4, 3))
    grid = Grid(0.5, 0.5, 1.0, 1.0, 6, 8)
    for sun in (0, -1, 1), (0.3, 0.4, 0.5), (0, 0, 1):
        plain = on_plane(house, grid, sun)
        inward = on_plane(rewound(house), grid, sun)
        np.testing.assert_array_equal(inward > 0, plain > 0)


def test_what_lies_below_the_plane_casts_nothing_on_it():
    grid = Grid(0.5, 0.5, 1.0, 1.0, 6, 6)
    assert not on_plane(box((2, 2, -5), (4, 4, -1)), grid, (0, -1, 1)).any()
    assert not on_plane(box((2, 2, -5), (4, 4, 0)), grid, (0, -1, 1)).any()
    assert not on_plane(sheet([(2, 2, 0), (4, 2, 0), (4, 4, 0), (2, 4, 0)]), grid, (0, 0, 1)).any()


def test_nothing_at_all_casts_nothing():
    caster = make_caster(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    grid = Grid(0.0, 0.0, 1.0, 1.0, 4, 3)
    for sweep in PlaneSweep(caster, grid, 0.0), HeightFieldSweep(caster, grid, np.zeros((3, 4))):
        assert not sweep.counts(SOUTH_45).any()
        assert not count_suns(sweep, SOUTH_45, (3, 4)).any()


def test_an_eye_counts_the_layers_between_it_and_the_light():
    caster = make_caster(*nested_boxes(4))
    blocks = FaceBlocks.of(caster)

    def count(eye, light):
        anchor = find_anchor(caster, blocks, np.array(eye, float), np.array(light, float))
        return anchor.count(caster.is_closed), anchor.enclosed.sum()

    sky = (0.1, 0.05, 1, 0)
    assert count((0, 0, 5, 1), sky) == (4, 0)
    assert count((5.5, 0, 5, 1), sky) == (1, 0)
    assert count((4.5, 0, 5, 1), sky) == (2, 0)
    assert count((20, 0, 5, 1), sky) == (0, 0)
    assert count((0, 0, -5, 1), sky) == (4, 0)
    # A lamp within all four: from outside no lit face lies between, and that tells nothing.
    assert count((0, 0, 30, 1), (0, 0, 5, 1)) == (0, 4)
    assert count((0, 0, 5.5, 1), (0, 0.1, 5, 1)) == (0, 0)
    # Both beyond everything.
    assert count((0.3, 0.2, 1, 0), sky) == (0, 0)


def test_named_pixels_of_a_frame():
    # Straight down on a slab 2 m up, the sun at 45 degrees in the west: its shadow lies 2 m east.
    slab = box((-4, -2, 2), (0, 2, 2.5))
    camera = Camera((0, 0, 20), (0, 0, 0), up=(0, 1, 0), size=(10, 6), height=6.0)
    counter = FrameCounter(make_scene(*slab), ground=0.0)
    view, frame = counter.see(camera)
    light = directional_light((-1, 0, 1))
    for method in "auto", "z-pass", "z-fail":
        counts = counter.count(view, camera, light, method)
        assert draw(counts[::-1]) == [
            "..........",
            ".....11...",
            ".....11...",
            ".....11...",
            ".....11...",
            "..........",
        ]
    np.testing.assert_allclose(frame.position[2, 7], (2.5, 0.5, 0), atol=1e-12)
    np.testing.assert_allclose(frame.position[2, 3], (-1.5, 0.5, 2.5), atol=1e-12)
    np.testing.assert_allclose(frame.normal[2, 3], (0, 0, 1))
    lit = frame.lit(counts, light)
    assert not lit[2, 5]
    assert lit[2, 7]
    assert lit[2, 3]


def test_attached_shadow_and_a_spot_s_cone():
    wall = sheet([(0, -3, 0), (0, 3, 0), (0, 3, 4), (0, -3, 4)])
    counter = FrameCounter(make_scene(*wall), ground=0.0)
    camera = Camera((6, 0, 2), (0, 0, 2), size=(5, 5), fov=50)
    view, frame = counter.see(camera)
    # The wall shows this side; its winding says the other. What is seen decides.
    np.testing.assert_allclose(frame.normal[2, 2], (1, 0, 0))
    for x, is_lit in (5, True), (-5, False):
        light = point_light((x, 0.5, 3))
        counts = counter.count(view, camera, light)
        assert frame.lit(counts, light)[2, 2] == is_lit
    for half_angle, is_lit in (20.0, True), (10.0, False):
        light = spot_light((5, 0, 2), (0, 0, 3.5), half_angle)  # 16.7 degrees off the middle
        counts = counter.count(view, camera, light)
        assert frame.lit(counts, light)[2, 2] == is_lit


@pytest.mark.parametrize("target", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)])
def test_faces_that_reach_a_little_before_the_near_plane(target):
    # A box 2 m before the eye, on each side of it: all but the two triangles of its back.
    low, high = np.array([-1.0, -1, -1]), np.array([1.0, 1, 1])
    caster = make_caster(*box(low + 3 * np.array(target), high + 3 * np.array(target)))
    for near, n in ((1.99, 0), (2.01, 10), (4.01, 12)):
        camera = Camera((0, 0, 0), target, near=near)
        found = find_faces_before(caster, FaceBlocks.of(caster), camera, np.zeros(3))
        assert len(found) == n
