"""The sheet of a plan and its four elevations in one round scale, on A3 across."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from numpy.typing import NDArray

from umbra.writers.hours import draw_hours_key, fill_hours
from umbra.writers.lettering import SMALL, SUBTITLE, measure
from umbra.writers.marks import draw_frame, draw_north, draw_scale_bar, find_ticks
from umbra.writers.paper import INK, Panel, make_figure, to_pixels
from umbra.writers.plan import DOTS_PER_INCH, Plan, Show
from umbra.writers.sheet import KEY_WIDTH, MARGIN, Sheet, Words

__all__ = ["Arrangement", "arrange", "draw_elevations", "find_pixel", "make_elevations_sheet"]

PAPER = (420 / 25.4, 297 / 25.4)  # A3 [inch]
HEAD, FOOT = 1.05, 0.75  # of the words, at most [inch]
CAPTION, GAP, AXIS = 0.28, 0.22, 0.7  # above a map, between them, and left of one [inch]
_ROUND = (1, 1.25, 1.5, 2, 2.5, 3, 4, 5, 7.5)
SCALES = tuple(round(n * 10**power) for power in range(1, 6) for n in _ROUND if n * 10**power >= 20)
Size = tuple[float, float]


@dataclass(frozen=True)
class Arrangement:
    """
    Where maps lie on the paper.

    Parameters
    ----------
    scale : int
        500 where a metre is 2 mm long.
    corners : list of (x, y)
        Of each map, the plan first, from the upper left of the room for them, downward [inch].
    """

    scale: int
    corners: list[Size]

    @property
    def per_metre(self) -> float:
        """Length of a metre on the paper [inch]."""
        return 1000 / 25.4 / self.scale


def arrange(plan: Size, elevations: Sequence[Size]) -> Arrangement:
    """
    Choose the arrangement with the largest round scale.

    Parameters
    ----------
    plan : (width, height)
        [m]
    elevations : sequence of (width, height)
        Of four [m].

    Returns
    -------
    arrangement : Arrangement
    """
    width = PAPER[0] - 2 * MARGIN - KEY_WIDTH - 0.4
    height = PAPER[1] - HEAD - FOOT
    for scale in SCALES:
        per_metre = 1000 / 25.4 / scale
        boxes = [
            (w * per_metre + AXIS + GAP, h * per_metre + CAPTION + GAP)
            for w, h in (plan, *elevations)
        ]
        for across, beside in ((1, True), (2, True), (2, False), (1, False)):
            corners, used = _place(boxes, across, beside)
            if used[0] <= width and used[1] <= height:
                return Arrangement(scale, corners)
    return Arrangement(SCALES[-1], corners)


def _place(boxes: list[Size], across: int, beside: bool) -> tuple[list[Size], Size]:
    """Put elevations in so many columns beside the plan or below it; give what is used."""
    plan, rest = boxes[0], boxes[1:]
    columns = [rest[k::across] for k in range(across)]
    wide = [max(w for w, _ in column) for column in columns]
    rows = [rest[k : k + across] for k in range(0, len(rest), across)]
    high = [max(h for _, h in row) for row in rows]
    x0, y0 = (plan[0], 0.0) if beside else (0.0, plan[1])
    corners = [(0.0, 0.0)]
    for k in range(len(rest)):
        row, column = divmod(k, across)
        corners.append((x0 + sum(wide[:column]), y0 + sum(high[:row])))
    used = (x0 + sum(wide), max(plan[1], y0 + sum(high)))
    return corners, (max(used[0], plan[0]), used[1])


def draw_elevations(
    path: str | os.PathLike[str],
    arrangement: Arrangement,
    maps: Sequence[tuple[str, Plan, NDArray]],
    max_hours: float,
    receivers: Literal["ground", "top"] = "ground",
    show: Show = "shadow",
    what: str = "",
) -> None:
    """
    Draw a plan and its elevations.

    Parameters
    ----------
    path : path
        Its ending chooses PNG, PDF or SVG.
    arrangement : Arrangement
    maps : sequence of (caption, plan, shadow_hours)
        The plan first; its words are those of the sheet.
    max_hours : float
        The colour scale's end [h].
    receivers : {'ground', 'top'}
        Of the plan.
    show : {'shadow', 'sun'}
        Which hours are drawn.
    what : str
        What the hours are of, for the key; hours in shadow or in the sun by default.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    make_elevations_sheet(arrangement, maps, max_hours, receivers, show, what)[0].save(path)


