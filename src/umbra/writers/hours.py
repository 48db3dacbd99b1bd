"""The picture of a study: hours in shadow on a plan; of several dates a map for each."""

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from umbra.writers.color import paint_shares, shade_ramp
from umbra.writers.contours import draw_contours, find_levels, trace
from umbra.writers.hatches import (
    draw_hatch,
    draw_hatch_swatch,
    find_swatches,
    hatch_canopies,
    outline_canopies,
)
from umbra.writers.marks import Swatch, draw_color_bar
from umbra.writers.paper import INK, LINE, QUIET, SMALL, Panel, wrap
from umbra.writers.plan import DayMap, Plan, Show, draw_look, name_hours, shade_roofs
from umbra.writers.raster import resample
from umbra.writers.sheet import KEY_WIDTH, Sheet, make_panels, make_sheet

__all__ = [
    "OUTLINE",
    "draw_hour_panels",
    "draw_hours",
    "draw_hours_key",
    "fill_hours",
    "make_hour_panels",
    "make_hours_sheet",
]

MISSING = 0.93  # grey of cells without a value
BAR = 5.0  # of a long colour bar, with its title and what is hatched [inch]
OUTLINE, PROPOSED = "#55555e", "#d0312d"


def draw_hours(
    path: str | os.PathLike[str],
    plan: Plan,
    shadow_hours: NDArray,
    max_hours: float,
    receivers: Literal["ground", "top"] = "ground",
    what: str = "",
    show: Show = "shadow",
    hatched: NDArray[np.bool_] | None = None,
    hatch: str = "",
    finer: NDArray | None = None,
) -> None:
    """
    Draw hours in shadow or in the sun, with contour lines at whole hours.

    Parameters
    ----------
    path : path
        Its ending chooses PNG, PDF or SVG.
    plan : Plan
    shadow_hours : (rows, cols) float32
        Rows ascend in y; NaN where there is no value.
    max_hours : float
        The colour scale's end: the hours that the sun was up in the period [h].
    receivers : {'ground', 'top'}
        ``ground``: roofs are drawn in grey over the hours. ``top``: the hours are
        those of roofs too, and buildings are outlined.
    what : str
        What the hours are of, for the key; hours in shadow or in the sun by default.
    show : {'shadow', 'sun'}
        ``sun``: max_hours less the hours in shadow are drawn; a place has the same colour.
    hatched : (rows, cols) bool, optional
        What is hatched; ``hatch`` says in the key what that is.
    hatch : str
    finer : (m, n) float32, optional
        The same hours on cells of another size, for the contour lines.

    Raises
    ------
    ValueError
        If ``shadow_hours`` does not fit the plan.
    OSError
        If the file cannot be written.
    """
    make_hours_sheet(
        plan, shadow_hours, max_hours, receivers, what, show, hatched, hatch, finer
    ).save(path)


def make_hours_sheet(
    plan: Plan,
    shadow_hours: NDArray,
    max_hours: float,
    receivers: Literal["ground", "top"] = "ground",
    what: str = "",
    show: Show = "shadow",
    hatched: NDArray[np.bool_] | None = None,
    hatch: str = "",
    finer: NDArray | None = None,
) -> Sheet:
    """Lay out what ``draw_hours`` writes; same parameters, less the path."""
    hours = np.asarray(shadow_hours, np.float32)
    if hours.shape != plan.shape:
        msg = f"shadow_hours is {hours.shape}, but the plan is {plan.shape}"
        raise ValueError(msg)
    sheet = make_sheet(plan, key_height=0.55)
    fill_hours(sheet, hours, max_hours, receivers, show, finer)
    if hatched is not None and hatched.any():
        draw_hatch(sheet, hatched)
    if max_hours > 0:
        remark = "" if plan.proposed is None else "outlined in red: proposed"
        swatches = find_swatches([plan])
        draw_hours_key(sheet, max_hours, what, remark, show, hatch, swatches)
    return sheet


