"""View factor and overcast light beside walls, in canyons and courtyards, by their closed forms."""

import numpy as np
import pytest
from support.shapes import box, duplicated, merge, rewound, sheet

from umbra.errors import InputError
from umbra.sky.casters import make_sky_casters
from umbra.sky.tensors import find_open
from umbra.sky.view_factors import measure_sky

FAR = 1e8
UP, EAST = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


def measure(mesh, point=(0.0, 0.0, 0.0), normal=UP):
    vertices, faces = mesh
    found = measure_sky(make_sky_casters(vertices, faces), [point], [normal], 1)
    return found.sky_view_factor[0], found.sky_component[0]


def wall(x, top):
    """A wall across the east, far to both sides, down below the horizon."""
    return sheet([(x, -FAR, -10.0), (x, FAR, -10.0), (x, FAR, top), (x, -FAR, top)])


def tilted(angle):
    return np.array([np.sin(angle), 0.0, np.cos(angle)])


@pytest.mark.parametrize("degrees", [1, 10, 25, 45, 60, 75, 89])
def test_wall_and_canyon(degrees):
    t = np.radians(degrees)
    obstruction = wall(1.0, np.tan(t))
    svf, _ = measure(obstruction)
    assert svf == pytest.approx((1 + np.cos(t)) / 2, abs=1e-9)
    svf, share = measure(obstruction, normal=EAST)
    assert svf == pytest.approx((1 - np.sin(t)) / 2, abs=1e-9)
    closed = 300 / (7 * np.pi) * ((np.pi / 2) * (1 - np.sin(t)) + 4 / 3 * np.cos(t) ** 2)
    assert share == pytest.approx(closed, abs=1e-9 * 100)
    svf, _ = measure(merge(obstruction, wall(-1.0, np.tan(t))))
    assert svf == pytest.approx(np.cos(t), abs=1e-9)


def test_known_figures_of_a_wall():
    for degrees, percent in ((0, 39.618), (15, 32.853), (25, 27.313), (40, 18.328), (75, 1.949)):
        _, share = measure(wall(1.0, np.tan(np.radians(degrees))), normal=EAST)
        assert share == pytest.approx(percent, abs=6e-4)


def test_round_tower_is_close_to_the_closed_form_of_its_polygon():
    # A regular prism around the point: the free sky is a cone's polygon, whose first moment is
    # the sum of n triangles: n/2 t n_z with the angle t of one side seen from the middle.
    n, height = 12, 1.7
    turn = np.arange(n) * 2 * np.pi / n
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    walls = [
        sheet([(*ring[k], -1), (*ring[(k + 1) % n], -1), (*ring[(k + 1) % n], height),
               (*ring[k], height)])
        for k in range(n)
    ]  # fmt: skip
    p, q = np.append(ring[0], height), np.append(ring[1], height)
    across = np.cross(p, q)
    angle = np.arctan2(np.linalg.norm(across), p @ q)
    exact = n * angle * across[2] / np.linalg.norm(across) / (2 * np.pi)
    svf, _ = measure(merge(*walls))
    assert svf == pytest.approx(exact, abs=1e-12)


def test_rectangular_courtyard():
    # The view factor of a rectangle parallel to the plane, from Lambert's formula corner by corner.
    a, b, c, d, h = 2.0, 3.0, 4.0, 1.0, 5.0

    def corner(x, y):
        x, y = x / h, y / h
        u, v = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
        return (x / u * np.arctan(y / u) + y / v * np.arctan(x / v)) / (2 * np.pi)

    exact = corner(a, b) + corner(a, d) + corner(c, b) + corner(c, d)
    yard = [
        sheet([(a, -d, -1), (a, b, -1), (a, b, h), (a, -d, h)]),
        sheet([(-c, -d, -1), (-c, b, -1), (-c, b, h), (-c, -d, h)]),
        sheet([(-c, b, -1), (a, b, -1), (a, b, h), (-c, b, h)]),
        sheet([(-c, -d, -1), (a, -d, -1), (a, -d, h), (-c, -d, h)]),
    ]
    svf, _ = measure(merge(*yard))
    assert svf == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize("degrees", [0, 20, 45, 90, 120, 180])
