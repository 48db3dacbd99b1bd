"""A study's summary in a few numbers, as JSON can hold them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from umbra.receivers.counted import Counted, meets_frame
from umbra.study import Study, name_dates, split_dates, tell_dates
from umbra.study.area_table import AreaTable, name_share
from umbra.study.compare import LEAST
from umbra.study.measures import Quantity
from umbra.sun import find_daylight, name_date
from umbra.sun.clock import say_hours
from umbra.writers.folder.taken_sun import TakenSun, name_proposal

__all__ = ["find_worst", "summarise", "tell_answers", "tell_areas", "tell_measure", "tell_sun"]

_MOST_DATES = 8
_NEVER = 1e-4  # hours that are none [h]
_WHOLE = 1e-6  # of a number, by which it may be off a whole one

_LEAST_SHARE = 5e-4
"""The least share that has a decimal of a percent."""
_MOST_AREAS = 8
"""Lines that tell of named areas."""
_MOST = 4
"""Casters that a line tells."""
_TAKEN = ("mean_before", "mean_lost", "most_lost")


def summarise(study: Study) -> dict[str, Any]:
    """
    Summarise a study in a few numbers, as JSON can hold them; also of each of several dates.

    They are sizes, hours of the sun and of shadow [h], the neighbours' losses to a proposal,
    and the seconds that the study took.
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
    if study.quantities:
        size["measures"] = {one.name: _find_figures(study, one) for one in study.quantities}
    return {
        **size,
        **(_find_hours(study) if study.has_hours else {}),
        **{name: study.facts[name] for name in ("prepare_seconds", "count_seconds")},
    }


def find_worst(study: Study) -> int:
    """Return the index of the date that loses most sun or, without a proposal, has the least."""
    dates = split_dates(study)
    worst = [-_weigh(date) for date in dates]
    return int(np.argmin(worst)) if len(dates) > 1 else 0


def _weigh(study: Study) -> float:
    """Return how bad a date is: the area times hours lost or, without a proposal, shadow."""
    groups = study.kind.list_counted(study)
    if not groups or not study.up_hours > 0:
        return -np.inf
    if "hours_lost" in study.more:
        lost = np.nan_to_num(np.asarray(study.more["hours_lost"][1]))
        return groups[-1].average(np.maximum(lost, 0))
    counted = study.kind.find_counted(study)
    return -np.inf if counted is None else -counted.average(study.sun_hours)


def tell_answers(
    study: Study, proposed: Sequence[str] = (), *, effect_first: bool = False
) -> list[str]:
    """
    Tell what a study found: named areas first, then the hours of each date, and each measure.

    Each line names the area that its figures are of. ``proposed`` are the patterns of the
    proposal's parts; what it takes is told before the hours that are left, with ``effect_first``
    before all else, and of several dates the worst first.
    """
    taker = _name_proposal(study, proposed)
    counted = study.kind.find_counted(study)
    lines: list[str] = []
    effects: list[str] = []
    if study.has_hours and counted is not None:
        dates, worst = split_dates(study), ""
        if effect_first and len(dates) > 1:
            first = find_worst(study)
            dates = [dates[first], *dates[:first], *dates[first + 1 :]]
            worst = f", the worst of {len(dates)} dates"
        for date in dates[:_MOST_DATES]:
            *effect, left = _tell_hours(date, taker, worst) or [""]
            worst = ""
            (effects if effect_first else lines).extend(effect)
            lines += [left] if left else []
        if len(dates) > _MOST_DATES:
            lines.append(f"and {len(dates) - _MOST_DATES} more dates, in study.nc")
    lines = effects + tell_areas(study.areas) + lines
    for one in study.quantities:
        figures = _find_figures(study, one)
        if one.per and "of" in figures:
            takers = sorted(figures["of"].items(), key=lambda item: -item[1])[:_MOST]
            shown = ", ".join(f"{name} {one.show(mean)}" for name, mean in takers)
            lines.append(f"{one.long_name}, in the mean: {shown}")
            continue
        if counted is None or figures["mean"] is None:
            continue
        of = counted.with_value(study.more[one.name][1])
        lost = study.more.get(f"{one.name}_lost")
        compared = of if lost is None else of.with_value(lost[1])
        lines.append(tell_measure(one, figures, counted, of, compared, taker))
    return lines


