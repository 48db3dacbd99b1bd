"""Windows of a raster hold the bits of the whole raster."""

import numpy as np
import pytest

from umbra.casters.casting import prepare_casting
from umbra.receivers.plan_tiles import PlaneTile, PlanModel, TopmostTile
from umbra.scene import Mesh, Part, make_scene
from umbra.scene.grid import Grid

BOX = [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5],
       [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]]  # fmt: skip


def make_town(seed=3, count=40):
    """Return turned boxes with slanted roofs on uneven ground."""
    rng = np.random.default_rng(seed)
    parts = []
    for n in range(count):
        corner = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))])
        size = rng.uniform(4, 15, 3)
        turn = rng.uniform(0, 6.3)
        at = corner * size
        at[4:, 2] += rng.uniform(0, 3) * corner[4:, 0]
        at[:, :2] = at[:, :2] @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
        at += [*rng.uniform(0, 120, 2), rng.uniform(-1, 1)]
        parts.append(Part(f"house {n}", "", Mesh(at, np.array(BOX))))
    return make_scene(parts)


@pytest.mark.parametrize(
    ("kind", "has_end"), [(PlaneTile, False), (TopmostTile, False), (TopmostTile, True)]
)
def test_windows_hold_the_bits_of_the_whole(kind, has_end):
    scene = make_town()
    casting = prepare_casting(scene, range(len(scene.parts)), 1)
    model = PlanModel(scene, casting.soup, casting.caster, 1, 0.3, kind, has_end=has_end)
    grid = Grid(-30.2, -29.7, 0.37, 0.41, 480, 430)
    suns = np.array([[0.7, -0.6, 0.2], [-0.3, -0.9, 0.6], [0.9, 0.1, 0.05], [0.0, -1.0, 0.4]])
    suns /= np.linalg.norm(suns, axis=1)[:, None]
    whole = model.make_tile(grid)
    masks = whole.make_counter().masks(suns)
    assert 0.05 < masks.mean() < 0.95
    for row in range(0, 430, 67):
        for col in range(0, 480, 71):
            rows, cols = slice(row, min(row + 67, 430)), slice(col, min(col + 71, 480))
            part = model.make_tile(grid.window(rows, cols))
            assert np.array_equal(part.grid.x, grid.x[cols])
            assert np.array_equal(part.grid.y, grid.y[rows])
            np.testing.assert_array_equal(part.make_counter().masks(suns), masks[:, rows, cols])
            np.testing.assert_array_equal(
                part.surface.heights, whole.surface.heights[rows, cols], strict=True
            )
            np.testing.assert_array_equal(part.surface.face, whole.surface.face[rows, cols])