def test_open_planes(degrees):
    b = np.radians(degrees)
    below = sheet([(-5, -5, -1), (5, -5, -1), (5, 5, -1), (-5, 5, -1)])
    svf, share = measure(below, normal=tilted(b))
    whole = find_open(tilted(b)[None])
    assert svf == pytest.approx((1 + np.cos(b)) / 2, abs=1e-12)
    assert (svf, share / 100) == pytest.approx((whole[0][0], whole[1][0]), abs=1e-12)


def test_plate_over_the_zenith():
    # A square plate of side 2 at height 1 takes 4 corners of a unit square.
    plate = sheet([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
    r = 1 / np.sqrt(2)
    taken = 4 * 2 * r * np.arctan(r) / (2 * np.pi)
    assert measure(plate)[0] == pytest.approx(1 - taken, abs=1e-12)
    # Seen below one of its edges, and below a corner: edges through the zenith.
    half = sheet([(0, -1, 1), (2, -1, 1), (2, 1, 1), (0, 1, 1)])
    assert measure(half)[0] == pytest.approx(
        1 - 2 * (2 / 5**0.5 * np.arctan(1 / 5**0.5) + r * np.arctan(2 * r)) / (2 * np.pi), abs=1e-12
    )
    quarter = sheet([(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    assert measure(quarter)[0] == pytest.approx(1 - taken / 4, abs=1e-12)


BLOCK = box((2, -3, 0), (5, 4, 6))


@pytest.mark.parametrize(
    "same",
    [
        rewound(BLOCK),
        rewound(BLOCK, [0, 3, 6]),
        duplicated(BLOCK, [0, 5, 10, 11]),
        merge(BLOCK, BLOCK),
        merge(box((2, -3, 0), (5, 0, 6)), box((2, 0, 0), (5, 4, 6))),  # a wall between, joined
        merge(
            box((2, -3, 0), (5, 4, 2.5)), box((2, -3, 2.5), (5, 1, 6)), box((2, 1, 2), (5, 4, 6))
        ),
        (BLOCK[0], BLOCK[1][2:]),  # without its bottom
        merge(BLOCK, box((7, -2, 0), (8, 3, 4))),  # another, hidden behind it
    ],
)
@pytest.mark.parametrize("point", [(0, 0, 0), (0.5, -1.5, 0.75), (2 - 1e-3, 0, 1)])
@pytest.mark.parametrize("normal", [UP, EAST, (0.6, 0.0, 0.8), (-1, 0, 0)])
def test_windings_duplicates_and_joints_change_nothing(same, point, normal):
    assert measure(same, point, normal) == pytest.approx(measure(BLOCK, point, normal), abs=1e-10)


def test_point_on_faces_and_in_their_planes():
    # On the wall, looking out: nothing is before it. On the ground beside the wall's foot, too.
    assert measure(BLOCK, (2, 0, 3), (-1, 0, 0)) == pytest.approx((0.5, 39.6177), abs=1e-4)
    assert measure(BLOCK, (2, 0, 0), UP)[0] == pytest.approx(
        0.5 + measure(BLOCK, (2 - 1e-9, 0, 0), UP)[0] - 0.5, abs=1e-6
    )
    assert measure(BLOCK, (3, 0, 6), UP) == pytest.approx((1, 100), abs=1e-9)
    assert measure(BLOCK, (3, 0, 3), UP) == pytest.approx((0, 0), abs=1e-12)


def test_shares_and_what_is_free_add_up():
    vertices, faces = merge(BLOCK, box((-9, -1, 0), (-7, 8, 12)), box((-6, 9, 3), (5, 11, 4)))
    part = np.repeat(np.arange(3, dtype=np.int32), 12)
    casters = make_sky_casters(vertices, faces, part)
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points = np.column_stack(
        [rng.uniform(-5, 1.9, 30), rng.uniform(-3, 8, 30), rng.uniform(0, 5, 30)]
    )
    found = measure_sky(casters, points, normals, 1, objects=3)
    whole = find_open(normals)[1]
    total = found.blocked_by.sum(1) + found.sky_component / 100 / whole
    assert total == pytest.approx(np.ones(30), abs=1e-9)
    assert (found.blocked_by.max(0) > 0.01).all()


def test_arrays_that_do_not_fit():
    casters = make_sky_casters(*BLOCK)
    with pytest.raises(InputError):
        measure_sky(casters, np.zeros((3, 3)), np.ones((2, 3)))
    with pytest.raises(InputError) as raised:
        measure_sky(casters, np.zeros((3, 3)), [UP, (0, 0, 0), UP])
    assert raised.value.point == 1
