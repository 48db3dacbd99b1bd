"""
The viewer's loop: events update the view; a changed view is drawn.

Nothing is drawn while idle. ``Controls`` handles mouse and keys; the scene is redrawn only
for a new view or size, Dear ImGui for a few frames after each event.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from imgui_bundle import imgui  # before glfw, whose library it brings

# isort: split
import glfw
import numpy as np

from umbra.devices import DEVICES
from umbra.errors import InputError, UmbraError
from umbra.folders.atomic import replace_file
from umbra.gl.programs import Program
from umbra.gl.state import Pass, State
from umbra.scene import Scene
from umbra.scene.pale import has_looks
from umbra.window.controls import Controls
from umbra.window.frame_profile import HOURS
from umbra.window.handles import GRIP, find_part
from umbra.window.hud import PictureArea, draw_handles, draw_help, draw_scale, draw_statistics
from umbra.window.input_events import Events
from umbra.window.overlays import find_top
from umbra.window.pacing import SMOOTH, Pacing
from umbra.window.panel import PanelState, draw_panel
from umbra.window.screen import Screen
from umbra.window.view_file import load_view, save_view
from umbra.window.view_painter import DrawnView, ViewPainter
from umbra.window.view_state import ViewState
from umbra.writers.pixels import write_png

__all__ = ["PANEL", "Viewer", "run_viewer"]

PANEL = 290
"""Width of the panel, in the window's units."""

_REST, _FASTEST = 0.5, 1 / 60  # [s] between idle checks, [s] per frame
_BOTH = 560.0  # width of help and statistics side by side
_LONGEST = 0.1  # [s] that a view advances in one frame


