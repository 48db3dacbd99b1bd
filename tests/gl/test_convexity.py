"""Which components are convex: in the small, at every edge and around every vertex."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.gl_judge import Judge
from support.shapes import box, torus_knot
from support.spheres import make_sphere
from support.sweeps import reduce_count

from umbra.gl.convexity import Balls, find_balls, find_convex
from umbra.gl.flags import LOW
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.selection import VolumeOptions
from umbra.rays.depth import GROUND
from umbra.scene import Camera, directional_light, make_scene, point_light
from umbra.volume.adjacency import make_caster, make_planes


def is_convex(vertices, faces):
    """Ask whether all that a soup consists of is convex."""
    caster = make_caster(np.asarray(vertices, float), np.asarray(faces, np.int32))
    planes = make_planes(caster.vertices, caster.faces)
    volumes = np.bincount(caster.component, -planes[3, :-1], len(caster.is_closed))
    balls = Balls.of(caster, caster.is_closed)
    return bool(find_convex(caster, caster.vertices, planes, volumes, balls).all())


def make_star(points=5, step=2, height=1.0):
    """Make the bipyramid over a star polygon: its faces wind ``step`` times around its axis."""
    turn = 2 * np.pi * step * np.arange(points) / points
    rim = np.stack([np.cos(turn), np.sin(turn), np.zeros(points)], 1)
    vertices = np.concatenate([rim, [[0, 0, height], [0, 0, -height]]])
    k = np.arange(points)
    after, top, bottom = (k + 1) % points, np.full(points, points), np.full(points, points + 1)
    return vertices, np.concatenate([np.stack([k, after, top], 1), np.stack([after, k, bottom], 1)])


def make_bowl(segments=24, rings=8, depth=0.5, wall=0.05):
    """Make a hemispherical bowl with an inside and an outside."""
    turn, rise = 2 * np.pi * np.arange(segments) / segments, np.linspace(0.08, np.pi / 2, rings)
    shells = []
    for radius in (1.0, 1.0 - wall):
        ring = np.stack(np.meshgrid(rise, turn, indexing="ij"), -1).reshape(-1, 2)
        shells.append(
            radius * np.stack([np.sin(ring[:, 0]) * np.cos(ring[:, 1]),
                               np.sin(ring[:, 0]) * np.sin(ring[:, 1]),
                               -2 * depth * np.cos(ring[:, 0])], 1)
        )  # fmt: skip
    n, faces = segments * rings, []
    for k in range(rings - 1):
        for s in range(segments):
            a, b = k * segments + s, k * segments + (s + 1) % segments
            c, d = a + segments, b + segments
            faces += [(a, d, b), (a, c, d), (n + a, n + b, n + d), (n + a, n + d, n + c)]
    low = 2 * n
    for s in range(segments):
        a, b = s, (s + 1) % segments
        c, d = (rings - 1) * segments + a, (rings - 1) * segments + b
        faces += [(a, b, low), (n + b, n + a, low + 1), (c, n + c, n + d), (c, n + d, d)]
    ends = np.array([[0, 0, -2 * depth], [0, 0, -2 * depth * (1 - wall)]])
    return np.concatenate([*shells, ends]), np.array(faces)


def turn_outward(vertices, faces):
    """Wind a closed soup so that it encloses a positive volume."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    volume = np.einsum("ij,ij->", a, np.cross(b, c))
    return (vertices, faces) if volume > 0 else (vertices, faces[:, ::-1])


def subdivide(vertices, faces, times=1):
    """Cut each face into four coplanar ones."""
    for _ in range(times):
        corners = vertices[faces]
        middles = (corners + np.roll(corners, -1, axis=1)) / 2
        (a, b, c), (d, e, f) = corners.transpose(1, 0, 2), middles.transpose(1, 0, 2)
        parts = ((a, d, f), (d, b, e), (f, e, c), (d, e, f))
        vertices = np.concatenate([np.stack(part, 1).reshape(-1, 3) for part in parts])
        faces = np.arange(len(vertices)).reshape(-1, 3)
    return vertices, faces


