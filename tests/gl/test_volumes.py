"""Volumes as index lists: instances, what is kept, what travels, what is left out."""

import weakref
from dataclasses import replace

import numpy as np
import pytest
from support.gl_judge import Judge
from support.shapes import HOUSE, box, city, jumble, merge, moved, torus_knot

from umbra.cpu.frame import FrameCounter
from umbra.gl import volumes
from umbra.gl.bodies import make_bodies
from umbra.gl.flags import SIDES, VolumeSelection
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.geometry import BLOCK, Geometry, make_groups
from umbra.gl.planner import Planner
from umbra.gl.projection import make_projection
from umbra.gl.selection import VolumeOptions
from umbra.gl.volumes import make_volumes
from umbra.scene import Camera, Mesh, Part, directional_light, make_scene, point_light

SIZE = (48, 40)
CAMERA = Camera((20, -25, 14), (0, 0, 3), size=SIZE)
LAMP = point_light((8, -3.3, 20))
SUN = directional_light((0.4, 0.3, 0.7))


def place(x, y, z=0.0, turn=0.0, stretch=(1, 1, 1)):
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.diag(stretch)
    matrix[:3, 3] = x, y, z
    return matrix


def instances(mesh, transforms):
    shared = Mesh(*mesh)
    return make_scene([Part(f"{i}", "", shared, t) for i, t in enumerate(transforms)])


TRANSFORMS = [
    place(-7, -4, turn=20),
    place(6, 3, 1.0, turn=-50, stretch=(0.5, 1.2, 0.8)),
    place(-4, 7, turn=10, stretch=(-1, 1, 1)),  # mirrored
    place(6, -7, stretch=(0.7, 0.7, -0.5)),  # and upside down
]


def compare(device, scene, camera, light, method="auto"):
    with GlFrameCounter(scene, ground=0.0, device=device) as ours:
        view, _ = ours.see(camera)
        counts = ours.count(view, camera, light, method)
    cpu = FrameCounter(scene, ground=0.0)
    right, _ = cpu.see(camera)
    same = right.face == view.face
    assert same.mean() > 0.98  # two walls in one plane are a tie
    return counts[same], cpu.count(right, camera, light)[same]


@pytest.mark.parametrize(
    "light", [LAMP, SUN, point_light((0.3, 1, 2)), directional_light((1, 2, -1))]
)
@pytest.mark.parametrize("mesh", [HOUSE, moved(torus_knot(40, 8), (0, 0, -4))], ids=["box", "knot"])
def test_instances_share_a_mesh_and_cast_as_copies_do(device, mesh, light):
    scene = instances(mesh, TRANSFORMS)
    for method in "auto", "z-fail":
        for camera in CAMERA, Camera((-6.5, -4, 2), (3, 3, 1), size=SIZE):
            counts, right = compare(device, scene, camera, light, method)
            assert (counts != right).mean() < 0.002


def test_instances_store_their_points_once(device):
    mesh = torus_knot(40, 8)
    one, many = (Geometry(device, instances(mesh, TRANSFORMS[:n])) for n in (1, 4))
    assert one._buffers[0]._buffer.size == many._buffers[0]._buffer.size
    assert many.n_points == 4 * one.n_points
    assert one.n_points % BLOCK == 0
    one.release()
    many.release()


def test_parts_of_one_name_and_transform_close_together(device):
    # A box in two parts, as a glTF mesh of two materials: closed only as a whole.
    vertices, faces = HOUSE
    transform = place(1, 2, turn=30)
    parts = [Part("house", kind, Mesh(vertices, faces[some]), transform)
             for kind, some in (("walls", slice(4, 12)), ("rest", slice(0, 4)))]  # fmt: skip
    scene = make_scene(parts)
    (group,) = make_groups(scene)
    assert group.parts == (0, 1)
    counts, right = compare(device, scene, CAMERA, SUN)
    assert set(np.unique(counts)) == {0, 1}
    assert (counts != right).mean() < 0.002


@pytest.mark.parametrize("stretch", [(1, 1, 0), (0, 1, 1), (0, 0, 1)])
def test_a_transform_that_flattens(device, stretch):
    scene = instances(HOUSE, [*TRANSFORMS[:2], place(1, -6, 3, turn=20, stretch=stretch)])
    assert [group.transform is None for group in make_groups(scene)] == [False, False, True]
    for light in LAMP, SUN:
        counts, right = compare(device, scene, CAMERA, light)
        assert (counts != right).mean() < 0.002


