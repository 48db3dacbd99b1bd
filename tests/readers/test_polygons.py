"""Polygons to triangles: area, orientation, and no crack ever."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.sweeps import reduce_count

from umbra.readers import ear_clipping
from umbra.readers.monotone import cut_by_sweep
from umbra.readers.triangulate import triangulate

WAYS = pytest.mark.parametrize("most", [ear_clipping.MOST, 0], ids=["ears", "sweep"])

UP = [0.0, 0.0, 1.0]


def cut(rings, points, most=ear_clipping.MOST):
    """Triangulate one polygon given as rings of indices, by ears or, from ``most`` on, a sweep."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ear_clipping, "MOST", most)
        return triangulate(
            np.asarray(points, float),
            np.array([c for ring in rings for c in ring], np.int64),
            np.array([len(ring) for ring in rings], np.int64),
            np.array([len(rings)], np.int64),
        )


def vector_areas(points, faces):
    points = np.asarray(points, float)
    a, b, c = points[faces].transpose(1, 0, 2)
    return np.cross(b - a, c - a) / 2


def edges_of(rings):
    return {(r[k - 1], r[k]) for r in rings for k in range(len(r))}


def boundary(faces):
    sums = {}
    for face in faces.tolist():
        for k in range(3):
            a, b = face[k - 1], face[k]
            sums[a, b] = sums.get((a, b), 0) + 1
            sums[b, a] = sums.get((b, a), 0) - 1
    assert all(abs(n) <= 1 for n in sums.values())
    return {edge for edge, n in sums.items() if n > 0}


def flat(*xy):
    return [[x, y, 0.0] for x, y in xy]


def test_triangle_stays_as_it_is():
    result = cut([[2, 0, 1]], flat((0, 0), (1, 0), (0, 1)))
    assert result.faces.tolist() == [[2, 0, 1]]
    assert result.faces.dtype == np.int32


@pytest.mark.parametrize("turn", range(4))
def test_concave_quad_is_cut_at_its_reflex_corner(turn):
    # A dart: corner 2 at (1, 1) points inward; the other diagonal runs outside.
    points = flat((0, 0), (4, 0), (1, 1), (0, 4))
    ring = np.roll([0, 1, 2, 3], turn).tolist()
    result = cut([ring], points)
    areas = vector_areas(points, result.faces)
    assert (areas[:, 2] > 0).all()
    assert areas[:, 2].sum() == pytest.approx(4.0)
    assert all(2 in face and 0 in face for face in result.faces.tolist())


@pytest.mark.parametrize("turn", range(4))
def test_quad_with_a_straight_corner_has_no_flat_triangle(turn):
    points = flat((0, 0), (1, 0), (2, 0), (0, 2))
    result = cut([np.roll([0, 1, 2, 3], turn).tolist()], points)
    assert vector_areas(points, result.faces)[:, 2] == pytest.approx([1.0, 1.0])


def test_l_shape_by_hand():
    points = flat((0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3))
    result = cut([[0, 1, 2, 3, 4, 5]], points)
    areas = vector_areas(points, result.faces)[:, 2]
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(5.0)
    assert boundary(result.faces) == edges_of([[0, 1, 2, 3, 4, 5]])


def test_clockwise_polygon_gives_clockwise_triangles():
    points = flat((0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3))
    result = cut([[5, 4, 3, 2, 1, 0]], points)
    assert (vector_areas(points, result.faces)[:, 2] < 0).all()


@pytest.mark.parametrize("hole", [[7, 6, 5, 4], [4, 5, 6, 7]])
def test_wall_with_a_window(hole):
    # A wall 4 x 3 m in the plane x = 7, facing +x; the window may be wound either way.
    points = [[7.0, y, z] for y, z in ((0, 0), (4, 0), (4, 3), (0, 3))]
    points += [[7.0, y, z] for y, z in ((1, 1), (2, 1), (2, 2), (1, 2))]
    result = cut([[0, 1, 2, 3], hole], points)
    areas = vector_areas(points, result.faces)
    assert (areas[:, 0] > 0).all()
    assert areas.sum(0) == pytest.approx([11.0, 0.0, 0.0])
    assert boundary(result.faces) == edges_of([[0, 1, 2, 3], [7, 6, 5, 4]])


