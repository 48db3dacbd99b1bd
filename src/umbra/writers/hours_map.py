"""Picture of a study: hours in shadow on a plan, with a map for each date."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.writers.area_outlines import draw_areas, find_names
from umbra.writers.context_lines import draw_context
from umbra.writers.contours import (
    PROPOSED,
    draw_contours,
    draw_hatch,
    draw_hatch_swatch,
    find_levels,
    find_swatches,
    hatch_covers,
    outline_covers,
    trace,
)
from umbra.writers.marks import Swatch, draw_color_bar
from umbra.writers.paper import INK, LINE, NIGHT, SMALL, Panel, wrap
from umbra.writers.picture_content import (
    MISSING,
    DayMap,
    Plan,
    Show,
    cover_with_roofs,
    draw_appearance,
    name_hours,
)
from umbra.writers.pixels import (
    HALF,
    NO_SUN,
    SLOPE_SHADE,
    Ramp,
    paint_shares,
    resample,
    shade_ramp,
)
from umbra.writers.sheet import KEY_WIDTH, Sheet, lay_out_sheet

__all__ = [
    "OUTLINE",
    "Lines",
    "draw_hours_key",
    "fill_hours",
    "fill_map",
    "list_dark",
    "make_hours_sheet",
    "tell_outlined",
]

DEEP = 0.6  # share from which lines are white
BAR = 5.0  # of a long colour bar, with its title and hatch [inch]
OUTLINE = "#55555e"


def make_hours_sheet(
    plan: Plan,
    days: Sequence[DayMap],
    max_hours: float,
    what: str = "",
    show: Show = "shadow",
    hatch: str = "",
    *,
    has_lines: bool = True,
    ramp: Ramp = "shade",
) -> Sheet:
    """
    Draw hours in shadow or in the sun, with contour lines at whole hours: a map for each day.

    ``max_hours`` is the colour scale's end: the longest time that the sun was up on one of the
    days [h]. With ``show`` of the sun, max_hours less the hours in shadow are drawn, and a place
    keeps its colour. ``what`` names the hours in the key, by default hours in shadow or in the
    sun; ``hatch`` explains hatched cells in the key; ``ramp`` has the colours. Places without any
    sun have a colour of their own. A ValueError says that hours do not fit.
    """
    for day in days:
        if day.hours.shape != plan.shape:
            of = f" on {day.title}" if day.title else ""
            msg = f"the hours{of} are {day.hours.shape}, but the plan is {plan.shape}"
            raise ValueError(msg)
    sheet = lay_out_sheet(plan, 0.55, days)
    for panel, day in zip(sheet.maps, days, strict=True):
        end = 0.0 if day.is_night else max_hours
        fill_hours(panel, day, end, show, has_lines=has_lines, ramp=ramp)
        if day.hatched is not None and day.hatched.any():
            draw_hatch(panel, day.hatched)
    if max_hours > 0:
        swatches = [*list_dark(days), *find_swatches([plan])]
        draw_hours_key(
            sheet, max_hours, what, tell_outlined(plan), show, hatch, swatches, ramp=ramp
        )
    return sheet


def fill_hours(
    panel: Panel,
    day: DayMap,
    max_hours: float,
    show: Show = "shadow",
    *,
    has_lines: bool = True,
    ramp: Ramp = "shade",
) -> None:
    """
    Draw the hours on a map, with contour lines and buildings, for ``make_hours_sheet``.

    Where ``max_hours`` is 0 the sun stays below the horizon, and no place has a value.
    """
    has_scale = max_hours > 0
    hours = np.asarray(day.hours, np.float32)
    if not has_scale:
        hours = np.full_like(hours, np.nan)
    levels = find_levels(max_hours) if has_lines else []
    texts = [f"{level} h" for level in levels] * 2 if ramp == "change" else []
    if ramp == "change":
        levels += [-level for level in levels]
    # Paint stays; lines and labels count the other way.
    traced = max_hours - hours if show == "sun" else hours
    shares = [abs(level) / max_hours for level in levels]
    fill_map(
        panel,
        resample(hours, panel.map_size) / (max_hours if has_scale else 1),
        hours,
        Lines(traced, levels, [1 - share if show == "sun" else share for share in shares], texts),
        ramp,
        dark=day.find_dark() if has_scale else None,
        words="no values here" if has_scale else NIGHT,
    )


@dataclass(frozen=True, eq=False)
class Lines:
    """
    Lines of equal values on a map.

    Parameters
    ----------
    values : (rows, cols) float
        Whose lines they are, in the plan's cells.
    levels : sequence of float
    shares : sequence of float
        Of the colour scale that lies under each line.
    texts : sequence of str, optional
        Labels; hours by default.
    """

    values: NDArray[np.floating]
    levels: Sequence[float]
    shares: Sequence[float]
    texts: Sequence[str] = ()


def fill_map(
    panel: Panel,
    shares: NDArray[np.floating],
    values: NDArray[np.floating],
    lines: Lines,
    ramp: Ramp,
    *,
    dark: NDArray[np.bool_] | None = None,
    words: str = "no values here",
) -> None:
    """
    Draw values on a panel's map by the shares of a colour scale, with lines and buildings.

    Parameters
    ----------
    panel : Panel
    shares : (height, width) float
        At the map's pixels; NaN is no value.
    values : (rows, cols) float
        In the plan's cells: no line crosses those that are NaN.
    lines : Lines
    ramp : str
    dark : (rows, cols) bool, optional
        Cells without any sun, which have a colour of their own.
    words : str
        Written over a map without values.
    """
    plan, size = panel.plan, panel.map_size
    is_missing = np.isnan(shares)
    shade = None if plan.appearance is None else plan.appearance.find_shade(size)
    image = paint_shares(np.nan_to_num(shares), shade, ramp)
    if dark is not None:
        image[resample(dark, size) > HALF] = NO_SUN
    image[is_missing] = MISSING
    if shade is not None:
        image[is_missing] -= SLOPE_SHADE * shade[is_missing, None]
    if plan.roofs_cover:
        cover_with_roofs(image, plan, size)
    if plan.appearance is not None:
        draw_appearance(image, plan.appearance, size)
    hatch_covers(image, plan, size)
    panel.paste(image, *panel.map_box[:2])
    draw_context(panel)

    traced, is_building = lines.values, plan.is_building
    blocked = np.isnan(values)
    if plan.appearance is not None:
        blocked |= plan.appearance.find_breaks(plan.shape)
    if plan.roofs_cover:  # under a roof the ground's hours mean nothing
        blocked |= is_building
    colors = [_find_line_color(share) for share in lines.shares]
    names = [box for _, box in find_names(panel)]
    draw_contours(panel, traced, lines.levels, colors, blocked, lines.texts, names)
    if plan.appearance is None:
        panel.rule_map(trace(panel, is_building), OUTLINE, 0.6 if plan.roofs_cover else 0.7)
    outline_covers(panel)
    if plan.proposed is not None and not plan.looks_through:
        panel.rule_map(trace(panel, plan.proposed), PROPOSED, 1.3)
    draw_areas(panel)
    if is_missing.all():
        panel.write_over(words)


def list_dark(days: Sequence[DayMap]) -> list[Swatch]:
    """Name the colour of places without any sun, where there are some."""
    is_seen = any(not day.is_night and day.find_dark().any() for day in days)
    return [Swatch("no sun", NO_SUN)] if is_seen else []


def tell_outlined(plan: Plan) -> str:
    """Name what is outlined in red, for a key."""
    is_outlined = plan.proposed is not None and not plan.looks_through
    return "outlined in red: proposed" if is_outlined else ""


def draw_hours_key(
    sheet: Sheet,
    max_hours: float,
    what: str = "",
    remark: str = "",
    show: Show = "shadow",
    hatch: str = "",
    swatches: Sequence[Swatch] = (),
    ramp: Ramp = "shade",
) -> None:
    """Draw the scale of hours up to ``max_hours``, above 0, and the hatch in a sheet's key."""
    what = what or name_hours(show)
    if hatch and sheet.is_wide:
        remark = ", ".join(filter(None, (remark, f"hatched: {hatch}")))
    elif hatch:
        sheet = _draw_hatch_key(sheet, hatch)
    title = [what] if sheet.is_wide else wrap(what, 8.0, KEY_WIDTH)
    colors = shade_ramp(ramp=ramp)[:: -1 if show == "sun" else 1]
    ticks = _find_scale_ticks(max_hours)
    if ramp == "change":
        won = [((1 - at) / 2, f"{name} won") for at, name in ticks[:0:-1]]
        lost = [((1 + at) / 2, f"{name} lost" if at else name) for at, name in ticks]
        ticks = won + lost
    draw_color_bar(sheet, colors, ticks, title, remark, swatches)


