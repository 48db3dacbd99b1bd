"""Frames on gl against frames on the CPU, and what forced methods say."""

import numpy as np
import pytest
from support.model_files import save_obj
from support.shapes import HOUSE, SCENES, box, merge, moved, sheet

from umbra.cli import main
from umbra.cpu.frame import FrameCounter
from umbra.gl.frame_counter import GlFrameCounter
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, directional_light, make_scene, point_light

SIZE = (96, 72)
OUTSIDE = Camera((20, -25, 14), (0, 0, 3), size=SIZE)
ORTHOGRAPHIC = Camera((20, -25, 14), (0, 0, 3), size=SIZE, height=30.0)
INSIDE = Camera((0.3, 0.2, 3), (10, 3, 0), size=SIZE)
BELOW = Camera((20, -25, -9), (0, 0, 3), size=SIZE)


def is_near_edge(view, counts):
    """Find pixels beside which the CPU sees another face or counts otherwise."""
    near = np.zeros(view.face.shape, bool)
    for values in (view.face, counts):
        for axis in (0, 1):
            differs = np.diff(values, axis=axis) != 0
            ahead = [slice(None), slice(None)]
            ahead[axis] = slice(1, None)
            behind = [slice(None), slice(None)]
            behind[axis] = slice(None, -1)
            near[tuple(ahead)] |= differs
            near[tuple(behind)] |= differs
    return near


