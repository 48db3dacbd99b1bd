"""Head-up display: handles of lights, the sun's path, the scale, statistics, help."""

import itertools

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from umbra.methods import METHODS
from umbra.window.controls import KEYS
from umbra.window.handles import GRIP, find_dome, find_handles, find_path, pick, project
from umbra.window.overlays import PALETTE, find_count_colors, find_scale_ticks
from umbra.window.screen import FONT_SIZE, INK
from umbra.window.view_painter import DrawnView
from umbra.window.view_state import SUN, ViewState

__all__ = [
    "PictureArea",
    "draw_handles",
    "draw_help",
    "draw_keys",
    "draw_scale",
    "draw_statistics",
    "grow",
]

_PAPER, _NORTH = (1.0, 1.0, 1.0), (0.64, 0.09, 0.09)
_SUN = (0.95, 0.71, 0.20)
_HOUR = (0.45, 0.29, 0.02)
_APART = 24.0  # labels of hours
_COMPASS = {"N": 0, "E": 90, "S": 180, "W": 270}
_CIRCLE = 72
_MARGIN = 12.0


def grow(length: float) -> float:
    """Scale a length for a standard screen to the units of this one."""
    return length * imgui.get_font_size() / FONT_SIZE


class PictureArea:
    """Area of the picture in the window, in Dear ImGui units of ``scale`` pixels."""

    def __init__(
        self, corner: tuple[float, float], size: tuple[float, float], scale: float
    ) -> None:
        self.corner, self.size, self.scale = corner, size, scale

    @property
    def pixels(self) -> tuple[int, int]:
        """Columns and rows of the picture at full resolution."""
        return max(round(self.size[0] * self.scale), 1), max(round(self.size[1] * self.scale), 1)

    def to_window(self, pixel: NDArray[np.float64] | tuple[float, float]) -> imgui.ImVec2:
        """Convert a pixel to a window position."""
        x, y = ((value + 0.5) / self.scale for value in pixel)
        return imgui.ImVec2(float(self.corner[0] + x), float(self.corner[1] + y))

    def to_pixel(self, at: tuple[float, float]) -> tuple[float, float]:
        """Convert a window position to a pixel."""
        x, y = ((a - c) * self.scale - 0.5 for a, c in zip(at, self.corner, strict=True))
        return x, y


def draw_handles(view: ViewState, frame: PictureArea, mouse: tuple[float, float] | None) -> None:
    """Draw the lights' handles and their guides; ``mouse`` is the pixel under it, if any."""
    draw = imgui.get_background_draw_list()
    low, size = frame.corner, frame.size
    draw.push_clip_rect(imgui.ImVec2(*low), imgui.ImVec2(low[0] + size[0], low[1] + size[1]))
    handles = find_handles(view, frame.pixels)
    if any(handle.number == SUN for handle in handles):
        _draw_dome(draw, view, frame)
    reached = pick(handles, mouse, grow(GRIP)) if mouse is not None else None
    for handle in handles:
        at = frame.to_window(handle.at)
        is_sun = handle.number == SUN
        color = _SUN if is_sun else _to_screen(view.lights[handle.number].color)
        if not is_sun:
            _draw_stem(draw, view, frame, handle.place)
        radius = grow(9.0 if is_sun else 7.0)
        is_reached = reached is not None and reached.number == handle.number
        if is_reached or handle.number == view.chosen:
            draw.add_circle(at, radius + grow(4.0), _tint(INK, 0.9 if is_reached else 0.45), 0, 2.0)
        draw.add_circle_filled(at, radius, _tint(color, 1.0))
        draw.add_circle(at, radius, _tint(INK, 0.9), 0, 1.5)
        if not is_sun:
            _write(draw, at.x + grow(14), at.y - grow(8), str(handle.number + 1))
    draw.pop_clip_rect()