FAR = st.tuples(*[st.sampled_from((0.0, 1.0, 1234.5, -70_000.0))] * 3).map(np.array)
SCALES = st.sampled_from((1e-3, 0.3, 1.0, 50.0, 1e4))
SPHERE = make_sphere(2, 1.0, (0, 0, 0))
TURNS = st.integers(0, 1000).map(
    lambda seed: np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
)


def place(mesh, scale, far, turn):
    vertices, faces = mesh
    turn = turn * np.sign(np.linalg.det(turn))
    return scale * (np.asarray(vertices, float) @ turn.T) + far, np.asarray(faces)


@settings(deadline=None, max_examples=reduce_count(60, 2))
@given(st.integers(0, 10_000), SCALES, TURNS, st.integers(0, 2))
def test_hulls_are_convex_however_large_and_however_they_are_cut(seed, scale, turn, times):
    points = np.random.default_rng(seed).normal(size=(12, 3))
    from scipy.spatial import ConvexHull  # noqa: PLC0415

    hull = ConvexHull(points)
    faces = hull.simplices.copy()
    a, b, c = points[faces].transpose(1, 0, 2)
    flipped = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[flipped] = faces[flipped][:, ::-1]
    mesh = subdivide(points, faces, times)
    assert is_convex(*place(mesh, scale, np.zeros(3), turn))


@pytest.mark.parametrize("shape", ["box", "sphere", "cut box", "wall of float32"])
def test_shapes_known_to_be_convex(shape):
    mesh = {
        "box": box((0, 0, 0), (40, 0.2, 3)),
        "sphere": (SPHERE.vertices, SPHERE.faces),
        "cut box": subdivide(*map(np.asarray, box((0, 0, 0), (4, 1, 3))), 3),
        "wall of float32": (np.float32(np.asarray(box((1, 1, 0), (40, 1.3, 3))[0]) / 3),
                            box((0, 0, 0), (1, 1, 1))[1]),
    }[shape]  # fmt: skip
    assert is_convex(*mesh)


@settings(deadline=None, max_examples=reduce_count(60, 2))
@given(st.sampled_from(((5, 2), (7, 2), (7, 3), (9, 4))), st.floats(0.2, 20), SCALES, FAR, TURNS)
def test_stars_wind_more_than_once_around_their_tips(star, height, scale, far, turn):
    assert not is_convex(*place(turn_outward(*make_star(*star, height)), scale, far, turn))


@settings(deadline=None, max_examples=reduce_count(60, 2))
@given(st.integers(6, 60), st.integers(3, 20), st.floats(0.01, 0.3), SCALES, FAR, TURNS)
def test_bowls_are_not_convex_at_any_scale(segments, rings, wall, scale, far, turn):
    bowl = turn_outward(*make_bowl(segments, rings, wall=wall))
    assert not is_convex(*place(bowl, scale, far, turn))


def test_a_trough_of_slivers_is_not_convex():
    """Strips of 10 m by some millimetres: each rises by less than 1e-6 of its length."""
    turn = np.linspace(0, np.pi, 1500)
    rims = [np.stack([r * np.cos(turn), -r * np.sin(turn)], 1) for r in (0.5, 0.45)]
    ring = np.concatenate([rims[0], rims[1][::-1]])
    n = len(ring)
    ends = [np.column_stack([np.full(n, x), ring]) for x in (0.0, 10.0)]
    k, after = np.arange(n), (np.arange(n) + 1) % n
    faces = [np.stack([k, after, n + k], 1), np.stack([after, n + after, n + k], 1)]
    half = len(turn)
    i = np.arange(half - 1)
    for first, flip in ((0, 1), (n, -1)):
        inner = first + n - 1 - i
        caps = np.concatenate([
            np.stack([first + i, inner, first + i + 1], 1),
            np.stack([first + i + 1, inner, inner - 1], 1),
        ])  # fmt: skip
        faces.append(caps[:, ::flip])
    mesh = turn_outward(np.concatenate(ends), np.concatenate(faces))
    caster = make_caster(mesh[0], mesh[1].astype(np.int32))
    assert caster.is_closed.all()
    assert not is_convex(*mesh)


