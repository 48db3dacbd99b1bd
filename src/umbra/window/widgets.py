"""Small widgets shared by the panels."""

from collections.abc import Sequence

from imgui_bundle import imgui

from umbra.window.hud import grow

__all__ = ["DIM", "WARNING", "choose", "draw_key", "put_label", "say", "slide"]

WARNING = imgui.ImVec4(1.0, 0.72, 0.35, 1.0)
DIM = imgui.ImVec4(0.62, 0.65, 0.70, 1.0)


def put_label(text: str) -> None:
    """Write a label at the left; the next widget fills the rest of the row."""
    imgui.align_text_to_frame_padding()
    imgui.text(text)
    imgui.same_line(grow(104))
    imgui.set_next_item_width(-1)


def slide(text: str, name: str, value: float, low: float, high: float, flags: int = 0) -> float:
    """Draw a labelled slider; return the value as it was, in float64, unless the slider moved."""
    put_label(text)
    changed, found = imgui.slider_float(f"##{name}", value, low, high, " ", flags)
    return found if changed else value


def choose(name: str, place: int, labels: Sequence[str], width: float = -1.0) -> int:
    """Draw a choice from a list that opens; return the number of what is chosen."""
    imgui.set_next_item_width(width)
    return imgui.combo(f"##{name}", place, list(labels))[1]


def say(text: str, color: imgui.ImVec4) -> None:
    """Write text wrapped to the panel's width."""
    imgui.push_text_wrap_pos(0.0)
    imgui.text_colored(color, text)
    imgui.pop_text_wrap_pos()


def draw_key(entries: list[tuple[str, tuple[float, float, float]]]) -> None:
    """Draw a legend of colours in a row."""
    for place, (label, color) in enumerate(entries):
        if place:
            imgui.same_line(0, grow(12))
        at, side = imgui.get_cursor_screen_pos(), imgui.get_text_line_height() * 0.7
        low = imgui.ImVec2(at.x, at.y + 0.2 * side)
        high = imgui.ImVec2(at.x + side, at.y + 1.2 * side)
        tint = imgui.get_color_u32(imgui.ImVec4(*color, 1.0))
        imgui.get_window_draw_list().add_rect_filled(low, high, tint, 2.0)
        imgui.dummy(imgui.ImVec2(side, side))
        imgui.same_line(0, 5)
        imgui.text_colored(DIM, label)
