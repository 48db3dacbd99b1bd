"""A sheet with one map or several: title, maps, key, scale bar, north arrow and note."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from umbra.writers.marks import Ticks, draw_frame, draw_north, draw_scale_bar, find_ticks
from umbra.writers.paper import (
    INK,
    LINE,
    QUIET,
    SMALL,
    SUBTITLE,
    TITLE,
    Leaf,
    Panel,
    Paper,
    measure_text,
    to_pixels,
    wrap,
)
from umbra.writers.picture_content import (
    AREA,
    DOTS_PER_INCH,
    DayMap,
    DayShadows,
    Plan,
    find_map_size,
)

__all__ = ["KEY_WIDTH", "MARGIN", "Sheet", "Words", "lay_out_sheet"]

MARGIN = 0.28
KEY_WIDTH = 1.32
NARROWEST = 4.4  # least width for the words [inch]


@dataclass(frozen=True, eq=False)
class Sheet(Panel):
    """A figure with a map, or several, and room for a key."""

    key_box: tuple[float, float, float, float]  # x, y, width, height [inch]
    is_wide: bool  # whether the key lies below the map rather than to its right
    panels: Sequence[Panel] = ()  # its maps, where there are several

    @property
    def maps(self) -> Sequence[Panel]:
        """Its maps, also where there is one."""
        return self.panels or (self,)

    @classmethod
    def of_panels(cls, panels: Sequence[Panel], key_box: tuple[float, float, float, float]) -> Self:
        """Return a sheet of several maps, the first of which is its own."""
        first = panels[0]
        return cls(first.leaf, first.plan, first.map_box, first.map_size, key_box, False, panels)


@dataclass(frozen=True)
class Words:
    """Words above and below the maps, broken into lines."""

    title: list[str]
    subtitle: list[str]
    note: list[str]

    @classmethod
    def of(cls, plan: Plan, width: float) -> "Words":
        """Break a plan's words into lines of at most ``width`` [inch]."""
        return cls(
            wrap(plan.title, TITLE, width, "bold"),
            wrap(plan.subtitle, SUBTITLE, width)
            + wrap(" · ".join(filter(None, (plan.date, plan.place))), SUBTITLE, width),
            wrap(plan.foot, SMALL, width),
        )

    @property
    def head(self) -> float:
        """Height of title and subtitle, margin and all [inch]."""
        lines = len(self.subtitle) * SUBTITLE + len(self.title) * TITLE
        return 0.16 + lines * LINE + MARGIN - 0.05

    @property
    def foot(self) -> float:
        """Height of the note, margin and all [inch]."""
        return MARGIN + len(self.note) * SMALL * LINE + (0.12 if self.note else 0)

    def draw(self, paper: Paper) -> None:
        """Write them at the head and the foot of the paper."""
        y = paper.leaf.height - MARGIN + 0.05
        for lines, size, weight, color in (
            (self.title, TITLE, "bold", INK),
            (self.subtitle, SUBTITLE, "normal", QUIET),
        ):
            for line in lines:
                y -= size * LINE
                paper.write(MARGIN, y + size * 0.3 / 72, line, size, weight=weight, color=color)
        for n, line in enumerate(reversed(self.note)):
            paper.write(MARGIN, MARGIN + n * SMALL * LINE, line, SMALL, color=QUIET)


def lay_out_sheet(
    plan: Plan, key_height: float, days: Sequence[DayMap] | Sequence[DayShadows] = ()
) -> Sheet:
    """
    Lay out a sheet, and draw all but the content of its maps and the key.

    One day has a large map with coordinates, and below it, if it is wide, a key of ``key_height``
    [inch]; each of several has a small one under its title and remark.
    """
    if len(days) > 1:
        return _lay_out_several(plan, [day.title for day in days], [day.remark for day in days])
    return _lay_out_one(plan, key_height)


