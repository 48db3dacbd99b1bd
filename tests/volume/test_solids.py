"""Shadow volumes as solids: closed, and of the volume that closed forms give."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.shapes import box, merge, moved, rewound, sheet, soup
from support.sweeps import reduce_count

from umbra.volume.adjacency import make_caster
from umbra.volume.solids import make_shadow_solid

SUN = np.array([0.3, -0.5, 0.4]) / np.linalg.norm([0.3, -0.5, 0.4])


def count_edges(solid):
    """How often each edge is used, and whether always once in either direction."""
    tail, head = solid.faces.ravel(), solid.faces[:, [1, 2, 0]].ravel()
    pairs = np.stack([np.minimum(tail, head), np.maximum(tail, head)], 1)
    _, edge, number = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    balance = np.bincount(edge.ravel(), np.where(tail < head, 1, -1))
    return number, balance


def check_closed(solid):
    number, balance = count_edges(solid)
    assert len(number) > 0
    assert (number == 2).all()
    assert (balance == 0).all()


@pytest.mark.parametrize("turn", [lambda mesh: mesh, rewound])
@pytest.mark.parametrize("ground", [0.0, -1.0, 2.0])
def test_a_box_on_above_and_in_the_ground(turn, ground):
    w, d, h = 3.0, 2.0, 5.0
    solid = make_shadow_solid(make_caster(*turn(box((1, 1, 0), (1 + w, 1 + d, h)))), SUN, ground)
    check_closed(solid)
    # The roof's prism down to the ground, and those of the two lit walls.
    top, low = h - ground, max(0 - ground, 0)
    walls = (top**2 - low**2) / 2 * (w * abs(SUN[1]) + d * abs(SUN[0])) / SUN[2]
    assert solid.volume == pytest.approx(w * d * top + walls, rel=1e-12)
    assert solid.vertices[:, 2].min() == ground
    far = (top * np.abs(SUN[:2]) / SUN[2]).max()
    assert np.ptp(solid.vertices[:, 1]) == pytest.approx(d + far, rel=1e-12)


def test_a_sheet_casts_from_both_sides():
    corners = [(0, 0, 1), (4, 0, 1), (4, 0, 3), (0, 0, 3)]
    for mesh in (sheet(corners), sheet(corners[::-1])):
        solid = make_shadow_solid(make_caster(*mesh), SUN, 0.0)
        check_closed(solid)
        assert solid.volume == pytest.approx(4 * (9 - 1) / 2 * abs(SUN[1]) / SUN[2], rel=1e-12)


def test_volumes_that_touch_stay_apart():
    two = merge(box((0, 0, 0), (1, 1, 2)), box((1, 1, 0), (2, 2, 2)))
    solid = make_shadow_solid(make_caster(*two), SUN, 0.0)
    check_closed(solid)
    alone = make_shadow_solid(make_caster(*box((0, 0, 0), (1, 1, 2))), SUN, 0.0)
    assert solid.volume == pytest.approx(2 * alone.volume, rel=1e-12)


def test_below_the_ground_nothing_casts():
    solid = make_shadow_solid(make_caster(*box((0, 0, -4), (1, 1, -1))), SUN, 0.0)
    assert len(solid.faces) == 0
    assert solid.volume == 0.0


@given(st.integers(0, 10**6), st.floats(-4, 4))
@settings(deadline=None, max_examples=reduce_count(60, 2))
def test_any_soup_is_closed(seed, ground):
    rng = np.random.default_rng(seed)
    vertices, faces = soup(rng, 30, low=-4.0)
    mesh = merge((vertices, faces), moved(box((-1, -1, -1), (1, 1, 1)), rng.normal(size=3)))
    light = rng.normal(size=3)
    light[2] = abs(light[2]) + 0.1
    light /= np.linalg.norm(light)
    solid = make_shadow_solid(make_caster(*mesh), light, ground)
    if len(solid.faces):
        check_closed(solid)
        assert solid.vertices[:, 2].min() >= ground
        # Each casting face's prism, one by one.
        caster = make_caster(*mesh)
        facing = light @ caster.planes[:3, :-1]
        casts = np.where(caster.face_is_closed, facing > 0, True)
        alone = sum(
            make_shadow_solid(make_caster(caster.vertices[face], np.array([[0, 1, 2]], np.int32)),
                              light, ground).volume
            for face in caster.faces[casts]
        )  # fmt: skip
        assert solid.volume == pytest.approx(alone, rel=1e-9, abs=1e-9)