@pytest.mark.parametrize("steps", [np.diag([1.0, 1, 1, 1]), place(3, 1, 0.5, turn=40)])
def test_a_moved_instance_casts_from_where_it_is(device, steps):
    scene = instances(HOUSE, TRANSFORMS)
    later = instances(HOUSE, [steps @ TRANSFORMS[0], *TRANSFORMS[1:]])
    with GlFrameCounter(scene, ground=0.0, device=device) as ours:
        view, _ = ours.see(CAMERA)
        ours.count(view, CAMERA, LAMP)
        ours.planner.move(later)
        ours.scene, ours.triangles = later, later.triangles()
        view, _ = ours.see(CAMERA)
        counts = ours.count(view, CAMERA, LAMP)
    cpu = FrameCounter(later, ground=0.0)
    right, _ = cpu.see(CAMERA)
    same = right.face == view.face
    assert same.mean() > 0.98  # two walls in one plane are a tie
    assert (counts != cpu.count(right, CAMERA, LAMP))[same].mean() < 0.002


@pytest.fixture
def planner(device):
    made = []

    def make(mesh, **options):
        scene = make_scene(*mesh)
        geometry = Geometry(device, scene)
        made.extend([Planner(device, scene, geometry, ground=0.0, **options), geometry])
        projection = make_projection(CAMERA, scene.origin, scene.bounds()[None], 0.0)
        return made[-2], projection

    yield make
    for each in made:
        each.release()


def test_what_travels_is_counted(planner):
    # A box in the sun: 3 lit faces, 6 silhouette edges.
    plans, projection = planner(HOUSE)
    (sun,) = plans.plan(projection, [SUN], "z-fail", choices=VolumeOptions(cut=False))
    assert sun.statistics.sides == 6  # one triangle an edge, they meet at infinity
    assert sun.statistics.dark_caps == 0
    assert sun.statistics.light_caps == 6
    assert sun.statistics.index_bytes == 6 * (6 + 6)
    (lamp,) = plans.plan(projection, [LAMP], "z-fail", choices=VolumeOptions(cut=False, cull=False))
    assert lamp.statistics.sides == 12
    assert lamp.statistics.dark_caps == 4  # a fan over six edges
    assert lamp.statistics.index_bytes == 6 * (12 + 4 + 6)
    (cut,) = plans.plan(projection, [SUN], "z-fail")
    assert (cut.statistics.sides, cut.statistics.dark_caps, cut.statistics.cut) == (12, 4, 1)
    (passed,) = plans.plan(projection, [SUN])
    assert passed.statistics.cases == (1, 0, 0)
    assert passed.statistics.sides_z_pass == passed.statistics.sides == 12
    assert passed.statistics.light_caps == passed.statistics.dark_caps == 0


def test_indices_are_short_where_they_fit(planner):
    small, projection = planner(city(3))
    large, _ = planner(torus_knot(400, 90))
    assert small.indices.dtype.itemsize == 2
    assert large.indices.dtype.itemsize == 4
    (plan,) = large.plan(projection, [LAMP])
    assert plan.statistics.index_bytes == 12 * (
        plan.statistics.sides + plan.statistics.dark_caps + plan.statistics.light_caps
    )


def test_nothing_is_done_while_nothing_moves(planner, monkeypatch):
    plans, projection = planner(city(3))
    first = plans.plan(projection, [LAMP, SUN])
    uploads = []
    monkeypatch.setattr(plans.indices, "write", lambda *lists, **_: uploads.append(lists))
    assert plans.plan(projection, [LAMP, SUN]) is first
    assert not uploads
    volumes = [list(kept) for kept in plans._plans._kept]
    other = Camera((22, -20, 9), (0, 0, 3), size=SIZE)
    moved_eye = make_projection(other, plans.scene.origin, plans.scene.bounds()[None], 0.0)
    plans.plan(moved_eye, [LAMP, SUN])
    assert len(uploads) == 1  # for both lights
    # The eye moved, no light: every volume is still there. Then one light moves.
    assert [list(kept) for kept in plans._plans._kept] == volumes
    plans.plan(moved_eye, [point_light((7, -3, 20)), SUN])
    assert len(uploads) == 2
    assert plans._plans._kept[0][0] is not volumes[0][0]
    assert plans._plans._kept[1][0] is volumes[1][0]