@pytest.mark.parametrize("camera", [OUTSIDE, ORTHOGRAPHIC, INSIDE, BELOW])
@pytest.mark.parametrize(
    "name", ["one box", "turned boxes", "torus knot", "soup", "cavity", "sheets"]
)
def test_frames_differ_from_the_cpus_only_at_edges(device, name, camera):
    scene = make_scene(*SCENES[name]())
    cpu = FrameCounter(scene, ground=0.0)
    right_view, right = cpu.see(camera)
    with GlFrameCounter(scene, ground=0.0, device=device) as ours:
        view, frame = ours.see(camera)
        assert frame.position.dtype == frame.normal.dtype == np.float64
        assert frame.part.dtype == np.int32
        same = view.face == right_view.face
        for light in point_light((8, -3.3, 20)), directional_light((0.4, 0.3, 0.7)):
            right_counts = cpu.count(right_view, camera, light)
            near = is_near_edge(right_view, right_counts)
            assert same[~near].all()
            for method in "auto", "z-fail", "lengyel", "mcguire":
                counts = ours.count(view, camera, light, method)
                assert counts.dtype == np.int32
                np.testing.assert_array_equal(counts[~near], right_counts[~near])
                assert (counts != right_counts)[same].mean() < 2e-3
        lit = frame.lit(counts, light)
        np.testing.assert_array_equal(lit[~near], right.lit(right_counts, light)[~near])
    seen = same & (view.face != NOTHING) & (np.abs(right.position) < 1e4).all(-1)
    np.testing.assert_allclose(frame.position[seen], right.position[seen], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(frame.normal[seen], right.normal[seen], atol=1e-12)
    np.testing.assert_array_equal(frame.part[same], right.part[same])


def test_a_scene_that_is_solved_by_hand(device):
    # 0.1 m pixels on the ground; a table of 2 x 2 m, 4 m up, under a sun at 45 degrees.
    table = sheet([(-1, -1, 4), (1, -1, 4), (1, 1, 4), (-1, 1, 4)])
    camera = Camera((0, 0, 10), (0, 0, 0), up=(0, 1, 0), size=(200, 200), height=20.0)
    with GlFrameCounter(make_scene(*table), ground=0.0, device=device) as ours:
        view, frame = ours.see(camera)
        np.testing.assert_allclose(frame.position[0, 0], [-9.95, 9.95, 0], atol=1e-9)
        for method in "auto", "z-fail":
            counts = ours.count(view, camera, directional_light((-1, 0, 1)), method)
            x, y, z = np.moveaxis(frame.position, -1, 0)
            expected = (z < 1) & (np.abs(x - 4) < 1) & (np.abs(y) < 1)
            assert expected.sum() == 400
            np.testing.assert_array_equal(counts, expected)


def test_a_part_of_a_scene_may_be_seen_and_cast_nothing(device):
    with GlFrameCounter(make_scene(*HOUSE), [], 0.0, device=device) as ours:
        view, _ = ours.see(OUTSIDE)
        assert not ours.count(view, OUTSIDE, point_light((8, -3.3, 20))).any()


def test_an_empty_view(device):
    away = Camera((20, -25, 14), (40, -50, 28), size=SIZE)
    with GlFrameCounter(make_scene(*HOUSE), device=device) as ours:
        view, frame = ours.see(away)
        assert (view.face == NOTHING).all()
        assert np.isnan(frame.position).all()
        assert not ours.count(view, away, point_light((8, -3.3, 20)), "z-fail").any()


@pytest.mark.parametrize(
    ("camera", "is_right"),
    [
        (OUTSIDE, True),
        (ORTHOGRAPHIC, True),
        (INSIDE, False),  # the eye is in the house, and so in its shadow
        (Camera((-5, -4, 1), (3, 3, 0), size=SIZE), False),  # the eye is in the house's shadow
        (Camera((20, -25, 14), (0, 0, 3), size=SIZE, near=32), False),  # the near plane cuts it
        (BELOW, True),
    ],
)
def test_z_pass_warns_exactly_where_it_is_wrong(device, camera, is_right):
    light, lines = directional_light((0.6, 0.5, 0.6)), []
    with GlFrameCounter(make_scene(*HOUSE), ground=0.0, device=device, warn=lines.append) as ours:
        view, _ = ours.see(camera)
        right = ours.count(view, camera, light)
        assert not lines
        plain = ours.count(view, camera, light, "z-pass")
    assert (np.abs(plain - right).sum() < 5) == is_right
    assert len(lines) == (not is_right)
    assert all("z-pass is wrong for this view" in line for line in lines)


def test_z_pass_does_not_warn_of_casters_behind_the_eye(device):
    lines = []
    scene = make_scene(*merge(HOUSE, moved(HOUSE, (60, -70, 0))))
    with GlFrameCounter(scene, ground=0.0, device=device, warn=lines.append) as ours:
        view, _ = ours.see(OUTSIDE)
        plain = ours.count(view, OUTSIDE, directional_light((0.4, 0.3, 0.7)), "z-pass")
        right = ours.count(view, OUTSIDE, directional_light((0.4, 0.3, 0.7)))
    np.testing.assert_array_equal(plain, right)
    assert not lines


def test_an_unknown_method_is_refused(device):
    with GlFrameCounter(make_scene(*HOUSE), device=device) as ours:
        view, _ = ours.see(OUTSIDE)
        with pytest.raises(ValueError, match=r"no method 'shadow-map'.*lengyel, mcguire"):
            ours.count(view, OUTSIDE, point_light((8, -3.3, 20)), "shadow-map")


def test_a_view_of_another_size_takes_another_target(device):
    with GlFrameCounter(make_scene(*HOUSE), ground=0.0, device=device) as ours:
        for size in ((20, 10), (31, 7), (20, 10)):
            camera = Camera((20, -25, 14), (0, 0, 3), size=size)
            view, _ = ours.see(camera)
            counts = ours.count(view, camera, point_light((8, -3.3, 20)))
            assert counts.shape == view.face.shape == size[::-1]


def test_the_command_line_draws_on_gl_what_it_draws_on_the_cpu(device, tmp_path, capsys):
    path = save_obj(tmp_path / "box.obj", {"box": box((-1, -1, 0), (1, 1, 3))})
    view = ["--eye", "-5,-6,7", "--target", "0,0,2", "--size", "80x60", "--ground", "0"]
    found = {}
    for name in "cpu", "gl":
        with pytest.raises(SystemExit) as ended:
            main(["render", str(path), *view, "--light", "6,-4,8", "--device", name,
                  "--arrays", str(tmp_path / f"{name}.npz")])  # fmt: skip
        assert not ended.value.code, capsys.readouterr().err
        with np.load(tmp_path / f"{name}.npz") as arrays:
            found[name] = dict(arrays)
    assert found["gl"]["count"].dtype == np.int32
    assert (found["gl"]["count"] != found["cpu"]["count"]).mean() < 2e-3
    assert (found["gl"]["lit"] != found["cpu"]["lit"]).mean() < 2e-3
    np.testing.assert_allclose(found["gl"]["position"], found["cpu"]["position"], atol=0.2)


@pytest.mark.parametrize(
    ("eye", "target"),
    [((40, -20, -15), (14, 12, 3)), ((14, 11, -6), (14, 12, 3))],
)
def test_floors_in_the_plane_of_the_ground_are_seen_from_below(device, eye, target):
    boxes = [moved(box((0, 0, 0), (6, 5, 8)), (11 * (k % 3), 9 * (k // 3), 0)) for k in range(9)]
    far_away = moved(box((0, 0, 0), (60, 50, 30)), (400, 300, 0))
    scene = make_scene(*merge(*boxes, far_away))
    camera = Camera(eye, target, size=(320, 240), near=0.05)
    right, _ = FrameCounter(scene, ground=0.0).see(camera)
    with GlFrameCounter(scene, ground=0.0, device=device) as ours:
        view, _ = ours.see(camera)
    assert (right.face >= 0).sum() > 1500
    assert (view.face != right.face).sum() <= 12  # far away, as floors before the eye round most
