"""Discs that no edge may cut are wholly free or hidden, as their middle."""

import numpy as np
import pytest
from support.shapes import box, duplicated, merge, rewound, soup

from umbra.rays.disc_marks import find_touching, make_face_edges, mark_cut_discs
from umbra.rays.face_tree import make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.rays.sun_disc import KnownDiscs, find_free_disc
from umbra.volume.adjacency import make_caster

RADIUS = 0.2666
UP = np.array([0.0, 0, 1])


def make_town(rng):
    """Boxes on a lattice, some of which share walls, floors and corners; some wound inward."""
    corners = rng.integers(-12, 12, (50, 2))
    sizes, tops = rng.integers(1, 5, (50, 2)), rng.integers(1, 9, 50)
    boxes = [box((*a, 0), (*(a + b), t)) for a, b, t in zip(corners, sizes, tops, strict=True)]
    return merge(*(rewound(one) if k % 7 == 0 else one for k, one in enumerate(boxes)))


def make_places(rng, kind, n=900):
    """Random places, places of the lattice, or places of walls; with normals, or without."""
    if kind == "random":
        points = rng.uniform((-12, -12, 0), (12, 12, 8), (n, 3))
        return points, np.full((n, 3), np.nan)
    points = np.round(rng.uniform((-12, -12, 0), (12, 12, 8), (n, 3)) * 2) / 2
    points[:, 1 if kind == "walls" else 2] //= 1
    normal = UP if kind == "lattice" else np.array([0.0, -1, 0])
    return points, normal * rng.uniform(0.05, 60, (n, 1))  # of any length, as a plan's


def make_suns(rng, n=24):
    """Suns from low to high; the first in the planes of walls, and at grazing angles."""
    altitude, azimuth = np.radians(rng.uniform(3, 80, n)), rng.uniform(0, 2 * np.pi, n)
    azimuth[:4] = 0.0, np.pi / 2, np.pi + 0.003, 1.5 * np.pi - 0.006
    level = np.cos(altitude)
    return np.stack([level * np.sin(azimuth), level * np.cos(azimuth), np.sin(altitude)], 1)


@pytest.mark.parametrize("kind", ["random", "lattice", "walls"])
@pytest.mark.parametrize("shape", ["town", "soup", "doubled"])
def test_unmarked_discs_are_as_their_middle(kind, shape):
    rng = np.random.default_rng(len(kind) + len(shape))
    mesh = make_town(rng)
    if shape == "soup":
        vertices, faces = soup(rng, 200)
        mesh = vertices * [4, 4, 2] + [0, 0, 4], faces
    elif shape == "doubled":
        mesh = duplicated(mesh, list(range(0, len(mesh[1]), 3)))
    tree = make_face_tree(make_caster(*mesh))
    points, normals = make_places(rng, kind)
    suns = make_suns(rng)
    shares = find_free_disc(tree, points, normals, suns, RADIUS)
    touching = find_touching(tree, points, normals)
    edges = make_face_edges(tree)
    marks = mark_cut_discs(tree, edges, points, normals, touching, suns, RADIUS)
    hidden = find_hidden(tree, points, normals, suns)
    assert ((shares > 1e-9) & (shares < 1 - 1e-9)).sum() > 30
    assert np.abs(shares - (1 - hidden))[~marks].max() < 1e-9
    assert (~marks & (hidden == 0)).sum() > 1000
    assert (~marks & (hidden == 1)).sum() > 1000
    known = find_free_disc(
        tree, points, normals, suns, RADIUS, known=KnownDiscs(marks, hidden.astype(np.uint8))
    )
    assert np.abs(known - shares).max() < 1e-9
    assert (known[marks & (shares > 0)] == shares[marks & (shares > 0)]).all()


def test_edges_within_a_surface_mark_nothing():
    """A sheet of four triangles before the zenith: its rim marks a band, its diagonals none."""
    corners = [(-9.0, -9, 10), (9, -9, 10), (9, 9, 10), (-9, 9, 10), (0, 0, 10)]
    faces = np.array([(k, (k + 1) % 4, 4) for k in range(4)], np.int32)
    tree = make_face_tree(make_caster(np.array(corners), faces))
    x = np.linspace(-9.5, 9.5, 1901)
    points = np.column_stack([x, 0.37 * x, 0 * x])
    touching = find_touching(tree, points, np.tile(UP, (len(x), 1)))
    marks = mark_cut_discs(
        tree, make_face_edges(tree), points, np.tile(UP, (len(x), 1)), touching, UP[None], RADIUS
    )[0]
    penumbra = 10 * np.tan(np.radians(RADIUS))
    assert not touching.any()
    assert np.array_equal(marks, np.abs(np.abs(x) - 9) <= penumbra * 1.001)


def test_a_penumbra_is_as_wide_as_its_edge_is_high_above():
    """Of the discs that an upright mast marks few are not cut, at its foot, too."""
    tree = make_face_tree(make_caster(*box((0, 0, 0), (0.2, 0.2, 40))))
    x, y = np.meshgrid(np.linspace(-0.4, 0.6, 501), np.linspace(0.3, 39, 60))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    normals, sun = np.tile(UP, (x.size, 1)), np.array([[0.0, -np.sqrt(0.5), np.sqrt(0.5)]])
    touching = find_touching(tree, points, normals)
    marks = mark_cut_discs(tree, make_face_edges(tree), points, normals, touching, sun, RADIUS)[0]
    shares = find_free_disc(tree, points, normals, sun, RADIUS)[0]
    cut = (shares > 0) & (shares < 1)
    assert marks[cut].all()
    assert cut.sum() > 5000
    assert (marks & ~cut).sum() < 0.05 * cut.sum()


def test_what_touches_a_face_is_told_but_not_its_own_surface():
    mesh = merge(box((0, 0, 0), (4, 4, 4)), box((4, 1, 0), (6, 2, 3)))
    tree = make_face_tree(make_caster(*mesh))
    places = {
        "on its own wall": ((2, 0, 2), (0, -1, 0), False),
        "on a wall, looking up": ((2, 0, 2), (0, 0, 1), True),
        "beside the wall on its plane": ((6, 0, 2), (0, 0, 1), False),
        "near the wall": ((2, -1e-5, 2), (0, 0, 1), False),
        "at the foot of a wall": ((2, 4, 0), (0, 0, 1), True),
        "on the wall that both have": ((4, 1.5, 1), (1, 0, 0), False),
        "where two walls meet": ((4, 1, 2), (1, 0, 0), True),
    }
    points, normals, expected = (list(column) for column in zip(*places.values(), strict=True))
    found = find_touching(tree, np.array(points, float), np.array(normals, float))
    assert dict(zip(places, found.tolist(), strict=True)) == dict(
        zip(places, expected, strict=True)
    )


def test_no_places_and_no_suns():
    tree = make_face_tree(make_caster(*box((0, 0, 0), (1, 1, 1))))
    edges, none = make_face_edges(tree), np.zeros((0, 3))
    assert len(edges.ends) == 18
    touching = find_touching(tree, none, none)
    assert mark_cut_discs(tree, edges, none, none, touching, UP[None], RADIUS).shape == (1, 0)
    one = np.ones((1, 3))
    touching = find_touching(tree, one, one)
    assert mark_cut_discs(tree, edges, one, one, touching, none, RADIUS).shape == (0, 1)
