"""The three cases: solved by hand, held against rays, a linear program and brute force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from support.raycaster import RayCaster
from support.shapes import BOX_FACES, box, jumble, merge, rewound, sheet, soup
from support.sweeps import reduce_count

from umbra.cpu.polygons import make_dark_cap, make_light_cap
from umbra.scene import Camera
from umbra.volume.adjacency import make_caster
from umbra.volume.placement import dark_cap_is_fan, find_placement, find_placements
from umbra.volume.regions import find_near_rectangle, make_regions, occlusion_pyramid

# At the origin, looking north along +y: the near rectangle is 4 wide and 2 high at y = 1.
AHEAD = Camera((0, 0, 0), (0, 1, 0), size=(200, 100), fov=90, near=1)
FLAT = Camera((0, 0, 0), (0, 1, 0), size=(200, 100), height=2, near=1)
CAMERAS = pytest.mark.parametrize("camera", [AHEAD, FLAT], ids=["perspective", "orthographic"])


def inside(planes, point):
    return bool((planes @ np.append(point, 1.0) >= -1e-9).all())


def placed(mesh, camera, light, **more):
    answer = find_placement(make_caster(*mesh), camera, light, **more)
    return answer.case, answer.needs_light_cap, answer.needs_dark_cap


def triangle(*corners):
    return np.array(corners, float), np.array([[0, 1, 2]], np.int32)


@CAMERAS
@pytest.mark.parametrize(
    ("light", "within", "without"),
    [
        # Above and before: halfway up the pyramid is half as wide.
        ((0, 1 + 4, 0, 1), [(0.9, 3, 0.4), (-0.9, 3, -0.4), (0, 4.9, 0)],
         [(1.1, 3, 0), (0, 3, 0.6), (0, 5.1, 0), (0, 0.9, 0)]),
        # Behind the eye: all side planes flip, and the near plane too.
        ((0, 1 - 4, 0, 1), [(0.9, -1, 0.4), (-0.9, -1, -0.4), (0, -2.9, 0)],
         [(1.1, -1, 0), (0, -1, 0.6), (0, -3.1, 0), (0, 1.1, 0)]),
        # To the side: (3, 3) is halfway between the rectangle's centre and (6, 5).
        ((6, 5, 0, 1), [(3, 3, 0), (3.9, 3, 0.4), (2.1, 3, -0.4)],
         [(4.1, 3, 0), (1.9, 3, 0), (3, 3, 0.6)]),
        # A direction: a prism that leans east and never ends.
        ((1, 1, 0, 0), [(4, 5, 0), (5.9, 5, 0.9), (1e4, 1e4 + 1, -0.9)],
         [(6.1, 5, 0), (1.9, 5, 0), (4, 5, 1.1), (0, 0.9, 0)]),
        # From behind.
        ((1, -1, 0, 0), [(4, -3, 0), (1e4, 1 - 1e4, 0.9)], [(1.9, -3, 0), (1.1, 1.1, 0)]),
    ],
)  # fmt: skip
def test_a_pyramid_by_hand(camera, light, within, without):
    planes = occlusion_pyramid(camera, light)
    assert planes.shape == (5, 4)
    np.testing.assert_allclose(np.linalg.norm(planes[:, :3], axis=1), 1)
    assert [inside(planes, p) for p in within] == [True] * len(within)
    assert [inside(planes, p) for p in without] == [False] * len(without)


@CAMERAS
@pytest.mark.parametrize(
    ("light", "without"),
    [
        ((0, 1, 9, 1), [(0, 1, -1.1), (0, 1, 9.1), (2.1, 1, 5)]),
        ((0, 1, 0.5, 1), [(0, 1, 1.1), (2.1, 1, 0)]),  # in the rectangle itself
        ((0, 0, 1, 0), [(0, 1, -1.1), (2.1, 1, 0)]),
        ((1, 0, 2, 0), [(0, 1, -1.1), (-2.1, 1, 0)]),
    ],
)
def test_a_light_in_the_near_plane_leaves_a_slab(camera, light, without):
    planes = occlusion_pyramid(camera, light)
    for t in (0.0, 0.5, 1.0):
        for corner in find_near_rectangle(camera):
            way = np.array(light[:3]) - light[3] * corner
            assert inside(planes, corner + t * way)
    for point in [*without, (0, 1.001, 0.5), (0, 0.999, 0.5)]:
        assert not inside(planes, point)


def test_the_origin_moves_the_planes_and_a_scissor_narrows_them():
    light = np.array([6, 5, 0, 1.0])
    shift = np.array([10, 20, 30.0])
    near = occlusion_pyramid(AHEAD, light)
    far = occlusion_pyramid(AHEAD, light - np.append(shift, 0), shift)
    np.testing.assert_allclose(far[:, 3], near[:, 3] + near[:, :3] @ shift)
    right = occlusion_pyramid(AHEAD, (0, 5, 0, 1), scissor=(150, 0, 200, 100))
    assert inside(right, (1.5, 1, 0))
    assert not inside(right, (0.9, 1, 0))
    low = occlusion_pyramid(AHEAD, (0, 5, 0, 1), scissor=(0, 75, 200, 100))
    assert inside(low, (0, 1, -0.6))
    assert not inside(low, (0, 1, -0.4))


CUBE = box((-0.1, 2.9, -0.1), (0.1, 3.1, 0.1))


@CAMERAS
@pytest.mark.parametrize(
    ("mesh", "light", "expected"),
    [
        # Between near rectangle and a light ahead, in view; its shadow runs to the eye.
        (CUBE, (0, 5, 0, 1), (3, True, False)),
        # The light behind: the cube throws its shadow ahead, the viewport is lit.
        (CUBE, (0, -5, 0, 1), (1, False, False)),
        # Behind the near plane, light behind: shadow ahead, light cap out of view.
        (box((-0.1, -1, -0.1), (0.1, -0.5, 0.1)), (0, -5, 0, 1), (2, False, True)),
        # No dark cap of a directional light.
        (box((-0.1, -1, -0.1), (0.1, -0.5, 0.1)), (0, -1, 0, 0), (2, False, False)),
        # Beside the way to the light.
        (box((2.5, 2.9, -0.1), (2.7, 3.1, 0.1)), (0, 5, 0, 1), (1, False, False)),
        # Above: the shadow falls on the rectangle, and leaves the view downward.
        (box((-3, 0, 3), (3, 2, 4)), (0, 1, 9, 1), (2, False, False)),
    ],
)
def test_cases_by_hand(camera, mesh, light, expected):
    assert placed(mesh, camera, light) == expected


def test_in_parallel_rays_all_of_infinity_is_one_point():
    # Thrown ahead and west: in view, but not straight ahead.
    behind = box((-0.1, -1, -0.1), (0.1, -0.5, 0.1))
    assert placed(behind, AHEAD, (1, -5, 0, 1)) == (2, False, True)
    assert placed(behind, FLAT, (1, -5, 0, 1)) == (2, False, False)
    bounds = np.array([[[-0.1, -1, -0.1], [0.1, -0.5, 0.1]]])
    for camera, light, expected in (
        (AHEAD, (1, -5, 0, 1), True), (FLAT, (1, -5, 0, 1), False), (FLAT, (0, -5, 0, 1), True),
    ):  # fmt: skip
        found = find_placements(bounds, make_regions(camera, light))
        assert found.needs_dark_cap.tolist() == [expected]


def test_only_triangles_that_cast_count():
    # Walls on both sides of the way to the light: bounds cannot tell, triangles can.
    walls = [triangle((x, 2.9, -9), (x, 2.9, 9), (x, 1, 0)) for x in (-3, 3)]
    assert placed(merge(*walls), AHEAD, (0, 5, 0, 1)) == (1, False, False)
    # The light in a solid: all faces turn from it and the closed rule casts nothing.
    solid = box((-9, 5, -9), (9, 6, 9))
    light = (0, 5.5, 0, 1)
    assert placed(solid, AHEAD, light) == (1, False, False)
    # As a room, or as triangles of which no more is known, it does, all around.
    assert placed(rewound(solid), AHEAD, light) == (3, True, True)
    assert find_placement(solid, AHEAD, light).case == 3


def test_an_edge_on_triangle_casts_nothing():
    mesh = triangle((0, 2, -1), (0, 4, -1), (0, 3, 2))
    assert placed(mesh, AHEAD, (0, 5, 0, 1))[0] == 1
    assert placed(mesh, AHEAD, (0.5, 5, 0, 1))[0] == 3


def test_clipping_decides_where_outcodes_cannot():
    # A sliver that passes the pyramid's corner outside, its bounds across it.
    passing = triangle((2, 3, 0), (0, 3, 2), (2, 3, 2))
    crossing = triangle((0.9, 3, -2), (0.9, 3, 2), (2, 3, 2))
    assert placed(passing, AHEAD, (0, 5, 0, 1))[0] == 1
    assert placed(crossing, AHEAD, (0, 5, 0, 1))[0] == 3
    # A corner inside is no matter where its triangle is edge-on.
    for turn in range(3):
        flat = triangle(*np.roll([(0, 3, 0), (0, 2, -1), (0, 4, -1)], turn, 0))
        assert placed(merge(passing, flat), AHEAD, (0, 5, 0, 1))[0] == 1
    # One that holds the whole cross-section, no corner inside.
    assert placed(triangle((-9, 3, -9), (9, 3, -9), (0, 3, 9)), AHEAD, (0, 5, 0, 1))[0] == 3


def test_a_caster_that_is_not_drawn_needs_its_light_cap_with_z_pass():
    light = (0, -5, 0, 1)
    assert placed(CUBE, AHEAD, light, is_drawn=False) == (1, True, False)
    behind = box((-0.1, -9, -0.1), (0.1, -8, 0.1))
    assert placed(behind, AHEAD, light, is_drawn=False) == (1, False, False)


def test_a_transform_is_as_good_as_moved_vertices():
    light = np.array([0, 5, 0, 1.0])
    turn = np.array([[0, -2, 0, 6.4], [2, 0, 0, 1.0], [0, 0, 2, 0], [0, 0, 0, 1]])
    for x in np.linspace(-3, 3, 25):
        low = np.array([x, 2.5, -0.1])
        vertices, faces = box(low, low + 0.2)
        moved = vertices @ turn[:3, :3].T + turn[:3, 3]
        expected = placed((moved, faces), AHEAD, light)
        assert placed((vertices, faces), AHEAD, light, transform=turn) == expected


def test_other_things_vertices_are_no_matter():
    vertices, faces = box((-0.1, 2.9, -0.1), (0.1, 3.1, 0.1))
    others = np.random.default_rng(0).uniform(-9, 9, (500, 3))
    among = np.concatenate([others, vertices])
    for x in (0, 1, 2.5):
        alone = find_placement((vertices + [x, 0, 0], faces), AHEAD, (0, 5, 0, 1))
        assert find_placement((among + [x, 0, 0], faces + 500), AHEAD, (0, 5, 0, 1)) == alone


def test_a_fan_closes_only_around_a_light_outside_the_bounds():
    bounds = np.array([[[0, 0, 0], [1, 1, 1]], [[0, 0, 2], [1, 1, 3]]], float)
    assert dark_cap_is_fan(bounds, (0.5, 0.5, 0.5, 1)).tolist() == [False, True]
    assert dark_cap_is_fan(bounds, (0.5, 0.5, 2.5, 1)).tolist() == [True, False]
    assert dark_cap_is_fan(bounds, (0.5, 0.5, 1, 1)).tolist() == [False, True]  # in a face
    assert dark_cap_is_fan(bounds, (1, 1, 1, 0)).tolist() == [True, True]
    assert not dark_cap_is_fan(bounds[0], (0.5, 0.5, 0.5, 1))


@given(st.integers(0, 10**6))
@settings(deadline=None, max_examples=reduce_count(60, 2))
def test_the_cap_is_a_fan_where_that_is_said(seed):
    random = np.random.default_rng(seed)
    caster = make_caster(*box((0, 0, 0), (1, 2, 3)))
    light = np.append(random.uniform(-1, 4, 3), 1)
    cap = make_dark_cap(caster, light)
    # A fan has as many triangles as the silhouette has edges, 4 or 6 of a box.
    is_fan = dark_cap_is_fan(np.array([[0, 0, 0], [1, 2, 3.0]]), light)
    assert is_fan == (len(cap.corners) in (4, 6))


def test_bounds_place_many_casters_at_once():
    low = np.array([[-0.1, 2.9, -0.1], [2.5, 2.9, -0.1], [-0.1, 4.9, -0.1], [-0.01, 2, -0.01]])
    bounds = np.stack([low, low + [[0.2], [0.2], [0.2], [0.02]]], 1)
    bounds = np.append(bounds, [[[-1, -9, 0.3], [1, -8, 0.5]]], 0)
    ahead = find_placements(bounds, make_regions(AHEAD, (0, 5, 0, 1)))
    # Inside the pyramid and the view; beside; around the light; inside; behind the eye.
    assert ahead.case.tolist() == [3, 1, 3, 3, 1]
    assert ahead.undecided.tolist() == [False, False, True, False, False]
    assert (ahead.case != 1).tolist() == [True, False, True, True, False]
    assert ahead.needs_light_cap.tolist() == [True, False, True, True, False]
    assert ahead.needs_dark_cap.tolist() == [False, False, True, False, False]
    assert ahead.dark_cap_is_fan.tolist() == [True, True, False, True, True]
    back = find_placements(
        bounds, make_regions(AHEAD, (0, -15, 0, 1)), is_drawn=bounds[:, 0, 0] > 0
    )
    assert back.case.tolist() == [1, 1, 1, 1, 2]
    assert back.needs_light_cap.tolist() == [True, False, True, True, False]
    assert back.needs_dark_cap.tolist() == [False, False, False, False, True]


def test_what_is_missing_or_empty_is_said():
    with pytest.raises(TypeError, match="camera and a light"):
        find_placement(CUBE)
    nothing = (np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert find_placement(nothing, AHEAD, (0, 5, 0, 1)).case == 1
    assert len(find_placements(np.zeros((0, 2, 3)), make_regions(AHEAD, (0, 5, 0, 1))).case) == 0


def a_view(random):
    """Make a random camera and light, now and then in special position."""
    eye = random.uniform(-8, 8, 3)
    target = eye + random.normal(size=3)
    if random.random() < 0.3:
        target[2] = eye[2]
    near = random.uniform(0.05, 4)
    more = {"fov": random.uniform(20, 120)}
    if random.random() < 0.3:
        more = {"height": random.uniform(1, 12)}
    camera = Camera(eye, target, size=(random.integers(8, 40), 20), near=near, **more)
    kind = random.integers(5)
    light = np.append(random.uniform(-10, 10, 3), 1.0)
    if kind == 0:
        light[3] = 0
    elif kind == 1:
        light = np.array([0, 0, 1.0, 0])
    elif kind == 2:  # in the near plane
        light[:3] = random.uniform(-2, 3, 4) @ find_near_rectangle(camera) / 4
        forward = camera.axes()[2]
        light[:3] -= ((light[:3] - camera.eye) @ forward - near) * forward
    return camera, light


def rectangle_points(camera, n=16):
    corners = find_near_rectangle(camera)
    u, v = (t.ravel()[:, None] for t in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n)))
    return (1 - u) * ((1 - v) * corners[0] + v * corners[1]) + u * (
        (1 - v) * corners[3] + v * corners[2]
    )


@given(st.integers(0, 10**6))
@settings(deadline=None, max_examples=reduce_count(150, 2))
def test_pyramids_hold_every_way_from_the_rectangle_to_the_light(seed):
    random = np.random.default_rng(seed)
    camera, light = a_view(random)
    planes = occlusion_pyramid(camera, light)
    points = rectangle_points(camera, 8)
    for t in (0, 1e-3, 0.4, 1) if light[3] else (0, 1, 1e3):
        ways = points + t * (light[:3] - light[3] * points)
        assert (ways @ planes[:, :3].T + planes[:, 3] >= -1e-9 * (1 + t)).all()


def mesh_of(kind, random):
    if kind == "soup":
        return soup(random, n=12, spread=6, low=-6)
    if kind == "jumble":
        return jumble(random, n=12, low=-6)
    low = random.uniform(-7, 6, (6, 3))
    return merge(*[box(a, a + random.uniform(0.2, 4, 3)) for a in low])


def any_triangle_meets(corners, camera, light, slack):
    """Ask a linear program whether triangles and the pyramid share a point."""
    spans = np.column_stack([find_near_rectangle(camera), np.ones(4)])
    cone = np.append(spans, light[None], 0)
    for three in corners:
        points = np.column_stack([three, np.ones(3)])
        left = np.concatenate([points, -cone]).T  # a points = b cone, weights b not below 0
        sums = np.append(np.ones(3), np.zeros(5))
        # Distance left over, least in the largest coordinate.
        n = left.shape[1]
        upper = np.block([[left[:3], -np.ones((3, 1))], [-left[:3], -np.ones((3, 1))]])
        equal = np.block([[np.append(sums, 0)], [left[3:], np.zeros((1, 1))]])
        answer = linprog(
            np.append(np.zeros(n), 1), A_ub=upper, b_ub=np.zeros(6), A_eq=equal, b_eq=[1, 0]
        )
        if answer.status == 0 and answer.fun <= slack:
            return True
    return False


@pytest.mark.parametrize("kind", ["soup", "jumble", "boxes"])
@given(seed=st.integers(0, 10**6))
@settings(deadline=None, max_examples=reduce_count(60, 2))
def test_case_1_is_given_just_where_the_viewport_is_lit(kind, seed):
    random = np.random.default_rng(seed)
    camera, light = a_view(random)
    vertices, faces = mesh_of(kind, random)
    caster = make_caster(vertices, faces)
    answer = find_placement(caster, camera, light)
    rays = RayCaster(caster.vertices, caster.faces)
    points = rectangle_points(camera)
    pierced = rays.count(
        points, np.full(len(points), -1), camera.apex(), light, caster.face_is_closed
    )
    if pierced.count.any():
        assert answer.case != 1
    side = light @ caster.planes[:, :-1]
    casts = (side > 0) | ((side < 0) & ~caster.face_is_closed)
    corners = caster.vertices[caster.faces[casts]]
    if answer.case == 1:
        assert not any_triangle_meets(corners, camera, light, 0.0)
    elif len(occlusion_pyramid(camera, light)) == 5:  # a light in the near plane is unsafe
        assert any_triangle_meets(corners, camera, light, 1e-4)


@pytest.mark.parametrize("kind", ["soup", "boxes"])
@given(seed=st.integers(0, 10**6))
@settings(deadline=None, max_examples=reduce_count(80, 2))
def test_caps_out_of_view_are_out_of_view(kind, seed):
    random = np.random.default_rng(seed)
    camera, light = a_view(random)
    mesh = mesh_of(kind, random)
    caster = make_caster(*mesh)
    answer = find_placement(caster, camera, light)
    cap = make_light_cap(caster, light).corners[..., :3]
    weights = random.dirichlet([0.6, 0.6, 0.6], 400)
    on_cap = (weights @ cap).reshape(-1, 3)
    x, y, w, _ = (np.column_stack([on_cap, np.ones(len(on_cap))]) @ camera.matrix().T).T
    depth = (on_cap - camera.eye) @ camera.axes()[2]
    cols, rows = camera.size

    def in_picture(x, y, w):
        w = np.where(w > 0, w, np.nan)
        return (x >= -0.5 * w) & (x <= (cols - 0.5) * w) & (y >= -0.5 * w) & (y <= (rows - 0.5) * w)

    if (in_picture(x, y, w) & (depth >= camera.near)).any() and answer.case != 1:
        assert answer.case == 3
        assert answer.needs_light_cap
    if light[3] == 0:
        assert not answer.needs_dark_cap
    elif camera.is_perspective and answer.case != 1:
        away = np.column_stack([on_cap - light[:3], np.zeros(len(on_cap))])
        x, y, w, _ = (away @ camera.matrix().T).T
        assert answer.needs_dark_cap or not in_picture(x, y, w).any()


@given(st.integers(0, 10**6))
@settings(deadline=None, max_examples=reduce_count(60, 2))
def test_bounds_never_promise_more_than_triangles_keep(seed):
    random = np.random.default_rng(seed)
    camera, light = a_view(random)
    low = random.uniform(-9, 9, (40, 3))
    bounds = np.stack([low, low + random.uniform(0.01, 5, (40, 3))], 1)
    regions = make_regions(camera, light)
    rough = find_placements(bounds, regions)
    for k in range(40):
        vertices = box(*bounds[k])[0]
        exact = find_placement((vertices, BOX_FACES), regions=regions)
        assert rough.dark_cap_is_fan[k] == exact.dark_cap_is_fan
        assert exact.case == 1 or rough.case[k] != 1
        assert rough.case[k] == exact.case or rough.undecided[k]
        assert rough.needs_light_cap[k] or not exact.needs_light_cap
        assert rough.needs_dark_cap[k] or not exact.needs_dark_cap


def test_a_shut_out_sheet_is_case_1_whatever_its_size():
    ground = sheet([(-1e5, -1e5, -2), (1e5, -1e5, -2), (1e5, 1e5, -2), (-1e5, 1e5, -2)])
    assert placed(ground, AHEAD, (3, 2, 5, 0)) == (1, False, False)
    assert placed(ground, AHEAD, (3, 2, -5, 0)) == (3, True, False)
