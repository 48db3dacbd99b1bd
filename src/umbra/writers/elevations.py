"""
The sheet of a plan and its four elevations, projected on the plan's axes, on A3 or A1 across.

The elevations from south and north stand below the plan, those from east and west beside it,
turned so that north is up, all in one scale; the plan takes what room is left.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from umbra.writers.contours import find_swatches
from umbra.writers.hours_map import draw_hours_key, fill_hours, list_dark
from umbra.writers.marks import draw_frame, draw_north, draw_scale_bar, find_ticks
from umbra.writers.paper import (
    LINE,
    QUIET,
    SMALL,
    SUBTITLE,
    Leaf,
    Panel,
    measure_text,
    to_pixels,
    wrap,
)
from umbra.writers.picture_content import DOTS_PER_INCH, Appearance, DayMap, Plan, Show
from umbra.writers.sheet import KEY_WIDTH, MARGIN, Sheet
from umbra.writers.title_block import (
    BLOCK,
    SunRose,
    draw_block,
    draw_moments,
    draw_sun_path,
    find_moment_height,
    find_type,
)

__all__ = [
    "PAPERS",
    "Arrangement",
    "SheetContent",
    "arrange",
    "find_pixel_side",
    "find_room",
    "make_elevations_sheet",
]

PAPERS = {"a3": (420 / 25.4, 297 / 25.4), "a1": (841 / 25.4, 594 / 25.4)}
"""Width and height of the papers [inch]."""
CAPTION, GAP, AXIS = 0.28, 0.22, 0.7  # above a map, between them, and left of one [inch]
FOOT = 0.5  # of the note [inch]
AXES = 0.35  # below an elevation that is turned, for its axis [inch]
CORNER = 4.0  # least width between the elevations in which moments stand, on A3 [inch]
SCALES = (10, 20, 50) + tuple(
    n * 10**power for power in range(6) for n in (100, 125, 200, 250, 500)
)
"""A planner's scales: 1:100, 1:125, 1:200, 1:250, 1:500 and on."""
FINER_SCALES = SCALES[:3] + tuple(
    n * 10**power for power in range(4) for n in (100, 125, 150, 200, 250, 300, 400, 500, 750)
)
"""More of them, for what cannot grow with the paper."""
Size = tuple[float, float]
EAST, WEST = 2, 4  # among the maps
NARROW = 0.7  # map whose caption is one word [inch]
_TURNED = (EAST, WEST)


@dataclass(frozen=True)
class Arrangement:
    """Places of maps on the paper, all in one scale."""

    scale: int  # 500 where a metre is 2 mm long
    plan: Size  # width and height of the plan for which there is room [m]
    paper: str = "a3"
    has_row: bool = True  # of moments at the foot; else they stand in the corner

    @property
    def per_metre(self) -> float:
        """Length of a metre on the paper [inch]."""
        return 1000 / 25.4 / self.scale


def find_room(paper: str = "a3", *, has_row: bool = True) -> Size:
    """Return the width and height that plan and elevations have together [inch]."""
    (wide, high), larger = PAPERS[paper], find_type(PAPERS[paper][1])
    row = find_moment_height(high) if has_row else 0.0
    column = BLOCK * larger + AXIS * (larger - 1)  # what larger type takes of the axis' place
    return wide - 2 * MARGIN - column - 2 * GAP, high - 2 * MARGIN - FOOT * larger - row


def find_free(scale: int, elevations: Sequence[Size], paper: str, *, has_row: bool = True) -> Size:
    """Return the size of the plan that a scale leaves room for [m]."""
    inch = 1000 / 25.4 / scale
    south, east, north, west = elevations
    width, height = find_room(paper, has_row=has_row)
    wide = width - AXIS - 2 * (CAPTION + GAP) - (east[1] + west[1]) * inch
    high = height - CAPTION - 2 * (CAPTION + GAP) - (south[1] + north[1]) * inch
    return wide / inch, high / inch


def arrange(need: Size, most: Size, elevations: Sequence[Size], paper: str = "a3") -> Arrangement:
    """
    Choose the largest standard scale at which all fits.

    The plan takes at least ``need``, the model and relevant shadows, and at most ``most``; sizes
    are (width, height) [m], elevations those from south, east, north and west. A plan that may grow
    fills the paper; one that may not takes a finer scale. The moments stand in the corner between
    the elevations, if it is large, and leave their row at the foot to the maps.
    """
    free = _arrange(need, most, elevations, paper, has_row=False)
    room = find_room(paper, has_row=False)
    corner = [have - of * free.per_metre for have, of in zip(room, free.plan, strict=True)]
    if min(corner[0], 1.4 * corner[1]) >= CORNER * find_type(PAPERS[paper][1]):
        return free
    return _arrange(need, most, elevations, paper, has_row=True)


