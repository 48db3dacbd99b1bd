"""Ways from single points to the sun: against the float64 ray caster, and the counts."""

import numpy as np
import pytest
from support.judge import on_plane
from support.raycaster import RayCaster
from support.shapes import SCENES, box, merge, sheet

from umbra.cpu.plane import PlaneSweep
from umbra.rays.face_tree import make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.scene.grid import Grid
from umbra.volume.adjacency import make_caster

EDGE = 1e-6


def make_suns(rng, n):
    suns = rng.normal(size=(n, 3))
    suns[:, 2] = np.abs(suns[:, 2]) + 0.05
    return suns / np.linalg.norm(suns, axis=1, keepdims=True)


def scatter(rng, vertices, faces, n=1200):
    """Give points on faces, each with the normal of one of its sides."""
    own = rng.integers(0, len(faces), n)
    corners = vertices[faces[own]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    kept = length > 1e-9
    points = np.einsum("ij,ijk->ik", rng.dirichlet([1, 1, 1], n), corners)[kept]
    normals = normals[kept] / length[kept, None] * rng.choice([-1, 1], kept.sum())[:, None]
    return points, normals, own[kept]


@pytest.mark.parametrize("name", list(SCENES))
def test_points_on_faces_agree_with_the_ray_caster(name):
    rng = np.random.default_rng(3)
    vertices, faces = SCENES[name]()
    points, normals, own = scatter(rng, vertices, faces)
    suns = make_suns(rng, 6)
    masks = find_hidden(make_face_tree(make_caster(vertices, faces)), points, normals, suns, 2)
    rays, open_rule = RayCaster(vertices, faces), np.zeros(len(faces), bool)
    for sun, mask in zip(suns, masks):
        facing = np.flatnonzero(normals @ sun > 0)
        assert mask[normals @ sun <= 0].all()  # attached
        light = np.append(sun, 0.0)
        # Seen from the sun's own side: of what touches the point nothing is between.
        pierced = rays.count(points[facing], own[facing], light, light, open_rule)
        differ = facing[(pierced.any != (mask[facing] > 0)) & (pierced.touching == 0)]
        apart = rays.distance_to_shadow_edges(
            points[differ], normals[differ], own[differ], light, open_rule
        )
        assert (apart <= EDGE).all()
        assert len(differ) <= 2


@pytest.mark.parametrize("name", list(SCENES))
def test_points_on_a_plane_agree_with_its_counts(name):
    vertices, faces = SCENES[name]()
    grid = Grid(-9.0371, -8.9137, 0.37, 0.41, 48, 44)
    suns = make_suns(np.random.default_rng(4), 8)
    caster = make_caster(vertices, faces)
    seen = on_plane(grid, 0.0)
    masks = find_hidden(make_face_tree(caster), seen.points, np.array(seen.normals), suns)
    counts = PlaneSweep(caster, grid, 0.0).counts(suns).reshape(len(suns), -1)
    assert (masks != (counts != 0)).sum() <= 3
    assert 0 < masks.mean() < 1


def test_a_point_between_two_coplanar_walls_sees_what_its_own_side_sees():
    # Two sheets in one place, a third behind them: the front sees the sun, the back does not.
    front = sheet([(0, 0, 0), (4, 0, 0), (4, 0, 4), (0, 0, 4)])
    tree = make_face_tree(make_caster(*merge(front, front)))
    points = np.array([(1.3, 0.0, 1.1), (1.3, 0.0, 1.1)])
    normals = np.array([(0.0, -1.0, 0.0), (0.0, 1.0, 0.0)])
    south = np.array([[0.1, -0.8, 0.6]])
    np.testing.assert_array_equal(find_hidden(tree, points, normals, south), [[0, 1]])
    np.testing.assert_array_equal(find_hidden(tree, points, normals, -south), [[1, 0]])


def test_nothing_hides_nothing():
    tree = make_face_tree(make_caster(np.zeros((3, 3)), np.zeros((0, 3), np.int32)))
    up = np.array([[0.0, 0.0, 1.0]])
    assert not find_hidden(tree, np.zeros((1, 3)), up, up).any()


def test_many_faces_in_one_place_and_deep_trees_are_found():
    # Sizes that fall by half each time make a lopsided tree.
    scale = 0.5 ** np.arange(900.0)
    corner = np.array([(0, 0, 5), (1, 0, 5), (0, 1, 5)], float)
    vertices = (corner * np.stack([scale, scale, np.ones(900)], 1)[:, None]).reshape(-1, 3)
    faces = np.arange(2700, dtype=np.int32).reshape(-1, 3)
    tree = make_face_tree(
        make_caster(vertices, np.concatenate([faces, np.tile(faces[:1], (500, 1))]))
    )
    up = np.array([[0.0, 0.0, 1.0]])
    points = np.array([(0.2, 0.2, 0.0), (0.7, 0.7, 0.0)])
    np.testing.assert_array_equal(find_hidden(tree, points, np.repeat(up, 2, 0), up), [[1, 0]])


@pytest.mark.parametrize("below", [1e-7, 1e-9])
def test_a_point_a_hair_under_a_roof_is_in_its_shadow(below):
    # No distance of ours decides what lies on what: only what float64 can tell does.
    roof = sheet([(-5, -5, 4), (5, -5, 4), (5, 5, 4), (-5, 5, 4)])
    tree = make_face_tree(make_caster(*roof))
    up = np.array([[0.0, 0.0, 1.0]])
    points = np.array([(0.3, 0.2, 4 - below), (0.3, 0.2, 4.0), (0.3, 0.2, 4 + below)])
    for sun in (up, np.array([[0.6, 0.0, 0.8]])):
        assert find_hidden(tree, points, np.repeat(up, 3, 0), sun).tolist() == [[1, 0, 0]]


def test_how_far_a_model_lies_from_zero_says_what_is_on_a_roof():
    # Coordinates of 5,000 km have digits of 1 nm: a point 2 nm under a roof may be meant on it.
    roof = sheet([(-5, -5, 4), (5, -5, 4), (5, 5, 4), (-5, 5, 4)])
    up = np.array([[0.0, 0.0, 1.0]])
    points = np.array([(0.3, 0.2, 4 - 2e-9)])
    assert find_hidden(make_face_tree(make_caster(*roof), 5e6), points, up, up).tolist() == [[0]]
    assert find_hidden(make_face_tree(make_caster(*roof)), points, up, up).tolist() == [[1]]


def test_a_face_behind_a_fold_hides_nothing():
    # A ridge from west to east; its north slope ends 0.1 um beside it, whoever stands on the
    # south slope there looks to the south, and the north slope is behind.
    rng = np.random.default_rng(2)
    ridge = np.array([(-4.0, 0, 3), (4.0, 0, 3)])
    south = sheet([(-4, -3, 1), (4, -3, 1), *ridge[::-1].tolist()])
    north = sheet([*ridge.tolist(), (4, 3, 1), (-4, 3, 1)])
    tree = make_face_tree(make_caster(*merge(south, north)))
    normal = np.array([0.0, -2, 3]) / np.sqrt(13)
    x = rng.uniform(-3, 3, 200)
    for down in (0.0, 1e-13, 1e-9, 1e-7):
        points = np.stack([x, np.full(200, -3 * down), np.full(200, 3 - 2 * down)], 1)
        suns = np.array([(0.1, -0.9, 0.4), (-0.3, -0.2, 0.9), (0.2, 0.5, 0.8)])
        suns /= np.linalg.norm(suns, axis=1, keepdims=True)
        masks = find_hidden(tree, points, np.tile(normal, (200, 1)), suns)
        assert not masks.any(), down


def is_dark_by_hand(boxes, x, y, sun):
    """Tell whether a box hides the sun from points of the ground, none of which is on an edge."""
    dark = np.zeros(x.shape, bool)
    for low, high in boxes:
        enter, leave = np.zeros(x.shape), np.full(x.shape, np.inf)
        for k, place in enumerate((x, y, np.zeros_like(x))):
            if sun[k] == 0:
                leave = np.where((place <= low[k]) | (place >= high[k]), -1.0, leave)
                continue
            ways = (low[k] - place) / sun[k], (high[k] - place) / sun[k]
            enter, leave = (
                np.maximum(enter, np.minimum(*ways)),
                np.minimum(leave, np.maximum(*ways)),
            )
        dark |= leave > enter
    return dark


@pytest.mark.parametrize("seed", range(4))
def test_boxes_that_touch_tell_one_story(seed):
    # Boxes, cells and suns on whole numbers: rays run along walls, through edges and corners.
    # Where all places about a cell are in shadow, or none is, so is the cell.
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(-8, 9.0), np.arange(-8, 9.0))
    for _ in range(60):
        low = rng.integers(-3, 3, (rng.integers(2, 5), 3)) * (1, 1, 0)
        boxes = [(one, one + rng.integers(1, 4, 3)) for one in low]
        vertices, faces = merge(*[box(*one) for one in boxes])
        suns = rng.integers((-2, -2, 1), (3, 3, 4), (6, 3)).astype(float)
        suns[np.arange(6), rng.integers(0, 2, 6)] *= rng.random(6) < 0.4
        scale = rng.choice([1.0, 0.3, 0.1])
        caster = make_caster(vertices * scale, faces)
        grid = Grid(-8 * scale, -8 * scale, scale, scale, 17, 17)
        unit = suns / np.linalg.norm(suns, axis=1, keepdims=True)
        plane = PlaneSweep(caster, grid, 0.0).masks(unit)
        places = on_plane(grid, 0.0)
        rays = find_hidden(make_face_tree(caster), places.points, np.array(places.normals), unit)
        for sun, *found in zip(suns, plane, rays.reshape(plane.shape)):
            about = [
                is_dark_by_hand(boxes, x + 1e-4 * a, y + 1e-4 * b, sun)
                for a, b in ((1, 0.7), (-1, 0.7), (1, -0.7), (-1, -0.7), (0.6, 1), (-0.6, -1))
            ]
            every, none = np.all(about, 0), ~np.any(about, 0)
            for mask in found:
                assert mask[every].all()
                assert not mask[none].any()


