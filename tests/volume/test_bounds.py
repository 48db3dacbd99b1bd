"""What is culled, clipped and cut: solved by hand, and held against sampled points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.sweeps import reduce_count

from umbra.errors import InputError
from umbra.scene import Camera
from umbra.volume.bounds import (
    can_box_end,
    find_box_distance,
    find_box_points,
    find_shadow_points,
    find_visible_parts,
    is_outside,
)
from umbra.volume.regions import find_near_rectangle, find_view_planes
from umbra.volume.scissor import (
    find_box_scissors,
    find_cone_planes,
    find_cone_scissor,
    find_depth_bounds,
    find_depths,
    find_sphere_depths,
    find_sphere_scissors,
    find_window_depths,
)

# At the origin, looking north along +y, the near plane at y = 1: there the picture is 4 wide
# and 2 high, a pixel 0.02 m.
AHEAD = Camera((0, 0, 0), (0, 1, 0), size=(200, 100), fov=90, near=1)
FLAT = Camera((0, 0, 0), (0, 1, 0), size=(200, 100), height=2, near=1)
CAMERAS = pytest.mark.parametrize("camera", [AHEAD, FLAT], ids=["perspective", "orthographic"])


def cube(*middles, half=0.5):
    middles = np.array(middles, float)
    return np.stack([middles - half, middles + half], 1)


@CAMERAS
def test_the_near_rectangle_by_hand(camera):
    expected = [(-2, 1, 1), (-2, 1, -1), (2, 1, -1), (2, 1, 1)]
    np.testing.assert_allclose(find_near_rectangle(camera), expected, atol=1e-15)
    part = find_near_rectangle(camera, (10, 20, 30), (150, 25, 200, 100))
    expected = [(1, 1, 0.5), (1, 1, -1), (2, 1, -1), (2, 1, 0.5)]
    np.testing.assert_allclose(part, np.array(expected) - (10, 20, 30), atol=1e-14)


def test_view_planes_by_hand():
    half = np.sqrt(0.5)
    expected = [
        (0, 1, 0, -1), (1 / 5**0.5, 2 / 5**0.5, 0, 0), (0, half, half, 0),
        (-1 / 5**0.5, 2 / 5**0.5, 0, 0), (0, half, -half, 0),
    ]  # fmt: skip
    np.testing.assert_allclose(find_view_planes(AHEAD), expected, atol=1e-15)
    expected = [(0, 1, 0, -1), (1, 0, 0, 2), (0, 0, 1, 1), (-1, 0, 0, 2), (0, 0, -1, 1)]
    np.testing.assert_allclose(find_view_planes(FLAT), expected, atol=1e-15)


def test_boxes_and_throws_outside_a_region():
    bounds = cube((0, 5, 0), (0, 0, 0), (0, 0.6, 0), (12, 5, 0), (10.9, 5, 0), (0, 5, 6.2))
    outside = is_outside(find_view_planes(AHEAD), find_box_points(bounds))
    assert outside.tolist() == [False, True, False, True, False, True]
    # Thrown to infinity: back over the eye, or ahead into the view.
    behind = find_shadow_points(cube((0, -5, 0)), (0, 5, 0, 1))
    assert is_outside(find_view_planes(AHEAD), behind).tolist() == [True]
    ahead = find_shadow_points(cube((0, -5, 0)), (0, -9, 0, 1))
    assert is_outside(find_view_planes(AHEAD), ahead).tolist() == [False]


def test_distances_and_ends_at_the_floor_by_hand():
    boxes = cube((3.5, 0, 0), (3.5, 4.5, 0), (0, 0, 0))
    assert [find_box_distance(box, np.array([0, 0, 0, 1.0])) for box in boxes] == [3, 5, 0]
    assert [find_box_distance(box, np.array([0, 0, 1.0, 0])) for box in boxes] == [0, 0, 0]
    boxes = cube((0, 0, 0.5), (0, 0, 6.4), (0, 0, 6.6))
    for light, expected in (
        ((0, 0, 7, 1), [True, True, False]),
        ((1, 0, 0.1, 0), [True] * 3),
        ((1, 0, 0, 0), [False] * 3),
        ((1, 0, -1, 0), [False] * 3),
    ):
        assert [can_box_end(box, np.array(light, float)) for box in boxes] == expected


def test_the_ends_of_shadows_by_hand():
    bounds = cube((0, 0, 3.5))
    light = (0, 0, 7, 1)
    ends = find_shadow_points(bounds, light)[0, 8:]
    np.testing.assert_allclose(ends[[0, 7]], [(-0.5, -0.5, -4, 0), (0.5, 0.5, -3, 0)])
    ends = find_shadow_points(bounds, light, floor=1)[0, 8:]
    np.testing.assert_allclose(ends[[0, 7]], [(-0.75, -0.75, 1, 1), (1, 1, 1, 1)])
    ends = find_shadow_points(bounds, light, reach=6)[0, 8:]  # 3 m below: twice as far
    np.testing.assert_allclose(ends[[0, 7]], [(-1, -1, -1, 1), (1, 1, 1, 1)])
    ends = find_shadow_points(bounds, light, floor=1, reach=6)[0, 8:]  # the floor is nearer
    np.testing.assert_allclose(ends[[0, 7]], [(-0.75, -0.75, 1, 1), (1, 1, 1, 1)])
    ends = find_shadow_points(bounds, light, floor=-5, reach=6)[0, 8:]  # the range is
    np.testing.assert_allclose(ends[[0, 7]], [(-1, -1, -1, 1), (1, 1, 1, 1)])
    ends = find_shadow_points(bounds, (0, 0, 3.5, 1), floor=1, reach=6)[0, 8:]  # inside
    np.testing.assert_allclose(ends[[0, 7]], [(-0.5, -0.5, -0.5, 0), (0.5, 0.5, 0.5, 0)])


def test_parts_in_view_by_hand():
    def parts(*args, **more):
        found = find_visible_parts(*args, **more)
        return list(zip(found.volume.tolist(), found.light_cap.tolist(), found.dark_cap.tolist()))

    # In view, thrown on and on; behind the eye, thrown ahead; behind and thrown away; aside.
    bounds = cube((0, 5, 0), (0, -3, 0), (0, -9, 0), (30, 5, 0))
    light = (0, -6, 0, 1)
    assert parts(bounds, light, AHEAD) == [
        (True, True, True), (True, False, True), (False,) * 3, (False,) * 3,
    ]  # fmt: skip
    # 10.5 m off, the first box is out of a range of 10 m; the second one's shadow is not.
    assert parts(bounds, light, AHEAD, reach=10) == [
        (False,) * 3, (True, False, True), (False,) * 3, (False,) * 3,
    ]  # fmt: skip
    # With a range of 6 m its shadow ends before the near plane.
    assert parts(bounds, light, AHEAD, reach=2.6) == [(False,) * 3] * 4
    # Only the right quarter of the picture: the shadow is in its middle.
    assert parts(bounds[:1], light, AHEAD, scissor=(150, 0, 200, 100)) == [(False,) * 3]
    # A little left of there the box still shows, but not its end, 2.4 pixels from the middle.
    assert parts(bounds[:1], light, AHEAD, scissor=(105, 0, 200, 100)) == [(True, True, False)]
    assert parts(bounds[:1], light, AHEAD, scissor=(102, 0, 200, 100)) == [(True, True, True)]
    # A box over the view, its shadow straight down through it, cut at z = 0.2 and -9.
    over, noon = cube((0, 5, 9)), (0, 0, 1, 0)
    assert parts(over, noon, AHEAD) == [(True, False, False)]
    assert parts(over, noon, AHEAD, floor=0.2) == [(True, False, True)]
    assert parts(over, noon, AHEAD, floor=-9) == [(True, False, False)]
    assert parts(over, noon, AHEAD, floor=7) == [(False, False, False)]
    # Beside it: straight down it never comes in.
    assert parts(cube((30, 5, 9)), noon, AHEAD) == [(False, False, False)]
    # Level light: no floor, no dark cap.
    assert parts(cube((0, 5, 0)), (0, -1, 0, 0), AHEAD, floor=-2) == [(True, True, False)]
    # Beyond the far plane no point is visible, but a volume that is counts to its end.
    short = Camera((0, 0, 0), (0, 1, 0), size=(200, 100), fov=90, near=1, far=4)
    assert parts(cube((0, 5, 0)), light, short) == [(False,) * 3]
    assert parts(cube((0, 5, 0)), (0, 9, 0, 1), short) == [(True, True, False)]


def test_the_far_end_of_a_box_that_stands_in_the_floor():
    # From the east at 45 degrees: the roof is thrown to x = -9.5 to -8.5, the feet stay; the
    # section at the floor, x = -0.5 to 0.5, ends there. Seen through what is above x + z = 0.
    tilted = Camera((0, 0, 0), (0, 1, 0), up=(1, 0, 1), size=(200, 100), height=2, near=1)
    bounds = np.array([[[-0.5, 4.5, -1], [0.5, 5.5, 9]], [[-0.5, 4.5, 0.7], [0.5, 5.5, 9]]])
    found = find_visible_parts(bounds, (1, 0, 1, 0), tilted, scissor=(0, 0, 200, 50), floor=0.0)
    assert found.volume.tolist() == [True, True]
    assert found.dark_cap.tolist() == [True, False]


def test_scissors_of_boxes_by_hand():
    middles = [(0.05, 5.5, 0.05), (0.01, 1.4, 0.01), (0, -3, 0), (3.53, 2.5, -0.925), (9, 3.5, 0)]
    # Near faces at 5 m, where a pixel is 0.1 m, and cut at 1 m, where it is 0.02 m; behind;
    # across the picture's edge, its left at 3.03 / 3, top at -0.425 / 3, bottom at -1.425 / 2;
    # aside.
    assert find_box_scissors(AHEAD, cube(*middles)).tolist() == [
        [95, 44, 106, 55], [75, 24, 126, 75], [0] * 4, [150, 57, 200, 86], [0] * 4,
    ]  # fmt: skip
    moved = cube(*middles) - (1, 2, 3)
    assert (
        find_box_scissors(AHEAD, moved, (1, 2, 3)) == find_box_scissors(AHEAD, cube(*middles))
    ).all()
    # In parallel rays a pixel is 0.02 m everywhere.
    assert find_box_scissors(FLAT, cube((0.01, 9, 0.01), (0, -3, 0))).tolist() == [
        [75, 24, 126, 75], [0] * 4,
    ]  # fmt: skip


def test_scissors_of_spheres_by_hand():
    # At 5 m of radius 3: the touching ray rises 3 in 4, 37.5 pixels of the middle, 49.5.
    found = find_sphere_scissors(
        AHEAD, [(0, 5, 0), (0, -5, 0), (0, 1, 0), (0, 0, 0)], [3, 3, 0.31, np.inf]
    )
    assert found.tolist() == [[62, 12, 138, 88], [0] * 4, [84, 34, 116, 66], [0, 0, 200, 100]]
    # The eye in the sphere: what the near plane leaves is 2 wide.
    assert find_sphere_scissors(AHEAD, [(0.005, 0, 0.005)], 2**0.5).tolist() == [[50, 0, 151, 100]]
    # Centre behind the near plane, in an orthographic view 0.6 across; before it 1.0.
    found = find_sphere_scissors(FLAT, [(0.005, 0.6, 0.005), (0.005, 1, 0.005)], 0.5)
    assert found.tolist() == [[85, 34, 116, 65], [75, 24, 126, 75]]


def test_window_depths_by_hand():
    assert find_window_depths(AHEAD, [1, 1.5, 5, np.inf]).tolist() == pytest.approx(
        [0, 1 / 3, 0.8, 1]
    )
    to_ten = Camera((0, 0, 0), (0, 1, 0), near=1, far=10)
    # z/w = (f + n)/(f - n) - 2 f n / ((f - n) d)
    assert find_window_depths(to_ten, [1, 2, 10]).tolist() == pytest.approx([0, 5 / 9, 1])
    flat = Camera((0, 0, 0), (0, 1, 0), height=2, near=1, far=11)
    assert find_window_depths(flat, [1, 2, 11]).tolist() == pytest.approx([0, 0.1, 1])
    with pytest.raises(InputError, match="finite far plane"):
        find_window_depths(FLAT, 2.0)


def test_depth_bounds_by_hand():
    found = find_depth_bounds(AHEAD, [(1.5, 5), (-3, 0.5), (0.5, np.inf), (-np.inf, 2)], widen=0.01)
    np.testing.assert_allclose(
        found.bounds, [(1 / 3 - 0.01, 0.81), (0, 1), (0, 1), (0, 0.51)], rtol=1e-12
    )
    assert found.is_empty.tolist() == [False, True, False, False]
    to_ten = Camera((0, 0, 0), (0, 1, 0), near=1, far=10)
    found = find_depth_bounds(to_ten, [(11, 12), (9, 12)])
    assert found.is_empty.tolist() == [True, False]
    assert (found.bounds[:, 0] <= found.bounds[:, 1]).all()
    # By default two steps of 24 bits.
    assert find_depth_bounds(AHEAD, [(2, 2)]).bounds[0] == pytest.approx(
        [0.5 - 2**-23, 0.5 + 2**-23], abs=1e-12
    )


def test_depths_by_hand():
    points = find_shadow_points(cube((0, 5, 0), (0, 5, 9), half=1), (0, -1, 0, 1))
    assert find_depths(AHEAD, points).tolist() == [[4, np.inf], [4, np.inf]]
    back = find_shadow_points(cube((0, 5, 0), half=1), (0, 9, 0, 1))
    assert find_depths(AHEAD, back).tolist() == [[-np.inf, 6]]
    across = find_shadow_points(cube((0, 5, 0), half=1), (1, 0, 0, 0))
    assert find_depths(AHEAD, across).tolist() == [[4, 6]]
    apart = find_depths(AHEAD, find_box_points(cube((0, 5, 0), half=1) - [0, 2, 0]), (0, 2, 0))
    assert apart.tolist() == [[4, 6]]
    assert find_sphere_depths(AHEAD, [(7, 5, 3)], 2).tolist() == [[3, 7]]
    assert find_sphere_depths(AHEAD, [(7, 3, 3)], 2, (0, 2, 0)).tolist() == [[3, 7]]


def a_camera(random):
    more = {"height": random.uniform(2, 20)} if random.random() < 0.3 else {}
    near = random.uniform(0.05, 3)
    far = near + random.uniform(5, 60) if random.random() < 0.5 or more else np.inf
    eye = random.uniform(-5, 5, 3)
    return Camera(
        eye, eye + random.normal(size=3), size=(int(random.integers(20, 90)), 60),
        fov=random.uniform(25, 130), near=near, far=far, **more,
    )  # fmt: skip


def a_light(random):
    light = np.append(random.uniform(-10, 10, 3), float(random.random() < 0.6))
    return np.array([0, 0, 1.0, 0]) if random.random() < 0.1 else light


def project(camera, points, origin):
    """Give pixels, and which points are drawn at all."""
    x, y, w, _ = (np.column_stack([points, np.ones(len(points))]) @ camera.matrix(origin).T).T
    depth = (points + origin - camera.eye) @ camera.axes()[2]
    cols, rows = camera.size
    w = np.where(depth > 0, w, 1.0)
    col, row = np.floor(x / w + 0.5), np.floor(y / w + 0.5)
    seen = (depth >= camera.near) & (depth <= camera.far)
    seen &= (col >= 0) & (col < cols) & (row >= 0) & (row < rows)
    return col, row, depth, seen


def points_in_view(camera, random, n=3000):
    """Scatter points over all that is seen, relative to the eye's place 0."""
    cols, rows = camera.size
    x = random.uniform(-0.5, cols - 0.5, n)
    y = random.uniform(-0.5, rows - 0.5, n)
    depth = camera.near + random.uniform(0, 1, n) ** 3 * min(camera.far - camera.near, 60)
    w = depth if camera.is_perspective else np.ones(n)
    matrix = camera.matrix()
    key = np.ones(n) if camera.is_perspective else -depth
    return (np.linalg.solve(matrix, np.stack([x * w, y * w, w, key])).T)[:, :3]