def tell_measure(
    one: Quantity,
    figures: dict[str, Any],
    counted: Counted,
    of: Counted,
    compared: Counted,
    taker: tuple[str, str] = ("the proposal", "takes"),
) -> str:
    """
    Tell a measure's mean, least and most, and beside a proposal what it takes.

    ``counted`` is what counts, ``of`` what has a value, ``compared`` what has one before as well.
    """
    mean, least, most = (one.show(figures[key]) for key in ("mean", "least", "most"))
    some = " with a value" if of.whole < counted.whole else ""
    told = f"{one.long_name}: {mean} in the mean of {of.tell_whole_of()}{some}, "
    told += f"from {least} to {most}"
    if "mean_lost" not in figures:
        return told
    before, lost, worst = (one.show(figures[key]) for key in _TAKEN)
    where = f" on the {compared.tell_whole()} there before" if compared.whole < of.whole else ""
    name, verb = taker
    told += f"; {before} before{where}, of which {name} {verb} {lost} in the mean"
    return f"{told}, at most {worst}"


def tell_areas(table: AreaTable | None) -> list[str]:
    """Tell the share of each named area with sun for long enough; of many lines the worst."""
    if table is None or table.least is None:
        return []
    least = table.least
    share, rows = name_share(least), table.list_rows()
    is_cut = len(rows) > _MOST_AREAS
    if is_cut:  # each area on its worst date
        worst: dict[str, dict[str, Any]] = {}
        for row in rows:
            if row["name"] not in worst or row[share] < worst[row["name"]][share]:
                worst[row["name"]] = row
        rows = sorted(worst.values(), key=lambda row: float(row[share]))
    date = f"its worst of {len(table.dates)} dates" if is_cut and len(table.dates) > 1 else ""
    lines = []
    for row in rows[:_MOST_AREAS]:
        before = row.get(f"{share}_before")
        told = "" if before is None else f"{100 * before:.1f} % before"
        remark = "; ".join(filter(None, (date, told)))
        remark = remark and f" ({remark})"
        lines.append(
            f"{row['name']}: {100 * row[share]:.1f} % of {row['area_m2']:,.0f} m² has at least "
            f"{least:g} h of sun on {name_date(row['date'])} from {table.tell_interval(row)}"
            f"{remark}"
        )
    if len(rows) > _MOST_AREAS:
        lines.append(f"and {len(rows) - _MOST_AREAS} more areas, in areas.csv")
    return lines


def _name_proposal(study: Study, proposed: Sequence[str]) -> tuple[str, str]:
    """Name the proposal, with the verb that follows."""
    scene = study.model.scene
    labels, parts = scene.labels(), scene.select(proposed) if proposed else []
    return name_proposal(
        [labels[k] for k in parts], {scene.parts[k].layer for k in parts}, proposed
    )


def _tell_hours(study: Study, taker: tuple[str, str], worst: str = "") -> list[str]:
    """
    Tell what a proposal takes of one date's sun, or of sums, and the sun that is left.

    ``worst`` follows the date of the first of them.
    """
    counted = study.kind.find_counted(study)
    if counted is None or not counted.whole or not study.up_hours > 0:
        return []
    never = counted.add_up(study.sun_hours <= _NEVER) / counted.whole
    days = study.period.days
    date = name_dates(study)
    has_losses = "hours_lost" in study.more
    prefix = f"{date}{'' if has_losses else worst}" if date else ""
    left = tell_sun(
        prefix, counted, counted.average(study.sun_hours), study.up_hours, never,
        is_sum=len(days) > 1,
    )  # fmt: skip
    if not has_losses:
        return [left]
    when = f" on {date}{worst}" if len(days) == 1 else f" ({date})" if date else ""
    return [_tell_loss(study, taker, when), left]


def tell_sun(
    date: str, counted: Counted, mean: float, whole: float, never: float, *, is_sum: bool
) -> str:
    """
    Tell the mean hours of sun of what counts, of the hours with the sun up, on a date or in sums.

    ``never`` is the share without any [0..1].
    """
    prefix = f"{date[0].upper()}{date[1:]}: the" if is_sum else f"On {date} the" if date else "The"
    what = counted.what.replace(", ", " ")
    what = counted.tell_whole() if what == counted.unit else f"{what} ({counted.tell_whole()})"
    share = f" ({100 * mean / whole:.3g} % of the possible)" if is_sum else ""
    told = f"{prefix} sun reaches {what} for {say_hours(mean)} of {say_hours(whole)} on average"
    return f"{told}{share}; {_tell_none(counted, never)}"