WALLS = {
    "south": (0, -1, 0), "north": (0, 1, 0), "west": (-1, 0, 0), "east": (1, 0, 0),
    "roof": (0, 0, 1), "slanted": (1, 1, 1),
}  # fmt: skip


def make_hut():
    """Make a box of which a slanted face cuts a corner, as a soup."""
    vertices, faces = map(np.asarray, box((0, 0, 0), (8, 6, 5)))
    vertices = np.asarray(vertices, np.float64)
    # The corner that is farthest along the slanted face's normal becomes three.
    corner = int(vertices.sum(1).argmax())
    points, soup = list(vertices), []
    for face in faces:
        if corner not in face:
            soup.append(face)
            continue
        k = list(face).index(corner)
        after, before = face[(k + 1) % 3], face[(k + 2) % 3]
        # Where the face's plane meets the cut: on its sides, or on a diagonal.
        ends = []
        for other in (after, before):
            way = vertices[other] - vertices[corner]
            part = 2.0 / -way.sum()
            points.append(vertices[corner] + part * way)
            ends.append(len(points) - 1)
        soup += [(ends[0], after, before), (ends[0], before, ends[1])]
    return np.array(points), soup, corner


def find_places(normal, random):
    """Find places on the hut's face of a normal, not near its edges, and the unit normal."""
    low, high = np.array([0.5, 0.5, 0.5]), np.array([5.0, 3.0, 2.5])
    places = random.uniform(low, high, (8, 3))
    size = np.array([8.0, 6.0, 5.0])
    normal = np.array(normal, float)
    if normal.all():
        shares = random.dirichlet((4, 4, 4), 8)
        return size - 2.0 * shares, normal / np.sqrt(3)
    axis = int(np.abs(normal).argmax())
    places[:, axis] = size[axis] if normal[axis] > 0 else 0.0
    return places, normal