def hides(bounds, points, light):
    """Tell whether boxes stand between points and the light, (n boxes, m points)."""
    way = light[:3] - light[3] * points
    way = np.where(way == 0, 1e-300, way)
    with np.errstate(over="ignore"):
        t = (bounds[:, :, None] - points) / way
    first, last = t.min(1).max(-1), t.max(1).min(-1)
    return (first <= last) & (last >= 0) & (first <= (1 if light[3] else np.inf))


@given(st.integers(0, 10**6))
@settings(deadline=None, max_examples=reduce_count(200, 2))
def test_what_is_culled_holds_no_visible_point(seed):
    random = np.random.default_rng(seed)
    camera, light = a_camera(random), a_light(random)
    low = random.uniform(-12, 12, (60, 3))
    bounds = np.stack([low, low + random.uniform(0.01, 4, (60, 3))], 1)
    floor = random.uniform(-6, 3) if random.random() < 0.5 else None
    reach = random.uniform(1, 20) if random.random() < 0.5 else np.inf
    scissor = np.sort(random.integers(0, 20, (2, 2)), 0).ravel() + [0, 0, 1, 1]
    scissor = scissor if random.random() < 0.5 else None
    origin = random.uniform(-3, 3, 3)
    place = light - np.append(light[3] * origin, 0)
    parts = find_visible_parts(
        bounds - origin, place, camera, origin,
        scissor=scissor, floor=None if floor is None else floor - origin[2], reach=reach,
    )  # fmt: skip
    points = points_in_view(camera, random)
    if scissor is not None:
        col, row, _, _ = project(camera, points, np.zeros(3))
        points = points[
            (col >= scissor[0]) & (col < scissor[2]) & (row >= scissor[1]) & (row < scissor[3])
        ]
    visible = points
    if floor is not None:
        visible = visible[visible[:, 2] >= floor]
    if light[3]:
        visible = visible[np.linalg.norm(visible - light[:3], axis=1) <= reach]
    assert not hides(bounds, visible, light)[~parts.volume].any()
    in_box = ((points >= bounds[:, None, 0]) & (points <= bounds[:, None, 1])).all(2)
    assert not in_box[parts.volume & ~parts.light_cap].any()
    assert not (parts.light_cap & ~parts.volume).any()

    # The far ends: on the floor, or where directions to infinity appear in the picture.
    inside = bounds[:, :1] + random.uniform(0, 1, (60, 200, 3)) * np.diff(bounds, axis=1)
    planes = find_view_planes(camera, (0, 0, 0), scissor)
    for k in np.flatnonzero(parts.volume & ~parts.dark_cap):
        if floor is not None and can_box_end(bounds[k], light):
            above = inside[k][inside[k, :, 2] >= floor]
            away = light[3] * above - light[:3]
            ends = above - (above[:, 2:] - floor) / away[:, 2:] * away
            ends = ends @ planes[:, :3].T + planes[:, 3]
            assert not (ends > 1e-9).all(1).any()
        elif light[3]:
            assert not ((inside[k] - light[:3]) @ planes[:, :3].T > 1e-9).all(1).any()


