"""Plans judged by rays: every cell of a plane and of the topmost surface, on every kind of mesh."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.judge import judge_field, judge_plane, look_down
from support.raycaster import RayCaster
from support.shapes import (
    SCENES,
    aligned_boxes,
    box,
    jumble,
    merge,
    rewound,
    soup,
    stack_of_triangles,
    staircase,
    turned,
)
from support.sweeps import reduce_count
from support.weights import check_weights

from umbra.cpu.height_field import HeightFieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.receivers.zenith import find_surface
from umbra.scene import make_scene
from umbra.scene.grid import Grid
from umbra.volume.adjacency import make_caster

GRID = Grid(-24.03, -22.07, 0.83, 0.71, 60, 64)
SUNS = [(0.3, 0.2, 0.8), (-0.7, 0.1, 0.3), (0.05, -1, 0.2), (0, 0, 1), (1, 0, 1), (-2, 3, 0.05)]


@pytest.mark.parametrize("name", SCENES)
def test_counts_on_a_plane_are_pierced_triangles(name):
    verdicts, _ = judge_plane(SCENES[name](), GRID, SUNS)
    verdicts.check()
    assert verdicts.deepest > 0


@pytest.mark.parametrize("name", SCENES)
def test_counts_on_the_topmost_surface_are_pierced_triangles(name):
    verdicts, _ = judge_field(SCENES[name](), GRID, SUNS)
    verdicts.check()
    assert verdicts.deepest > 0


@pytest.mark.parametrize("height", [1.5, 3.0, 6.5, 11.0])
@pytest.mark.parametrize("name", ["nested boxes", "jumble", "wound inward", "cavity", "torus knot"])
def test_planes_that_cut_casters(name, height):
    judge_plane(SCENES[name](), GRID, SUNS, height=height)[0].check()


def test_pixel_centres_on_edges_and_suns_along_boxes():
    # Cells of 1 m whose centres are whole numbers, as are all corners.
    grid = Grid(-10.0, -10.0, 1.0, 1.0, 36, 36)
    suns = [(1, 0, 1), (-1, 0, 1), (0, 1, 1), (0, -1, 2), (1, 1, 1), (-1, 1, 1), (0, 0, 1),
            (3, 4, 5), (1e-9, 1, 1), (1, 1e-12, 1), (2, 0, 1)]  # fmt: skip
    for judge in judge_plane, judge_field:
        # Half of all cells may lie on edges here; off them each must be right.
        verdicts, counts = judge(aligned_boxes(), grid, suns)
        verdicts.check(most_on_edges=0.25)
        if judge is judge_plane:
            # Half open: under the zenith every box counts its own area in whole cells.
            assert counts[6].sum() == 4 * 3 + 3 * 3 + 4 * 3 + 3 * 3 + 2 * 2 + 5 * 2 + 4 * 3


def test_ground_under_the_very_corner_of_what_floats():
    # Seen from the zenith the cell lies on a corner; seen from the sun it lies beside all.
    mesh = merge(box((4, 0, 0), (6, 1, 3)), box((-3, -2, 1), (-1, 2, 2)))
    grid = Grid(-8.0, -8.0, 0.5, 0.5, 36, 36)
    x, y = np.meshgrid(grid.x, grid.y)
    level = np.full(x.shape, -1.0)
    heights = np.where((x >= 4) & (x < 6) & (y >= 0) & (y < 1), 3.0, level)
    heights = np.where((x >= -3) & (x < -1) & (y >= -2) & (y < 2), 2.0, heights)
    suns = np.array(
        [(a, b, c) for a in range(-3, 4) for b in range(-3, 4) for c in (1, 2, 3)], float
    )
    counts = HeightFieldSweep(make_caster(*mesh), grid, heights).counts(suns)
    assert counts.min() == 0
    assert (heights[18, 24], counts[7 * 3 * 4 + 1, 18, 24]) == (-1, 0)  # (4, 1), sun (1, -3, 2)

    rays = RayCaster(*mesh)
    up, own = np.array([0.0, 0, 1, 0]), np.full(x.size, -1)
    closed = np.ones(len(mesh[1]), bool)
    for sun, count in zip(suns, counts, strict=True):
        answers = []
        for aside in ((0, 0), (1e-4, 2e-4), (-2e-4, 1e-4), (-1e-4, -2e-4), (2e-4, -1e-4)):
            points = np.stack([x + aside[0], y + aside[1], heights + 1e-7], -1).reshape(-1, 3)
            answers.append(rays.count(points, own, up, np.append(sun, 0), closed).any)
        certain = (np.array(answers) == answers[0]).all(0).reshape(x.shape)
        assert certain.mean() > 0.8
        assert ((count != 0) == answers[0].reshape(x.shape))[certain].all(), sun


def test_a_staircase_counts_every_one_of_its_300_steps():
    mesh = staircase()
    # Just below the noses a ray up the flight passes in and out of each step.
    grid = Grid(-0.61, 0.05, 0.06, 0.19, 12, 10)
    suns = [(0.5, 0, 0.25), (0.5, 0.001, 0.25), (0.5, -0.0007, 0.2501)]
    # The last column is under the first step, or on it: one tread above, or the other 299.
    for judge, last in (judge_plane, 1), (judge_field, 299):
        verdicts, counts = judge(mesh, grid, suns)
        verdicts.check()
        assert verdicts.deepest == 300
        np.testing.assert_array_equal(counts[0], [[0, 0] + [300] * 9 + [last]] * 10)


def test_a_sloping_side_many_cells_wide_meets_a_slope():
    # The wall's top rises with the ground: its shadow is a band, 300 cells long, on the slope.
    rise = np.array([0.0, 0.0, 0.1])
    wall, faces = box((0, 0, 0.5), (30, 0.2, 3))
    wall = wall + wall[:, :1] * rise
    ground = np.array([[-1.0, -1, 0], [31, -1, 0], [31, 9, 0], [-1, 9, 0]])
    ground = ground + ground[:, :1] * rise
    mesh = merge((wall, faces), (ground, np.array([[0, 1, 2], [0, 2, 3]])))
    grid = Grid(0.013, -0.48, 0.1, 0.05, 300, 120)
    verdicts, counts = judge_field(mesh, grid, [(0.02, -0.9, 0.8), (-0.3, -1, 0.6), (0, -1, 1)])
    verdicts.check()
    assert (counts.any(1).sum(1) > 250).all()


@pytest.mark.parametrize("way", [judge_plane, judge_field])
def test_more_layers_than_int16_holds(way):
    mesh = stack_of_triangles(40_000)
    grid = Grid(-6.0, -5.0, 1.1, 1.3, 12, 9)
    # The second sun is as deep; the third leaves the stack's shadow off the grid.
    suns = [(0.1, 0.05, 1), (-0.2, 0.1, 1), (9, 9, 1)]
    verdicts, counts = way(mesh, grid, suns)
    verdicts.check()
    assert set(np.unique(counts[:2])) == {0, 40_000}
    assert counts[:2].any(axis=(1, 2)).all()
    assert not counts[2].any()


@pytest.mark.parametrize("layers", [127, 128, 255, 256, 257, 511, 512, 65_536])
def test_layers_that_wrap_around_in_few_bits(layers):
    caster = make_caster(*stack_of_triangles(layers))
    grid = Grid(-6.0, -5.0, 1.1, 1.3, 12, 9)
    check_steps(PlaneSweep(caster, grid, 0.0), layers)


@pytest.mark.parametrize("layers", [255, 256, 257, 512])
def test_layers_that_begin_in_cells_of_their_own(layers):
    # No cell is crossed by many edges, but the middle lies under all boxes.
    half = 2 + 0.03 * np.arange(layers)
    mesh = merge(*(box((-w, -w, 5 + w), (w, w, 5.01 + w)) for w in half))
    grid = Grid(-0.02, -22.01, 0.02, 0.02, 3, 2201)
    check_steps(PlaneSweep(make_caster(*mesh), grid, 0.0), layers)


def check_steps(sweep, layers):
    suns = np.array([(0.001, 0.002, 1), (0.0, 0.001, 1)])
    counts = sweep.counts(suns)
    assert counts.max() == layers
    check_weights(sweep, suns, counts > 0)


@pytest.mark.parametrize("layers", [127, 128, 255, 256, 300])
def test_boxes_in_the_ground_that_wrap_around_in_few_bits(layers):
    # All outlines in the ground begin in the same cells, and change with the sun. Roofs lie apart,
    # and suns in the north and south leave corners in their columns: nothing else overflows.
    half = 4 + 1e-4 * np.arange(layers)
    mesh = merge(*(box((-w, -w, -1), (w, w, 3000 * (w - 4) + 1)) for w in half))
    sweep = PlaneSweep(make_caster(*mesh), Grid(-12.0, -131.0, 1.1, 1.3, 24, 200), 0.0)
    around = np.append(np.linspace(0, 6, 36), np.array([1, 3, 1, 3]) * np.pi / 2)
    suns = np.column_stack([np.cos(around).round(12), np.sin(around), np.full(40, 1.5)])
    wanted = sweep.counts(suns)
    assert wanted.max() == layers
    rng = np.random.default_rng(1)
    for _ in range(3):  # what a sun leaves behind is no other's
        order = rng.permutation(40)
        check_weights(sweep, suns[order], wanted[order] > 0)


def test_deep_suns_do_not_disturb_the_others_in_a_batch():
    mesh = stack_of_triangles(40_000)
    caster = make_caster(*mesh)
    grid = Grid(-6.0, -5.0, 1.1, 1.3, 12, 9)
    suns = np.array([(9, 9, 1), (0.1, 0.05, 1), (9, -9, 1), (-0.2, 0.1, 1)], float)
    heights, _ = look_down(mesh, grid, ground=0.0)
    for sweep in PlaneSweep(caster, grid, 0.0), HeightFieldSweep(caster, grid, heights):
        counts = sweep.counts(suns)
        check_weights(sweep, suns, counts > 0)
        assert (counts > 0).sum(0).max() == 2 - isinstance(sweep, HeightFieldSweep)


@pytest.mark.parametrize("name", ["turned boxes", "jumble", "wound inward"])
def test_results_do_not_depend_on_threads(name):
    mesh = SCENES[name]()
    caster = make_caster(*mesh)
    rng = np.random.default_rng(3)
    suns = np.column_stack([rng.normal(size=(70, 2)), rng.uniform(0.05, 1, 70)])
    heights = look_down(mesh, GRID, ground=0.0)[0]
    results = []
    for threads in (1, 2, 3):
        found = []
        for sweep in (
            PlaneSweep(caster, GRID, 0.5, threads),
            HeightFieldSweep(caster, GRID, heights, threads),
        ):
            counts = sweep.counts(suns)
            check_weights(sweep, suns, counts != 0)
            found.append(counts)
        found.append(look_down(mesh, GRID, threads=threads)[1])
        results.append(found)
    for other in results[1:]:
        for first, again in zip(results[0], other):
            np.testing.assert_array_equal(first, again)


@pytest.mark.parametrize("name", ["turned boxes", "soup", "flipped windings", "sheets"])
def test_a_flat_field_counts_as_the_plane_does(name):
    mesh = SCENES[name]()
    caster = make_caster(*mesh)
    suns = np.array(SUNS)
    plane = PlaneSweep(caster, GRID, 0.0).counts(suns)
    field = HeightFieldSweep(caster, GRID, np.zeros((GRID.rows, GRID.cols))).counts(suns)
    # Where a caster stands on the cell the field asks for its foot, seen from the sky.
    stands = look_down(mesh, GRID)[1] >= 0
    np.testing.assert_array_equal(plane[:, ~stands], field[:, ~stands])


def test_a_turned_world_gives_turned_counts():
    # Quarter turns map this grid onto itself: rows become columns.
    grid = Grid(-20.5, -20.5, 1.0, 1.0, 42, 42)
    mesh = SCENES["turned boxes"]()
    sun = np.array([(0.61, 0.23, 0.4)])
    first = PlaneSweep(make_caster(*mesh), grid, 0.0).counts(sun)[0]
    again = PlaneSweep(make_caster(*turned(mesh, 90)), grid, 0.0).counts(turned((sun, 0), 90)[0])[0]
    # A point (x, y) goes to (-y, x).
    np.testing.assert_array_equal(again, first.T[:, ::-1])


@st.composite
def meshes(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    kind = draw(st.sampled_from(["soup", "jumble", "boxes", "whole"]))
    if kind == "soup":
        return soup(rng, draw(st.integers(1, 25)), low=draw(st.sampled_from([0.5, -8.0])))
    if kind == "jumble":
        return jumble(rng, draw(st.integers(1, 40)), draw(st.integers(3, 9)), low=-3.0)
    boxes = []
    for _ in range(draw(st.integers(1, 5))):
        low, size = rng.uniform(-8, 4, 3), rng.uniform(0.5, 9, 3)
        if kind == "whole":  # aligned with the cells and with each other
            low, size = np.round(low), np.ceil(size)
        boxes.append(box(low, low + size))
        if draw(st.booleans()):
            boxes[-1] = rewound(boxes[-1])
    return merge(*boxes)


@settings(max_examples=reduce_count(200, 2), deadline=None, derandomize=True)
@given(
    meshes(),
    st.sampled_from([(0.0, 0.0, 1.0, 1.0), (0.137, -0.291, 1.03, 0.97), (0.5, 0.25, 0.75, 1.5)]),
    st.lists(
        st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(0.03, 3)), min_size=1, max_size=3
    )
    | st.lists(
        st.tuples(*[st.integers(-2, 2).map(float)] * 2, st.just(1.0)), min_size=1, max_size=3
    ),
    st.sampled_from([0.0, -2.5, 1.0, 3.3]),
)
def test_any_plan_of_anything(mesh, place, suns, height):
    x0, y0, dx, dy = place
    grid = Grid(x0 - 14 * dx, y0 - 13 * dy, dx, dy, 29, 27)
    # Whole metres and whole suns put many cells on edges; none else may differ.
    judge_plane(mesh, grid, suns, height=height)[0].check(most_on_edges=0.25)
    judge_field(mesh, grid, suns, ground=height)[0].check(most_on_edges=0.25)


def test_roofs_whose_corners_share_an_x_or_a_y_are_seen_from_above():
    # Each face has two corners with one x and two with one y: none is a wall.
    roof = np.array([[0, 0, 7], [4, 0, 7], [4, 3, 7], [0, 3, 7.0]])
    surface = find_surface(
        make_scene(roof, np.array([[0, 1, 2], [0, 2, 3]])).triangles(),
        Grid(0.5, 0.5, 1.0, 1.0, 4, 3), 0.0,
    )  # fmt: skip
    assert (surface.face >= 0).all()
    np.testing.assert_array_equal(surface.heights, np.full((3, 4), 7.0))


def test_long_shadows_end_where_a_valley_rises_again():
    # Sides are followed a block of 32 cells at a time: a ridge and a pit lie along them.
    step = 1.0
    x, y = np.meshgrid(np.arange(-2.0, 181.0, step * 6), np.arange(-2.0, 141.0, step * 5))
    z = 4 * np.exp(-(((x - 120) / 12) ** 2)) - 6 * np.exp(-(((x - 150) / 9) ** 2)) + 0.02 * y
    corners = np.stack([x, y, z], -1).reshape(-1, 3)
    k = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    hills = corners, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    towers = [box((10, 20, -8), (16, 27, 9)), box((60, 70, -8), (63, 74, 15)),
              box((101, 40, -8), (103, 90, 7))]  # fmt: skip
    mesh = merge(hills, *towers)
    suns = [(-1, 0.02, 0.07), (-1, -0.4, 0.03), (-0.4, -1, 0.05), (0.3, 1, 0.1), (1, 0.3, 0.02)]
    verdicts, counts = judge_field(mesh, Grid(0.03, 0.07, step, step, 170, 130), suns)
    verdicts.check()
    assert (counts.any((1, 2))).all()
