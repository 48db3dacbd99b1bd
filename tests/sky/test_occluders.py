"""What is known to be covered leaves out what cannot bound the free sky, and nothing else."""

import numpy as np
import pytest
from support.shapes import box, merge, sheet

from umbra.sky.casters import make_sky_casters
from umbra.sky.events import find_events, find_spans
from umbra.sky.gather import gather_faces, keep_above
from umbra.sky.nearest import find_hits
from umbra.sky.skyline import BINS, look_along, make_cover, make_covers
from umbra.sky.sweep import find_pieces, integrate
from umbra.sky.tensors import sum_tensors
from umbra.sky.view_factors import measure_sky
from umbra.sky.wall_cover import cover_by_walls

UP = np.array([0.0, 0.0, 1.0])


def gabled(seed, n=60):
    """A town of gabled houses, some of which float."""
    rng = np.random.default_rng(seed)
    houses = []
    for x, y in rng.uniform(-40, 40, (n, 2)):
        a, b, h, ridge = rng.uniform([2, 2, 1, 0.5], [6, 6, 8, 4])
        low = rng.choice([0.0, 0.0, 0.0, 3.0])
        eaves = low + h
        houses.append(box((x, y, low), (x + a, y + b, eaves)))
        for side in (y, y + b):
            houses.append(
                sheet([(x, side, eaves), (x + a, side, eaves), (x + a, y + b / 2, eaves + ridge),
                       (x, y + b / 2, eaves + ridge)])
            )  # fmt: skip
    return merge(*houses)


def gather(casters, p, normal, raises):
    covers = make_covers(1)
    cover_by_walls(casters, p, normal, np.inf, covers)
    walls = covers[0].copy()
    return gather_faces(casters, p, normal, covers, np.zeros(1), raises), walls, covers[0]


def gather_all(casters, p, normal):
    return gather_faces(casters, p, normal, make_covers(1), np.zeros(1), False)


def measure_plainly(casters, p, normal):
    """Measure by all faces, from the horizon on."""
    seen = gather_all(casters, p, normal)
    events = find_events(seen, normal, np.zeros(casters.n_edges, np.bool_), make_cover())
    pieces = find_pieces(seen, normal, events, *find_spans(seen), make_cover())
    moments = np.zeros(7)
    integrate(pieces, moments)
    return sum_tensors(moments, normal)


def interpolate(shares, first, second):
    """Return directions within the bins, and the tangents there of arcs between their sides."""
    a = np.array([look_along(b) for b in range(BINS)])
    b = np.roll(a, -1, 0)
    toward = (1 - shares)[:, None] * a + shares[:, None] * b
    length = np.linalg.norm(toward, axis=1)
    return toward / length[:, None], ((1 - shares) * first + shares * second) / length