def _draw_hatch_key(sheet: Sheet, hatch: str) -> Sheet:
    """Explain the hatch at the foot of the key; return the sheet with the rest of the key."""
    x, y, w, h = sheet.key_box
    y, h = max(y, y + h - BAR), min(h, BAR)
    lines = wrap(hatch, SMALL, KEY_WIDTH - 0.3)
    room = len(lines) * SMALL * LINE + 0.14
    draw_hatch_swatch(sheet, x, y + room - 0.24, 0.22, 0.14)
    for n, line in enumerate(lines):
        sheet.write(x + 0.29, y + room - 0.2 - n * SMALL * LINE, line, SMALL)
    return replace(sheet, key_box=(x, y + room, w, h - room))


def _find_line_color(share: float) -> tuple[str, str]:
    """Choose a line's colour and its label's halo to stand out on their shade."""
    return (INK, "#ffffffc8") if share < DEEP else ("#ffffff", "#202048d0")


def _find_scale_ticks(max_hours: float) -> list[tuple[float, str]]:
    """Name whole hours on the colour scale, or the ends of a scale shorter than one."""
    levels = [0, *find_levels(max_hours)]
    if len(levels) == 1:
        return [(0.0, "0 h"), (1.0, f"{max_hours * 60:.0f} min")]
    return [(level / max_hours, f"{level} h") for level in levels]
