"""A still eye's view holds after anything else was drawn into its targets."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box
from support.spheres import make_sphere

from umbra.errors import InputError
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, Material, Mesh, Part, directional_light, make_scene
from umbra.scene.exposure import NIGHT
from umbra.window.view_painter import ViewPainter
from umbra.window.view_state import make_view

CAMERA = Camera((0, -30, 15), (0, 0, 2), size=(120, 90))


def make_balls():
    """Make three coarse balls with smooth normals."""
    parts = []
    for x in (-8.0, 0.0, 8.0):
        mesh = make_sphere(1, 3.0, (0, 0, 0))
        normals = (mesh.vertices / 3.0).astype(np.float32)
        parts.append(Part(f"{x}", "", Mesh(mesh.vertices + [x, 0, 3.5], mesh.faces, normals)))
    return make_scene(parts)


def make_sun(turn):
    return directional_light((np.cos(turn), np.sin(turn), 0.5))


def count_apart(one, two):
    return int((np.abs(one.astype(int) - two).max(-1) > 1).sum())


@pytest.mark.parametrize("between", [{"lights": []}, {"lights": [make_sun(1)], "shadows": False}])
def test_after_a_picture_without_shadows(device, between):
    scene = make_balls()
    with (
        SceneRenderer(scene, 0.0, device=device) as kept,
        SceneRenderer(scene, 0.0, device=device) as fresh,
    ):
        for turn in range(3):
            kept.draw(CAMERA, [make_sun(turn)])
        for turn in range(3, 9):
            kept.draw(CAMERA, **between)
            kept.draw(CAMERA, [make_sun(turn)])
            assert count_apart(kept.read(), fresh.render(CAMERA, [make_sun(turn)])) == 0


def test_a_night_that_another_renderer_drew_first(device):
    scene = make_balls()
    with (
        SceneRenderer(scene, 0.0, device=device) as kept,
        SceneRenderer(scene, 0.0, device=device) as other,
    ):
        for turn in range(3):
            kept.draw(CAMERA, [make_sun(turn)])
        other.draw(CAMERA, [make_sun(3)], sky=NIGHT)
        kept.draw(CAMERA, [make_sun(3)], sky=NIGHT)
        assert count_apart(kept.read(), other.read()) == 0


def test_a_refused_size_leaves_the_renderer_as_it_was(device):
    with SceneRenderer(make_balls(), 0.0, device=device) as renderer:
        before = renderer.render(CAMERA, [make_sun(1)] * 2)
        with pytest.raises(InputError) as found:
            renderer.draw(replace(CAMERA, size=(10**6, 30)), [make_sun(1)])
        assert found.value.limit < 10**6
        np.testing.assert_array_equal(renderer.render(CAMERA, [make_sun(1)] * 2), before)


def make_views(scene):
    """Yield views of a still eye under a turning sun, with counts over one of them."""
    view = make_view(scene, (120, 90))
    for azimuth in range(10, 300, 50):
        overlays = frozenset({"counts"} if azimuth == 160 else ())
        yield replace(
            view, sun=replace(view.sun, azimuth=azimuth, altitude=25.0), overlays=overlays
        )


def test_after_counts_were_shown(device):
    scene = make_balls()
    kept = ViewPainter(device, scene, 0.0)
    for view in make_views(scene):
        kept.draw(view, (120, 90))
        fresh = ViewPainter(device, scene, 0.0)
        fresh.draw(view, (120, 90))
        assert count_apart(kept.read(), fresh.read()) == 0
        fresh.release()
    kept.release()


def test_shown_counts_are_whole_though_pictures_shorten(device):
    scene = make_scene([Part(f"{x}", "", make_sphere(2, 2.0, (x, 0, 9))) for x in (0, 8)])
    view = make_view(scene, (120, 90))
    painter = ViewPainter(device, scene, 0.0)
    assert painter.draw(view, (120, 90)).statistics[-1].low > 0
    drawn = painter.draw(view.toggle("counts").toggle("edges"), (120, 90))
    assert drawn.highest == 1
    assert drawn.statistics[-1].low == 0
    assert drawn.edges > 0
    dark = replace(view, sun=replace(view.sun, shines=False)).toggle("edges")
    assert painter.draw(dark, (120, 90)).edges == 0
    painter.release()


@pytest.mark.parametrize("height", [None, 30.0])
@pytest.mark.parametrize("far", [(0, 0, 0), (85_000, 447_000, 12)])
def test_a_floor_of_glass_lies_before_the_ground_in_its_plane(device, far, height):
    from umbra.cpu.frame import FrameCounter  # noqa: PLC0415
    from umbra.gl.frame_counter import GlFrameCounter  # noqa: PLC0415

    floor = np.array([[-20, -20, 0], [20, -20, 0], [20, 20, 0], [-20, 20, 0]], float) + far
    vertices, faces = box((-4, -4, 0), (4, 4, 9))
    parts = [Part("house", "", Mesh(np.asarray(vertices, float) + far, faces))]
    for opacity in (1.0, 0.5):
        material = Material((0.5, 0.7, 0.6), opacity=opacity)
        mesh = Mesh(floor, np.array([[0, 1, 2], [0, 2, 3]]))
        scene = make_scene([*parts, Part("floor", "", mesh, material=material)])
        camera = Camera(
            np.add(far, (20, -25, 14)), np.add(far, (0, 0, 3)), size=(40, 30), height=height
        )
        ground = float(far[2])
        seen, _ = FrameCounter(scene, ground=ground).see(camera)
        with GlFrameCounter(scene, ground=ground, device=device) as counter:
            np.testing.assert_array_equal(counter.see(camera)[0].face, seen.face)
        assert (seen.face >= 12).sum() > 200
    with SceneRenderer(scene, ground, device=device) as renderer:
        with_floor = renderer.render(camera, [make_sun(1)])
    with SceneRenderer(make_scene(parts), ground, device=device) as renderer:
        without = renderer.render(camera, [make_sun(1)])
    assert count_apart(with_floor, without) > 200


@pytest.mark.parametrize("turn", [0.0, 0.6, 0.8, 2.0, 4.0])
@pytest.mark.parametrize("below", [-3.0, 5.0])
def test_level_parallel_views_see_no_ground(device, turn, below):
    from umbra.cpu.frame import FrameCounter  # noqa: PLC0415
    from umbra.gl.frame_counter import GlFrameCounter  # noqa: PLC0415
    from umbra.rays.depth import GROUND  # noqa: PLC0415

    scene = make_scene(*box((-4, -4, 0), (4, 4, 9)))
    eye = 40 * np.cos(turn), 40 * np.sin(turn), below
    camera = Camera(eye, (0, 0, below), size=(40, 30), height=40.0)
    seen, _ = FrameCounter(scene, ground=0.0).see(camera)
    assert not (seen.face == GROUND).any()
    with GlFrameCounter(scene, ground=0.0, device=device) as counter:
        np.testing.assert_array_equal(counter.see(camera)[0].face, seen.face)