def _lay_out_one(plan: Plan, key_height: float) -> Sheet:
    map_size = rows, cols = find_map_size(plan)
    w, h = cols / DOTS_PER_INCH, rows / DOTS_PER_INCH
    is_wide = w > 2.6 * h
    x_ticks, y_ticks, label_width = _find_ticks(plan, w, h)
    has_axes = any(plan.axes)

    left = MARGIN + (0.27 if has_axes else 0) + label_width
    width = max(left + w + (MARGIN + 0.1 if is_wide else 0.32 + KEY_WIDTH + MARGIN), NARROWEST)
    words = Words.of(plan, width - 2 * MARGIN)
    strip = words.foot
    bottom = strip + ((key_height + 0.2) if is_wide else 0) + (0.42 if has_axes else 0.1)
    left, bottom = to_pixels(left), to_pixels(bottom)
    height = bottom + h + words.head
    leaf = Leaf(to_pixels(width), to_pixels(height))
    if is_wide:
        key_box = (left + 3.0, strip, w - 3.0 - 0.8, key_height)
    else:
        key_box = (left + w + 0.32, bottom + 0.6, KEY_WIDTH, h - 0.6 - 0.85)
    sheet = Sheet(leaf, plan, (left, bottom, w, h), map_size, key_box, is_wide)

    words.draw(sheet)
    draw_frame(sheet, x_ticks, y_ticks, label_width)
    if is_wide:
        draw_scale_bar(sheet, left, strip + key_height / 2 - 0.05, 2.2, zero="center")
        draw_north(sheet, left + w - 0.3, strip + key_height / 2)
    else:
        draw_scale_bar(sheet, key_box[0], bottom + 0.03, KEY_WIDTH - 0.25)
        draw_north(sheet, key_box[0] + 0.3, bottom + h - 0.36)
    return sheet


def _find_ticks(plan: Plan, w: float, h: float) -> tuple[Ticks, Ticks, float]:
    """Find the ticks of a map of w by h inches, and how wide the labels beside it are."""
    x0, x1, y0, y1 = plan.extent
    across = find_ticks(x0, x1, w, lambda label: measure_text(label, SMALL) + 0.3)
    # A row of houses is low on its sheet, but still gets a few heights.
    up = find_ticks(y0, y1, h, lambda _: min(0.55, max(0.12, h / 4)))
    across, up = across if plan.axes[0] else [], up if plan.axes[1] else []
    return across, up, max((measure_text(label, SMALL) for _, label in up), default=0)


SHAPE = 1.4  # of all maps together: width by height
GAP, CAPTION = 0.2, 0.3  # between maps, and above each [inch]
WIDEST = 16.5  # of a row of maps [inch]
LEAST_HEIGHT = 3.6  # of the key [inch]


def _lay_out_several(plan: Plan, captions: Sequence[str], remarks: Sequence[str]) -> Sheet:
    """Lay out maps of the plan's extent, a remark of a line or more below each caption."""
    x0, x1, y0, y1 = plan.extent
    aspect, n = (x1 - x0) / (y1 - y0), len(captions)
    cols = min(
        range(1, n + 1), key=lambda c: abs(math.log(c * aspect / (math.ceil(n / c) * SHAPE)))
    )
    cols = 3 if n == 3 else cols  # beside each other they are compared
    rows = math.ceil(n / cols)
    area = min(AREA, 2 * AREA / n)
    area = min(area, WIDEST**2 / (cols**2 * aspect))
    w, h = (to_pixels(side) for side in (math.sqrt(area * aspect), math.sqrt(area / aspect)))
    wrapped = [wrap(remark, SMALL, w) for remark in remarks]
    caption_height = CAPTION + max(map(len, wrapped)) * SMALL * LINE
    maps_width = cols * w + (cols - 1) * GAP
    maps_height = max(rows * (h + caption_height) + (rows - 1) * GAP, LEAST_HEIGHT)
    width = to_pixels(MARGIN + maps_width + 0.32 + KEY_WIDTH + MARGIN)
    words = Words.of(plan, width - 2 * MARGIN)
    bottom = to_pixels(words.foot + 0.1)
    height = to_pixels(bottom + maps_height + words.head)
    leaf = Leaf(width, height)
    map_size = round(h * DOTS_PER_INCH), round(w * DOTS_PER_INCH)
    left = to_pixels(MARGIN)
    panels = []
    for k, caption in enumerate(captions):
        row, col = divmod(k, cols)
        x = to_pixels(left + col * (w + GAP))
        y = to_pixels(height - words.head - (row + 1) * (h + caption_height) - row * GAP)
        panel = Panel(leaf, plan, (x, y, w, h), map_size)
        draw_frame(panel, [], [], 0)
        for n_line, line in enumerate(reversed(wrapped[k])):
            panel.write(x, y + h + 0.07 + n_line * SMALL * LINE, line, SMALL, color=QUIET)
        top = y + h + 0.08 + len(wrapped[k]) * SMALL * LINE
        panel.write(x, top, caption, SUBTITLE, weight="bold")
        panels.append(panel)
    key_x = left + maps_width + 0.32
    key_box = (key_x, bottom + 0.6, KEY_WIDTH, maps_height - 0.6 - 0.95)
    sheet = Sheet.of_panels(panels, key_box)
    words.draw(sheet)
    draw_scale_bar(panels[0], key_x, bottom + 0.03, KEY_WIDTH - 0.25)
    draw_north(panels[0], key_x + 0.3, bottom + maps_height - 0.45)
    return sheet
