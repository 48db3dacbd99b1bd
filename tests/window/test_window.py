"""The window on a display that nobody looks at: real mouse and keys, pictures compared."""

import contextlib
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.command import SCRIPT
from support.desk import Desk
from support.model_files import save_obj
from support.shapes import box

from umbra import read
from umbra.gl.scene_renderer import SceneRenderer
from umbra.ground.choice import find_ground
from umbra.scene.pale import PALENESS, PAPER, STUDIO, expose_suns, make_pale
from umbra.window.handles import find_handles, project
from umbra.window.pacing import SMOOTH
from umbra.window.view_state import SUN

PANEL = 290
SIZE = (1280 - PANEL, 800)
TIME_SLIDER = (105, 275, 159)  # left, right and middle of the panel's slider
COUNTING = (150, 457)  # the heading of the section that holds
DETAIL = (190, 535)  # the middle of the slider in a row of its own, below the size of masks


@pytest.fixture
def model(tmp_path):
    """A tower and a hut to its east, on the ground."""
    path = tmp_path / "model.obj"
    save_obj(path, {"tower": box((0, 0, 0), (2, 2, 6)), "hut": box((4, 0, 0), (5, 1, 1))})
    return path


@contextlib.contextmanager
def draw_pale(model):
    """Draw pictures as the window does, by the renderer alone: pale, its suns exposed."""
    ground = find_ground(read(model))
    scene = make_pale(ground.scene, PALENESS, PAPER)
    with SceneRenderer(scene, ground.level, ground_color=PAPER) as renderer:

        def draw(camera, lights, method="auto", *, samples=SMOOTH):
            renderer.still.forget()
            renderer.draw(camera, expose_suns(lights), method, samples=samples, sky=STUDIO)
            return renderer.read()

        yield draw


def open_desk(display, model, *more):
    return Desk(display, model.parent, model.name, "--lat", "48.2", "--lon", "16.37", *more)


def test_orbit_keys_slider_screenshot_and_close(display, model):
    with open_desk(display, model, "--date", "2026-06-21", "--at", "09:00") as desk:
        first = desk.view()
        assert first.sun.clock() == "09:00"

        desk.drag((700, 700), (760, 690), (800, 680))
        turned = desk.view()
        assert turned.viewpoint.heading == pytest.approx(first.viewpoint.heading + 30)
        assert turned.viewpoint.tilt == pytest.approx(first.viewpoint.tilt + 6)

        desk.drag((700, 700), (720, 700), button=3)
        assert desk.view().viewpoint.target != turned.viewpoint.target
        desk.display.do("click", 4)
        assert desk.view().viewpoint.distance == pytest.approx(0.9 * turned.viewpoint.distance)

        left, right, y = TIME_SLIDER
        middle = (left + right) // 2
        desk.drag((left + 66, y), (middle - 10, y), (middle, y), slowly=True)
        noon = desk.view()
        assert abs(noon.sun.minutes - 720) < 20
        desk.press("Right")
        assert desk.view().sun.minutes == noon.sun.minutes + 15

        desk.press("3", "m", "l")
        shown = desk.view()
        assert shown.overlays == {"edges"}
        assert shown.method == "z-pass"
        assert len(shown.lights) == 1
        assert shown.chosen == 0

        desk.press("3", "m")
        wanted = desk.view()
        desk.press("p")
        picture = np.asarray(Image.open(desk.wait_for("model.png")))
        status, out, err = desk.close()
    assert (status, out, err) == (0, "", "")
    assert sorted(path.name for path in model.parent.iterdir()) == [
        "model.obj", "model.png", "model.view.json"
    ]  # fmt: skip
    with draw_pale(model) as draw:
        lights = list(wanted.shining().values())
        expected = draw(wanted.viewpoint.camera(SIZE), lights, wanted.method)
    assert picture.shape == expected.shape
    apart = np.abs(picture.astype(int) - expected).max(2)
    assert (apart > 1).mean() < 1e-4
    assert expected.std() > 10


