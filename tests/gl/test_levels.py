"""Coarser casters: every pixel that differs is within the bound of an exact shadow's edge."""

from dataclasses import replace

import numpy as np
import pytest
from support.gl_judge import ROUNDING
from support.shapes import merge
from support.spheres import make_sphere
from support.sweeps import sample_pairs

from umbra.calls.picture import draw_picture
from umbra.calls.picture_options import RenderOptions
from umbra.cpu.frame import FrameCounter
from umbra.errors import InputError
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.levels import make_levels
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.selection import VolumeOptions
from umbra.methods import SOFT, Softness
from umbra.scene import Camera, Scene, directional_light, make_scene, point_light
from umbra.scene.mesh import Mesh, Part, transform_points
from umbra.soft import ball_light
from umbra.volume.silhouette import find_silhouettes

LIGHTS = {"sun": directional_light((0.4, 0.3, 0.7)), "lamp": point_light((10, 10, 18))}
CAMERAS = {
    "air": Camera((-25, -30, 12), (12, 12, 0), size=(240, 180)),
    "orthographic": Camera((-25, -30, 22), (12, 12, 0), size=(240, 180), height=40.0),
    "among them": Camera((3.0, 4.0, 0.4), (12, 12, 1.5), size=(240, 180)),
}
BEHIND = 4.0 + 1.0
"""A coarser volume begins at most so many of its errors behind its caster."""


def make_rocks(count=24):
    """Make bumpy balls of 1,280 faces above the ground."""
    rng = np.random.default_rng(1)
    ball = make_sphere(3)
    vertices, faces = ball.vertices, ball.faces
    found = []
    for _ in range(count):
        ways = rng.normal(size=(6, 3)) * 2.5
        bumps = 1.0 + 0.05 * np.sin(vertices @ ways.T + rng.uniform(0, 6, 6)).sum(1)
        place = [*rng.uniform(-8, 32, 2), rng.uniform(1.5, 3.0)]
        found.append((bumps[:, None] * vertices * rng.uniform(0.7, 1.2) + place, faces))
    return merge(*found)


def measure_to_edges(caster, light, points):
    """Give how near the ways from points to a light pass each's nearest silhouette edge [m]."""
    ((_, found),) = find_silhouettes(caster, light[None])
    a, b = caster.vertices[caster.edges[found.codes[: found.starts[1]] >> 2]].transpose(1, 0, 2)
    nearest = []
    for point in points:
        way = light[:3] - light[3] * point
        way /= np.linalg.norm(way)
        # Distance of lines, where both feet are on the edge and before the point, else of ends.
        along, apart = b - a, point - a
        normal = np.cross(along, way)
        square = np.maximum((normal**2).sum(1), 1e-300)
        part = np.clip((np.cross(apart, way) * normal).sum(1) / square, 0.0, 1.0)
        on_edge = a + part[:, None] * along
        forth = np.maximum((on_edge - point) @ way, 0.0)
        nearest.append(np.linalg.norm(point + forth[:, None] * way - on_edge, axis=1).min())
    return np.array(nearest)


@pytest.fixture(scope="module")
def rocks():
    return make_scene(*make_rocks())


@pytest.mark.parametrize(("view", "light"), sample_pairs(CAMERAS, LIGHTS, 2))
def test_pixels_differ_only_near_edges(device, rocks, view, light):
    camera, light = CAMERAS[view], LIGHTS[light]
    cpu = FrameCounter(rocks, ground=0.0)
    seen, frame = cpu.see(camera)
    exact = cpu.count(seen, camera, light)
    place = light.local(rocks.origin)
    changed = []
    for detail in 0.0, 4.0, 8.0:
        with GlFrameCounter(rocks, ground=0.0, device=device, detail=detail) as ours:
            theirs, _ = ours.see(camera)
            counts = ours.count(theirs, camera, light)
            statistics = ours.plan.statistics
        differs = (counts != exact) & (theirs.face == seen.face)
        points = frame.position[differs] - rocks.origin
        assert statistics.moved == ours.moved
        assert (statistics.moved > 0) == (detail > 0)
        assert (statistics.coarse > 0) == (detail > 0)
        if detail == 0:
            assert len(points) <= 3  # within 1/128 pixel of edges, as ever
            continue
        changed.append(len(points))
        bound = statistics.moved + ROUNDING * 100.0
        apart = measure_to_edges(cpu.caster, place, points)
        beside = np.linalg.norm(points[:, None] - cpu.caster.vertices, axis=-1).min(1)
        far = (apart > bound) & (beside > BEHIND * bound)
        assert not far.any(), (points[far][:3], apart[far][:3], beside[far][:3], bound)
        # On the casters themselves light stays light, but for few pixels.
        wrong = frame.lit(counts, light) != frame.lit(exact, light)
        assert np.count_nonzero(wrong & differs & (seen.face >= 0)) <= 0.002 * differs.size
    assert changed[-1] > 10


