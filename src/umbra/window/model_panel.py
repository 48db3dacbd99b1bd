"""The panel's sections on the model: animations, and parts with their casting."""

from collections.abc import Sequence
from dataclasses import replace

from imgui_bundle import imgui

from umbra.scene import Part
from umbra.window.controls import Controls
from umbra.window.hud import grow
from umbra.window.motion import Motion
from umbra.window.view import ViewState
from umbra.window.widgets import DIM, choose, slide

__all__ = ["draw_animation", "draw_parts"]

_LISTED = 8  # parts visible in the list


def draw_animation(view: ViewState, controls: Controls, motion: Motion) -> ViewState:
    """Draw the choice of animation and its time; playback goes to ``controls``."""
    width = imgui.ImVec2(grow(70), 0)
    if imgui.button("Pause##animation" if controls.animates else "Play##animation", width):
        view = controls.press_key(view, "t")
    imgui.same_line()
    values = [*motion.choices.values()]
    last = values.index(view.animation) if view.animation in values else 0
    place = choose("animation", last, [*motion.choices])
    if place != last:
        view = replace(view, animation=values[place], time=0.0)
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