def test_lights_are_dragged_by_their_handles(display, model):
    with open_desk(display, model, "--date", "2026-06-21", "--at", "09:00") as desk:
        view = desk.view()
        (sun,) = find_handles(view, SIZE)
        x, y = PANEL + sun.at[0], sun.at[1]
        later = find_handles(desk_at(view, 600), SIZE)[0].at
        desk.drag((x, y), (x + 2, y), (PANEL + later[0], later[1]))
        assert desk.view().sun.minutes == pytest.approx(600, abs=10)

        desk.press("l")
        lit = desk.view()
        (lamp,) = (h for h in find_handles(lit, SIZE) if h.number == 0)
        x, y = PANEL + lamp.at[0], lamp.at[1]
        desk.drag((x, y), (x + 30, y + 5), (x + 60, y + 20))
        moved = desk.view()
        (after,) = (h for h in find_handles(moved, SIZE) if h.number == 0)
        assert after.at == pytest.approx((lamp.at[0] + 60, lamp.at[1] + 20), abs=2)
        assert moved.viewpoint == lit.viewpoint

        desk.press("Delete", "Delete")
        assert desk.view().shining().keys() <= {SUN}
        desk.press("ctrl+q")
        assert desk.finish() == (0, "", "")


def test_the_sun_goes_behind_the_land_of_a_file(display, model):
    """The file as study takes it; a loaded view keeps the land; the picture is that without sun."""
    land = model.parent / "ring.csv"
    land.write_text("azimuth,elevation\n" + "".join(f"{45 * k},25\n" for k in range(8)))
    when = ("--date", "2026-03-21", "--at", "16:30")
    with open_desk(display, model, "--horizon", land, *when) as desk:
        view = desk.view()
        assert view.sun.place()[1] > 10
        desk.press("ctrl+o", "p")
        dark = np.asarray(Image.open(desk.wait_for("model.png"))).astype(int)
        desk.press(*["Left"] * 16, "p")  # four hours earlier
        noon = np.asarray(Image.open(desk.wait_for("model-2.png"))).astype(int)
        assert desk.close() == (0, "", "")
    with draw_pale(model) as draw:
        camera = view.viewpoint.camera(SIZE)
        expected = [
            draw(camera, lights).astype(int)
            for lights in ([], list(desk_at(view, 750).shining().values()))
        ]
    for found, known in zip((dark, noon), expected, strict=True):
        assert (np.abs(found - known).max(2) > 1).mean() < 1e-4
    assert np.abs(noon - dark).max() > 50


def desk_at(view, minutes):
    from dataclasses import replace  # noqa: PLC0415

    return replace(view, sun=replace(view.sun, minutes=float(minutes)))


def test_walk_play_cpu_and_rest(display, model):
    with open_desk(display, model) as desk:
        first = desk.view()
        desk.press("c")
        desk.hold("w")
        walked = desk.view()
        ahead = walked.viewpoint.eye - first.viewpoint.eye
        assert ahead @ first.viewpoint.axes()[2] > 0.05
        assert ahead[2] == pytest.approx(0, abs=1e-9)

        desk.press("c", "space")
        desk.view()
        desk.press("space")
        played = desk.view()
        assert played.sun.minutes > first.sun.minutes
        desk.press("g")
        assert desk.view().device == "cpu"
        # Nothing moves: the processor rests, once the last frame is drawn.
        used = [find_processor_time(desk.process.pid)]
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and (len(used) < 2 or used[-1] - used[-2] > 0.25):
            time.sleep(1.0)
            used.append(find_processor_time(desk.process.pid))
        assert used[-1] - used[-2] <= 0.25, used
        assert desk.close()[0] == 0