@pytest.mark.parametrize("shape", ["twice", "inward", "flat", "sliver", "open", "knot"])
def test_what_is_no_solid_is_not_convex(shape):
    vertices, faces = map(np.asarray, box((0, 0, 0), (1, 2, 3)))
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [2, 1, 0]])
    sliver = faces[1:], faces[0]
    edge = np.concatenate([vertices, [(vertices[sliver[1][0]] + vertices[sliver[1][1]]) / 2]])
    a, b, c = sliver[1]
    mesh = {
        "twice": (np.concatenate([vertices, vertices]), np.concatenate([faces, faces + 8])),
        "inward": (vertices, faces[:, ::-1]),
        "flat": flat,
        # A face of no area fills the T-junction in an edge.
        "sliver": (edge, np.concatenate([sliver[0], [[a, 8, c], [8, b, c], [a, b, 8]]])),
        "open": (vertices, faces[1:]),
        "knot": torus_knot(40, 8),
    }[shape]
    caster = make_caster(np.asarray(mesh[0], float), np.asarray(mesh[1], np.int32))
    planes = make_planes(caster.vertices, caster.faces)
    volumes = np.bincount(caster.component, -planes[3, :-1], len(caster.is_closed))
    balls = Balls.of(caster, find_balls(caster))
    assert not find_convex(caster, caster.vertices, planes, volumes, balls).any()


SHORT = VolumeOptions(narrow=False, shorten=True)


def join(*meshes):
    """Join soups."""
    firsts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [np.asarray(faces) + k for (_, faces), k in zip(meshes, firsts, strict=False)]
    return np.concatenate([np.asarray(mesh[0], float) for mesh in meshes]), np.concatenate(faces)


def is_on_ground(view):
    """Tell which pixels show the ground: short volumes leave faces turned from the light at 0."""
    return view.face == GROUND


def lift(mesh, z, scale=1.0, x=0.0, y=0.0):
    return np.asarray(mesh[0], float) * scale + (x, y, z), mesh[1]


def test_a_lamp_in_the_ball_around_a_caster_may_shine_anywhere(device):
    slab, crate = box((-20, -1.5, 5), (6, 1.5, 5.2)), box((3.5, -1, 2.7), (5.5, 1, 3.3))
    camera = Camera((4.5, -9, 6), (4.5, 0, 1), size=(156, 78))
    with Judge(device, join(slab, crate), choices=SHORT) as scene:
        verdicts, counts = scene.judge(camera, point_light((1, 0, 5.9)))
        verdicts.check(0.01)
        assert (counts > 0).sum() > 500


@pytest.mark.parametrize("light", [directional_light((0.4, -0.3, 1)), point_light((3, -2, 9))])
@pytest.mark.parametrize("scale", [1.0, 0.3])
def test_shadows_of_a_star_are_those_of_its_faces(device, light, scale):
    star = lift(turn_outward(*make_star()), 3, scale)
    camera = Camera((4, -6, 7), (0, 0, 1.5), size=(100, 90), fov=45)
    with Judge(device, star, choices=SHORT) as scene:
        scene.judge(camera, light)[0].check(0.01)
        assert not scene.counter.plan.selection.find(LOW).any()