def make_elevations_sheet(
    arrangement: Arrangement,
    maps: Sequence[tuple[str, Plan, NDArray]],
    max_hours: float,
    receivers: Literal["ground", "top"] = "ground",
    show: Show = "shadow",
    what: str = "",
) -> tuple[Sheet, list[Panel]]:
    """Lay out what ``draw_elevations`` writes; same parameters, less the path."""
    width, height = (to_pixels(side) for side in PAPER)
    figure = make_figure(width, height)
    first = maps[0][1]
    scale = f"1:{arrangement.scale:,} on A3 (420 x 297 mm)".replace(",", "\u2009")
    words = Words.of(
        replace(first, title=f"{first.title}, plan and elevations", note=f"{scale} · {first.note}"),
        width - 2 * MARGIN,
    )
    top = height - max(words.head, HEAD)
    panels = []
    for (caption, plan, hours), (x, y) in zip(maps, arrangement.corners, strict=True):
        panel = _make_panel(figure, plan, (MARGIN + AXIS + x, top - CAPTION - y), arrangement)
        panel.write(panel.map_box[0], top - CAPTION - y + 0.08, caption, SUBTITLE, weight="bold")
        fill_hours(panel, hours, max_hours, receivers if plan is first else "top", show)
        _draw_axes(panel)
        panels.append(panel)
    key_x, bottom = width - MARGIN - KEY_WIDTH, FOOT
    key_box = (key_x, bottom + 0.6, KEY_WIDTH, top - bottom - 0.6 - 0.85)
    sheet = Sheet(figure, first, panels[0].map_box, panels[0].map_size, key_box, is_wide=False)
    words.draw(sheet)
    if max_hours > 0:
        draw_hours_key(sheet, max_hours, what, show=show)
    draw_scale_bar(panels[0], key_x, bottom + 0.03, KEY_WIDTH - 0.25)
    draw_north(panels[0], key_x + 0.3, top - 0.36)
    sheet.write(key_x, bottom + 0.32, scale.partition(" on")[0], SUBTITLE, color=INK, weight="bold")
    return sheet, panels


def _make_panel(figure: object, plan: Plan, corner: Size, arrangement: Arrangement) -> Panel:
    """Make a map of true size below and right of a corner [inch]."""
    x0, x1, y0, y1 = plan.extent
    cols, rows = (
        max(1, round(side * arrangement.per_metre * DOTS_PER_INCH)) for side in (x1 - x0, y1 - y0)
    )
    w, h = cols / DOTS_PER_INCH, rows / DOTS_PER_INCH
    x, y = (round(v * DOTS_PER_INCH) / DOTS_PER_INCH for v in (corner[0], corner[1] - h))
    return Panel(figure, plan, (x, y, w, h), (rows, cols))  # type: ignore[arg-type]


def _draw_axes(panel: Panel) -> None:
    """Draw the frame, and heights or northings beside it."""
    _, _, y0, y1 = panel.plan.extent
    h = panel.map_box[3]
    ticks = find_ticks(y0, y1, h, lambda _: min(0.55, max(0.2, h / 4)))
    panel = replace(panel, plan=replace(panel.plan, axes=("", panel.plan.axes[1])))
    draw_frame(panel, [], ticks, max((measure(label, SMALL) for _, label in ticks), default=0))


def find_pixel(arrangement: Arrangement) -> float:
    """Give the side of a pixel in the model [m]."""
    return 1 / (arrangement.per_metre * DOTS_PER_INCH)