@pytest.mark.parametrize("seed", range(3))
def test_it_changes_no_measure(seed):
    casters = make_sky_casters(*gabled(seed))
    rng = np.random.default_rng(seed)
    points = rng.uniform((-45, -45, 0), (45, 45, 6), (12, 3))
    normals = rng.normal(size=(12, 3))
    normals[::3, 2] = 0.0
    normals[1::3] = (0, 0, 1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    found = measure_sky(casters, points, normals, 1)
    plain = np.array([measure_plainly(casters, p, n) for p, n in zip(points, normals)])
    assert found.sky_view_factor == pytest.approx(plain[:, 0], abs=1e-12)
    assert found.sky_component == pytest.approx(100 * plain[:, 1], abs=1e-10)
    assert plain[:, 0].max() > 0.2


@pytest.mark.parametrize("side", [1, -1])
def test_a_verge_through_the_level_close_before_its_wall(side):
    # What rounding leaves of the verge's arc differs from place to place: many walls.
    rng = np.random.default_rng(0)
    n_half = 0
    for _ in range(8):
        turn, low, high = rng.uniform((0, -40, 5), (2 * np.pi, -12, 40))
        along = np.array([np.cos(turn), np.sin(turn), 0.0])
        toward = side * np.array([-along[1], along[0], 0.0])
        at, (left, right) = rng.uniform(-5, 5, 3), rng.uniform(2, 10, 2)
        wall = sheet([at - left * along - 60 * UP, at + right * along - 60 * UP,
                      at + right * along + high * UP, at - left * along + low * UP])  # fmt: skip
        casters = make_sky_casters(*wall)
        points = at + toward * np.array([3e-9, 1e-8, 5e-8, 1e-7, 3e-7, 3e-6, 1e-4])[:, None]
        for normal in (UP, toward, (2 * UP - toward) / 5**0.5, (UP + along) / 2**0.5):
            found = measure_sky(casters, points, np.tile(normal, (len(points), 1)), 1)
            plain = np.array([measure_plainly(casters, p, normal) for p in points])
            assert found.sky_view_factor == pytest.approx(plain[:, 0], abs=1e-12)
            assert found.sky_component == pytest.approx(100 * plain[:, 1], abs=1e-10)
            n_half += (abs(plain[:, 0] - 0.5) < 0.25).sum()
    assert n_half > 100


def test_a_wall_of_several_strips_far_from_the_origin():
    # A strip's ends lie off its edge by rounding, which raises what it covers beside a near place.
    rng, distances = np.random.default_rng(0), 10 ** np.linspace(-5.5, -3, 30)
    for _ in range(8):
        turn, low, high = rng.uniform((0, -10, 5), (2 * np.pi, 40, 40))
        along = np.array([np.cos(turn), np.sin(turn), 0.0])
        at = rng.uniform(4000, 5000, 3)
        top = [at - 20 * along + low * UP, at + 20 * along + high * UP]
        bottom = [at + step * along - 60 * UP for step in (-20, *rng.uniform(-20, 20, 4), 20)]
        fan = [[0, k, k + 1] for k in range(2, 7)] + [[0, 7, 1]]
        casters = make_sky_casters(np.array([*top, *bottom]), np.array(fan, np.int32))
        assert len(casters.strips) >= 5
        points = at + distances[:, None] * np.cross(along, UP)
        found = measure_sky(casters, points, np.tile(UP, (len(points), 1)), 1).sky_view_factor
        plain = [measure_plainly(casters, p, UP)[0] for p in points]
        assert found == pytest.approx(plain, abs=1e-8)
        assert found == pytest.approx(0.5, abs=2e-3)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_known_to_be_covered_is(seed):
    casters, rng = make_sky_casters(*gabled(seed, 150)), np.random.default_rng(seed)
    n_above = 0
    for p in rng.uniform((-30, -30, 0), (30, 30, 2), (4, 3)):
        everything = gather_all(casters, p, UP)
        _, _, cover = gather(casters, p, UP, True)
        is_above = np.isfinite(cover[:, 2])
        n_above += is_above.sum()
        known = np.where(is_above[:, None], cover[:, 2:], 0.0)
        horizon = np.zeros(BINS)
        for low, next_low, high, next_high, is_known in (
            (horizon, horizon, cover[:, 0], cover[:, 1], cover[:, :2].min(1) > 0),
            (*known.T, is_above),
        ):
            shares = rng.random(BINS)
            toward, start = interpolate(shares, low, next_low)
            _, end = interpolate(shares, high, next_high)
            for part in (0.001, 0.5, 0.999):
                rays = np.column_stack([toward, start + part * (end - start)])
                assert (find_hits(everything, casters, rays)[is_known] >= 0).all()
    assert n_above > 100


def test_it_leaves_few_faces():
    casters, p = make_sky_casters(*gabled(1, 300)), np.array([0.3, 0.2, 0.1])
    seen, walls, raised = gather(casters, p, UP, True)
    assert (raised[:, :2].min(1) >= walls[:, :2].min(1)).all()
    assert (raised[:, 0] > walls[:, 0]).mean() > 0.2
    # What faces were left out for stays covered.
    floats = np.isfinite(walls[:, 2])
    stays = ((raised[:, 2:4] <= walls[:, 2:4]) & (raised[:, 4:] >= walls[:, 4:])).all(1)
    assert floats.sum() > 20
    assert (stays | (raised[:, :2] >= walls[:, 4:]).all(1))[floats].all()
    by_walls, _, _ = gather(casters, p, UP, False)
    kept = len(keep_above(seen, raised).size)
    assert kept < 0.8 * len(seen.size) < 0.8 * len(by_walls.size)
    assert len(by_walls.size) < 0.5 * len(gather_all(casters, p, UP).size)