def test_hole_that_touches_its_outside_in_a_corner():
    # The hole's corner 4 stands on the outer corner 0, under another index.
    points = flat((0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 2), (2, 1))
    result = cut([[0, 1, 2, 3], [4, 5, 6]], points)
    areas = vector_areas(points, result.faces)[:, 2]
    assert areas.sum() == pytest.approx(16 - 1.5)
    assert np.abs(areas).sum() == pytest.approx(16 - 1.5)
    assert result.crossed == 0


def test_closed_ring_and_repeated_corners_are_tolerated():
    points = flat((0, 0), (2, 0), (2, 2), (0, 2), (2, 0))
    # The ring ends where it began; corner 4 stands on corner 1.
    result = cut([[0, 1, 4, 2, 3, 0]], points)
    assert len(result.faces) == 2
    assert vector_areas(points, result.faces)[:, 2].sum() == pytest.approx(4.0)


def test_quad_with_two_corners_in_one_place_is_one_triangle():
    points = flat((0, 0), (2, 0), (2, 0), (0, 2))
    assert len(cut([[0, 1, 2, 3]], points).faces) == 1


def test_fan_where_the_first_corner_sees_all_and_ears_where_not():
    # A reflex corner: a fan from it is right, one from its neighbours is not.
    points = flat((1, 1), (0, 4), (-2, 2), (-1, 0), (4, 0))
    for turn in range(5):
        areas = vector_areas(points, cut([np.roll(range(5), turn).tolist()], points).faces)
        assert (areas[:, 2] > 0).all()
        assert areas[:, 2].sum() == pytest.approx(9.0)


@pytest.mark.parametrize(
    "ring", [[], [0], [0, 1], [0, 1, 0, 1], [0, 0, 0], [0, 1, 1, 0], [0, 1, 3], [0, 1, 3, 0]]
)
def test_fewer_than_three_distinct_corners_are_skipped_and_counted(ring):
    # Corner 3 stands on corner 1.
    result = cut([ring], flat((0, 0), (1, 0), (1, 1), (1, 0)))
    assert len(result.faces) == 0
    assert result.degenerate == 1


def test_polygon_without_area_keeps_its_boundary():
    # All corners on a line: dropping it would leave its neighbours a crack.
    points = flat((0, 0), (1, 0), (2, 0), (3, 0), (4, 0))
    result = cut([[0, 1, 2, 3, 4]], points)
    assert boundary(result.faces) == edges_of([[0, 1, 2, 3, 4]])
    assert vector_areas(points, result.faces) == pytest.approx(0)


def test_polygons_keep_their_order_and_owner():
    points = flat((0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3))
    result = triangulate(
        np.array(points),
        np.array([0, 1, 2, 3, 4, 5, 0, 1, 0, 1, 2, 0, 1, 2, 3]),
        np.array([6, 2, 3, 4]),
        np.array([1, 1, 1, 1]),
    )
    assert result.polygon.tolist() == [0, 0, 0, 0, 2, 3, 3]
    assert result.degenerate == 1


def test_crossed_ring_is_counted():
    points = flat((0, 0), (4, 0), (0, 3), (4, 3), (2, 5))
    result = cut([[0, 1, 2, 3, 4]], points)
    assert result.crossed == 1
    assert boundary(result.faces) == edges_of([[0, 1, 2, 3, 4]])