def test_no_detail_is_exact_after_levels_were_made(device, rocks):
    camera, light = CAMERAS["air"], LIGHTS["sun"]
    with GlFrameCounter(rocks, ground=0.0, device=device) as ours:
        view, _ = ours.see(camera)
        exact = ours.count(view, camera, light)
        ours.choices = VolumeOptions(narrow=False, detail=8.0)
        coarse = ours.count(view, camera, light)
        assert (coarse != exact).any()
        drawn = ours.plan.statistics
        ours.choices = VolumeOptions(narrow=False)
        np.testing.assert_array_equal(ours.count(view, camera, light), exact)
        assert drawn.sides + drawn.coarse < 0.6 * ours.plan.statistics.sides


def test_levels_are_closed_and_move_no_corner_farther_than_said(device, rocks):
    with GlFrameCounter(rocks, device=device) as ours:
        (body,) = ours.planner.bodies
        levels = make_levels(body)
    assert len(levels) >= 1
    counts = [len(body.caster.faces)]
    shell = np.repeat(np.arange(body.n_shells), np.diff(body.face_starts))
    for level in levels:
        caster, made = level.body.caster, level.body
        assert caster.is_closed.all()
        counts.append(len(caster.faces))
        for number, owner in enumerate(level.shells):
            fine = body.caster.faces[body.faces[shell == owner]]
            mine = made.faces[made.face_starts[number] : made.face_starts[number + 1]]
            kept = np.unique(caster.faces[mine])
            assert set(kept.tolist()) <= set(np.unique(fine).tolist())
            corners = body.caster.vertices[np.unique(fine)]
            apart = np.linalg.norm(corners[:, None] - caster.vertices[kept], axis=-1).min(1)
            assert apart.max() <= level.moves[owner] + 1e-12
    assert (np.diff(counts) < 0).all()


def find_farthest(points, others):
    """Give how far any of the points (n, 3) is from the nearest of others [m]."""
    return np.linalg.norm(points[:, None] - others, axis=-1).min(1).max()


def test_levels_of_instances_follow_them_in_place_and_size(device):
    def place(sizes, shift):
        matrices = [np.diag([size, size, size, 1.0]) for size in sizes]
        for number, matrix in enumerate(matrices):
            matrix[:3, 3] = 9.0 * number + shift, shift, 4.0
        parts = [Part(f"rock {k}", "", ball, transform=m) for k, m in enumerate(matrices)]
        return Scene(tuple(parts), origin=np.zeros(3))

    sphere = make_sphere(3)
    ball = Mesh(sphere.vertices, sphere.faces)
    with GlFrameCounter(place((1.0, 3.0), 0.0), device=device, detail=30.0) as ours:
        planner = ours.planner
        view, _ = ours.see(CAMERAS["air"])
        ours.count(view, CAMERAS["air"], LIGHTS["sun"])
        assert ours.plan.statistics.coarse > 0
        for sizes, shift in ((1.0, 3.0), 0.0), ((6.0, 0.5), 2.0):
            planner.move(place(sizes, shift))
            (body,), table, bounds = planner.bodies, planner.detailed.table, planner.detailed.bounds
            coarse = [level.body for level in planner._levels[0] if level.body is not None]
            assert len(coarse) > 1
            for row, level in enumerate(coarse):
                for number, transform in enumerate(body.transforms):
                    # The corners that are left lie in the bounds of the instance itself.
                    fine, mine = bounds[number], bounds[table.chain[row, number]]
                    assert (mine[0] >= fine[0] - 1e-9).all()
                    assert (mine[1] <= fine[1] + 1e-9).all()
                    assert np.ptp(mine, axis=0).min() > 0.5 * np.ptp(fine, axis=0).max()
                    used = np.unique(level.caster.faces)
                    points, left = (
                        transform_points(transform, vertices)
                        for vertices in (body.caster.vertices, level.caster.vertices[used])
                    )
                    assert find_farthest(points, left) <= table.moves[row, number] + 1e-9