@given(st.integers(0, 10**6))
@settings(deadline=None, max_examples=reduce_count(200, 2))
def test_scissors_and_depth_bounds_hold_all_that_is_seen(seed):
    random = np.random.default_rng(seed)
    camera = a_camera(random)
    origin = random.uniform(-3, 3, 3)
    centre = random.uniform(-8, 8, (12, 3))
    radius = random.uniform(0.05, 8, 12)
    way = random.normal(size=(12, 1500, 3))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    way *= random.uniform(0, 1, (12, 1500, 1)) ** 0.2
    in_spheres = centre[:, None] + radius[:, None, None] * way
    bounds = np.stack([centre - radius[:, None] * [1, 0.5, 0.2], centre + radius[:, None]], 1)
    in_boxes = bounds[:, :1] + random.uniform(0, 1, (12, 1500, 3)) * np.diff(bounds, axis=1)
    spheres = (
        in_spheres,
        find_sphere_scissors(camera, centre, radius, origin),
        find_depth_bounds(camera, find_sphere_depths(camera, centre, radius, origin)),
    )
    boxes = (
        in_boxes,
        find_box_scissors(camera, bounds, origin),
        find_depth_bounds(camera, find_depths(camera, find_box_points(bounds), origin)),
    )
    for points, scissors, depths in (spheres, boxes):
        for k in range(12):
            col, row, depth, seen = project(camera, points[k], origin)
            left, top, right, bottom = scissors[k]
            assert ((col >= left) & (col < right) & (row >= top) & (row < bottom))[seen].all()
            if depths.is_empty[k]:
                assert not seen.any()
            elif seen.any():
                window = find_window_depths(camera, depth[seen])
                low, high = depths.bounds[k]
                assert low <= window.min()
                assert window.max() <= high