@pytest.mark.parametrize("far", [0.0, 5e6])
def test_box_with_corners_on_an_edge_stays_closed(far, find_open_edges):
    # Corners 8 and 9 on the edge 4-5, in both faces that meet there; a wall with a
    # straight corner is what ear clipping would drop.
    points = [[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0], [0, 0, 4], [2, 0, 4], [2, 3, 4]]
    points += [[0, 3, 4], [0.5, 0, 4], [1.25, 0, 4]]
    points = np.array(points) + far
    faces = [
        [3, 2, 1, 0],
        [4, 8, 9, 5, 6, 7],
        [0, 1, 5, 9, 8, 4],
        [1, 2, 6, 5],
        [2, 3, 7, 6],
        [3, 0, 4, 7],
    ]
    result = triangulate(
        points,
        np.array([c for f in faces for c in f]),
        np.array([len(f) for f in faces]),
        np.ones(len(faces), np.int64),
    )
    assert find_open_edges(points, result.faces) == []
    assert set(result.faces.ravel().tolist()) == set(range(10))
    assert len(result.faces) == 16
    areas = np.linalg.norm(vector_areas(points, result.faces), axis=1)
    assert areas.sum() == pytest.approx(52.0)
    assert (areas > 1e-3).all()


def frames():
    """Rotations by whole quarter turns: they keep coordinates exact."""
    axes = [[0, 1, 2], [1, 2, 0], [2, 0, 1]]
    return st.sampled_from([np.eye(3)[axis] * sign for axis in axes for sign in (1, -1)])


@st.composite
def star_polygons(draw):
    """Rings around a middle, seldom convex, on a grid so that corners are often straight."""
    n = draw(st.integers(3, 14))
    angles = np.sort(draw(st.lists(st.integers(0, 359), min_size=n, max_size=n, unique=True)))
    gaps = np.diff(np.append(angles, angles[0] + 360))
    radii = np.array(draw(st.lists(st.integers(4, 40), min_size=n, max_size=n)))
    ring = np.stack([radii * np.cos(np.radians(angles)), radii * np.sin(np.radians(angles))], 1)
    # The middle is inside only if no gap is a half turn.
    if gaps.max() >= 175:
        ring = np.array([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]])
    # Straight corners on every edge that is drawn: halves are exact.
    for k in sorted(draw(st.sets(st.integers(0, len(ring) - 1), max_size=4)), reverse=True):
        ring = np.insert(ring, k, (ring[k - 1] + ring[k]) / 2, axis=0)
    hole = draw(st.booleans())
    rings = [list(range(len(ring)))]
    if hole and np.linalg.norm(ring, axis=1).min() > 0.5:
        inner = 0.25 * np.array([[-1.0, -1], [-1, 1], [1, 1], [1, -1]])
        if _depth(ring) > 0.5:
            rings.append([len(ring) + k for k in range(4)])
            ring = np.concatenate([ring, inner])
    points = np.concatenate([ring, np.zeros((len(ring), 1))], axis=1) @ draw(frames())
    return rings, points + draw(st.sampled_from([0.0, 448000.0]))


def _depth(ring):
    """Distance from the middle to the nearest edge."""
    a, b = ring, np.roll(ring, -1, axis=0)
    t = np.clip(-(a * (b - a)).sum(1) / ((b - a) ** 2).sum(1), 0, 1)
    return np.linalg.norm(a + t[:, None] * (b - a), axis=1).min()


@WAYS
@given(star_polygons())
@settings(deadline=None, max_examples=reduce_count(300, 2))
def test_triangles_fill_the_polygon_and_keep_every_edge(most, drawn):
    rings, points = drawn
    result = cut(rings, points, most)
    exact = points - points[0]
    expected = sum(
        np.cross(exact[ring], np.roll(exact[ring], -1, axis=0)).sum(0) / 2 for ring in rings
    )
    areas = vector_areas(exact, result.faces)
    size = np.linalg.norm(expected)
    assert areas.sum(0) == pytest.approx(expected, abs=1e-7 * size)
    # No overlap: the sizes add up too. Far from zero, halves of edges are rounded.
    assert np.linalg.norm(areas, axis=1).sum() == pytest.approx(size, rel=1e-6)
    assert boundary(result.faces) == edges_of(rings)
    assert set(result.faces.ravel().tolist()) == {c for ring in rings for c in ring}


