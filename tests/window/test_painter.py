"""Pictures of views, without a window."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from support.shapes import box, merge
from support.spheres import make_sphere

import umbra
from umbra.cpu.frame import FrameCounter
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.selection import VolumeOptions
from umbra.gl.state import State
from umbra.scene import Mesh, Part, make_scene, point_light
from umbra.window.handles import find_part
from umbra.window.overlays import Overlays, find_count_colors, find_top
from umbra.window.view_painter import ViewPainter
from umbra.window.view_state import METHODS, SOFT, SUN, make_view

SIZE = (320, 240)


@pytest.fixture
def painter(device, tower):
    painter = ViewPainter(device, tower, 0.0)
    yield painter
    painter.release()


def test_a_view_is_what_the_renderer_draws(painter, tower):
    view = make_view(tower, SIZE)
    drawn = painter.draw(view, SIZE)
    picture = painter.read()
    expected = painter.renderer.render(
        view.viewpoint.camera(SIZE), list(view.shining().values()), "auto"
    )
    assert np.array_equal(picture, expected)
    assert drawn.size == SIZE
    assert {"surfaces", "shadows", "light"} <= drawn.passes.keys()
    assert all(spent >= 0 for spent in drawn.passes.values())
    assert drawn.statistics[SUN].cases == (2, 0, 0)
    assert painter.draw(view, SIZE, times=False).passes == {}


@pytest.mark.parametrize("method", METHODS["gl"])
def test_every_method_draws(painter, tower, method):
    view = make_view(tower, SIZE)
    painter.draw(view, SIZE)
    expected = painter.read().astype(int)
    drawn = painter.draw(view.choose_method(method).toggle("edges").toggle("edges"), SIZE)
    apart = (np.abs(painter.read() - expected).max(2) > 3).mean()
    assert apart < 0.01 or any("wrong" in warning for warning in drawn.warnings)


@pytest.mark.parametrize("soft", SOFT[1:])
def test_soft_shadows_are_the_same_on_both_devices(painter, tower, soft):
    view = replace(make_view(tower, SIZE), sun_radius=4.0)
    painter.draw(view, SIZE)
    hard = painter.read().astype(int)
    view = replace(view.add_light(point_light((3, -8, 9), (0.5, 0.5, 0.5))), soft=soft)
    drawn = painter.draw(view.toggle("counts"), SIZE)
    assert drawn.statistics.keys() == {SUN, 0}
    painter.draw(view, SIZE)
    of_gl = painter.read().astype(int)
    painter.draw(view.choose_device("cpu"), SIZE)
    of_cpu = painter.read().astype(int)
    assert (np.abs(of_gl - of_cpu).max(2) > 4).mean() < 0.01
    assert (np.abs(of_gl - hard).max(2) > 10).mean() > 0.01


def test_a_pale_view_has_a_low_sun_that_whitens_no_wall_on_both_devices(device, tower):
    painter = ViewPainter(device, tower, 0.0, is_pale=True)
    pictures = {}
    try:
        for altitude in (3.0, 25.0):
            view = make_view(tower, SIZE)
            toward = view.viewpoint.camera(SIZE).eye
            azimuth = float(np.degrees(np.arctan2(toward[0], toward[1]))) % 360 + 30
            sun = replace(view.sun, by_clock=False, azimuth=azimuth, altitude=altitude)
            view = replace(view, sun=sun)
            painter.draw(view, SIZE)
            pictures[altitude] = painter.read().astype(int)
            painter.draw(view.choose_device("cpu"), SIZE)
            assert (np.abs(pictures[altitude] - painter.read()).max(2) > 3).mean() < 0.005
    finally:
        painter.release()
    low, high = (pictures[altitude].min(2)[SIZE[1] // 4 :] for altitude in pictures)
    assert low.max() <= high.max() + 8  # a wall takes the cosine of 25 degrees less of a high sun
    assert np.median(low) == pytest.approx(np.median(high), abs=1)  # level ground


@pytest.mark.parametrize("scale", [2, 4])
@pytest.mark.parametrize("method", ["auto", "alpha"])
def test_small_masks_are_those_of_render(painter, tower, scale, method):
    view = replace(make_view(tower, SIZE), mask_scale=scale).choose_method(method)
    painter.draw(view, (323, 241))  # which neither 2 nor 4 divides
    of_window = painter.read().astype(int)
    camera = view.viewpoint.camera((323, 241))
    lights, more = list(view.shining().values()), {"ground": 0.0, "device": "gl", "samples": 1}
    render = partial(umbra.render, tower, camera, lights, method=method, style="plain", **more)
    assert (np.abs(of_window - render(mask_scale=scale)).max(2) > 4).mean() < 0.001
    assert (np.abs(of_window - render()).max(2) > 4).mean() > 0.004
    painter.draw(replace(view, mask_filter="nearest"), (323, 241))
    assert (np.abs(painter.read() - of_window).max(2) > 4).mean() > 0.004


def test_coarser_casters_are_those_of_render(device):
    ball = make_sphere(3)
    balls = [(3.0 * x, 3.0 * y, 1.5) for x in range(4) for y in range(4)]
    scene = make_scene(*merge(*((ball.vertices + place, ball.faces) for place in balls)))
    painter = ViewPainter(device, scene, 0.0)
    view = replace(make_view(scene, SIZE), detail=8.0)
    drawn = painter.draw(view, SIZE)
    assert drawn.statistics[SUN].coarse > 0
    camera, light = view.viewpoint.camera(SIZE), view.shining()[SUN]
    more = {"ground": 0.0, "device": "gl", "samples": 1, "style": "plain"}
    picture = umbra.render(scene, camera, light, detail=8.0, **more)
    assert (np.abs(painter.read().astype(int) - picture).max(2) > 4).mean() < 0.001
    exact = painter.draw(replace(view, detail=0.0), SIZE)
    assert exact.statistics[SUN].coarse == 0
    assert (np.abs(painter.read().astype(int) - picture).max(2) > 10).any()
    painter.release()


def test_length_and_gap_make_the_layers_of_both_devices(painter, tower):
    view = replace(make_view(tower, SIZE), soft="weng", layer_length=4.0, layer_gap=2.0)
    painter.draw(replace(view, layer_gap=0.4), SIZE)
    of_many = painter.read().astype(int)
    painter.draw(view, SIZE)
    of_gl = painter.read().astype(int)
    painter.draw(view.next_device(), SIZE)
    assert (np.abs(painter.read() - of_gl).max(2) > 4).mean() < 0.01
    assert (np.abs(of_gl - of_many).max(2) > 10).mean() > 0.01


def test_both_devices_show_the_same(painter, tower):
    view = make_view(tower, SIZE)
    painter.draw(view, SIZE)
    of_gl = painter.read().astype(int)
    drawn = painter.draw(view.choose_device("cpu"), SIZE)
    of_cpu = painter.read().astype(int)
    assert drawn.passes.keys() == {"see", "count", "shade"}
    assert (np.abs(of_gl - of_cpu).max(2) > 3).mean() < 0.01


def test_counts_are_shown_in_their_colours(painter, tower):
    view = make_view(tower, SIZE).toggle("counts")
    drawn = painter.draw(view, SIZE)
    picture = painter.read() / 255
    counter = FrameCounter(tower, ground=0.0)
    camera = view.viewpoint.camera(SIZE)
    seen, frame = counter.see(camera)
    counts = counter.count(seen, camera, view.sun.light())
    assert drawn.highest == counts.max() >= 1
    # The soft shade is the same all over the ground.
    ground = frame.normal[..., 2] > 0.99
    aside = np.array([0.45, -0.55, 0.70]) / np.linalg.norm([0.45, -0.55, 0.70])
    expected = find_count_colors(counts, find_top(drawn.highest)) * (0.8 + 0.2 * aside[2])
    apart = np.abs(picture - expected).max(2)[ground]
    assert (apart > 0.01).mean() < 0.01


def test_cases_edges_and_volumes_change_what_they_should(painter, tower):
    view = make_view(tower, SIZE)
    painter.draw(view, SIZE)
    plain = painter.read().astype(int)
    counter = FrameCounter(tower, ground=0.0)
    seen, _ = counter.see(view.viewpoint.camera(SIZE))
    is_caster = seen.face >= 0

    painter.draw(view.toggle("cases"), SIZE)
    tinted = np.abs(painter.read() - plain).max(2) > 8
    assert (tinted == is_caster).mean() > 0.99
    blue = (painter.read().astype(int) - plain)[is_caster]
    assert blue[:, 2].mean() > blue[:, 0].mean()

    drawn = painter.draw(view.toggle("edges"), SIZE)
    assert drawn.edges == 12  # a box seen from a corner has six, and there are two
    changed = np.abs(painter.read() - plain).max(2) > 40
    assert 0.002 < changed.mean() < 0.05

    painter.draw(view.toggle("volumes"), SIZE)
    assert (np.abs(painter.read() - plain).max(2) > 3).mean() > 0.01


def draw_volumes(device, away):
    """Draw the volumes of a lamp so far from an edge, and whether points near it were split."""
    scene = make_scene(*box((0, 0, 0), (4, 4, 4)))
    camera, lamp = (
        umbra.Camera((14, -12, 9), (2, 2, 1), size=SIZE),
        point_light((4 + away, 2, 4 - away)),
    )
    renderer = SceneRenderer(scene, 0.0, device=device, choices=VolumeOptions(shorten=False))
    overlays = Overlays(renderer)
    renderer.draw(camera, [lamp])
    plain = renderer.read().astype(int)
    with State(device) as state:
        overlays.draw(state, renderer.targets, renderer.plans[0], frozenset({"volumes"}))
    changed = np.abs(renderer.read() - plain).max(2) > 3
    is_near = renderer.planner.indices.nearby is not None
    overlays.release()
    renderer.release()
    return changed, is_near


def test_shown_volumes_beside_a_lamp_are_those_that_are_counted(device):
    near, is_near = draw_volumes(device, 0.0001)
    far, is_far = draw_volumes(device, 0.012)
    assert (is_near, is_far) == (True, False)
    assert far.mean() > 0.02
    assert (near != far).mean() < 0.1 * far.mean()


def test_overlays_lie_over_the_cpus_picture_too(painter, tower):
    view = make_view(tower, SIZE).choose_device("cpu")
    painter.draw(view, SIZE)
    plain = painter.read().astype(int)
    for overlay in ("volumes", "cases", "edges", "counts"):
        painter.draw(view.toggle(overlay), SIZE)
        assert (np.abs(painter.read() - plain).max(2) > 3).mean() > 0.002


def test_nothing_is_chosen_at_night(painter, tower):
    view = make_view(tower, SIZE)
    dark = replace(view, sun=replace(view.sun, shines=False), overlays=frozenset({"counts"}))
    for each in (dark, dark.choose_device("cpu")):
        drawn = painter.draw(each, SIZE)
        assert drawn.statistics == {}
        assert painter.read().max() > 0


def test_a_wrong_method_is_told(painter, tower):
    view = make_view(tower, SIZE)
    inside = replace(
        view.choose_method("z-pass"),
        viewpoint=replace(view.viewpoint, target=(4.0, 0.5, 0.5), distance=0.6, near=0.001),
        sun=replace(view.sun, azimuth=270.0, altitude=20.0),
    )
    for each in (inside, inside.choose_device("cpu")):
        (warning,) = set(painter.draw(each, SIZE).warnings)
        assert "z-pass is wrong for this view" in warning


def test_a_lamp_among_many_instances(device):
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
                [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])  # fmt: skip
    parts = []
    for number in range(9):
        transform = np.eye(4)
        transform[:2, 3] = divmod(number, 3)
        transform[:2, 3] *= 2
        parts.append(Part(f"tetrahedron {number}", "", mesh, transform=transform))
    scene = make_scene(parts)
    painter = ViewPainter(device, scene, 0.0)
    view = make_view(scene, SIZE).add_light(point_light((2.5, 2.5, 3)))
    for overlay in ("volumes", "cases", "edges", "counts"):
        view = view.toggle(overlay)
    drawn = painter.draw(view, SIZE)
    assert drawn.statistics[0].shells == 9
    assert 27 <= drawn.edges <= 36
    painter.release()


@pytest.mark.parametrize("no_cast", [{0}, {1}, {0, 1}])
def test_parts_that_cast_nothing_are_still_seen(painter, tower, no_cast):
    view = make_view(tower, SIZE)
    painter.draw(view, SIZE)
    whole = painter.read().astype(int)
    still = view.choose_casters({0, 1} - no_cast, 2)
    drawn = painter.draw(still, SIZE)
    assert drawn.statistics[SUN].shells == 2 - len(no_cast)
    of_gl = painter.read().astype(int)
    camera, lights = view.viewpoint.camera(SIZE), [*view.shining().values()]
    names = [tower.parts[number].name for number in no_cast]
    render = partial(
        umbra.render, tower, camera, lights, ground=0.0, no_cast=names, samples=1, style="plain"
    )
    assert (np.abs(of_gl - render(device="gl")).max(2) > 1).mean() < 0.001
    assert (np.abs(of_gl - render()).max(2) > 3).mean() < 0.01
    assert (np.abs(of_gl - whole).max(2) > 10).mean() > 0.001
    painter.draw(still.next_device(), SIZE)
    assert (np.abs(painter.read() - render()).max(2) > 1).mean() < 0.001
    painter.draw(view, SIZE)
    np.testing.assert_array_equal(painter.read(), whole)


def test_components_are_told_apart(device):
    boxes = [box((3 * n, 0, 0), (3 * n + 1, 1, 1 + n)) for n in range(2)]
    vertices, faces = box((6, 0, 0), (7, 1, 1))
    meshes = [*boxes, (vertices, faces[2:])]  # without its floor
    scene = make_scene([Part(str(n), "", Mesh(*mesh)) for n, mesh in enumerate(meshes)])
    painter = ViewPainter(device, scene, 0.0)
    view = make_view(scene, SIZE)
    painter.draw(view, SIZE)
    plain = painter.read().astype(int)
    drawn = painter.draw(view.toggle("components"), SIZE)
    assert drawn.components == (2, 1)
    camera = view.viewpoint.camera(SIZE)
    part = FrameCounter(scene, ground=0.0).see(camera)[1].part
    colors = [painter.read()[part == n].mean(0) - plain[part == n].mean(0) for n in range(3)]
    assert colors[2][0] > max(colors[0][0], colors[1][0]) + 10  # what is open is red
    assert np.abs(colors[0] - colors[1]).max() > 10
    assert (np.abs(painter.read() - plain).max(2) > 8)[part < 0].mean() < 0.02
    assert painter.draw(view.toggle_cast(2).toggle("components"), SIZE).components == (2, 0)
    assert painter.draw(view, SIZE).components is None
    painter.release()


def test_the_part_under_a_pixel_is_found(tower):
    camera = make_view(tower, SIZE).viewpoint.camera(SIZE)
    part = FrameCounter(tower, ground=0.0).see(camera)[1].part
    for number in range(2):
        row, col = np.argwhere(part == number).mean(0).round().astype(int)
        assert find_part(tower, camera, (col, row)) == part[row, col] == number
    assert find_part(tower, camera, (1, 1)) is None


def test_lamps_alone_shine_at_night_on_both_devices(painter, tower):
    day = make_view(tower, SIZE)
    lamps = day.add_light(point_light((6, -12, 9), (0.9, 0.9, 0.9)))
    night = replace(lamps, sun=replace(day.sun, shines=False))
    pictures = []
    for view in (day, day, night, night, night.choose_device("cpu"), day):  # twice: it is kept
        painter.draw(view, SIZE)
        pictures.append(painter.read().astype(int))
    for picture in pictures[2:5]:
        assert picture[0].mean() < 0.6 * pictures[0][0].mean()
        assert picture.min() < 0.6 * pictures[0].min()
        assert picture.max() > 150  # where the lamp shines
        assert (np.abs(picture - pictures[2]).max(-1) > 4).mean() < 0.01
    np.testing.assert_allclose(pictures[5], pictures[0], atol=1)