def _draw_dome(draw: imgui.ImDrawList, view: ViewState, frame: PictureArea) -> None:
    """Draw the horizon with north, and the sun's path of the day with hours."""
    camera = view.viewpoint.camera(frame.pixels)
    middle, radius = find_dome(view.viewpoint)
    turn = np.linspace(0, 2 * np.pi, _CIRCLE + 1)
    ring = middle + radius * np.stack([np.sin(turn), np.cos(turn), 0 * turn], 1)
    _draw_line(draw, frame, project(camera, ring), INK, 0.6)
    north = view.sun.site.true_north if view.sun.site is not None else 0.0
    for name, azimuth in _COMPASS.items():
        turn = np.radians(north + azimuth)
        (at,) = project(
            camera, middle + 1.07 * radius * np.array([[np.sin(turn), np.cos(turn), 0.0]])
        )
        if not np.isnan(at).any():
            spot = frame.to_window(at)
            color = _NORTH if name == "N" else INK
            _write(draw, spot.x - grow(5), spot.y - grow(8), name, color)
    path = find_path(view)
    if path is not None:
        minutes, places = path
        pixels = project(camera, places)
        _draw_line(draw, frame, pixels, _SUN, 0.95, 2.0)
        hours = (minutes % 60 == 0) & ~np.isnan(pixels).any(1)
        last: imgui.ImVec2 | None = None
        for minute, pixel in zip(minutes[hours], pixels[hours], strict=True):
            spot = frame.to_window(pixel)
            draw.add_circle_filled(spot, grow(3.0), _tint(_HOUR, 1.0))
            away = spot if last is None else imgui.ImVec2(spot.x - last.x, spot.y - last.y)
            if np.hypot(away.x, away.y) > grow(_APART):  # hours crowd where the path turns away
                _write(draw, spot.x - grow(7), spot.y - grow(22), f"{minute / 60:02.0f}", _HOUR)
                last = spot


def _draw_line(
    draw: imgui.ImDrawList,
    frame: PictureArea,
    pixels: NDArray[np.float64],
    color: tuple[float, ...],
    opacity: float,
    width: float = 1.0,
) -> None:
    """Draw a line with a soft pale outline, visible on any background."""
    shown = ~np.isnan(pixels[:, 0])
    points = [frame.to_window(pixel) for pixel in np.nan_to_num(pixels)]
    rim, line = _tint(_PAPER, 0.6 * opacity), _tint(color, opacity)
    for tint, wide in ((rim, width + 1.2), (line, width)):
        for index in np.flatnonzero(shown[1:] & shown[:-1]):
            draw.add_line(points[index], points[index + 1], tint, wide)


def _write(
    draw: imgui.ImDrawList, x: float, y: float, text: str, color: tuple[float, ...] = INK
) -> None:
    """Write text with a pale outline."""
    for right, down in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        draw.add_text(imgui.ImVec2(x + right, y + down), _tint(_PAPER, 0.85), text)
    draw.add_text(imgui.ImVec2(x, y), _tint(color, 1.0), text)


def _draw_stem(
    draw: imgui.ImDrawList, view: ViewState, frame: PictureArea, position: NDArray[np.float64]
) -> None:
    """Draw a vertical line from a lamp to the target's height."""
    foot = np.array([position[0], position[1], min(view.viewpoint.target[2], position[2])])
    pixels = project(view.viewpoint.camera(frame.pixels), np.stack([position, foot]))
    _draw_line(draw, frame, pixels, INK, 0.7)


def draw_scale(title: str, top: float, frame: PictureArea, *, hours: NDArray | None = None) -> None:
    """Draw a scale of counts, or of hours in their colours, from 0 to ``top`` below the picture."""
    width, height = grow(260.0), grow(14.0)
    _begin("scale", frame, right=False, top=False)
    imgui.text(title)
    draw, at = imgui.get_window_draw_list(), imgui.get_cursor_screen_pos()
    ticks = find_scale_ticks(int(top))
    palette = PALETTE if hours is None else hours
    if hours is None and len(ticks) == top + 1:  # a field for each count
        step = width / len(ticks)
        for count in ticks:
            low = imgui.ImVec2(at.x + count * step, at.y)
            high = imgui.ImVec2(low.x + step, at.y + height)
            draw.add_rect_filled(
                low, high, _tint(find_count_colors(np.array(count), int(top)), 1.0)
            )
            _write_below(draw, low.x + step / 2, at.y + height, count)
    else:
        step = width / (len(palette) - 1)
        for index, (left, right) in enumerate(itertools.pairwise(palette)):
            low = imgui.ImVec2(at.x + index * step, at.y)
            high = imgui.ImVec2(low.x + step, at.y + height)
            a, b = _tint(left, 1.0), _tint(right, 1.0)
            draw.add_rect_filled_multi_color(low, high, a, b, b, a)
        for count in ticks:
            _write_below(draw, at.x + width * count / top, at.y + height, count)
    imgui.dummy(imgui.ImVec2(width, height + imgui.get_text_line_height() + 3))
    imgui.end()