@pytest.mark.parametrize("radius", [0.3, 2.0])
def test_a_fine_bowl_in_a_scene_of_kilometres_keeps_its_own_shadow(device, radius):
    place = 3000.0, -2000.0
    bowl = lift(turn_outward(*make_bowl(200, 60)), 4, radius, *place)
    city = (
        box((0, 0, 0), (5, 5, 5)),
        box((6000, 0, 0), (6005, 5, 5)),
        box((0, -4000, 0), (1, -3999, 9)),
    )
    camera = Camera((3000, -2000 - 3 * radius, 4 + 4 * radius), (*place, 4 - radius / 2),
                    size=(80, 60), fov=40)  # fmt: skip
    with Judge(device, join(bowl, *city), choices=SHORT) as scene:
        scene.judge(camera, directional_light((0.8, 0.1, 0.6)))[0].check(0.03)


def test_stacked_stars_do_not_wrap_around(device):
    """Each ray through a tip meets two lit faces: 128 of them are 256."""
    flat = turn_outward(*make_star(height=0.02))
    stars = join(*(lift(flat, 2 + 0.1 * k) for k in range(128)))
    camera = Camera((0, -6, 18), (0, 0, 0), size=(60, 60), fov=12)
    with Judge(device, stars) as scene:
        verdicts, counts = scene.judge(
            camera, directional_light((0, 0, 1)), "auto", "z-fail", where=is_on_ground
        )
        verdicts.check(0.02)
        assert counts.max() >= 0
        assert scene.counter.plan.statistics.deepest >= 256


@pytest.mark.parametrize("method", ["alpha", "screen"])
def test_masks_take_stars_apart(device, method):
    star = lift(turn_outward(*make_star()), 3, 1.5)
    camera = Camera((4, -6, 7), (0, 0, 1.5), size=(100, 75))
    sun = directional_light((0.1, 0.1, 1))
    with GlFrameCounter(make_scene(*star), ground=0.0, device=device) as counter:
        view, _ = counter.see(camera)
        right, found = (counter.count(view, camera, sun, each) > 0 for each in ("auto", method))
        assert (found != right).sum() <= 5  # pixels at edges
        assert right.sum() > 200


def make_random(random):
    """Make a random solid: a star, a bowl, a hull, or a doubled shell, of some size."""
    kind, scale = random.integers(5), random.uniform(0.4, 1.6)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    if kind == 0:
        mesh = make_star(*((5, 2), (7, 3))[random.integers(2)], random.uniform(0.3, 2))
    elif kind == 1:
        mesh = make_bowl(int(random.integers(6, 16)), int(random.integers(3, 7)))
    elif kind == 2:
        mesh = SPHERE.vertices, SPHERE.faces
    elif kind == 3:
        mesh = join(box((-1, -1, -1), (1, 1, 1)), box((-1, -1, -1), (1, 1, 1)))
    else:
        mesh = box((-1, -0.2, -0.5), random.uniform(0.1, 2, 3))
    vertices, faces = place(turn_outward(*map(np.asarray, mesh)), scale, np.zeros(3), turn)
    return vertices + random.uniform((-5, -5, 3), (5, 5, 7)), faces


@settings(deadline=None, max_examples=reduce_count(25, 2))
@given(st.integers(0, 100_000), st.sampled_from((0.0, 2500.0)))
def test_shadows_of_random_solids_on_the_ground_are_those_of_rays(shared_device, seed, far):
    random = np.random.default_rng(seed)
    solids = [make_random(random) for _ in range(random.integers(1, 6))]
    vertices, faces = join(*solids)
    aside = np.array([far, -2 * far, 0.0])
    light = directional_light(random.normal(size=3) * (1, 1, 0.2) + (0, 0, 1.2))
    if random.random() < 0.6:
        light = point_light(random.uniform((-5, -5, 4), (5, 5, 12)) + aside)
    camera = Camera(aside + (9, -14, 9), aside + (0, 0, 1), size=(48, 36))
    with Judge(shared_device, (vertices + aside, faces), choices=SHORT) as scene:
        scene.judge(camera, light, where=is_on_ground)[0].check(0.02)
