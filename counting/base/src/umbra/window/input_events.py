"""Window events: glfw's mouse and key events turned into a new view."""

from typing import Any

from imgui_bundle import imgui  # before glfw, whose library it brings

# isort: split
import glfw

from umbra.window.controls import Controls
from umbra.window.hud import PictureArea
from umbra.window.view_state import ViewState

__all__ = ["Events"]

_SETTLE = 3  # frames after an event
_BUTTONS = {0: "left", 1: "right", 2: "middle"}
_KEYS = {
    glfw.KEY_SPACE: "space", glfw.KEY_TAB: "tab", glfw.KEY_LEFT: "left", glfw.KEY_RIGHT: "right",
    glfw.KEY_DELETE: "delete", glfw.KEY_F1: "f1",
    **{glfw.KEY_A + n: chr(ord("a") + n) for n in range(26)},
    **{glfw.KEY_0 + n: str(n) for n in range(10)},
}  # fmt: skip


class Events:
    """
    Holds the view, updated by events.

    ``window`` is a glfw window; sets its callbacks, so Dear ImGui must start afterwards.

    Attributes
    ----------
    frame : PictureArea
        Area of the picture, updated by the viewer.
    mouse : (float, float)
        Position at the last event, in the window.
    stirs : int
        Frames still to be drawn.
    """

    def __init__(
        self, window: Any, view: ViewState, controls: Controls, frame: PictureArea
    ) -> None:
        self.view, self.controls, self.frame = view, controls, frame
        self.mouse = (0.0, 0.0)
        self.stirs = _SETTLE
        self._listen(window)

    def _listen(self, window: Any) -> None:
        glfw.set_mouse_button_callback(window, self._on_button)
        glfw.set_cursor_pos_callback(window, self._on_cursor)
        glfw.set_scroll_callback(window, self._on_scroll)
        glfw.set_key_callback(window, self._on_key)
        glfw.set_char_callback(window, self.stir)
        glfw.set_cursor_enter_callback(window, self.stir)
        glfw.set_window_focus_callback(window, self._on_focus)
        glfw.set_framebuffer_size_callback(window, self.stir)
        glfw.set_window_refresh_callback(window, self.stir)

    def stir(self, *_: object) -> None:
        """Request a few more frames: Dear ImGui settles after an event."""
        self.stirs = _SETTLE

    def _on_button(self, _: Any, button: int, action: int, mods: int) -> None:
        self.stir()
        name = _BUTTONS.get(button)
        if name is None:
            return
        if action == glfw.RELEASE:
            self.controls.release(name)
            return
        if self.is_over_picture():
            shift = bool(mods & glfw.MOD_SHIFT)
            pixel = self.frame.to_pixel(self.mouse)
            self.view = self.controls.press(self.view, name, pixel, shift=shift)

    def _on_cursor(self, window: Any, x: float, y: float) -> None:
        self.stir()
        self.mouse = (x, y)  # glfw would return the position now, not at the event
        shift = any(
            glfw.get_key(window, key) == glfw.PRESS
            for key in (glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT)
        )
        self.view = self.controls.move(self.view, self.frame.to_pixel((x, y)), shift=shift)

    def _on_scroll(self, _: Any, __: float, steps: float) -> None:
        self.stir()
        if self.is_over_picture():
            self.view = self.controls.scroll(self.view, steps)

    def is_over_picture(self) -> bool:
        """Return whether the mouse is on the picture and not on a panel over it."""
        over = self.mouse[0] >= self.frame.corner[0]
        return over and not imgui.get_io().want_capture_mouse

    def _on_key(self, _: Any, key: int, __: int, action: int, mods: int) -> None:
        self.stir()
        name = _KEYS.get(key)
        if name is None:
            return
        if action == glfw.RELEASE:
            self.controls.release_key(name)
        elif not imgui.get_io().want_text_input:
            again = action == glfw.REPEAT
            if not again or name in {"left", "right"}:
                self.view = self.controls.press_key(
                    self.view, name,
                    control=bool(mods & glfw.MOD_CONTROL), shift=bool(mods & glfw.MOD_SHIFT),
                )  # fmt: skip

    def _on_focus(self, _: Any, focused: int) -> None:
        self.stir()
        if not focused:
            self.controls.let_go()
