"""Cutting casters at a plane keeps every chain of edges closed, and what it encloses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.shapes import SCENES, box, jumble, rewound, sheet
from support.sweeps import reduce_count

from umbra.cpu.plane import clip_above
from umbra.volume.adjacency import make_caster
from umbra.volume.silhouette import find_silhouette_edges


def enclosed(caster, light, height):
    """Give the signed area that a silhouette's shadow has on a plane."""
    edges, multiplicity = find_silhouette_edges(caster, light)
    ends = caster.vertices[edges]
    flat = ends[..., :2] - (ends[..., 2:] - height) * light[:2] / light[2]
    a, b = flat[:, 0], flat[:, 1]
    return (multiplicity * (a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1])).sum() / 2


def check_closed(caster, light):
    edges, multiplicity = find_silhouette_edges(caster, light)
    net = np.zeros(len(caster.vertices), np.int64)
    np.add.at(net, edges[:, 0], multiplicity)
    np.subtract.at(net, edges[:, 1], multiplicity)
    assert not net.any()


def test_nothing_to_cut_is_nothing_done():
    caster = make_caster(*box((0, 0, 1), (2, 2, 3)))
    assert clip_above(caster, 0.5) is caster


def test_a_face_in_the_plane_is_not_above_it():
    caster = clip_above(make_caster(*sheet([(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)])), 1.0)
    assert len(caster.edges) == 0


@pytest.mark.parametrize(("inward", "area"), [(False, 2 * (5 + 1)), (True, 2 * 1)])
def test_the_top_of_a_box_casts_its_own_shadow(inward, area):
    # 4 m high, cut at 3; a sun of 45 degrees in the south throws what stands out a metre north:
    # the roof, or wound inward the back wall, which alone is lit and above the cut.
    mesh = box((0, 0, 0), (2, 5, 4))
    caster = clip_above(make_caster(*(rewound(mesh) if inward else mesh)), 3.0)
    assert enclosed(caster, np.array([0.0, -1, 1, 0]), 3.0) == pytest.approx(area)
    points = caster.vertices[8:]
    assert len(points) > 0
    assert (points[:, 2] == 3.0).all()


@pytest.mark.parametrize("height", [0.25, 1.0, 3.7, 6.0])
@pytest.mark.parametrize("name", SCENES)
def test_cut_chains_stay_closed(name, height):
    caster = clip_above(make_caster(*SCENES[name]()), height)
    for light in (0.3, 0.2, 0.8, 0.0), (0.0, -1.0, 1.0, 0.0), (30.0, -20.0, 45.0, 1.0):
        check_closed(caster, np.array(light))
    used = np.unique(caster.edges)
    assert (caster.vertices[used, 2] >= height).all()


@settings(max_examples=reduce_count(100, 2), deadline=None, derandomize=True)
@given(st.integers(0, 2**32), st.integers(1, 40), st.integers(3, 9), st.booleans())
def test_any_soup_cut_at_any_height(seed, n, places, whole):
    rng = np.random.default_rng(seed)
    mesh = jumble(rng, n, places, low=-3.0)
    if whole:
        mesh = np.round(mesh[0]), mesh[1]
    height = float(np.round(rng.uniform(-3, 9)))
    caster = clip_above(make_caster(*mesh), height)
    check_closed(caster, np.append(rng.normal(size=2), [1.0, 0.0]))


def test_cutting_leaves_what_is_enclosed_of_convex_pieces():
    # What stands above the plane casts as if it stood there alone, closed by the plane.
    rng = np.random.default_rng(5)
    for _ in range(20):
        low, size = rng.uniform(-3, 0, 3), rng.uniform(1, 6, 3)
        cut = float(rng.uniform(low[2], low[2] + size[2]))
        light = np.append(rng.normal(size=2), [1.0, 0.0])
        whole = clip_above(make_caster(*box(low, low + size)), cut)
        alone = make_caster(*box((*low[:2], cut), low + size))
        assert enclosed(whole, light, cut) == pytest.approx(enclosed(alone, light, cut))
