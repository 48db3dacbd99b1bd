"""Welding, components and which of them are closed."""

import numpy as np
import pytest
from support.shapes import (
    TOP,
    box,
    cavity,
    duplicated,
    merge,
    moved,
    rewound,
    sheet,
    staircase,
    three_walls,
    torus_knot,
)

from umbra.volume.adjacency import make_caster, weld_vertices

HOUSE = box((0, 0, 0), (4, 3, 5))


def test_equal_places_weld_and_nothing_else_does():
    vertices = np.array(
        [(0.0, 1, 2), (0, 1, 2), (-0.0, 1, 2), (0, 1, np.nextafter(2, 3)), (2, 1, 0), (0, 1, 2)]
    )
    assert weld_vertices(vertices).tolist() == [0, 0, 0, 3, 4, 0]


def test_welding_many_vertices_is_as_sorting_them():
    rng = np.random.default_rng(0)
    vertices = rng.integers(-6, 6, (5000, 3)) / 4.0
    first = weld_vertices(vertices)
    assert (first <= np.arange(5000)).all()
    np.testing.assert_array_equal(vertices[first], vertices)
    assert len(np.unique(first)) == len(np.unique(vertices, axis=0))


def test_no_vertices_at_all():
    assert weld_vertices(np.zeros((0, 3))).shape == (0,)
    caster = make_caster(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert len(caster.faces) == len(caster.edges) == len(caster.is_closed) == 0


@pytest.mark.parametrize(
    ("mesh", "is_closed"),
    [
        (HOUSE, [True]),
        (rewound(HOUSE), [True]),
        (rewound(HOUSE, TOP), [False]),
        (rewound(HOUSE, [0]), [False]),
        (duplicated(HOUSE, [3]), [False]),
        (duplicated(HOUSE, np.arange(12)), [True]),
        ((HOUSE[0], HOUSE[1][:-1]), [False]),
        (sheet([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]), [False]),
        (three_walls(), [False]),
        (merge(HOUSE, moved(HOUSE, (9, 0, 0))), [True, True]),
        (merge(HOUSE, moved(HOUSE, (4, 0, 0))), [True]),  # joined by the edges of one wall
        (cavity(), [True, True]),
        (torus_knot(), [True]),
        (staircase(20), [True]),
    ],
)
def test_components_and_whether_they_are_closed(mesh, is_closed):
    assert make_caster(*mesh).is_closed.tolist() == is_closed


def test_unwelded_triangles_find_their_neighbours():
    vertices, faces = HOUSE
    loose = vertices[faces].reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(-1, 3)
    caster = make_caster(*loose)
    assert caster.is_closed.tolist() == [True]
    assert len(caster.edges) == 18


def test_a_fence_does_not_open_the_house_it_touches():
    # The fence shares the house's whole south-west edge.
    fence = sheet([(0, 0, 0), (0, 0, 5), (-3, -3, 5), (-3, -3, 0)])
    mesh = merge(HOUSE, fence)
    assert make_caster(*mesh).is_closed.tolist() == [False]
    group = np.array([7] * 12 + [3] * 2, np.int32)
    caster = make_caster(*mesh, group)
    closed = np.zeros(14, bool)
    closed[caster.source] = caster.face_is_closed
    assert closed.tolist() == [True] * 12 + [False] * 2
    # Each pair of incidences is of one kind.
    a, b = caster.edge_faces.T
    assert (caster.face_is_closed[a] == caster.face_is_closed[b]).all()


def test_groups_do_not_part_what_is_closed_only_together():
    # One building whose roof and walls are different things: closed all the same.
    caster = make_caster(*HOUSE, np.array([0] * 4 + [1] * 8, np.int32))
    assert caster.is_closed.tolist() == [True]


def test_degenerate_triangles_are_left_out():
    vertices, faces = HOUSE
    extra = np.array([[0, 0, 1], [2, 5, 2], [3, 3, 3]], np.int32)
    caster = make_caster(vertices, np.concatenate([extra, faces]))
    assert sorted(caster.source) == list(range(3, 15))
    assert caster.is_closed.tolist() == [True]
    # Corners that are equal only by place count as equal, too.
    caster = make_caster(np.vstack([vertices, vertices[:1]]), np.array([[0, 8, 1]], np.int32))
    assert len(caster.faces) == 0


def test_planes_point_outward_and_pass_through_their_corners():
    vertices, faces = HOUSE
    caster = make_caster(vertices, faces)
    middle = np.append(vertices.mean(0), 1.0)
    assert (middle @ caster.planes[:, :-1] < 0).all()
    corners = np.concatenate([vertices[caster.faces], np.ones((12, 3, 1))], 2)
    np.testing.assert_allclose(np.einsum("fcj,jf->fc", corners, caster.planes[:, :-1]), 0)
    # The length is twice the area: two metres by three, as two triangles.
    assert np.linalg.norm(caster.planes[:3, :-1], axis=0).sum() == 2 * (12 + 12 + 15 * 2 + 20 * 2)
    assert np.isnan(caster.planes[:, -1]).all()
    np.testing.assert_array_equal(caster.faces, faces[caster.source])


def test_every_incidence_is_in_exactly_one_pair():
    mesh = merge(three_walls(), duplicated(moved(HOUSE, (9, 9, 0)), [2, 2, 5]))
    caster = make_caster(*mesh)
    seen = []
    for (a, b), (i, j) in zip(caster.edge_faces, caster.edges):
        seen += [(int(a), *sorted((i, j)))]
        if b != a:
            seen += [(int(b), *sorted((i, j)))]
    expected = [
        (f, *sorted((face[k], face[(k + 1) % 3])))
        for f, face in enumerate(caster.faces)
        for k in range(3)
    ]
    assert sorted(seen) == sorted(expected)