def draw_statistics(drawn: DrawnView, view: ViewState, frame: PictureArea) -> None:
    """Draw the statistics of the last picture."""
    _begin("statistics", frame, right=True, top=True)
    cols, rows = drawn.size
    _write_row("frame", f"{drawn.spent:.1f} ms")
    _write_row("picture", f"{cols} x {rows}")
    if drawn.passes:
        imgui.separator()
        for name, spent in drawn.passes.items():
            _write_row(name, f"{spent:.2f} ms")
    statistics = drawn.statistics.get(view.chosen)
    if statistics is not None:
        imgui.separator()
        rows_of = {
            "casters": f"{statistics.shells:,}",
            "out of view": f"{statistics.culled:,}",
            "case 1, 2, 3": ", ".join(f"{n:,}" for n in statistics.cases),
            "sides": f"{statistics.sides:,}",
            "begun low": f"{statistics.low:,}",
            "light caps": f"{statistics.light_caps:,}",
            "dark caps": f"{statistics.dark_caps:,}",
            "index bytes": f"{statistics.index_bytes:,}",
            "counts in": view.method
            if view.method in METHODS["gl"].masks
            else statistics.counts_in,
        }
        if statistics.moved:
            rows_of |= {
                "coarser": f"{statistics.coarse:,}",
                "casters off": f"{statistics.moved:.2g} m",
            }
        for name, value in rows_of.items():
            _write_row(name, value)
    if drawn.edges:
        _write_row("edges", f"{drawn.edges:,}")
    if drawn.components is not None:
        closed, opened = drawn.components
        _write_row("components", f"{closed + opened:,}, {opened:,} open")
    imgui.end()


def draw_help(frame: PictureArea) -> None:
    """Draw the help on mouse and keys over the picture."""
    _begin("help", frame, right=False, top=True)
    draw_keys()
    imgui.end()


def draw_keys() -> None:
    """Draw what mouse and keys do."""
    mouse = {
        "Drag": "turn; on a light: move it",
        "Shift+drag": "pan; on a light: on its level",
        "Right drag": "pan",
        "Wheel": "nearer, away",
    }
    for keys, meaning in {**mouse, **KEYS, "F1": "this list"}.items():
        imgui.text(keys)
        imgui.same_line(grow(120))
        imgui.push_text_wrap_pos(0.0)
        imgui.text_disabled(meaning)
        imgui.pop_text_wrap_pos()


def _begin(name: str, frame: PictureArea, *, right: bool, top: bool) -> None:
    """Begin a passive window in a corner of the picture."""
    margin = grow(_MARGIN)
    x = frame.corner[0] + (frame.size[0] - margin if right else margin)
    y = frame.corner[1] + (margin if top else frame.size[1] - margin)
    pivot = imgui.ImVec2(float(right), float(not top))
    imgui.set_next_window_pos(imgui.ImVec2(x, y), imgui.Cond_.always.value, pivot)
    imgui.set_next_window_bg_alpha(0.88)
    flags = imgui.WindowFlags_
    imgui.begin(
        name,
        None,
        flags.no_decoration.value | flags.always_auto_resize.value | flags.no_inputs.value
        | flags.no_saved_settings.value | flags.no_nav.value | flags.no_focus_on_appearing.value,
    )  # fmt: skip


def _write_row(name: str, value: str) -> None:
    imgui.text_disabled(name)
    imgui.same_line(grow(100))
    imgui.text(value)


def _write_below(draw: imgui.ImDrawList, middle: float, y: float, number: int) -> None:
    text = str(number)
    width = imgui.calc_text_size(text).x
    draw.add_text(imgui.ImVec2(middle - width / 2, y + 2), _tint(INK, 1.0), text)


def _to_screen(color: tuple[float, float, float]) -> tuple[float, ...]:
    strength = max(*color, 1e-3)
    return tuple((value / strength) ** (1 / 2.2) for value in color)


def _tint(color: tuple[float, ...] | NDArray, alpha: float) -> int:
    red, green, blue = (float(value) for value in color)
    return imgui.get_color_u32(imgui.ImVec4(red, green, blue, alpha))