def test_edges_are_smooth_once_nothing_moves(display, model):
    with open_desk(display, model, "--date", "2026-06-21", "--at", "09:00") as desk:
        view = desk.view()
        with draw_pale(model) as draw:
            lights, camera = list(view.shining().values()), view.viewpoint.camera(SIZE)
            jagged, smooth = (draw(camera, lights, samples=n) for n in (1, SMOOTH))
        differs = np.abs(jagged.astype(int) - smooth).max(2) > 30
        differs[:120] = False  # the legend
        assert differs.sum() > 300
        until, apart, looks = time.monotonic() + 60, 255.0, 0
        while apart > 5 and time.monotonic() < until:
            time.sleep(0.5)
            looks += 1
            if looks % 10 == 0:  # where a frame took a second on a busy machine: it is drawn again
                desk.press("Right", "Left")
            shown = desk.look()[:, PANEL:]
            levels = np.abs(shown.astype(int) - smooth)[differs].max(1)
            apart = 100 * (levels > 1).mean()  # compass and hours lie over some edges
        assert apart <= 5
        assert desk.close()[0] == 0


def test_the_part_under_the_mouse_casts_or_not(display, model):
    with open_desk(display, model, "--no-cast", "hut", "--detail", "1.25") as desk:
        first = desk.view()
        assert first.no_cast == {1}
        assert first.detail == 1.25
        desk.drag(COUNTING, COUNTING)
        desk.drag((DETAIL[0] - 20, DETAIL[1]), DETAIL, slowly=True)
        coarse = desk.view()
        assert coarse.detail == pytest.approx(4.0, abs=1.0)
        assert coarse.mask_scale == 1
        (place,) = project(first.viewpoint.camera(SIZE), np.array([[1.0, 1, 3]]))
        display.do("mousemove", round(PANEL + place[0]), round(place[1]))
        until = time.monotonic() + 60  # the panel lets the mouse go some frames after a drag
        while desk.view().no_cast == {1} and time.monotonic() < until:
            desk.press("x")
        assert desk.view().no_cast == {0, 1}
        desk.press("x", "5", "r")
        shown = desk.view()
        assert (shown.no_cast, shown.overlays, shown.mask_scale) == ({1}, {"components"}, 2)
        display.do("mousemove", PANEL + 5, 5)  # the ground
        desk.press("x")
        assert desk.view().no_cast == {1}
        assert desk.close() == (0, "", "")


def test_a_window_closed_while_it_draws_leaves_no_process(display, model):
    with open_desk(display, model) as desk:
        desk.view()
        desk.press("space")
        assert desk.close() == (0, "", "")
        with pytest.raises(ProcessLookupError):
            os.kill(desk.process.pid, 0)


def test_a_saved_view_begins(display, model):
    with open_desk(display, model) as desk:
        desk.drag((700, 700), (760, 690), (800, 680))
        desk.press("1", "2", "l")
        saved = desk.view()
        desk.close()
    path = model.parent / "model.view.json"
    with Desk(display, model.parent, model.name, "--view", path.name) as desk:
        begun = desk.view()
        desk.press("ctrl+q")
        assert desk.finish() == (0, "", "")
    assert begun.viewpoint == saved.viewpoint
    assert begun.sun == saved.sun
    assert begun.overlays == saved.overlays == {"volumes", "cases"}


def test_without_a_display_it_says_how_to_render(model):
    for package in ("moderngl", "glfw", "imgui_bundle"):
        pytest.importorskip(package)
    environment = {k: v for k, v in os.environ.items() if k not in {"DISPLAY", "WAYLAND_DISPLAY"}}
    for display, reason in ((None, "there is no display"), (":9876", "no window opens here")):
        if display is not None:
            environment["DISPLAY"] = display
        done = subprocess.run(
            [sys.executable, str(SCRIPT), "view", str(model)],
            capture_output=True, text=True, check=False, env=environment, timeout=60,
        )  # fmt: skip
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1
        assert reason in done.stderr
        assert f"umbra render {model} --eye" in done.stderr


def find_processor_time(pid):
    with contextlib.suppress(OSError):
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0