def fill_hours(
    panel: Panel,
    hours: NDArray,
    max_hours: float,
    receivers: Literal["ground", "top"],
    show: Show = "shadow",
    finer: NDArray | None = None,
) -> None:
    """
    Draw the hours on a map, with contour lines and what stands there.

    Parameters
    ----------
    panel : Panel
    hours, max_hours, receivers, show, finer
        As ``draw_hours`` takes them.
    """
    plan, has_scale = panel.plan, max_hours > 0
    seen = resample(hours, panel.map_size)
    is_missing = np.isnan(seen)
    shade = None if plan.look is None else plan.look.find_shade(panel.map_size)
    image = paint_shares(np.nan_to_num(seen) / (max_hours if has_scale else 1), shade)
    is_building = np.zeros(plan.shape, bool)
    if plan.building_height is not None:
        is_building = np.nan_to_num(plan.building_height) > 0
    image[is_missing] = MISSING
    if plan.look is not None:
        draw_look(image, plan.look, panel.map_size)
    elif receivers == "ground":
        grey, coverage = shade_roofs(plan, panel.map_size)
        image += coverage[..., None] * (grey[..., None] - image)
    hatch_canopies(image, plan, panel.map_size)
    panel.paste(image, *panel.map_box[:2])

    is_ground = receivers == "ground"
    levels = find_levels(max_hours)
    traced = hours if finer is None else finer
    if show == "sun":  # paint stays; lines and labels count the other way
        traced = max_hours - traced
    shares = [level / max_hours for level in levels]
    colors = [_find_line_color(1 - share if show == "sun" else share) for share in shares]
    blocked = np.isnan(hours)
    if plan.look is not None:
        blocked |= plan.look.find_breaks(plan.shape)
    elif is_ground:  # under a roof the ground's hours mean nothing
        blocked |= is_building
    if blocked.shape != traced.shape:
        blocked = (resample(blocked, traced.shape) > 0.5) | np.isnan(traced)
    draw_contours(panel, traced, levels, colors, blocked)
    if plan.look is None:
        panel.rule_map(trace(panel, is_building), OUTLINE, 0.6 if is_ground else 0.7)
    outline_canopies(panel)
    if plan.proposed is not None:
        panel.rule_map(trace(panel, plan.proposed), PROPOSED, 1.3)
    if is_missing.all():
        x, y, w, h = panel.map_box
        reason = "no values here" if has_scale else "the sun stays below the horizon"
        panel.write(x + w / 2, y + h / 2, reason, 9.0, color=QUIET, ha="center", va="center")


def draw_hours_key(
    sheet: Sheet,
    max_hours: float,
    what: str = "",
    remark: str = "",
    show: Show = "shadow",
    hatch: str = "",
    swatches: Sequence[Swatch] = (),
) -> None:
    """Draw the scale of hours up to ``max_hours``, above 0, and the hatch in a sheet's key."""
    what = what or name_hours(show)
    if hatch and sheet.is_wide:
        remark = ", ".join(filter(None, (remark, f"hatched: {hatch}")))
    elif hatch:
        sheet = _draw_hatch_key(sheet, hatch)
    title = [what] if sheet.is_wide else wrap(what, 8.0, KEY_WIDTH)
    ramp = shade_ramp()[:: -1 if show == "sun" else 1]
    draw_color_bar(sheet, ramp, _find_scale_ticks(max_hours), title, remark, swatches)


def _draw_hatch_key(sheet: Sheet, hatch: str) -> Sheet:
    """Say what is hatched at the foot of the key; give the sheet with what is left of it."""
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
    return (INK, "#ffffffc8") if share < 0.6 else ("#ffffff", "#202048d0")


def _find_scale_ticks(max_hours: float) -> list[tuple[float, str]]:
    """Name whole hours on the colour scale, or the ends of a scale shorter than one."""
    levels = [0, *find_levels(max_hours)]
    if len(levels) == 1:
        return [(0.0, "0 h"), (1.0, f"{max_hours * 60:.0f} min")]
    return [(level / max_hours, f"{level} h") for level in levels]


def draw_hour_panels(
    path: str | os.PathLike[str],
    plan: Plan,
    days: Sequence[DayMap],
    max_hours: float,
    receivers: Literal["ground", "top"] = "ground",
    what: str = "",
    show: Show = "shadow",
    hatch: str = "",
) -> None:
    """
    Draw the hours on several dates a map for each, all on one scale.

    Parameters
    ----------
    path : path
    plan : Plan
        Of every map; its words are those of all dates.
    days : sequence of DayMap
    max_hours : float
        The colour scale's end: the most hours that the sun was up on one of the dates [h].
    receivers : {'ground', 'top'}
        As ``draw_hours`` takes them.
    what : str
        What the hours are of, for the key.
    show : {'shadow', 'sun'}
        As ``draw_hours`` takes it.
    hatch : str
        What is hatched, for the key.

    Raises
    ------
    ValueError
        If the hours of a date do not fit the plan.
    OSError
        If the file cannot be written.
    """
    make_hour_panels(plan, days, max_hours, receivers, what, show, hatch)[0].save(path)


def make_hour_panels(
    plan: Plan,
    days: Sequence[DayMap],
    max_hours: float,
    receivers: Literal["ground", "top"] = "ground",
    what: str = "",
    show: Show = "shadow",
    hatch: str = "",
) -> tuple[Sheet, list[Panel]]:
    """Lay out what ``draw_hour_panels`` writes; same parameters, less the path."""
    for day in days:
        if day.hours.shape != plan.shape:
            msg = f"the hours on {day.title} are {day.hours.shape}, but the plan is {plan.shape}"
            raise ValueError(msg)
    sheet, panels = make_panels(plan, [day.title for day in days], [day.remark for day in days])
    for panel, day in zip(panels, days, strict=True):
        hours = np.asarray(day.hours, np.float32)
        fill_hours(panel, hours, max_hours, receivers, show, day.finer)
        if day.hatched is not None and day.hatched.any():
            draw_hatch(panel, day.hatched)
    if max_hours > 0:
        remark = "" if plan.proposed is None else "outlined in red: proposed"
        draw_hours_key(sheet, max_hours, what, remark, show, hatch, find_swatches([plan]))
    return sheet, panels
