"""The window: glfw, its OpenGL context and Dear ImGui, opened and closed together."""

import ctypes
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from umbra.errors import InputError, UmbraError
from umbra.gl.backends import WindowBinding, has_display, hint_window
from umbra.gl.context import Device, tell_driver
from umbra.packages import write_install

__all__ = ["ACCENT", "FONT_SIZE", "INK", "QUIET", "Screen", "check_display"]

_FONTS, FONT_SIZE = ("fonts/Roboto/Roboto-Regular.ttf", "fonts/Roboto/Roboto-Bold.ttf"), 15.0


def check_display(instead: str) -> None:
    """
    Check, without opening one, that a window can be opened.

    Raises `UmbraError` if a package is missing, and `InputError` without a display, which
    names the command to use ``instead``.
    """
    for package in ("moderngl", "glfw", "imgui_bundle"):
        if find_spec(package) is None:
            name = package.replace("_", "-")
            msg = f"umbra view needs {name}, which is not installed; {write_install('view')}"
            raise UmbraError(msg, package=name)
    is_elsewhere = not sys.platform.startswith(("linux", "freebsd"))
    if not (is_elsewhere or has_display()):
        msg = f"there is no display to open a window on; draw a picture instead: {instead}"
        raise InputError(msg)


class Screen:
    """
    A window with an OpenGL 3.3 context and Dear ImGui.

    Parameters
    ----------
    title : str
    size : (int, int)
        Width and height.
    instead : str
        As in ``check_display``.

    Raises
    ------
    InputError
        If the display cannot be opened.
    UmbraError
        If the display has no OpenGL 3.3.

    Attributes
    ----------
    window
        The glfw window.
    device : Device
    unit : float
        Scale of text and widgets relative to a standard screen.
    """

    def __init__(self, title: str, size: tuple[int, int], instead: str) -> None:
        # Dear ImGui bundles the glfw that both must share, so it is imported first.
        from imgui_bundle import imgui  # noqa: I001, PLC0415
        import glfw  # noqa: PLC0415
        import moderngl  # noqa: PLC0415

        self._glfw, self._imgui = glfw, imgui
        reasons: list[str] = []
        glfw.set_error_callback(lambda _, text: reasons.append(_decode(text)))
        if not glfw.init():
            msg = (
                f"no window opens here ({'; '.join(reasons) or 'glfw does not start'}); "
                f"draw a picture instead: {instead}"
            )
            raise InputError(msg)
        hint_window(glfw)
        self.window: Any = glfw.create_window(*size, title, None, None)
        if not self.window:
            glfw.terminate()
            msg = f"no window with OpenGL 3.3 opens here ({'; '.join(reasons)}); {tell_driver()}"
            raise UmbraError(msg)
        glfw.make_context_current(self.window)
        glfw.swap_interval(1)
        # A dense screen needs larger text, unless its units are already larger than pixels.
        pixels, _ = glfw.get_framebuffer_size(self.window)
        dense, _ = glfw.get_window_content_scale(self.window)
        self.unit = max(dense * size[0] / max(pixels, 1), 1.0)
        self._context = moderngl.create_context(require=330)
        self.device = Device.of(self._context, "given", WindowBinding(self.window))

    def start_gui(self) -> None:
        """Start Dear ImGui; callbacks set earlier are called before its own."""
        imgui = self._imgui
        imgui.create_context()
        io = imgui.get_io()
        io.set_ini_filename("")
        folder = find_spec("imgui_bundle")
        for name in _FONTS if folder and folder.origin else ():  # the second is of headings
            font = Path(str(folder.origin)).parent / "assets" / name  # type: ignore[union-attr]
            if font.is_file():
                io.fonts.add_font_from_file_ttf(str(font), FONT_SIZE * self.unit)
        _set_style(imgui, self.unit)
        pointer = ctypes.cast(self.window, ctypes.c_void_p).value
        imgui.backends.glfw_init_for_opengl(pointer, True)
        imgui.backends.opengl3_init("#version 330")

    def begin(self) -> None:
        """Begin a Dear ImGui frame."""
        self.device.use()
        backends = self._imgui.backends
        backends.opengl3_new_frame()
        backends.glfw_new_frame()
        self._imgui.new_frame()

    def end(self) -> None:
        """Draw the Dear ImGui frame and present."""
        self.device.use()
        imgui = self._imgui
        imgui.render()
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())
        self._glfw.swap_buffers(self.window)

    def close(self) -> None:
        """Close the window and free its context."""
        imgui, glfw = self._imgui, self._glfw
        self.device.use()
        if imgui.get_current_context() is not None:
            if imgui.get_io().backend_renderer_user_data is not None:
                imgui.backends.opengl3_shutdown()
                imgui.backends.glfw_shutdown()
            imgui.destroy_context()
        self.device.release()
        self._context.release()
        glfw.destroy_window(self.window)
        glfw.terminate()


def _decode(text: Any) -> str:
    return text.decode(errors="replace") if isinstance(text, bytes) else str(text)


INK, QUIET, ACCENT = (0.110, 0.110, 0.133), (0.353, 0.353, 0.392), (0.184, 0.290, 0.541)
"""Colours of the page of ``umbra view --web``, too: words, remarks, what is set; sRGB."""
_RULE, _TINT = (0.839, 0.839, 0.863), (0.941, 0.937, 0.925)


def _set_style(imgui: Any, unit: float) -> None:
    imgui.style_colors_light()
    style, colors = imgui.get_style(), imgui.Col_
    style.window_rounding = style.frame_rounding = style.grab_rounding = 4.0
    style.window_border_size = 0.0
    style.frame_border_size = 1.0
    style.window_padding = imgui.ImVec2(14, 10)
    style.item_spacing = imgui.ImVec2(8, 5)
    style.separator_text_border_size = 1.0
    for name, color in (
        (colors.window_bg, (1.0, 1.0, 1.0)),
        (colors.border, (0.71, 0.71, 0.75)),
        (colors.separator, _RULE),
        (colors.frame_bg, (1.0, 1.0, 1.0)),
        (colors.frame_bg_hovered, _TINT),
        (colors.frame_bg_active, _TINT),
        (colors.header, (1.0, 1.0, 1.0)),
        (colors.header_hovered, _TINT),
        (colors.header_active, _TINT),
        (colors.button, (1.0, 1.0, 1.0)),
        (colors.button_hovered, _TINT),
        (colors.button_active, _RULE),
        (colors.popup_bg, (1.0, 1.0, 1.0)),
        (colors.slider_grab, ACCENT),
        (colors.slider_grab_active, (0.13, 0.21, 0.42)),
        (colors.check_mark, ACCENT),
        (colors.text, INK),
        (colors.text_disabled, QUIET),
    ):
        style.set_color_(name, imgui.ImVec4(*color, 1.0))
    style.scale_all_sizes(unit)