def _arrange(
    need: Size, most: Size, elevations: Sequence[Size], paper: str, *, has_row: bool
) -> Arrangement:
    """Choose the scale, with or without a row of moments."""
    for scale in SCALES if not np.isfinite(most).all() else FINER_SCALES:
        free = find_free(scale, elevations, paper, has_row=has_row)
        long = max(elevations[0][0], elevations[2][0]), max(elevations[1][0], elevations[3][0])
        if all(have >= max(side) for have, side in zip(free, zip(need, long), strict=True)):
            plan = [min(have, max(end, own)) for have, end, own in zip(free, most, long)]
            return Arrangement(scale, (plan[0], plan[1]), paper, has_row)
    return Arrangement(SCALES[-1], need, paper, has_row)


@dataclass(frozen=True, eq=False)
class SheetContent:
    """What stands on a sheet besides its maps of hours."""

    # of the model's middle from the plan's, across and up [m]
    offset: Size = (0.0, 0.0)
    moments: Sequence[tuple[str, NDArray[np.bool_]]] = ()  # clock times and shadows, (rows, cols)
    moments_plan: Plan | None = None
    sun: SunRose = field(default_factory=SunRose)
    logo: NDArray[np.uint8] | None = None  # (rows, cols, 4), row 0 the top


def make_elevations_sheet(
    arrangement: Arrangement,
    maps: Sequence[tuple[str, Plan, DayMap]],
    max_hours: float,
    show: Show = "shadow",
    what: str = "",
    content: SheetContent | None = None,
) -> Sheet:
    """
    Draw a plan and its elevations: maps of (caption, plan, hours), the plan first.

    Elevations are from south, east, north and west. The first plan has the words of the sheet.
    ``max_hours`` is the colour scale's end [h]; ``what`` names the hours in the key, by default
    hours in shadow or in the sun.
    """
    content = content or SheetContent()
    width, height = (to_pixels(side) for side in PAPERS[arrangement.paper])
    larger, first = find_type(height), maps[0][1]
    leaf = Leaf(width, height, larger)
    block, foot = BLOCK * larger, FOOT * larger
    scale = f"1:{arrangement.scale:,}".replace(",", "\u2009")
    panels = _place_panels(leaf, arrangement, maps, content.offset)
    for k, (panel, (name, _, day)) in enumerate(zip(panels, maps, strict=True)):
        x, y, w, h = panel.map_box
        # The last one's name may be wider than it, and ends where it ends.
        at, side = (x + w, "right") if k == WEST else (x, "left")
        caption = name.partition(" ")[0] if w < NARROW * larger else name
        panel.write(at, y + h + 0.08, caption, SUBTITLE * larger, weight="bold", ha=side)
        shown = replace(day, hours=_turn(day.hours, k)) if k in _TURNED else day
        fill_hours(panel, shown, max_hours, show)
        _draw_axes(panel, is_turned=k in _TURNED)
    key_x, bottom = width - MARGIN - block, MARGIN + foot
    top = draw_block(panels[0], (key_x, height - MARGIN, block), content.logo, scale, larger)
    draw_scale_bar(panels[0], key_x, top - 0.36 * larger, block - 0.8 * larger)
    draw_north(panels[0], key_x + block - 0.22 * larger, top - 0.42 * larger)
    rose = draw_sun_path(panels[0], content.sun, (key_x, MARGIN + 0.1, block), larger)
    low = MARGIN + rose + 0.3 * larger
    high = top - 0.7 * larger - low
    sheet = Sheet.of_panels(panels, (key_x, low, KEY_WIDTH * larger, high))
    if max_hours > 0:
        swatches = [
            *list_dark([day for _, _, day in maps]),
            *find_swatches([plan for _, plan, _ in maps]),
        ]
        draw_hours_key(sheet, max_hours, what, show=show, swatches=swatches)
    wide = key_x - GAP - MARGIN
    paper = arrangement.paper.upper()
    size = " x ".join(f"{side * 25.4:.0f}" for side in PAPERS[arrangement.paper])
    if content.moments and content.moments_plan is not None:
        place = MARGIN, bottom, wide, find_moment_height(height)
        if not arrangement.has_row:
            place = _find_corner(panels, bottom, key_x - GAP)
        draw_moments(leaf, content.moments_plan, content.moments, place, larger)
    note = f"{scale} on {paper} ({size} mm) · {first.foot}"
    _write_note(panels[0], note, wide, SMALL * larger)
    return sheet


def _find_corner(
    panels: Sequence[Panel], bottom: float, right: float
) -> tuple[float, float, float, float]:
    """Return the place (x, y, width, height) below the turned elevations, right of the others."""
    boxes = [panel.map_box for panel in panels]
    left = max(boxes[k][0] + boxes[k][2] for k in (1, 3)) + 2 * GAP
    top = min(boxes[k][1] for k in (0, *_TURNED)) - AXES
    return left, bottom, right - left, top - bottom


def _write_note(panel: Panel, note: str, wide: float, size: float) -> None:
    """Write how the sheet was made at its foot."""
    for n, line in enumerate(reversed(wrap(note, size, wide)[:3])):
        panel.write(MARGIN, MARGIN + n * size * LINE, line, size, color=QUIET)