def _tell_none(counted: Counted, never: float) -> str:
    """Tell the share of an area without any sun, or the number of points or panes."""
    number = never * counted.whole
    is_count = counted.unit != "m²" and abs(number - round(number)) < _WHOLE
    if not never:
        return "all get some" if is_count and counted.whole > 1 else "all gets some"
    if not is_count or round(number) == round(counted.whole):
        return f"{say_share(never)} gets none"
    return f"{round(number):,} of them {'gets' if round(number) == 1 else 'get'} none"


def say_share(share: float) -> str:
    """Format a share [0..1] in percent with one decimal; only none is 0 %, and only all 100 %."""
    if share in {0, 1}:
        return f"{100 * share:.0f} %"
    if min(share, 1 - share) < _LEAST_SHARE:
        return "under 0.1 %" if share < _LEAST_SHARE else "over 99.9 %"
    return f"{100 * share:.1f} %"


def _tell_loss(study: Study, taker: tuple[str, str], when: str) -> str:
    """Tell what a proposal takes of all ground that is shown, as tables and maps do."""
    lost = np.nan_to_num(np.asarray(study.more["hours_lost"][1]))
    *_, counted = study.kind.list_counted(study)
    is_cut = study.kind.is_plan and meets_frame(counted.which & (np.abs(lost) > LEAST))
    taken = TakenSun.of(counted, lost, study.more["newly_under"][1], is_cut=is_cut)
    is_sum, under = len(study.period.days) > 1, float(str(study.facts["under_hours"]))
    return taken.tell(counted, taker, when, under, is_sum=is_sum)


def _find_hours(study: Study) -> dict[str, Any]:
    """Return how long the sun was up, and the hours in shadow."""
    is_known = np.isfinite(study.shadow_hours) & getattr(study, "is_of_model", True)
    known = study.shadow_hours[is_known]
    return {
        "hours": study.up_hours,
        "most_shadow_hours": float(known.max(initial=0.0)),
        "mean_shadow_hours": float(known.mean()) if known.size else None,
        "mean_sun_hours": study.up_hours - float(known.mean()) if known.size else None,
    }


def _find_figures(study: Study, one: Quantity) -> dict[str, Any]:
    """Return the mean by area, the least and the most of a measure, with its unit."""
    counted = study.kind.find_counted(study)
    values = np.asarray(study.more[one.name][1])
    figures: dict[str, Any] = {"unit": one.unit, "mean": None, "least": None, "most": None}
    if counted is None or not counted.which.any():
        return figures
    if one.per:
        names = np.asarray(study.more[one.per][1]).tolist()
        each = {name: counted.average(row) for name, row in zip(names, values, strict=True)}
        return {"unit": one.unit, "of": each}
    counted = counted.with_value(values)
    known = values[counted.which]
    if not len(known):
        return figures
    least, most = float(known.min()), float(known.max())
    figures |= {"mean": counted.average(values), "least": least, "most": most}
    if f"{one.name}_lost" in study.more:
        before, lost = (np.asarray(study.more[f"{one.name}_{w}"][1]) for w in ("before", "lost"))
        both = counted.with_value(lost)
        if both.which.any():
            figures |= {
                "mean_before": both.average(before), "mean_lost": both.average(lost),
                "most_lost": float(lost[both.which].max()),
            }  # fmt: skip
    return figures


def _list_neighbours(study: Study) -> list[dict[str, Any]]:
    """Return the neighbours that lose sun, on a date or on all dates together."""
    names = [name for name in study.more if name.startswith("neighbour_")]
    columns = [study.more[name][1].tolist() for name in ("neighbour", *names)]
    keys = ["name", *(name.removeprefix("neighbour_") for name in names)]
    rows = [dict(zip(keys, row)) for row in zip(*columns)]
    return [{"date": tell_dates(study), **row} for row in rows if row["area_touched"] > 0]
