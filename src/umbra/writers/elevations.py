"""The sheet of a plan and its four elevations in standard scales, on A3 across."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from umbra.writers.contours import find_swatches
from umbra.writers.hours_map import draw_hours_key, fill_hours, list_dark
from umbra.writers.marks import draw_frame, draw_north, draw_scale_bar, find_ticks
from umbra.writers.paper import INK, SMALL, SUBTITLE, Leaf, Panel, measure_text, to_pixels
from umbra.writers.picture_content import DOTS_PER_INCH, DayMap, Plan, Show
from umbra.writers.sheet import KEY_WIDTH, MARGIN, Sheet, Words

__all__ = ["Arrangement", "arrange", "find_pixel_side", "make_elevations_sheet"]

PAPER = (420 / 25.4, 297 / 25.4)  # A3 [inch]
HEAD, FOOT = 1.05, 0.75  # of the words, at most [inch]
CAPTION, GAP, AXIS = 0.28, 0.22, 0.7  # above a map, between them, and left of one [inch]
SCALES = tuple(n * 10**power for power in range(1, 6) for n in (1, 2, 5))
"""A planner's scales: 1:100, 1:200, 1:500 and on."""
FINER_SCALES = SCALES[:3] + tuple(
    n * 10**power for power in range(4) for n in (100, 125, 150, 200, 250, 300, 400, 500, 750)
)
"""More of them, for what cannot grow with the paper."""
PADS = AXIS + GAP, CAPTION + GAP  # of a map, across and down [inch]
WAYS = (1, True), (2, True), (2, False), (1, False)
"""Columns of elevations, and whether they are beside the plan or below it."""
ROOM = PAPER[0] - 2 * MARGIN - KEY_WIDTH - 0.4, PAPER[1] - HEAD - FOOT
Size = tuple[float, float]


@dataclass(frozen=True)
class Arrangement:
    """Places of maps on the paper."""

    scale: int  # 500 where a metre is 2 mm long
    corners: list[Size]  # of each map, the plan first, from the room's upper left, downward [inch]
    plan: Size  # width and height of the plan for which there is room [m]
    of_elevations: int  # their scale

    def per_metre(self, map_number: int = 0) -> float:
        """Return the length of a metre on the paper, in the plan or another map [inch]."""
        return 1000 / 25.4 / (self.of_elevations if map_number else self.scale)


def arrange(need: Size, most: Size, elevations: Sequence[Size]) -> Arrangement:
    """
    Choose the largest standard scale at which all fits, and arrange the paper.

    The plan takes at least ``need``, the model and relevant shadows, and at most ``most``; sizes
    are (width, height) [m]. A plan that may grow fills the paper, in one scale with its elevations.
    One that may not takes a finer scale, and elevations a larger one, if there is room.
    """
    grows = not np.isfinite(most).all()
    for scale in SCALES if grows else FINER_SCALES:
        per_metre = 1000 / 25.4 / scale
        found: list[tuple[float, int, int, Size, list[Size]]] = []
        for other in (scale,) if grows else (one for one in FINER_SCALES if one <= scale):
            larger = 1000 / 25.4 / other
            boxes = [(w * larger + PADS[0], h * larger + PADS[1]) for w, h in elevations]
            for across, beside in WAYS if grows else (*WAYS, (4, False)):
                block = _Block.of(boxes, across)
                free = [ROOM[k] - (block.size[k] if beside == (k == 0) else 0) for k in (0, 1)]
                free = [(side - pad) / per_metre for side, pad in zip(free, PADS, strict=True)]
                fits = block.size[0] <= ROOM[0] and block.size[1] <= ROOM[1]
                if fits and all(have >= side for have, side in zip(free, need, strict=True)):
                    plan = min(free[0], most[0]), min(free[1], most[1])
                    paper = [side * per_metre + pad for side, pad in zip(plan, PADS, strict=True)]
                    corners = block.lay(paper, ROOM, beside)
                    found.append((plan[0] * plan[1], -other, -len(found), plan, corners))
        if found:
            _, other, _, plan, corners = max(found)
            return Arrangement(scale, corners, plan, -other)
    return Arrangement(SCALES[-1], [(0.0, 0.0)] * (1 + len(elevations)), need, SCALES[-1])