def _place_panels(
    leaf: Leaf,
    arrangement: Arrangement,
    maps: Sequence[tuple[str, Plan, DayMap]],
    offset: Size,
) -> list[Panel]:
    """Place the plan at the upper left, and each elevation on its axis."""
    inch = arrangement.per_metre
    top = leaf.height - MARGIN - CAPTION
    room = find_room(arrangement.paper, has_row=arrangement.has_row)
    plans = [plan for _, plan, _ in maps]
    sizes = [(x1 - x0, y1 - y0) for x0, x1, y0, y1 in (plan.extent for plan in plans)]
    wide, high = (side * inch for side in sizes[0])
    heights = [side[1] * inch for side in sizes]
    # Room that a plan that cannot grow leaves is shared between the maps.
    beside, below = (sum(heights[k] + CAPTION + GAP for k in panels) for panels in ((2, 4), (1, 3)))
    gap_x = GAP + max(0.0, room[0] - AXIS - wide - beside) / 2
    gap_y = GAP + max(0.0, room[1] - CAPTION - high - below) / 2
    left = MARGIN + AXIS * leaf.larger
    # An elevation of more than the plan shows stands in its middle.
    spare = [
        max(0.0, sizes[0][k] - max(sizes[own][0] for own in pair)) / 2
        for k, pair in enumerate(((1, 3), (2, 4)))
    ]
    across, up = (float(np.clip(off, -have, have)) * inch for off, have in zip(offset, spare))
    middle = left + wide / 2 + across, top - high / 2 + up
    panels = [_make_panel(leaf, plans[0], (left, top), inch)]
    y, x = top - high, left + wide
    for k in (1, 3):
        y -= gap_y + CAPTION
        panels.append(_make_panel(leaf, plans[k], (middle[0] - sizes[k][0] * inch / 2, y), inch))
        y -= heights[k]
    for k in (2, 4):
        x += gap_x + CAPTION / 2
        turned = _turn_plan(plans[k], k)
        panels.append(_make_panel(leaf, turned, (x, middle[1] + sizes[k][0] * inch / 2), inch))
        x += heights[k] + CAPTION / 2
    return [panels[k] for k in (0, 1, 3, 2, 4)]


def _turn(values: NDArray, which: int) -> NDArray:
    """Turn an elevation (rows, cols), rows ascending, by 90 degrees: roofs of the east are left."""
    return np.ascontiguousarray(values.T[:, ::-1] if which == EAST else values.T[::-1])


def _turn_plan(plan: Plan, which: int) -> Plan:
    """Turn an elevation so that north is up."""
    look = plan.appearance
    arrays = {
        name: None if array is None else _turn(array, which)
        for name in ("building_height", "proposed", "nothing", "canopies")
        for array in (getattr(plan, name),)
    }
    if look is not None:
        layers = (look.shade, look.lines, look.jumps, look.creases)
        sky = None if look.sky is None else _turn(look.sky, which)
        shade, lines, jumps, creases = (_turn(layer, which) for layer in layers)
        look = Appearance(shade, lines, jumps, creases, sky)
    x, y = (-plan.y[::-1], plan.x) if which == EAST else (plan.y, -plan.x[::-1])
    return replace(plan, x=x, y=y, appearance=look, **arrays)  # type: ignore[arg-type]


def _make_panel(leaf: Leaf, plan: Plan, corner: Size, per_metre: float) -> Panel:
    """Make a map of true size below and right of a corner [inch]."""
    x0, x1, y0, y1 = plan.extent
    cols, rows = (max(1, round(side * per_metre * DOTS_PER_INCH)) for side in (x1 - x0, y1 - y0))
    w, h = cols / DOTS_PER_INCH, rows / DOTS_PER_INCH
    x, y = (round(v * DOTS_PER_INCH) / DOTS_PER_INCH for v in (corner[0], corner[1] - h))
    return Panel(leaf, plan, (x, y, w, h), (rows, cols))


def _draw_axes(panel: Panel, *, is_turned: bool) -> None:
    """Draw the frame, and heights or northings along it; heights of a turned one below it."""
    x0, x1, y0, y1 = panel.plan.extent
    _, _, w, h = panel.map_box
    larger = panel.leaf.larger
    size = SMALL * larger
    if is_turned:
        room = 0.12 * larger
        across = find_ticks(x0, x1, w, lambda label: measure_text(label, size) + room)
        across = [(at, label.removeprefix("\u2212")) for at, label in across]
        draw_frame(replace(panel, plan=replace(panel.plan, axes=("", ""))), across, [], 0)
        return
    ticks = find_ticks(y0, y1, h, lambda _: min(0.55 * larger, max(0.2 * larger, h / 4)))
    panel = replace(panel, plan=replace(panel.plan, axes=("", panel.plan.axes[1])))
    draw_frame(panel, [], ticks, max((measure_text(label, size) for _, label in ticks), default=0))


def find_pixel_side(arrangement: Arrangement) -> float:
    """Return the side of a pixel of the maps, in the model [m]."""
    return 1 / (arrangement.per_metre * DOTS_PER_INCH)
