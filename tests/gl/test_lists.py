"""Lights exactly in the plane of the ground, roofs and walls: counts against float64 rays."""

import numpy as np
import pytest
from support.gl_judge import closed_faces
from support.judge import judge_edge_on
from support.raycaster import RayCaster
from support.shapes import box, merge

from umbra.cpu.frame import FrameCounter
from umbra.gl.frame_counter import GlFrameCounter
from umbra.rays.depth import GROUND
from umbra.scene import Camera, directional_light, make_scene, point_light
from umbra.volume.adjacency import make_caster

LIFT = 1e-7
"""How far the rays' light is on the viewer's side [m], or how steep."""


def boxes_on(ground):
    """Make boxes that stand on the ground, turned by any angle."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(12):
        vertices, faces = box((0, 0, 0), rng.uniform(2, 6, 3))
        cosine, sine = np.cos(angle := rng.uniform(0, 3)), np.sin(angle)
        turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
        found.append((vertices @ turn.T + [*rng.uniform(-14, 14, 2), ground], faces))
    return merge(*found)


@pytest.mark.parametrize("ground", [0.0, 171.3])
@pytest.mark.parametrize("side", [1, -1])
def test_ground_is_counted_as_from_the_viewers_side(device, ground, side):
    scene = make_scene(*boxes_on(ground))
    soup = scene.triangles()
    rays = RayCaster(soup.vertices, soup.faces, scene.origin)
    is_closed = closed_faces(make_caster(soup.vertices, soup.faces), len(soup.faces))
    shadowed = 0
    with GlFrameCounter(scene, ground=ground, device=device) as ours:
        cpu = FrameCounter(scene, ground=ground)
        for height in None, 30.0:
            camera = Camera(
                (20, -25, ground + side * 14), (0, 0, ground), size=(96, 80), height=height
            )
            for x, y, w in (4.1, -18.2, 1), (19.5, -7.0, 1), (-20.0, 3.3, 1), (0.4, 0.9, 0):
                light = point_light((x, y, ground)) if w else directional_light((x, y, 0.0))
                place = light.local(scene.origin)
                place[2] += side * LIFT
                for counter in cpu, ours:
                    view, frame = counter.see(camera)
                    near = np.linalg.norm(frame.position - camera.target, axis=-1) < 200.0
                    seen = (view.face == GROUND) & near
                    points = frame.position[seen] - scene.origin
                    own = np.full(len(points), -1)
                    eye = camera.apex(scene.origin)
                    true = rays.count(points, own, eye, place, is_closed).count
                    for method in "auto", "z-fail":
                        counts = counter.count(view, camera, light, method)[seen]
                        assert np.count_nonzero(counts != true) <= 2e-3 * len(true) + 1
                    shadowed += np.count_nonzero(true)
    assert (shadowed > 1000) == (side > 0)


@pytest.mark.parametrize("ground", [0.0, None])
def test_roofs_in_the_plane_of_the_light(device, ground):
    vertices, faces = boxes_on(0.0)
    vertices[vertices[:, 2] > 3.5, 2] = 4.0
    with GlFrameCounter(make_scene(vertices, faces), ground=ground, device=device) as ours:
        camera = Camera((20, -25, 14), (0, 0, 2), size=(96, 80))
        for light in directional_light((0.4, 0.9, 0.0)), point_light((19.5, -7.0, 4.0)):
            wrong, _ = judge_edge_on(ours, camera, light)
            assert wrong == 0


def test_walls_in_the_plane_of_the_light(device):
    rng = np.random.default_rng(7)
    corners = np.append(rng.integers(-12, 9, (30, 2)), np.zeros((30, 1)), 1)
    scene = make_scene(*merge(*(box(low, low + rng.uniform(2, 8, 3)) for low in corners)))
    with GlFrameCounter(scene, ground=0.0, device=device) as ours:
        camera = Camera((20, -25, 14), (0, 0, 2), size=(96, 80))
        lights = [directional_light((x, y, 1)) for x, y in ((0, 1), (1, 0), (0, -1), (-1, 0))]
        lights.append(point_light(corners[0] + [0, 4, 9]))
        wrong, shaded = np.sum([judge_edge_on(ours, camera, light) for light in lights], axis=0)
        assert wrong == 0
        assert shaded > 100