@WAYS
@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.integers(0, 3), st.integers(0, 1)), min_size=3, max_size=9
    )
)
@settings(deadline=None, max_examples=reduce_count(300, 2))
def test_any_ring_at_all_keeps_its_signed_boundary(most, corners):
    # Crossed, folded, warped, repeated: whatever the ring, its neighbours still fit.
    points = np.array(corners, float)
    ring = list(range(len(points)))
    result = cut([ring], points, most)
    sums = {}

    def add(a, b, sign):
        a, b = tuple(points[a]), tuple(points[b])
        if a != b:
            key = (min(a, b), max(a, b))
            sums[key] = sums.get(key, 0) + (sign if a < b else -sign)

    for k in ring:
        add(ring[k - 1], k, 1)
    for face in result.faces.tolist():
        for k in range(3):
            add(face[k - 1], face[k], -1)
    assert not any(sums.values())


def whole_rings(*rings):
    """Give corners of rings, and which follows each."""
    ends = np.cumsum([len(ring) for ring in rings])
    following = np.arange(1, ends[-1] + 1)
    following[ends - 1] = ends - [len(ring) for ring in rings]
    return np.concatenate(rings).astype(float), following


def swept_area(points, faces):
    a, b, c = points[faces].transpose(1, 0, 2)
    (ax, ay), (bx, by) = (b - a).T, (c - a).T
    areas = (ax * by - ay * bx) / 2
    assert (areas >= 0).all()
    return areas.sum()


@pytest.mark.parametrize("degrees", [0, 30, 90, 211])
def test_a_sweep_cuts_combs_stars_and_rows_of_holes(degrees):
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[cos, sin], [-sin, cos]])
    angle = np.arange(40_000) * 2 * np.pi / 40_000
    radius = np.where(np.arange(40_000) % 2, 50.0, 100.0)
    star = np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)
    teeth = np.stack([np.arange(30_001), np.where(np.arange(30_001) % 2, 100.0, 1.0)], 1)
    comb = np.concatenate([[[0.0, 0.0], [30_000.0, 0.0]], teeth[::-1]])
    square = np.array([[0.25, 0.25], [0.25, 0.75], [0.75, 0.75], [0.75, 0.25]])
    yards = [square + [k % 100, k // 100] for k in range(10_000)]
    block = np.array([[-1.0, -1], [101, -1], [101, 101], [-1, 101]])
    for rings, area in (
        ([star], 40_000 * 0.5 * 100 * 50 * np.sin(np.pi / 20_000)),
        ([comb], 30_000 * 50.5),
        ([block, *yards], 102**2 - 2500),
    ):
        points, following = whole_rings(*rings)
        points = points @ turn
        faces = cut_by_sweep(points, following)
        assert len(faces) == len(points) + 2 * (len(rings) - 1) - 2
        assert swept_area(points, faces) == pytest.approx(area, rel=1e-9)
        assert boundary(faces) == set(enumerate(following.tolist()))


def test_a_sweep_refuses_rings_that_cross():
    rng = np.random.default_rng(1)
    for n in (5, 50, 5000):
        assert cut_by_sweep(*whole_rings(rng.uniform(0, 10, (n, 2)))) is None
    block = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4]])
    outside = np.array([[3.0, 1], [3, 2], [5, 2], [5, 1]])
    assert cut_by_sweep(*whole_rings(block, outside)) is None


def test_large_rings_that_cross_keep_their_boundary():
    points = np.random.default_rng(2).uniform(0, 100, (30_000, 3))
    ring = list(range(len(points)))
    result = cut([ring], points)
    assert len(result.faces) == len(points) - 2
    assert result.crossed == 1
    assert boundary(result.faces) == edges_of([ring])


def test_a_corner_that_a_ring_visits_again_and_again():
    petals = np.array([[[0, 0, 0], [k + 1, 1, 0], [k + 1, 2, 0]] for k in range(3000)], float)
    points = petals.reshape(-1, 3)
    result = cut([list(range(len(points)))], points)
    assert len(result.faces) < 3 * len(points)
