"""Cameras: pixel centres, depth keys, and the point that all rays share."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.sweeps import reduce_count

from umbra.errors import InputError
from umbra.scene import Camera


def place(camera, point, origin=(0, 0, 0)):
    """Give a point's column, row and depth key."""
    x, y, w, k = camera.matrix(origin) @ np.append(np.subtract(point, origin), 1.0)
    assert w > 0
    return x / w, y / w, k / w


def test_named_points_of_a_perspective_view():
    # Looking east, 90 degrees tall: at 10 m the picture is 20 m high, 2 m a pixel.
    camera = Camera((0, 0, 0), (1, 0, 0), size=(15, 10), fov=90)
    assert place(camera, (10, 0, 0)) == pytest.approx((7, 4.5, 0.1))
    assert place(camera, (10, -2, 0)) == pytest.approx((8, 4.5, 0.1))  # south is right
    assert place(camera, (10, 0, 9)) == pytest.approx((7, 0, 0.1))  # the top row's centre
    assert place(camera, (20, 0, 9)) == pytest.approx((7, 2.25, 0.05))


def test_named_points_of_an_orthographic_view():
    camera = Camera((0, 0, 9), (0, 0, 0), up=(0, 1, 0), size=(4, 6), height=12.0)
    assert place(camera, (0, 0, 0)) == pytest.approx((1.5, 2.5, -9))
    assert place(camera, (2, 0, 5)) == pytest.approx((2.5, 2.5, -4))
    assert place(camera, (0, 2, 5)) == pytest.approx((1.5, 1.5, -4))


def test_nearer_points_have_greater_keys():
    for height in None, 8.0:
        camera = Camera((1, 2, 3), (9, -4, 5), height=height, near=0.5, far=40.0)
        forward = camera.axes()[2]
        far, near = camera.key_range()
        keys = [place(camera, camera.eye + t * forward)[2] for t in (0.5, 1, 7, 40)]
        assert keys == sorted(keys, reverse=True)
        assert keys[0] == pytest.approx(near)
        assert keys[-1] == pytest.approx(far)
        assert Camera((0, 0, 0), (1, 0, 0), height=height).key_range()[0] == (
            0.0 if height is None else -np.inf
        )


vectors = st.tuples(*[st.floats(-50, 50, width=32)] * 3)


@settings(max_examples=reduce_count(60, 2), deadline=None, derandomize=True)
@given(vectors, vectors, st.none() | st.floats(1, 90), vectors)
def test_all_rays_share_the_apex(eye, target, height, origin):
    if np.linalg.norm(np.cross(np.subtract(target, eye), (0, 0, 1))) < 1e-3:
        return
    camera = Camera(eye, target, height=height)
    axes = camera.axes()
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(-1)  # right, up, forward: seen, not turned
    apex = camera.apex(origin)
    np.testing.assert_allclose(camera.matrix(origin)[:3] @ apex, 0, atol=1e-6)
    assert apex[3] == (height is None)


def test_the_origin_is_subtracted_without_loss():
    far = np.array([2.6e6, 1.2e6, 400])
    near = Camera((5, -7, 3), (0, 0, 0)).matrix()
    moved = Camera((5, -7, 3) + far, far).matrix(far)
    np.testing.assert_allclose(moved, near, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"eye": (0, 0, np.nan)}, "eye needs three finite"),
        ({"target": (0, 0)}, "target needs three finite"),
        ({"size": (0, 5)}, "0x5 pixels is empty"),
        ({"near": 0}, "near= must lie between"),
        ({"near": 5, "far": 5}, "near= must lie between"),
        ({"fov": 180}, "field of view"),
        ({"height": 0}, "height= above 0"),
        ({"target": (0, 0, 9)}, "along its up vector"),
        ({"target": (0, 0, 0)}, "along its up vector or at its own eye"),
    ],
)
def test_views_that_make_no_sense_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Camera(**{"eye": (0, 0, 0), "target": (1, 0, 0)} | wrong)