def test_volumes_of_a_lamp_that_moves_are_let_go(planner):
    plans, projection = planner(city(3))
    lamp = replace(LAMP, range=30.0)
    (first,) = plans.plan(projection, [lamp])
    assert first.draws
    made = weakref.ref(first.volumes[0])
    del first
    for k in range(3):
        (far,) = plans.plan(projection, [replace(lamp, position=np.array([500.0 + k, 0, 20, 1]))])
        assert not far.draws
    assert made() is None


def test_each_box_of_a_town_is_a_caster(planner):
    plans, projection = planner(merge(city(3), moved(HOUSE, (0, -200, 0))))
    (plan,) = plans.plan(projection, [SUN])
    assert plan.statistics.shells == 10
    assert plan.statistics.culled >= 1  # the one far behind the eye
    (whole,) = plans.plan(projection, [SUN], choices=VolumeOptions(cull=False))
    assert whole.statistics.culled == 0
    assert whole.statistics.sides > plan.statistics.sides


def test_a_lights_range_culls(planner):
    plans, projection = planner(city(3))
    lamp = point_light((0, 0, 30))
    near = type(lamp)(lamp.position, range=5.0)
    assert plans.plan(projection, [near])[0].statistics.culled == 9
    assert plans.plan(projection, [lamp])[0].statistics.culled < 9
    plan = plans.plan(projection, [near], choices=VolumeOptions(narrow=False))[0]
    assert plan.statistics.culled < 9
    assert plan.scissor is None


@pytest.mark.parametrize("most", [255, 0])
@pytest.mark.parametrize("height", [None, 30.0])
def test_counts_are_right_within_a_lights_range(device, monkeypatch, height, most):
    monkeypatch.setattr("umbra.gl.volume_plan.STENCIL_MOST", most)
    scene = make_scene(*city(3))
    camera = Camera((20, -25, 14), (0, 0, 3), size=SIZE, height=height)
    narrow, whole = (
        GlFrameCounter(scene, ground=0.0, device=device, choices=VolumeOptions(narrow=narrow))
        for narrow in (True, False)
    )
    # The same light counts everywhere first: nothing of it may be left.
    everywhere = point_light((0, 0, 20))
    for place in (2, -6, 7), (-14, 3, 20), (14, -20, 9), (-9, 9, 2):
        for reach in 3.0, 9.0, 20.0:
            light = type(LAMP)(np.append(place, 1.0), range=reach)
            view, frame = whole.see(camera)
            right = whole.count(view, camera, light)
            view, frame = narrow.see(camera)
            narrow.count(view, camera, everywhere)
            counts = narrow.count(view, camera, light)
            within = np.linalg.norm(np.nan_to_num(frame.position) - place, axis=-1) < reach
            within &= frame.part != -1
            np.testing.assert_array_equal(counts[within], right[within])
            if height is None and within.any():
                depth = narrow._target.read_depth()[within]
                low, high = narrow.plan.depth_bounds
                assert low <= depth.min()
                assert depth.max() <= high
            left, bottom, cols, rows = narrow.plan.scissor
            rows_, cols_ = np.nonzero(within)
            if within.any():
                assert left <= cols_.min()
                assert cols_.max() < left + cols
                assert SIZE[1] - bottom - rows <= rows_.min()
                assert rows_.max() < SIZE[1] - bottom
    narrow.release()
    whole.release()


def test_only_some_parts_cast(device):
    scene = make_scene([Part("a", "", Mesh(*HOUSE)), Part("b", "", Mesh(*moved(HOUSE, (9, 3, 0))))])
    found = []
    for casters in ([0], [1], [0, 1], []):
        with GlFrameCounter(scene, casters, 0.0, device=device) as ours:
            view, _ = ours.see(CAMERA)
            found.append(ours.count(view, CAMERA, SUN))
    np.testing.assert_array_equal(found[0] + found[1], found[2])
    assert found[0].any()
    assert found[1].any()
    assert not found[3].any()


@pytest.mark.parametrize("seed", range(4))
def test_the_deepest_count_is_bounded(device, seed):
    rng = np.random.default_rng(seed)
    mesh = [jumble(rng), city(3), merge(*[box((k, -3, 0), (k + 0.4, 4, 5)) for k in range(9)]),
            torus_knot(60, 8)][seed]  # fmt: skip
    with Judge(device, mesh) as scene:
        for light in LAMP, SUN, point_light((0.3, 0.2, 3)), directional_light((1, 0, 0.05)):
            verdicts, _ = scene.judge(CAMERA, light)
            assert verdicts.deepest <= scene.counter.plan.statistics.deepest