class Viewer:
    """
    Interactive window of a scene.

    Parameters
    ----------
    screen : Screen
        Closed with the viewer.
    scene : Scene
    view : ViewState
        Initial view.
    title : str
    ground : float, optional
        z of a drawn, receiving plane [m].
    threads : int
        For pictures on the CPU.
    picture : Path
        File of screenshots; further ones get a number.
    view_file : Path
        File to save and load views.
    animates : bool
        Whether to start the view's animation.
    """

    def __init__(
        self,
        screen: Screen,
        scene: Scene,
        view: ViewState,
        *,
        title: str,
        ground: float | None = None,
        threads: int = 1,
        picture: Path,
        view_file: Path,
        animates: bool = False,
    ) -> None:
        self.screen, self.picture, self._images_of = screen, picture, view.lights
        self.panel = PanelState(title, str(view_file))
        self.painter = ViewPainter(
            screen.device, scene, ground, threads, is_pale=not has_looks(scene)
        )
        self._show = Program(screen.device, "picture.vert.glsl", "show.frag.glsl")
        self._has_panel, self._has_help = True, False
        self._pacing = Pacing(is_software=screen.device.is_software)
        self._shown: tuple[Any, ...] | None = None
        self._wanted: tuple[Any, ...] | None = None
        self._since = 0.0  # when that was first wanted
        self._drawn: DrawnView | None = None
        self._is_panel_held = False
        frame = self._find_frame()
        grip = GRIP * screen.unit * frame.scale
        motion = self.painter.motion
        self.controls = Controls(
            scene.bounds(), frame.pixels, grip, animates=animates, motion=motion
        )
        self.events = Events(screen.window, view, self.controls, frame)
        screen.start_gui()

    def run(self) -> None:
        """Show the window until it is closed."""
        last = time.perf_counter()
        while not glfw.window_should_close(self.screen.window):
            spent = time.perf_counter() - last
            if self.controls.needs_time:
                glfw.wait_events_timeout(max(_FASTEST - spent, 1e-3))
            elif self.events.stirs or self._is_stale():
                glfw.poll_events()
            else:
                glfw.wait_events_timeout(_REST)
            now = time.perf_counter()
            if self.controls.needs_time:
                passed = min(now - last, _LONGEST)
                self.events.view = self.controls.advance(self.events.view, passed)
            last = now
            if self.events.stirs or self.controls.needs_time or self._is_stale():
                self.events.stirs = max(self.events.stirs - 1, 0)
                self._draw()

    def close(self) -> None:
        """Free all objects and close the window; `UmbraError` if any are left."""
        self.painter.release()
        self._show.release()
        left = sorted(self.screen.device.live)
        self.screen.close()
        if left:
            msg = f"{len(left)} objects were left on the device (first: {left[0]}); report this"
            raise UmbraError(msg, left=left)

    # -- drawing ---------------------------------------------------------------------------

    def _find_frame(self) -> PictureArea:
        """Find the picture's area: the window without the panel."""
        width, height = glfw.get_window_size(self.screen.window)
        pixels, _ = glfw.get_framebuffer_size(self.screen.window)
        panel = PANEL * self.screen.unit
        left = panel if self._has_panel and width > 2 * panel else 0.0
        return PictureArea((left, 0.0), (width - left, float(height)), pixels / max(width, 1))

    def _choose(self) -> tuple[Any, ...]:
        """Return the picture's inputs: view, size, step, samples per pixel."""
        moves = self.controls.is_moving or self._is_panel_held
        view = self.events.view
        wanted = (view, self.events.frame.pixels, self._pacing.choose_step(moves))
        if wanted != self._wanted:
            self._wanted, self._since = wanted, time.perf_counter()
        if not DEVICES[view.device].is_window or view.overlays:
            return *wanted, 1  # as they are drawn
        if self._shown is not None and self._shown == (*wanted, SMOOTH):
            return self._shown
        return *wanted, self._pacing.choose_samples(time.perf_counter() - self._since)

    def _is_stale(self) -> bool:
        return self._shown != self._choose()

    def _draw(self) -> None:
        events = self.events
        frame = events.frame = self._find_frame()
        self.controls.size = frame.pixels
        if min(frame.size) < 8:  # minimised
            glfw.wait_events_timeout(_REST)
            return
        self.screen.begin()
        if frame.corner[0] > 0:
            size = (frame.corner[0], frame.size[1])
            parts = self.painter.scene.parts
            events.view = draw_panel(events.view, self.panel, self.controls, size, parts)
        self._is_panel_held = imgui.is_any_item_active() and imgui.is_mouse_down(0)
        self._obey()
        events.view = self.painter.motion.follow(events.view)
        if self._is_stale():
            self._paint(self._choose())
        view = events.view
        draw_handles(
            view, frame, frame.to_pixel(events.mouse) if events.is_over_picture() else None
        )
        if self._drawn is not None:
            if "counts" in view.overlays and view.chosen in view.shining():
                title = "Shadow counts: volumes that hold a point"
                draw_scale(title, find_top(self._drawn.highest), frame)
            elif self._drawn.period:
                hours = self._drawn.period
                draw_scale(f"Hours of shadow, of {hours:.3g}", hours, frame, hours=HOURS)
            has_room = frame.size[0] > _BOTH * self.screen.unit or not self._has_help
            if self.panel.statistics and has_room:
                draw_statistics(self._drawn, view, frame)
        if self._has_help:
            draw_help(frame)
        self._put_picture()
        self.screen.end()

    def _paint(self, wanted: tuple[Any, ...]) -> None:
        """Draw the scene into the painter's target."""
        view, (cols, rows), step, samples = wanted
        size = (max(cols // step, 1), max(rows // step, 1))
        self._drawn = self.painter.draw(
            view, size, times=self.panel.statistics, shrink=step, samples=samples
        )
        self.panel.warnings = self._drawn.warnings
        self._pacing.note(step, self._drawn.spent, samples)
        self._shown = wanted

    def _put_picture(self) -> None:
        """Draw the picture into the window."""
        gl, frame = self.screen.device.gl, self.events.frame
        targets = self.painter.renderer.targets
        assert targets is not None
        cols, rows = frame.pixels
        left = round(frame.corner[0] * frame.scale)
        gl.BindFramebuffer(0x8D40, 0)
        gl.Viewport(0, 0, left + cols, rows)
        with State(self.screen.device) as state:
            state.use(Pass(color_write=True, scissor=(left, 0, cols, rows)))
            targets.picture.bind(0)
            for name in (0x2800, 0x2801):  # linear filter when enlarged
                gl.TexParameteri(0x0DE1, name, 0x2601)
            self._show.set(
                picture=0, corner=np.array([left, 0.0]), size=np.array([cols, rows], float)
            )
            self._show.draw(3)

    # -- commands --------------------------------------------------------------------------

    def _obey(self) -> None:
        """Execute the pending commands."""
        commands, self.controls.commands = self.controls.commands, []
        for command in commands:
            self.events.stir()
            try:
                self._do(command)
            except (InputError, OSError) as error:
                self.panel.message = str(error)

    def _do(self, command: str) -> None:
        file = Path(self.panel.view_file)
        if command == "cast":
            self._toggle_cast()
        elif command == "screenshot":
            self.panel.message = f"saved {self._shoot()}"
        elif command == "save":
            save_view(file, self.events.view)
            self.panel.message = f"saved {file}"
        elif command == "load":
            view = load_view(file, self._images_of)
            self.painter.motion.find_duration(view)  # raises for another model's animation
            land = self.events.view.sun.land  # of the model, as no view knows it
            self.events.view = replace(view, sun=replace(view.sun, land=land))
            self.panel.message = f"loaded {file}"
        elif command == "panel":
            self._has_panel = not self._has_panel
        elif command == "help":
            self._has_help = not self._has_help
        elif command == "quit":
            glfw.set_window_should_close(self.screen.window, True)

    def _toggle_cast(self) -> None:
        """Toggle whether the part under the mouse casts."""
        events, scene, part = self.events, self.painter.scene, None
        if events.is_over_picture():
            camera = events.view.viewpoint.camera(events.frame.pixels)
            part = find_part(scene, camera, events.frame.to_pixel(events.mouse))
        if part is None:
            self.panel.message = "point at a part with the mouse, then press X"
            return
        view = events.view = events.view.toggle_cast(part)
        casts = "casts no shadow" if part in view.no_cast else "casts"
        self.panel.message = f"{scene.parts[part].name} {casts}"

    def _shoot(self) -> Path:
        """Write the picture at full resolution, without panel and handles."""
        wanted = (self.events.view, self.events.frame.pixels, 1, SMOOTH)
        if self._shown != wanted:
            self._paint(wanted)
        path, number = self.picture, 1
        while path.exists():
            number += 1
            path = self.picture.with_stem(f"{self.picture.stem}-{number}")
        with replace_file(path) as beside:
            write_png(beside, self.painter.read())
        return path


def run_viewer(
    scene: Scene,
    view: ViewState,
    *,
    names: Sequence[str],
    size: tuple[int, int],
    instead: str,
    **options: Any,
) -> None:
    """
    Open a window on a scene and return when it is closed.

    Parameters
    ----------
    scene : Scene
    view : ViewState
    names : sequence of str
        Names of the files.
    size : (int, int)
        Size of the window.
    instead : str
        Alternative command, named in the `InputError` if no window opens.
    **options
        As for ``Viewer``.
    """
    title = ", ".join(names[:2]) + (f" and {len(names) - 2} more" if len(names) > 2 else "")
    screen = Screen(f"{title} - umbra", size, instead)
    try:
        viewer = Viewer(screen, scene, view, title=title, **options)
    except BaseException:
        screen.close()
        raise
    try:
        viewer.run()
    finally:
        viewer.close()
