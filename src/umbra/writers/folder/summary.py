"""Summary of a study in a few numbers, as JSON."""

from typing import Any

import numpy as np

from umbra.study import Study, split_dates, tell_dates
from umbra.sun import find_daylight

__all__ = ["sum_up"]


def sum_up(study: Study) -> dict[str, Any]:
    """
    Summarise a study in a few numbers; for several dates also those of each.

    Parameters
    ----------
    study : Study

    Returns
    -------
    numbers : dict
        Sizes, hours of the sun and of shadow [h], what a proposal takes from its
        neighbours, and the seconds that it took; what JSON can hold.
    """
    if not study.kind.is_raster:
        size: dict[str, Any] = {"samples": len(study.shadow_hours)}
    else:
        size = {"cols": len(study.x), "rows": len(study.y), "cell": [study.grid.dx, study.grid.dy]}
    dates, count = split_dates(study), len(study.period.days)
    if "neighbour" in study.more:
        size["neighbours"] = [row for one in dates for row in _list_neighbours(one)]
    if count > 1:
        size["days"] = count
    if len(dates) > 1:
        size["dates"] = []
        for one in dates:
            day = one.period.days[0]
            daylight = find_daylight(study.site, day)
            clock = {
                name: None if when is None else when.isoformat(timespec="seconds")
                for name, when in (("sunrise", daylight.rises), ("sunset", daylight.sets))
            }
            size["dates"].append({"date": str(day), **clock, **_find_hours(one)})
    if "assumed_ground_share" in study.facts:
        size["assumed_ground_share"] = study.facts["assumed_ground_share"]
    return {
        **size,
        **_find_hours(study),
        **{name: study.facts[name] for name in ("prepare_seconds", "count_seconds")},
    }


def _find_hours(study: Study) -> dict[str, Any]:
    """Return how long the sun was up, and the hours in shadow."""
    is_known = np.isfinite(study.shadow_hours) & getattr(study, "is_of_model", True)
    known = study.shadow_hours[is_known]
    return {
        "hours": study.up_hours,
        "most_shadow_hours": float(known.max(initial=0.0)),
        "mean_shadow_hours": float(known.mean()) if known.size else None,
    }


def _list_neighbours(study: Study) -> list[dict[str, Any]]:
    """Return the neighbours that lose sun, on a date or on all dates together."""
    names = [name for name in study.more if name.startswith("neighbour_")]
    columns = [study.more[name][1].tolist() for name in ("neighbour", *names)]
    keys = ["name", *(name.removeprefix("neighbour_") for name in names)]
    rows = [dict(zip(keys, row)) for row in zip(*columns)]
    return [{"date": tell_dates(study), **row} for row in rows if row["area_touched"] > 0]