@pytest.mark.parametrize("name", WALLS)
@pytest.mark.parametrize("far", [0.0, 1000.0])
def test_a_point_without_a_normal_sees_what_either_side_of_its_wall_sees(name, far):
    points, soup, corner = make_hut()
    faces = [tuple(map(int, face)) for face in soup]
    rim = {k for face in faces for k in face if k >= 8}
    order = {tuple(np.round(points[k], 9)): k for k in sorted(rim, reverse=True)}
    ring = sorted(order.values(), key=lambda k: np.arctan2(*(points[k] - points[corner])[:2]))
    # Close the cut by a fan about its middle.
    points = np.concatenate([points, [points[ring].mean(0)]])
    for a, b in zip(ring, ring[1:] + ring[:1]):
        way = np.cross(points[a] - points[-1], points[b] - points[-1])
        faces.append((a, b, len(points) - 1) if way.sum() > 0 else (b, a, len(points) - 1))
    vertices = points + (far, -far, 0.0)
    soup = np.array(faces, np.int32)
    caster = make_caster(vertices, soup)
    assert caster.is_closed.all()
    random = np.random.default_rng(1)
    places, normal = find_places(WALLS[name], random)
    places = places + (far, -far, 0.0)
    suns = random.normal(size=(300, 3))
    suns[:, 2] = np.abs(suns[:, 2]) + 0.02
    suns /= np.linalg.norm(suns, axis=1, keepdims=True)
    tree = make_face_tree(caster)
    free = np.full(places.shape, np.nan)
    found = find_hidden(tree, places, free, suns)
    rays, eye, own = RayCaster(vertices, soup), np.array([0.1, 0.2, 1, 0]), np.full(len(places), -1)
    closed = np.zeros(len(soup), bool)
    right = np.ones_like(found)
    for side in (1e-5, -1e-5):
        beside = places + side * normal
        for k, sun in enumerate(suns):
            right[k] &= rays.count(beside, own, eye, np.append(sun, 0.0), closed).any
    np.testing.assert_array_equal(found, right)
    # Of a solid no sun behind a wall reaches it: as with the outward normal.
    outward = find_hidden(tree, places, np.broadcast_to(normal, places.shape).copy(), suns)
    np.testing.assert_array_equal(found, outward)
    assert 0 < found.mean() < 1 or name == "roof"


def test_a_point_without_a_normal_on_a_sheet_is_lit_from_both_sides():
    vertices, faces = sheet([(0, 0, 0), (4, 0, 0), (4, 0, 3), (0, 0, 3)])
    tree = make_face_tree(make_caster(np.asarray(vertices, float), np.asarray(faces, np.int32)))
    suns = np.array([[0.1, 0.7, 0.5], [0.1, -0.7, 0.5], [0.0, 0.0, 1.0]])
    suns /= np.linalg.norm(suns, axis=1, keepdims=True)
    assert not find_hidden(tree, np.array([[1.0, 0.0, 1.0]]), np.full((1, 3), np.nan), suns).any()
