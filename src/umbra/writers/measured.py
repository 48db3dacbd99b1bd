"""Picture of a measure: its values on a plan or view with lines of equal values, or at points."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.scene.grid import Places
from umbra.study.measures import Quantity
from umbra.writers.contours import (
    PROPOSED,
    draw_contours,
    find_swatches,
    hatch_covers,
    outline_covers,
    trace,
)
from umbra.writers.hours import DEEP, OUTLINE, tell_outlined
from umbra.writers.marks import draw_color_bar, find_round
from umbra.writers.paper import INK, wrap
from umbra.writers.pixels import SLOPE_SHADE, Ramp, paint_shares, resample, shade_ramp
from umbra.writers.plan import MISSING, Plan, cover_with_roofs, draw_appearance
from umbra.writers.point_map import fill_points
from umbra.writers.sheet import KEY_WIDTH, Sheet, lay_out

__all__ = ["find_end", "make_measure_sheet", "make_measured_points_sheet"]

_STEPS = 5
"""Fewest parts of a scale between its lines: a round step makes more of them."""


def find_end(quantity: Quantity, values: NDArray[np.floating]) -> float:
    """Return the upper end of a quantity's scale: its own, or a round one above all values."""
    if quantity.most is not None:
        return quantity.most
    largest = float(np.nanmax(values, initial=0.0))
    if not largest > 0:
        return 1.0
    step = find_round(largest / 4)
    return step * math.ceil(largest / step - 1e-9)


def make_measure_sheet(
    plan: Plan, values: NDArray[np.floating], quantity: Quantity, end: float
) -> Sheet:
    """
    Draw a measure on a plan or a view, with lines at round values.

    Parameters
    ----------
    plan : Plan
    values : (rows, cols) float
        Rows ascend; NaN is no value.
    quantity : Quantity
    end : float
        Upper end of the scale.
    """
    sheet = lay_out(plan, 0.55)
    (panel,) = sheet.maps
    size = panel.map_size
    seen = resample(np.asarray(values, np.float32), size)
    is_missing = np.isnan(seen)
    share = np.nan_to_num(seen) / np.float32(end)
    is_light = quantity.ramp == "light"
    shade = None if plan.appearance is None else plan.appearance.find_shade(size)
    image = paint_shares(1 - share if is_light else share, shade, _name_ramp(quantity))
    image[is_missing] = MISSING
    if shade is not None:
        image[is_missing] -= SLOPE_SHADE * shade[is_missing, None]
    if plan.roofs_cover:
        cover_with_roofs(image, plan, size)
    if plan.appearance is not None:
        draw_appearance(image, plan.appearance, size)
    hatch_covers(image, plan, size)
    panel.paste(image, *panel.map_box[:2])
    levels = _find_levels(end)[1:-1]
    blocked = np.isnan(values)
    if plan.appearance is not None:
        blocked |= plan.appearance.find_breaks(plan.shape)
    if plan.roofs_cover:
        blocked |= plan.is_building
    colors = [_find_color(level / end, is_light=is_light) for level in levels]
    texts = [f"{level:g}{quantity.suffix}" for level in levels]
    draw_contours(panel, values, levels, colors, blocked, texts)
    if plan.appearance is None:
        panel.rule_map(trace(panel, plan.is_building), OUTLINE, 0.6 if plan.roofs_cover else 0.7)
    outline_covers(panel)
    if plan.proposed is not None and not plan.looks_through:
        panel.rule_map(trace(panel, plan.proposed), PROPOSED, 1.3)
    if is_missing.all():
        panel.write_over("no values here")
    _draw_key(sheet, quantity, end)
    return sheet


def make_measured_points_sheet(
    plan: Plan,
    places: Places,
    values: NDArray[np.floating],
    quantity: Quantity,
    end: float,
    names: Sequence[str] = (),
) -> Sheet:
    """Draw a measure at points on a plan of the buildings around them; see `make_measure_sheet`."""
    sheet = lay_out(plan, 0.62)
    (panel,) = sheet.maps
    ramp = _find_colors(quantity)
    share = np.clip(np.nan_to_num(values) / end, 0, 1)
    colors = ramp[np.rint(share * (len(ramp) - 1)).astype(np.intp)]
    colors[np.isnan(values)] = MISSING
    texts = [quantity.show(value) for value in values]
    fill_points(panel, places, colors, texts, names)
    _draw_key(sheet, quantity, end)
    return sheet


def _name_ramp(quantity: Quantity) -> Ramp:
    return "shade" if quantity.ramp == "light" else "loss"


def _find_colors(quantity: Quantity) -> NDArray[np.float64]:
    """Return the colours of the scale, from 0 to its end, (n, 3) sRGB."""
    return shade_ramp(ramp=_name_ramp(quantity))[:: -1 if quantity.ramp == "light" else 1]


def _find_levels(end: float) -> list[float]:
    """Return round values from 0 to the scale's end."""
    step = find_round(end / _STEPS)
    return [step * k for k in range(math.floor(end / step + 1e-9) + 1)]


def _find_color(share: float, *, is_light: bool) -> tuple[str, str]:
    """Choose a line's colour and its label's halo to stand out on their shade."""
    deep = 1 - share if is_light else share
    return (INK, "#ffffffc8") if deep < DEEP else ("#ffffff", "#202048d0")


def _draw_key(sheet: Sheet, quantity: Quantity, end: float) -> None:
    """Draw the scale with the measure's name and unit."""
    unit = quantity.suffix.strip()
    what = f"{quantity.long_name} [{unit}]" if unit else quantity.long_name
    title = [what] if sheet.is_wide else wrap(what, 8.0, KEY_WIDTH)
    ticks = [(level / end, f"{level:g}") for level in _find_levels(end)]
    swatches = find_swatches([sheet.plan])
    draw_color_bar(sheet, _find_colors(quantity), ticks, title, tell_outlined(sheet.plan), swatches)