def test_instances_are_taken_as_long_as_their_transforms_make_them(device):
    sphere = make_sphere(3)
    ball, stretches = Mesh(sphere.vertices, sphere.faces), ((1, 1, 1), (0.5, 0.25, 2), (8, 8, 8))
    turned = [np.linalg.qr(np.random.default_rng(k).normal(size=(3, 3)))[0] for k in range(3)]
    places = [np.eye(4) for _ in range(3)]
    for matrix, turn, stretch in zip(places, turned, stretches, strict=True):
        matrix[:3, :3] = turn * stretch
    parts = [Part(f"rock {k}", "", ball, transform=m) for k, m in enumerate(places)]
    with GlFrameCounter(Scene(tuple(parts), np.zeros(3)), device=device, detail=30.0) as ours:
        view, _ = ours.see(CAMERAS["air"])
        ours.count(view, CAMERAS["air"], LIGHTS["sun"])
        moves, levels = ours.planner.detailed.table.moves, ours.planner._levels[0]
    for row, level in enumerate(levels):
        np.testing.assert_allclose(moves[row], level.moves[0] * np.array([1.0, 2.0, 8.0]))


@pytest.mark.parametrize("kind", ["alpha", *SOFT])
def test_levels_of_an_earlier_picture_are_not_in_those_that_do_without(device, rocks, kind):
    camera, lamp = CAMERAS["air"], LIGHTS["lamp"]
    lights = [lamp] if kind == "alpha" else [ball_light(lamp, 0.5)]
    options = {"method": kind} if kind == "alpha" else {"soft": kind}
    given = {"device": device, "softness": Softness(samples=4, spots=4)}
    with SceneRenderer(rocks, 0.0, **given) as renderer:
        exact = renderer.render(camera, lights, **options)
    with SceneRenderer(rocks, 0.0, choices=VolumeOptions(detail=8.0), **given) as renderer:
        renderer.render(camera, [lamp])
        assert renderer.statistics[0].coarse > 0
        np.testing.assert_array_equal(renderer.render(camera, lights, **options), exact)


def test_levels_of_what_bends_are_made_anew(device, rocks):
    camera, lights = CAMERAS["air"], [LIGHTS["sun"]]
    (part,) = rocks.parts
    bent = part.mesh.vertices * (1.0 + 0.05 * np.sin(part.mesh.vertices[:, 2:]))
    posed = replace(rocks, parts=(replace(part, mesh=part.mesh.moved(bent)),))
    given = {"device": device, "choices": VolumeOptions(detail=8.0)}
    with SceneRenderer(posed, 0.0, **given) as renderer:
        expected = renderer.render(camera, lights)
        coarse = renderer.statistics[0].coarse
    with SceneRenderer(rocks, 0.0, **given) as renderer:
        renderer.render(camera, lights)
        renderer.move(posed)
        picture = renderer.render(camera, lights)
        assert renderer.statistics[0].coarse == coarse > 0
    assert (picture != expected).any(-1).sum() <= 3


def test_options_say_where_there_are_no_levels():
    with pytest.raises(InputError, match="give device='gl'"):
        RenderOptions(detail=1.0)
    for other in {"soft": "wedges"}, {"mask_scale": 2}, {"method": "alpha"}:
        with pytest.raises(InputError, match="detail= is for hard shadows"):
            RenderOptions(device="gl", detail=1.0, **other)
    with pytest.raises(InputError, match="0 or more; got -1"):
        RenderOptions(device="gl", detail=-1.0)
    assert RenderOptions(device="gl", detail=1.0).detail == 1.0


def test_picture_says_how_far_casters_are_off(shared_device, rocks):
    camera, lines = CAMERAS["air"], []
    options = RenderOptions(device="gl", detail=4.0, samples=1, ground=0.0)
    draw_picture(rocks, camera, [LIGHTS["sun"]], options, lines.append, tell=lines.append)
    assert len(lines) == 1
    assert "coarser meshes, which are off by up to 1.4" in lines[0]