@given(st.integers(0, 10**6))
@settings(deadline=None, max_examples=reduce_count(40, 2))
def test_scissors_are_tight(seed):
    # What a fine grid on the surface, cut at the near plane, spans is theirs but for 2 pixels.
    random = np.random.default_rng(seed)
    camera = a_camera(random)
    turn, tilt = np.meshgrid(np.linspace(0, 2 * np.pi, 400), np.linspace(0, np.pi, 400))
    way = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], -1)
    ball = way.reshape(-1, 3)
    centre, radius = random.uniform(-6, 6, 3), random.uniform(0.5, 5)
    right, up, forward = camera.axes()
    surface = centre + radius * ball
    short = camera.near - (centre - camera.eye) @ forward
    if abs(short) < radius:
        rim = np.outer(np.cos(turn[0]), right) + np.outer(np.sin(turn[0]), up)
        rim *= np.sqrt(radius**2 - short**2)
        surface = np.concatenate([surface, centre + short * forward + rim])
    surface = surface[(surface - camera.eye) @ forward >= camera.near * (1 - 1e-12)]
    if not len(surface):
        return
    x, y, w, _ = (np.column_stack([surface, np.ones(len(surface))]) @ camera.matrix().T).T
    cols, rows = camera.size
    span = [
        np.clip((x / w).min(), -1, cols), np.clip((y / w).min(), -1, rows),
        np.clip((x / w).max(), -1, cols) + 1, np.clip((y / w).max(), -1, rows) + 1,
    ]  # fmt: skip
    found = find_sphere_scissors(camera, centre[None], radius)[0]
    if found.any():
        assert np.abs(found - np.clip(span, 0, [cols, rows, cols, rows])).max() <= 2
    else:
        assert span[0] >= cols - 1 or span[2] <= 1 or span[1] >= rows - 1 or span[3] <= 1


