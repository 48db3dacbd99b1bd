"""The skyline raised by all faces leaves out what cannot bound the free sky, and nothing else."""

import numpy as np
import pytest
from support.shapes import box, merge, sheet

from umbra.sky.casters import make_sky_casters
from umbra.sky.events import find_events, find_spans
from umbra.sky.gather import gather_faces
from umbra.sky.occluders import keep_above, raise_skyline
from umbra.sky.skyline import BINS, find_skyline
from umbra.sky.sweep import find_pieces, integrate
from umbra.sky.tensors import sum_tensors
from umbra.sky.view_factors import measure_sky


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


def gather(casters, p, normal):
    skyline = find_skyline(casters.strips, casters.strip_boxes, p, np.inf)
    return gather_faces(casters, p, normal, 0.0, skyline[None], np.zeros(1)), skyline


def measure_plainly(casters, p, normal):
    """Measure by all faces, from the horizon on."""
    nothing = np.zeros(BINS)
    seen = gather_faces(casters, p, normal, 0.0, np.zeros((1, BINS)), np.zeros(1))
    events = find_events(seen, normal, np.zeros(casters.n_edges, np.bool_), nothing)
    pieces = find_pieces(seen, normal, events, *find_spans(seen), nothing)
    moments = np.zeros(7)
    integrate(pieces, moments)
    return sum_tensors(moments, normal)


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


def test_it_leaves_few_faces():
    casters, up = make_sky_casters(*gabled(1, 300)), np.array([0.0, 0.0, 1.0])
    seen, skyline = gather(casters, np.array([0.3, 0.2, 0.1]), up)
    raised = skyline.copy()
    raise_skyline(seen, raised)
    assert (raised >= skyline).all()
    assert (raised > skyline).mean() > 0.2
    assert len(keep_above(seen, raised).size) < 0.85 * len(seen.size)
