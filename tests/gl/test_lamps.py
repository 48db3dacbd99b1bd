"""Lamps on faces, on edges and at corners, on the gl device by the rule of the cpu's."""

import numpy as np
import pytest
from support.gl_judge import Judge
from support.judge import Verdicts
from support.lamps import PLACES, RIMS, hang, look_at
from support.shapes import HOUSE, box, merge, moved, rewound, sheet

from umbra.cpu.frame import FrameCounter
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.resources import Indices
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, Mesh, Part, make_scene, point_light

METHODS = ("auto", "z-fail", "lengyel", "mcguire")
APART = [0.0, 1e-12, 1e-9, 1e-6, 1e-3]


@pytest.mark.parametrize("apart", APART)
@pytest.mark.parametrize("place", PLACES)
def test_every_pixel_under_a_lamp_on_a_turned_box(device, place, apart):
    verdicts = Verdicts()
    for seed in range(4):
        mesh, lamp = hang(np.random.default_rng(seed), place, apart)
        with Judge(device, mesh) as judge:
            for height in None, 14.0:
                verdicts += judge.judge(look_at(seed, height), lamp, *METHODS)[0]
    verdicts.check(most_on_edges=0.01)


@pytest.mark.parametrize("apart", [0.0, 1e-8])
@pytest.mark.parametrize("kind", ["inward", "open", "in company"])
def test_other_casters_that_hold_a_lamp(device, kind, apart):
    verdicts = Verdicts()
    for seed, place in enumerate(PLACES):
        (vertices, faces), lamp = hang(np.random.default_rng(seed), place, apart)
        if kind == "inward":
            mesh = rewound((vertices, faces))
        elif kind == "open":
            mesh = vertices, faces[np.arange(len(faces)) != seed]
        else:
            roof = sheet([(-9, -9, 9), (9, -9, 9), (9, 9, 10), (-9, 9, 10)])
            mesh = merge((vertices, faces), HOUSE, roof)
        with Judge(device, mesh) as judge:
            verdicts += judge.judge(look_at(seed), lamp, "auto", "z-fail")[0]
    verdicts.check(most_on_edges=0.01)


def test_lamps_come_and_go_in_turn(device):
    mesh, near = hang(np.random.default_rng(3), "edge", 1e-7)
    far, camera = point_light((3, -2, 14)), look_at(3)
    with GlFrameCounter(make_scene(*mesh), ground=0.0, device=device) as counter:
        view, _ = counter.see(camera)
        first = [counter.count(view, camera, lamp) for lamp in (near, far)]
        again = [counter.count(view, camera, lamp) for lamp in (near, far)]
        np.testing.assert_array_equal(first, again)
    with SceneRenderer(make_scene(*mesh), ground=0.0, device=device) as renderer:
        both = renderer.render(camera, [near, far])
        renderer.render(camera, [far])
        np.testing.assert_array_equal(renderer.render(camera, [near, far]), both)


def test_instances_that_a_lamp_nearly_touches(device):
    # One mesh twice, moved: the lamp is at the edge of one of them.
    mesh, _ = hang(np.random.default_rng(5), "edge")
    moves = []
    for x in (-6.0, 2.0):
        moves.append(np.eye(4))
        moves[-1][:3, 3] = x, 0.3, 0.25
    body = Mesh(*mesh)
    parts = [Part(f"box {k}", "", body, transform=move) for k, move in enumerate(moves)]
    a, b = (mesh[0][i] + moves[1][:3, 3] for i in RIMS[7])
    camera = Camera((3, -15, 9), (-1, 0, 3), size=(32, 24))
    for apart in 0.0, 1e-6:
        lamp = point_light(0.3 * a + 0.7 * b + apart * np.array([0.48, 0.6, 0.64]))
        scene = make_scene(parts)
        with GlFrameCounter(scene, ground=0.0, device=device) as counter:
            view, _ = counter.see(camera)
            counts = counter.count(view, camera, lamp)
        plain = FrameCounter(scene, ground=0.0)
        expected = plain.count(plain.see(camera)[0], camera, lamp)
        frame = plain.see(camera)[1]
        assert (frame.lit(counts, lamp) != frame.lit(expected, lamp)).mean() < 0.01
        assert expected.any()


def test_points_near_a_lamp_widen_the_numbers_where_they_must(device):
    # 4,096 boxes have 32,768 corners, which two bytes just tell apart, with their far ends.
    boxes = [
        moved(box((0, 0, 0), (1, 1, 2)), (4 * (k % 64), 4 * (k // 64), 0)) for k in range(4096)
    ]
    beyond = moved(box((0, 0, 0), (1, 1, 2)), (-900, -900, -3))
    lamp = point_light((101.0005, 101.0004, 2.0003))  # beside a corner
    camera = Camera((92, 88, 30), (101, 101, 0), size=(96, 72))
    shown = []
    for mesh, first in ((merge(*boxes), 2), (merge(*boxes, beyond), 4)):
        with SceneRenderer(make_scene(*mesh), 0.0, device=device) as renderer:
            assert renderer.planner.indices.dtype.itemsize == first
            shown.append(renderer.render(camera, [lamp]))
            assert renderer.planner.indices.nearby is not None
            assert renderer.planner.indices.dtype.itemsize == 4
    assert len(np.unique(shown[0])) > 10
    np.testing.assert_array_equal(*shown)
    one = Indices(device, 2 * 32_760)
    assert one.widen(8).itemsize == 2
    assert one.widen(9).itemsize == 4