@CAMERAS
@pytest.mark.parametrize("reach", [4.0, 30.0, np.inf])
def test_a_cones_scissor_and_planes_hold_it(camera, reach):
    random = np.random.default_rng(3)
    matrix, smaller = camera.matrix(), 0
    for half_angle in (0.5, 5, 20, 45, 80, 88.9, 95) * 20:
        place, axis = random.normal(0, 6, 3) + (0, 4, 0), random.normal(0, 1, 3)
        axis /= np.linalg.norm(axis)
        ways = random.normal(0, 1, (4000, 3)) * random.choice([0.01, 0.1, 1], (4000, 1)) + axis
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        ways = ways[ways @ axis >= np.cos(np.radians(half_angle))]
        points = place + min(reach, 1e4) * random.uniform(0, 1, (len(ways), 1)) ** 3 * ways
        planes = find_cone_planes(place, axis, half_angle)
        assert planes is None or (points @ planes[:, :3].T + planes[:, 3] > -1e-9).all()
        left, top, right, bottom = find_cone_scissor(camera, place, axis, half_angle, reach)
        x, y, w, _ = (np.column_stack([points, np.ones(len(points))]) @ matrix.T).T
        seen = points[:, 1] >= camera.near
        x, y = x[seen] / w[seen], y[seen] / w[seen]
        shown = (np.abs(x - 99.5) < 99.9) & (np.abs(y - 49.5) < 49.9)
        x, y = x[shown], y[shown]
        assert ((x > left - 0.51) & (x < right - 0.49) & (y > top - 0.51)).all()
        assert (y < bottom - 0.49).all()
        smaller += (right - left) * (bottom - top) < 200 * 100
    assert smaller >= (0 if np.isinf(reach) and camera.height else 20)
