"""The picture of a study of points: a plan with each point in the colour of its hours."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.scene.grid import Places
from umbra.writers.area_outlines import draw_areas
from umbra.writers.context_lines import draw_context, tint_context
from umbra.writers.contours import PROPOSED, trace
from umbra.writers.hours_map import OUTLINE, draw_hours_key, list_dark, tell_outlined
from umbra.writers.paper import INK, NIGHT, RULE, Panel, measure_text
from umbra.writers.picture_content import MISSING, DayMap, Plan, Show, cover_with_roofs
from umbra.writers.pixels import NO_SUN, Ramp, shade_ramp
from umbra.writers.sheet import Sheet, lay_out_sheet

__all__ = ["FEW", "fill_points", "make_points_sheet"]

FEW = 40
"""Most points that are labelled."""
# of the ground, apart from the scale's sunlit end
PAPER = np.array((0.985, 0.985, 0.98), np.float32)
LABEL = 7.0  # size of type [point]
AWAY = 0.12  # from which a line leads to a label [inch]
_STEEP = 1e-6  # level part of a normal that points outward
HIGH = 0.13  # of a label [inch]

_WAYS = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))

Box = tuple[float, float, float, float]


def make_points_sheet(
    plan: Plan,
    places: Places,
    days: Sequence[DayMap],
    max_hours: float,
    names: Sequence[str] = (),
    show: Show = "shadow",
    what: str = "",
    ramp: Ramp = "shade",
) -> Sheet:
    """
    Draw points in the colours of their hours in shadow or in the sun: a map for each day.

    Points are in the plan's coordinates. Points above one another stand side by side, the lowest
    first, outward from their wall. ``max_hours`` is the colour scale's end: how long the sun was up
    in the period [h]. Few enough are labelled by their names, or numbered. ``show`` chooses the
    hours of labels and key, ``what`` names them in the key.
    """
    sheet = lay_out_sheet(plan, 0.62, days)
    for panel, day in zip(sheet.maps, days, strict=True):
        _fill_hours(panel, places, day, max_hours, names, show, shade_ramp(ramp=ramp))
    if max_hours > 0:
        remark, swatches = tell_outlined(plan), list_dark(days)
        draw_hours_key(sheet, max_hours, what, remark, show, swatches=swatches, ramp=ramp)
    return sheet


def _fill_hours(
    panel: Panel,
    places: Places,
    day: DayMap,
    max_hours: float,
    names: Sequence[str],
    show: Show,
    ramp: NDArray[np.float64],
) -> None:
    """Draw points on a map in the colours of their hours."""
    hours = np.asarray(day.hours, np.float64)
    is_night = day.is_night or not max_hours > 0
    share = np.nan_to_num(hours) / max(max_hours, 1e-9)
    colors = ramp[np.clip(share * (len(ramp) - 1) + 0.5, 0, len(ramp) - 1).astype(np.intp)]
    colors[day.find_dark()] = NO_SUN
    colors[np.isnan(hours)] = MISSING  # what a proposal brings loses nothing to it
    if is_night:
        colors = np.full_like(colors, MISSING)
    shown = max_hours - hours if show == "sun" else hours
    texts = [""] * len(shown) if is_night else [_tell(value) for value in shown[: FEW + 1]]
    fill_points(panel, places, colors, texts, names)
    if is_night:
        panel.write_over(NIGHT)


def _tell(hours: float) -> str:
    return f"{hours:.3g} h" if hours == hours else "-"  # noqa: PLR0124  (NaN)


def fill_points(
    panel: Panel,
    places: Places,
    colors: NDArray[np.float64],
    texts: Sequence[str],
    names: Sequence[str] = (),
) -> None:
    """
    Draw points on a map with its buildings; label few of them by names, or numbers, and texts.

    Parameters
    ----------
    panel : Panel
    places : Places
        In the plan's coordinates.
    colors : (n, 3) float64
        sRGB.
    texts : sequence of str
        What is told of each of the first ``FEW``.
    names : sequence of str
    """
    plan = panel.plan
    image = np.broadcast_to(PAPER, (*panel.map_size, 3)).copy()
    tint_context(image, panel)
    cover_with_roofs(image, plan, panel.map_size)
    if plan.fills_areas:
        _fill_areas(image, plan, places, colors)
    panel.paste(image, *panel.map_box[:2])
    draw_context(panel)
    panel.rule_map(trace(panel, plan.is_building), OUTLINE, 0.6)
    if plan.proposed is not None:
        panel.rule_map(trace(panel, plan.proposed), PROPOSED, 1.3)
    if plan.fills_areas:
        draw_areas(panel)
        return

    n, points = len(places), places.points
    radius = float(np.clip(0.5 / math.sqrt(n), 0.018, 0.062))
    middles = panel.place(points[:, :2])
    spread, stacks = _spread(middles, points[:, 2], places.normals[:, :2], 2.15 * radius)
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    disc = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    panel.fill([spot + disc for spot in spread], colors, INK, 0.6)
    draw_areas(panel)
    if n <= FEW:
        named = names or range(1, n + 1)
        labels = [": ".join(filter(None, (f"{named[k]}", texts[k]))) for k in range(n)]
        _label(panel, spread, stacks, labels, radius)


def _fill_areas(
    image: NDArray[np.float32], plan: Plan, places: Places, colors: NDArray[np.float64]
) -> None:
    """Fill areas on a map (rows, cols, 3), row 0 the lowest, by the nearest of their points."""
    from PIL import Image, ImageDraw  # noqa: PLC0415
    from scipy.spatial import cKDTree  # noqa: PLC0415

    rows, cols = image.shape[:2]
    x0, x1, y0, y1 = plan.extent
    scale = np.array([cols / (x1 - x0), rows / (y1 - y0)])
    inside = np.zeros((rows, cols), np.bool_)
    for area in plan.areas:
        own = np.zeros((rows, cols), np.bool_)
        for ring in area.rings:  # a ring within another is a hole
            mask = Image.new("1", (cols, rows))
            corners = (ring - (x0, y0)) * scale - 0.5
            ImageDraw.Draw(mask).polygon([(x, y) for x, y in corners.tolist()], fill=1)
            own ^= np.asarray(mask)
        inside |= own
    which = np.argwhere(inside)
    if len(which):
        at = (which[:, ::-1] + 0.5) / scale + (x0, y0)
        image[inside] = colors[cKDTree(places.points[:, :2]).query(at)[1]]


def _spread(
    places: NDArray[np.float64], z: NDArray[np.float64], normals: NDArray[np.float64], pitch: float
) -> tuple[NDArray[np.float64], list[NDArray[np.intp]]]:
    """Move points above one another apart, outward from their wall; name them, lowest first."""
    spread = places.copy()
    cells = np.round(places / (pitch / 2)).astype(np.int64)
    stack = np.unique(cells, axis=0, return_inverse=True)[1].ravel()
    order = np.lexsort((z, stack))
    stacks = np.split(order, np.flatnonzero(np.diff(stack[order])) + 1)
    for members in stacks:
        outward = np.nan_to_num(normals[members[0]])
        length = math.hypot(*outward)
        way = outward / length if length > _STEEP else np.array([1.0, 0.0])
        first = 0.5 if length > _STEEP else 0.0  # off the wall
        steps = (first + np.arange(len(members)))[:, None] * pitch
        spread[members] = places[members[0]] + steps * way
    return spread, stacks


def _label(
    panel: Panel,
    places: NDArray[np.float64],
    stacks: list[NDArray[np.intp]],
    texts: Sequence[str],
    radius: float,
) -> None:
    """Write labels beside points, those above one another as a list, clear of all others."""
    left, bottom, w, h = panel.map_box
    taken: list[Box] = [(x - radius, y - radius, x + radius, y + radius) for x, y in places]
    for members in stacks:
        low, high = places[members].min(0) - radius, places[members].max(0) + radius
        wide = max(measure_text(texts[k], LABEL) for k in members) + 0.04
        tall = HIGH * len(members)
        middle, reach = (low + high) / 2, (high - low + (wide, tall)) / 2
        free = None
        for away in (0.05, 0.12, 0.22, 0.35, 0.5):
            for across, up in _WAYS:
                x, y = middle + (reach + away) * (across, up)
                box = (x - wide / 2, y - tall / 2, x + wide / 2, y + tall / 2)
                is_inside = (
                    box[0] > left and box[2] < left + w and box[1] > bottom and box[3] < bottom + h
                )
                if is_inside and not any(_overlap(box, other) for other in taken):
                    free = box
                    break
            if free:
                break
        if free is None:
            continue  # too crowded: the table has it
        taken.append(free)
        if away > AWAY:
            end = np.clip(middle, free[:2], free[2:])
            panel.rule([[np.clip(end, low, high), end]], RULE, 0.5)
        for line, member in enumerate(members):
            y = free[1] + (line + 0.5) * HIGH
            panel.write(
                free[0] + 0.02, y, texts[member], LABEL, halo="#ffffffd8", va="center_baseline"
            )


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
