"""Measures of a whole study in tiles besides hours: their figures, in sentences and as a table."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from umbra.study.measures import Quantity
from umbra.writers.city.city_figures import CityFigures
from umbra.writers.folder.summary import tell_measure
from umbra.writers.report.markup import Table
from umbra.writers.report.measure_tables import count_decimals, tell_unit

__all__ = ["find_city_measures", "lay_out_city_measures", "tell_city_measures"]


def find_city_measures(
    figures: CityFigures | None, quantities: Sequence[Quantity]
) -> list[tuple[Quantity, float, dict[str, Any]]]:
    """
    Return the figures of each measure, tile by tile, with the area that has a value [m2].

    They are those of ``summarise``: mean, least and most; with a proposal what was before, and what
    it takes.
    """
    if figures is None or figures.counted is None:
        return []
    found = []
    for one in quantities:
        if one.per or not figures.holds(one.name):
            continue
        area, told = _add_up(figures, one.name, "")
        if not area > 0:
            continue
        if figures.holds(f"{one.name}_lost"):
            both, lost = _add_up(figures, f"{one.name}_lost", "_lost")
            _, before = _add_up(figures, f"{one.name}_before", "_before", f"{one.name}_lost")
            if both > 0:
                told |= {"mean_before": before["mean_before"], "mean_lost": lost["mean_lost"]}
                told |= {"most_lost": lost["most_lost"], "compared": both}
        found.append((one, area, told))
    return found


def _add_up(
    figures: CityFigures, name: str, ending: str, like: str = ""
) -> tuple[float, dict[str, Any]]:
    """Return the area with a value, of this variable and of one like it, and its figures."""
    area, total, least, most = 0.0, 0.0, np.inf, -np.inf
    others = figures.read(like) if like else figures.read(name)
    for (values, areas), (other, _) in zip(figures.read(name), others, strict=True):
        known = np.isfinite(values) & np.isfinite(other)
        if known.any():
            own = np.broadcast_to(areas, values.shape)[known]
            shown = values[known].astype(np.float64)
            area, total = area + float(own.sum()), total + float((own * shown).sum())
            least, most = min(least, float(shown.min())), max(most, float(shown.max()))
    mean = total / area if area > 0 else None
    return area, {f"mean{ending}": mean, f"least{ending}": least, f"most{ending}": most}


def tell_city_measures(
    figures: CityFigures | None, quantities: Sequence[Quantity], taker: tuple[str, str]
) -> list[str]:
    """
    Tell each measure in a sentence, as ``tell_answers`` does of one study.

    ``taker`` names the proposal, with the verb that follows.
    """
    if figures is None or figures.counted is None:
        return []
    counted = figures.counted
    lines = []
    for one, area, told in find_city_measures(figures, quantities):
        of = counted.of_weight(area)
        compared = counted.of_weight(told.get("compared", area))
        lines.append(tell_measure(one, told, counted, of, compared, taker))
    return lines


def lay_out_city_measures(
    figures: CityFigures | None, quantities: Sequence[Quantity], of: str
) -> Table | None:
    """Lay out all measures, a row each; None without any. ``of`` says of what they are."""
    found = find_city_measures(figures, quantities)
    if not found:
        return None
    keys = {"mean": "mean", "least": "least", "most": "most"}
    if any("mean_lost" in told for *_, told in found):
        keys |= {"mean_before": "mean before", "mean_lost": "mean lost", "most_lost": "most lost"}
    rows = []
    for one, _, told in found:
        digits = count_decimals(np.array([told["most"]]))
        values = [told.get(key) for key in keys]
        shown = [None if v is None else round(float(v), digits) + 0.0 for v in values]
        rows.append((f"{one.long_name}{tell_unit(one)}", *shown))
    return Table("Measures", ("measure", *keys.values()), rows, of)
