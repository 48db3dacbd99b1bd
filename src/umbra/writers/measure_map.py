"""Picture of a measure: its values on a plan or view with lines of equal values, or at points."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.scene.grid import Places
from umbra.study.measures import Quantity
from umbra.writers.contours import find_swatches
from umbra.writers.hours_map import Lines, fill_map, tell_outlined
from umbra.writers.marks import draw_color_bar, find_round
from umbra.writers.paper import wrap
from umbra.writers.picture_content import MISSING, Plan
from umbra.writers.pixels import Ramp, resample, shade_ramp
from umbra.writers.point_map import fill_points
from umbra.writers.sheet import KEY_WIDTH, Sheet, lay_out_sheet

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
    sheet = lay_out_sheet(plan, 0.55)
    (panel,) = sheet.maps
    is_light = quantity.ramp == "light"
    shares = resample(np.asarray(values, np.float32), panel.map_size) / np.float32(end)
    levels = _find_levels(end)[1:-1]
    texts = [f"{level:g}{quantity.suffix}" for level in levels]
    positions = [1 - level / end if is_light else level / end for level in levels]
    lines = Lines(values, levels, positions, texts)
    fill_map(panel, 1 - shares if is_light else shares, values, lines, _name_ramp(quantity))
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
    sheet = lay_out_sheet(plan, 0.62)
    (panel,) = sheet.maps
    ramp = _find_colors(quantity)
    share = np.clip(np.nan_to_num(values) / end, 0, 1)
    colors = ramp[np.rint(share * (len(ramp) - 1)).astype(np.intp)]
    colors[np.isnan(values)] = MISSING
    texts = ["-" if np.isnan(value) else quantity.show(value) for value in values]
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


def _draw_key(sheet: Sheet, quantity: Quantity, end: float) -> None:
    """Draw the scale with the measure's name and unit."""
    unit = quantity.suffix.strip()
    what = f"{quantity.long_name} [{unit}]" if unit else quantity.long_name
    title = [what] if sheet.is_wide else wrap(what, 8.0, KEY_WIDTH)
    ticks = [(level / end, f"{level:g}") for level in _find_levels(end)]
    swatches = find_swatches([sheet.plan])
    draw_color_bar(sheet, _find_colors(quantity), ticks, title, tell_outlined(sheet.plan), swatches)
