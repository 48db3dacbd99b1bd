"""
The panel's sections on the model: animations, and parts with their casting.

Also small widgets that the panels share.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from imgui_bundle import imgui

from umbra.scene import Part
from umbra.window.controls import Controls
from umbra.window.hud import grow
from umbra.window.motion import Motion
from umbra.window.screen import QUIET
from umbra.window.view_state import ViewState

__all__ = [
    "DIM",
    "WARNING",
    "bold",
    "choose",
    "draw_animation",
    "draw_legend",
    "draw_parts",
    "put_label",
    "say",
    "slide",
]

WARNING = imgui.ImVec4(0.639, 0.200, 0.106, 1.0)
DIM = imgui.ImVec4(*QUIET, 1.0)


@contextmanager
def bold() -> Iterator[None]:
    """Write in the type of headings, if the window has one."""
    fonts = imgui.get_io().fonts.fonts
    imgui.push_font(fonts[1] if len(fonts) > 1 else None, 0.0)
    try:
        yield
    finally:
        imgui.pop_font()


def put_label(text: str) -> None:
    """Write a label at the left; the next widget fills the rest of the row."""
    imgui.align_text_to_frame_padding()
    imgui.text(text)
    imgui.same_line(grow(104))
    imgui.set_next_item_width(-1)


def slide(text: str, name: str, value: float, low: float, high: float, flags: int = 0) -> float:
    """Draw a labelled slider; return the value as it was, in float64, unless the slider moved."""
    put_label(text)
    changed, moved = imgui.slider_float(f"##{name}", value, low, high, " ", flags)
    return moved if changed else value


def choose(name: str, index: int, labels: Sequence[str], width: float = -1.0) -> int:
    """Draw a choice from a list that opens; return the number of what is chosen."""
    imgui.set_next_item_width(width)
    return imgui.combo(f"##{name}", index, list(labels))[1]


def say(text: str, color: imgui.ImVec4) -> None:
    """Write text wrapped to the panel's width."""
    imgui.push_text_wrap_pos(0.0)
    imgui.text_colored(color, text)
    imgui.pop_text_wrap_pos()


def draw_legend(entries: list[tuple[str, tuple[float, float, float]]]) -> None:
    """Draw a legend of colours in a row."""
    for index, (label, color) in enumerate(entries):
        if index:
            imgui.same_line(0, grow(12))
        at, side = imgui.get_cursor_screen_pos(), imgui.get_text_line_height() * 0.7
        low = imgui.ImVec2(at.x, at.y + 0.2 * side)
        high = imgui.ImVec2(at.x + side, at.y + 1.2 * side)
        tint = imgui.get_color_u32(imgui.ImVec4(*color, 1.0))
        imgui.get_window_draw_list().add_rect_filled(low, high, tint, 2.0)
        imgui.dummy(imgui.ImVec2(side, side))
        imgui.same_line(0, 5)
        imgui.text_colored(DIM, label)


_LISTED = 8  # parts visible in the list


def draw_animation(view: ViewState, controls: Controls, motion: Motion) -> ViewState:
    """Draw the choice of animation and its time; playback goes to ``controls``."""
    width = imgui.ImVec2(grow(70), 0)
    if imgui.button("Pause##animation" if controls.animates else "Play##animation", width):
        view = controls.press_key(view, "t")
    imgui.same_line()
    values = [*motion.choices.values()]
    last = values.index(view.animation) if view.animation in values else 0
    index = choose("animation", last, [*motion.choices])
    if index != last:
        view = replace(view, animation=values[index], time=0.0)
    duration = motion.find_duration(view)
    if duration > 0:
        text = f"{view.time:.2f} s of {duration:.3g}"
        view = replace(view, time=slide(text, "moment", view.time, 0.0, duration))
    return view


def draw_parts(view: ViewState, pattern: str, parts: Sequence[Part]) -> tuple[ViewState, str]:
    """
    Draw the list of parts that match a pattern, each with a checkbox to cast.

    Returns the view and the edited pattern.
    """
    imgui.set_next_item_width(-1)
    _, typed = imgui.input_text_with_hint("##pattern", "name, kind or layer", pattern)
    word = typed.strip()
    pattern = word if any(sign in word for sign in "*?[") else f"*{word}*"
    listed = [n for n, part in enumerate(parts) if not word or part.matches(pattern)]
    casting = set(range(len(parts))) - view.no_cast
    for label, chosen in (
        ("cast", casting.union(listed)), ("cast not", casting.difference(listed)),
        ("alone", set(listed)),
    ):  # fmt: skip
        if imgui.small_button(label):
            view = view.choose_casters(chosen, len(parts))
        imgui.same_line()
    imgui.text_colored(DIM, f"{len(listed)} listed")
    height = imgui.get_frame_height_with_spacing() * (min(max(len(listed), 1), _LISTED) + 0.5)
    imgui.begin_child("parts", imgui.ImVec2(-1, height))
    clipper = imgui.ListClipper()
    clipper.begin(len(listed))
    while clipper.step():
        for number in listed[clipper.display_start : clipper.display_end]:
            part = parts[number]
            name = ", ".join(filter(None, (part.name, part.kind))) or "part"
            changed, _ = imgui.checkbox(f"{name}##{number}", number not in view.no_cast)
            view = view.toggle_cast(number) if changed else view
    clipper.end()
    imgui.end_child()
    return view, typed
