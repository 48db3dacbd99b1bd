"""What pixels see: each centre inside a mesh belongs to exactly one face, and to the nearest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.judge import PLAN, look_down
from support.shapes import box, merge, moved, sheet, terrain
from support.sweeps import reduce_count

from umbra.rays.depth import GROUND, NOTHING, add_ground, rasterise_depth
from umbra.scene import Camera
from umbra.scene.grid import Grid


def test_named_pixels_of_one_triangle():
    # Corners on pixel centres: rows run down, the first column and row belong to the face.
    view = rasterise_depth(
        np.array([(1.0, 1, 5), (4, 1, 5), (1, 4, 5)]),
        np.array([[0, 1, 2]], np.int32),
        PLAN,
        (6, 6),
    )
    assert view.face.tolist() == [
        [-1, -1, -1, -1, -1, -1],
        [-1, 0, 0, 0, -1, -1],
        [-1, 0, 0, -1, -1, -1],
        [-1, 0, -1, -1, -1, -1],
        [-1, -1, -1, -1, -1, -1],
        [-1, -1, -1, -1, -1, -1],
    ]
    assert view.key[1, 1] == 5
    assert view.key[0, 0] == -np.inf


@pytest.mark.parametrize("x0", [-159.7, -158.0, -159.5, -47 - 70 * 1.61])
def test_no_pixel_falls_through_where_columns_meet_vertices(x0):
    # Rounding may put an edge's line just past its own corner: its other face begins there.
    mesh = terrain(n=120)
    grid = Grid(x0, -55.0, 1.61, 0.53, 150, 200)
    _, own = look_down(mesh, grid)
    x, y = np.meshgrid(grid.x, grid.y)
    inside = (np.abs(x) < 59.49) & (np.abs(y) < 59.49)
    assert inside.sum() > 5000
    assert (own[inside] != NOTHING).all()


@settings(max_examples=reduce_count(150, 2), deadline=None, derandomize=True)
@given(st.integers(0, 2**32), st.integers(0, 3))
def test_faces_that_share_edges_cover_each_centre_once(seed, digits):
    # A flat fan of triangles around a point, its corners on few places: ties abound.
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 9))
    if (np.diff(angle, append=angle[0] + 2 * np.pi) > 3).any():
        return
    rim = 9 + np.stack([np.cos(angle), np.sin(angle)], 1) * rng.uniform(2, 8, (9, 1))
    flat = np.round(np.vstack([rng.uniform(8.6, 9.4, (1, 2)), rim]), digits)
    vertices = np.column_stack([flat, np.full(10, 3.0)])
    faces = np.array([[0, 1 + k, 1 + (k + 1) % 9] for k in range(9)], np.int32)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    if (np.cross(b - a, c - a)[:, 2] <= 0).any():
        return  # rounding folded the fan
    covered = sum(
        rasterise_depth(vertices, faces[k : k + 1], PLAN, (18, 18)).face == 0 for k in range(9)
    )
    # A centre exactly on a corner is the one place where edges may disagree by rounding.
    corners = flat[(flat % 1 == 0).all(1)].astype(int)
    covered[corners[:, 1], corners[:, 0]] = 1
    assert covered.max() == 1
    together = rasterise_depth(vertices, faces, PLAN, (18, 18)).face >= 0
    together[corners[:, 1], corners[:, 0]] = True
    np.testing.assert_array_equal(together, covered == 1)
    # Every centre strictly inside the rim is covered.
    x, y = np.meshgrid(np.arange(18), np.arange(18))
    inside = np.zeros((18, 18), bool)
    for k in range(9):
        sides = [
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
            for p, q in ((a[k], b[k]), (b[k], c[k]), (c[k], a[k]))
        ]
        inside |= np.all([side > 1e-9 for side in sides], 0)
    assert (covered[inside] == 1).all()


def test_the_nearest_face_and_then_the_first_is_seen():
    stack = merge(
        moved(box((0, 0, 0), (4, 4, 1)), (0, 0, 0)),
        box((1, 1, 1), (3, 3, 2)),
        box((1, 1, 1), (3, 3, 2)),
    )
    heights, own = look_down(stack, Grid(0.5, 0.5, 1.0, 1.0, 4, 4), ground=-1.0)
    np.testing.assert_array_equal(heights, [[1, 1, 1, 1], [1, 2, 2, 1], [1, 2, 2, 1], [1, 1, 1, 1]])
    assert set(np.unique(own)) <= {2, 3, 14, 15}


def test_faces_that_reach_behind_the_eye():
    # A floor through the eye's feet fills the lower half of the picture, to the last row.
    camera = Camera((0, 0, 2), (1, 0, 2), size=(9, 9), fov=90)
    floor = np.array([(-50.0, -50, 0), (1e7, -2e7, 0), (1e7, 2e7, 0), (-50, 50, 0)])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    view = rasterise_depth(floor, faces, camera.matrix(), camera.size, camera.key_range())
    assert (view.face[5:] != NOTHING).all()
    assert (view.face[:4] == NOTHING).all()
    # In the middle of the bottom row the ray falls 8/9 metre in each one it goes forward.
    assert view.key[8, 4] == pytest.approx(4 / 4.5 / 2)


def test_near_and_far_limits():
    # Quads 2, 5 and 9 metres ahead; only what lies between the limits is seen.
    quads = [sheet([(d, -9, -9), (d, 9, -9), (d, 9, 9), (d, -9, 9)]) for d in (2.0, 5.0, 9.0)]
    vertices, faces = merge(*quads)
    for height in (None, 4.0):
        for near, far, expected in (
            (0.1, 99, 0),
            (2.5, 99, 1),
            (5.5, 99, 2),
            (0.1, 1.0, None),
            (2.5, 4.5, None),
            (2.5, np.inf, 1),
        ):
            camera = Camera(
                (0, 0, 0.3), (1, 0, 0.3), size=(7, 5), near=near, far=far, height=height
            )
            view = rasterise_depth(
                vertices, faces, camera.matrix(), camera.size, camera.key_range()
            )
            found = set(np.unique(view.face) // 2)
            assert found == {-1 if expected is None else expected}


@pytest.mark.parametrize("height", [None, 12.0])
def test_the_ground_hides_what_is_under_it(height):
    camera = Camera((0.3, -20, 11), (0, 0, 0), size=(24, 18), height=height)
    mesh = merge(box((-3, -3, 1), (3, 3, 2)), box((-3, -3, -4), (3, 3, -2)))
    view = rasterise_depth(*mesh, camera.matrix(), camera.size, camera.key_range())
    assert (view.face >= 12).any()
    add_ground(view, camera.matrix(), 0.0, camera.key_range())
    assert (view.face < 12).all()
    assert {GROUND} < set(np.unique(view.face))
