"""Studies on OpenGL: the CPU's counts, masks and hours, but for cells on an edge."""

import numpy as np
import pytest
from support.shapes import box, city, merge, rewound, stack_of_triangles, terrain, three_walls
from support.weights import check_weights

from umbra.casters.casting import prepare_casting
from umbra.gl.plan_sweep import GlSweep
from umbra.receivers.plan_tiles import PlaneTile, PlanModel, TopmostTile
from umbra.scene import Mesh, Part, make_scene
from umbra.scene.grid import Grid

SUNS = np.array(
    [
        (np.cos(azimuth) * np.cos(height), np.sin(azimuth) * np.cos(height), np.sin(height))
        for azimuth, height in ((0.3, 0.2), (1.2, 0.7), (2.0, 1.2), (4.0, 0.05), (5.0, 0.5))
    ]
)
MESHES = {
    "city": lambda: city(5, seed=2),
    "terrain": lambda: terrain(50),
    "open walls": three_walls,
    "wound inward": lambda: rewound(merge(box((0, 0, 0), (6, 6, 9)), box((9, 2, 0), (12, 9, 4)))),
}


def prepare_sweep(scene, chosen, receivers, ground, grid):
    tile = {"ground": PlaneTile, "top": TopmostTile}[receivers]
    cast = prepare_casting(scene, chosen, 1)
    return PlanModel(scene, cast.soup, cast.caster, 1, ground, tile).make_tile(grid).make_counter()


def sweeps(device, scene, receivers, casters=None, rise=0.4):
    low, high = scene.bounds() - scene.origin
    x, y = low[:2] - 5
    grid = Grid(x + 0.013, y + 0.017, *((high - low)[:2] + 10) / (150, 110), 150, 110)
    ground = low[2] + rise
    chosen = list(range(len(scene.parts))) if casters is None else casters
    cpu = prepare_sweep(scene, chosen, receivers, ground, grid)
    return cpu, GlSweep(scene, casters, grid, ground, receivers == "ground", device)


def is_on_edge(counts):
    """Tell which cells have a neighbour of another count, (..., rows, cols) bool."""
    wide = np.pad(counts, [(0, 0)] * (counts.ndim - 2) + [(1, 1), (1, 1)], mode="edge")
    rows, cols = counts.shape[-2:]
    near = [wide[..., i : i + rows, j : j + cols] != counts for i in range(3) for j in range(3)]
    return np.any(near, axis=0)


@pytest.mark.parametrize("receivers", ["ground", "top"])
@pytest.mark.parametrize("name", MESHES)
def test_counts_masks_and_hours_are_the_cpus(device, name, receivers):
    cpu, gl = sweeps(device, make_scene(*MESHES[name]()), receivers)
    with gl:
        expected, counts = cpu.counts(SUNS), gl.counts(SUNS)
        differ = counts != expected
        assert not (differ & ~is_on_edge(expected) & ~is_on_edge(counts)).any()
        assert differ.mean() < 1e-3
        assert (expected != 0).any()
        assert (gl.masks(SUNS) != cpu.masks(SUNS)).mean() < 1e-3
        check_weights(gl, SUNS, gl.masks(SUNS))
        check_weights(cpu, SUNS, cpu.masks(SUNS))


def test_only_chosen_parts_cast_and_all_receive(device):
    tower, hall = Mesh(*box((0, 0, 0), (3, 3, 12))), Mesh(*box((8, 0, 0), (20, 9, 4)))
    scene = make_scene([Part("tower", "", tower), Part("hall", "", hall)])
    cpu, gl = sweeps(device, scene, "top", casters=[1])
    with gl:
        assert (gl.counts(SUNS) != cpu.counts(SUNS)).mean() < 3e-4


def test_more_volumes_than_the_stencil_can_count(device):
    cpu, gl = sweeps(device, make_scene(*stack_of_triangles(600)), "ground", rise=-5.0)
    with gl:
        expected = cpu.counts(SUNS[2:3])
        assert expected.max() == 600
        assert (gl.counts(SUNS[2:3]) != expected).mean() < 1e-3
        # 512 volumes are none to 8 bits.
        assert (gl.masks(SUNS[2:3]) != cpu.masks(SUNS[2:3])).mean() < 1e-3


def test_cells_on_the_corners_of_a_raster_are_the_cpus(device):
    # Rough land whose corners are the cells' very centres: every edge runs through some.
    rng = np.random.default_rng(3)
    rows, cols = 30, 36
    y, x = np.mgrid[0.0:rows, 0.0:cols]
    z = 0.3 * rng.normal(size=(rows, cols)).cumsum(0).cumsum(1)
    number = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    scene = make_scene(np.stack([x, y, z], -1).reshape(-1, 3), faces)
    grid = Grid(-scene.origin[0], -scene.origin[1], 1.0, 1.0, cols, rows)
    suns = SUNS / np.linalg.norm(SUNS, axis=1, keepdims=True)
    cpu = prepare_sweep(scene, [0], "top", -50.0, grid)
    with GlSweep(scene, None, grid, -50.0, False, device) as gl:
        inner = np.s_[:, :-1, :-1]  # beside the last ones there is no land
        differ = (gl.masks(suns) != cpu.masks(suns))[inner]
    # What differs is cut by a shadow's edge within 1/128 cell of its centre.
    assert differ.mean() < 2e-3