def find_body(device, parts):
    scene = instances(merge(*parts), TRANSFORMS[:3])
    geometry = Geometry(device, scene)
    (body,) = make_bodies(scene, geometry)
    geometry.release()
    return body


@pytest.mark.parametrize(
    "light", [(8, -3.3, 20, 1), (0.4, 0.3, 0.7, 0), (1, 0, 0, 0), (-7, -4, 0, 1)]
)
def test_sides_of_some_shells_are_those_of_all(device, light):
    sheets = [moved((np.array([(0, 0, 0), (1, 0, 0), (0, 1.5, 0)], float), np.array([(0, 1, 2)])),
                    (3 * k, 9, 1)) for k in range(5)]  # fmt: skip
    boxes = [moved(box((0, 0, 0), (1, 1, 2)), (2 * k, 3, 0)) for k in range(15)]
    body = find_body(device, [*boxes, *sheets])
    opened = np.zeros((3, len(body.caster.is_closed)), bool)
    opened[1, 2] = True
    light = np.array(light, float)
    whole = make_volumes(body, light, opened)
    assert body.n_shells == 20
    random = np.random.default_rng(4)
    few = make_volumes(body, light, opened)
    for share in 0.04, 0.1, 0.3, 0.9:
        wanted = random.random(60) < share
        sides, shells = few.list_sides(wanted)
        all_sides, all_shells = whole.list_sides()
        chosen = wanted[all_shells]
        np.testing.assert_array_equal(shells, all_shells[chosen])
        expected = np.column_stack([shells, all_sides[chosen]])
        found = np.column_stack([shells, sides])
        assert sorted(map(tuple, found)) == sorted(map(tuple, expected))


@pytest.mark.parametrize("w", [0.0, 1.0], ids=["suns", "lamps"])
def test_sides_of_several_lights_are_those_of_each(device, w):
    # Level suns see sides of the boxes and sheets edge-on: those are asked for themselves.
    sheets = [moved((np.array([(0, 0, 0), (1, 0, 0), (0, 1.5, 0)], float), np.array([(0, 1, 2)])),
                    (3 * k, 9, 1)) for k in range(5)]  # fmt: skip
    boxes = [moved(box((0, 0, 0), (1, 1, 2)), (2 * k, 3, 0)) for k in range(15)]
    body = find_body(device, [*boxes, *sheets])
    opened = np.zeros((3, len(body.caster.is_closed)), bool)
    ways = np.array([(3, 1, 5), (1, 2, 0), (-9, 2, 4), (7, -20, 30), (0, 0, 1)])
    lights = [np.append(way, w) for way in ways]
    random = np.random.default_rng(4)
    wanted = [random.random(60) < share for share in (1.0, 0.3, 0.0, 0.7, 0.1)]
    together = [make_volumes(body, light, opened) for light in lights]
    together[0].find(random.random(60) < 0.5)  # some are known already
    held = replace(make_volumes(body, lights[3], opened), held=np.array([[1, 2]]))
    together[3] = held
    selections = [VolumeSelection(np.uint8(SIDES) * some, some.astype(np.int8)) for some in wanted]
    volumes.find_sides_together([[each] for each in together], selections, np.array([0, 60]))
    for light, some, each in zip(lights, wanted, together, strict=True):
        alone = make_volumes(body, light, opened)
        if each is held:
            alone = replace(alone, held=held.held)
        found, expected = (
            np.column_stack(one.list_sides(some)[::-1]).tolist() for one in (each, alone)
        )
        assert sorted(map(tuple, found)) == sorted(map(tuple, expected))
        assert len(found) > 0 or not some.any()


def test_nothing_is_made_of_what_no_light_reaches(planner, monkeypatch):
    asked = []
    made = volumes.make_shell_sides
    monkeypatch.setattr(
        volumes, "make_shell_sides", lambda *a: asked.append(a[1].sum()) or made(*a)
    )
    plans, projection = planner(merge(HOUSE, moved(HOUSE, (60, 0, 0)), moved(HOUSE, (-90, 0, 0))))
    (far,) = plans.plan(projection, [replace(point_light((300, 0, 20)), range=30.0)])
    assert not asked
    assert (far.statistics.culled, far.statistics.deepest, far.draws) == (3, 0, ())
    (near,) = plans.plan(projection, [replace(point_light((8, -3.3, 20)), range=30.0)])
    assert asked == [1]
    assert (near.statistics.culled, near.statistics.deepest) == (2, 1)
    sides = near.volumes[0].list_sides
    assert len(sides()[0]) == 3 * len(sides(near.case > 0)[0])