@dataclass(frozen=True)
class _Block:
    """Elevations in rows and columns."""

    across: int  # columns
    wide: list[float]  # of each column [inch]
    high: list[float]  # of each row [inch]

    @classmethod
    def of(cls, boxes: list[Size], across: int) -> "_Block":
        wide = [max(w for w, _ in boxes[k::across]) for k in range(across)]
        rows = [boxes[k : k + across] for k in range(0, len(boxes), across)]
        return cls(across, wide, [max(h for _, h in row) for row in rows])

    @property
    def size(self) -> Size:
        """Width and height [inch]."""
        return sum(self.wide), sum(self.high)

    def lay(self, plan: Sequence[float], room: Size, beside: bool) -> list[Size]:
        """Return the corners of the plan and of each elevation, spare room shared between them."""
        x0, y0 = (plan[0], 0.0) if beside else (0.0, plan[1])
        spare = room[0] - x0 - self.size[0], room[1] - y0 - self.size[1]
        # Beside the plan each column has its gap, below it each row has.
        step_x = spare[0] / (self.across if beside else max(self.across - 1, 1))
        step_y = spare[1] / (max(len(self.high) - 1, 1) if beside else len(self.high))
        first_x, first_y = (step_x, 0.0) if beside else (0.0, step_y)
        corners = [(0.0, 0.0)]
        for k in range(self.across * len(self.high)):
            row, column = divmod(k, self.across)
            x = x0 + first_x + sum(self.wide[:column]) + column * step_x
            corners.append((x, y0 + first_y + sum(self.high[:row]) + row * step_y))
        return corners


def make_elevations_sheet(
    arrangement: Arrangement,
    maps: Sequence[tuple[str, Plan, DayMap]],
    max_hours: float,
    show: Show = "shadow",
    what: str = "",
) -> Sheet:
    """
    Draw a plan and its elevations: maps of (caption, plan, hours), the plan first.

    The first plan has the words of the sheet. ``max_hours`` is the colour scale's end
    [h]; ``what`` names the hours in the key, by default hours in shadow or in the sun.
    """
    width, height = (to_pixels(side) for side in PAPER)
    leaf = Leaf(width, height)
    first = maps[0][1]
    scale, other = (
        f"1:{n:,}".replace(",", "\u2009") for n in (arrangement.scale, arrangement.of_elevations)
    )
    told = scale if scale == other else f"plan {scale}, elevations {other}"
    words = Words.of(
        replace(
            first,
            title=f"{first.title}, plan and elevations",
            note=f"{told} on A3 (420 x 297 mm) · {first.note}",
        ),
        width - 2 * MARGIN,
    )
    top = height - max(words.head, HEAD)
    panels = []
    for k, (caption, plan, day) in enumerate(maps):
        x, y = arrangement.corners[k]
        named = caption if scale == other else f"{caption}, {other if k else scale}"
        corner = MARGIN + AXIS + x, top - CAPTION - y
        panel = _make_panel(leaf, plan, corner, arrangement.per_metre(k))
        panel.write(panel.map_box[0], top - CAPTION - y + 0.08, named, SUBTITLE, weight="bold")
        fill_hours(panel, day, max_hours, show)
        _draw_axes(panel)
        panels.append(panel)
    key_x, bottom = width - MARGIN - KEY_WIDTH, FOOT
    key_box = (key_x, bottom + 0.6, KEY_WIDTH, top - bottom - 0.6 - 0.85)
    sheet = Sheet.of_panels(panels, key_box)
    words.draw(sheet)
    if max_hours > 0:
        swatches = [
            *list_dark([day for _, _, day in maps]),
            *find_swatches([plan for _, plan, _ in maps]),
        ]
        draw_hours_key(sheet, max_hours, what, show=show, swatches=swatches)
    draw_scale_bar(panels[0], key_x, bottom + 0.03, KEY_WIDTH - 0.25)
    draw_north(panels[0], key_x + 0.3, top - 0.36)
    sheet.write(key_x, bottom + 0.32, scale, SUBTITLE, color=INK, weight="bold")
    return sheet


def _make_panel(leaf: Leaf, plan: Plan, corner: Size, per_metre: float) -> Panel:
    """Make a map of true size below and right of a corner [inch]."""
    x0, x1, y0, y1 = plan.extent
    cols, rows = (max(1, round(side * per_metre * DOTS_PER_INCH)) for side in (x1 - x0, y1 - y0))
    w, h = cols / DOTS_PER_INCH, rows / DOTS_PER_INCH
    x, y = (round(v * DOTS_PER_INCH) / DOTS_PER_INCH for v in (corner[0], corner[1] - h))
    return Panel(leaf, plan, (x, y, w, h), (rows, cols))


def _draw_axes(panel: Panel) -> None:
    """Draw the frame, and heights or northings beside it."""
    _, _, y0, y1 = panel.plan.extent
    h = panel.map_box[3]
    ticks = find_ticks(y0, y1, h, lambda _: min(0.55, max(0.2, h / 4)))
    panel = replace(panel, plan=replace(panel.plan, axes=("", panel.plan.axes[1])))
    draw_frame(panel, [], ticks, max((measure_text(label, SMALL) for _, label in ticks), default=0))


def find_pixel_side(arrangement: Arrangement, map_number: int = 0) -> float:
    """Return the side of a pixel of the plan or of another map, in the model [m]."""
    return 1 / (arrangement.per_metre(map_number) * DOTS_PER_INCH)
