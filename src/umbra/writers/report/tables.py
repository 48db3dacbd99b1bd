"""
Tables of a report: of several dates under one another, of figures, of verdicts.

Others compare before with after, by neighbours that lose sun and by casters.
"""

import calendar
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from umbra.receivers.counted import Counted
from umbra.study import Study, split_dates, tell_dates
from umbra.study.compare import LEAST
from umbra.study.rules import Place, Rules, Verdict
from umbra.sun import find_daylight, name_date
from umbra.writers.folder.month_maps import list_months
from umbra.writers.report.markup import Pin, Table

__all__ = [
    "UP",
    "find_comparisons",
    "find_figures",
    "find_sun_areas",
    "join_dates",
    "lay_out_month_table",
    "list_dates",
    "make_month_table",
    "make_verdict_table",
    "tell_hours_counted",
]

UP = "with the sun up, in these hours"
"""Name of the figure that every study has."""
NEVER = 1e-4
"""Hours that are none [h]."""
_MOST_ROWS = 40
_LEAST = "in the sun for at least"
_SLACK = 1e-3  # of hours in float32 [h]


def join_dates(study: Study, make: Callable[[Study], Table | None]) -> Table | None:
    """
    Make a table of each of a study's dates, and put them under one another.

    ``make`` returns the table of a study of one date, or of sums. Several dates are named in a
    first column, sums in the title. None if no date has a table.
    """
    dates = split_dates(study)
    found = [(tell_dates(one), table) for one in dates if (table := make(one)) is not None]
    if not found:
        return None
    name, first = found[0]
    if len(dates) == 1:
        is_sum = len(study.period.days) > 1
        return replace(first, title=f"{first.title}, {name}") if is_sum else first
    notes = list(dict.fromkeys(table.note for _, table in found))
    return replace(
        first,
        columns=("date", *first.columns),
        rows=[(date, *row) for date, table in found for row in table.rows],
        note=notes[0] if len(notes) == 1 else " ".join(f"{d}: {t.note}" for d, t in found),
        index=[k for _, table in found for k in table.index],
        link=first.link + 1,
    )


def find_figures(study: Study) -> list[tuple[str, float, str]]:
    """Return a study's figures: name, value and unit of each."""
    figures = [(UP, study.up_hours, "h")]
    counted = study.kind.find_counted(study)
    hours = study.shadow_hours
    if counted is None:  # a camera's pixels have no area
        seen = np.isfinite(hours)
        if isinstance(study, Study):
            seen &= study.is_of_model
        weight, what = seen.astype(np.float64), "surfaces"
    else:
        seen, weight, what = counted.which, counted.weight, counted.name
    if not seen.any() or not study.up_hours > 0:  # a night has neither sun nor shadow
        return figures
    share = weight[seen] / weight[seen].sum()
    mean = float(share @ study.sun_hours[seen])
    return [
        *figures,
        (f"mean sun, {what}", mean, "h"),
        ("share of the possible", 100 * mean / study.up_hours, "%"),
        ("never in the sun", float(100 * share @ (study.sun_hours[seen] <= NEVER)), "%"),
        ("never in shadow", float(100 * share @ (hours[seen] <= NEVER)), "%"),
    ]


def tell_hours_counted(study: Study) -> str:
    """Say in a sentence what a study's figures are of, and how much of it there is."""
    counted = study.kind.find_counted(study)
    if counted is None or counted.unit != "m²":
        return ""
    told = f"Shares and means are of {counted.tell_whole()} of {counted.what}"
    return f"{told}, as far as the plan shows them. " if study.kind.is_plan else f"{told}. "


def list_dates(study: Study) -> Table | None:
    """Return the figures of each of several dates, with sunrise and sunset; None for one date."""
    dates = split_dates(study)
    if len(dates) == 1:
        return None
    figures = [find_figures(one) for one in dates]
    rows: list[Sequence[object]] = []
    named = {name: f"{name} [{unit}]" for found in figures for name, _, unit in found}
    for one, found in zip(dates, figures, strict=True):
        daylight = str(find_daylight(study.site, one.period.days[0]))
        values = {name: round(value, 1 if unit == "%" else 2) for name, value, unit in found}
        rows.append((tell_dates(one), daylight, *map(values.get, named)))
    return Table(
        "Date by date",
        ("date", "daylight", *named.values()),
        rows,
        f"{tell_hours_counted(study)}Sunrise and sunset are when the sun's upper rim crosses a "
        "level horizon, as in almanacs.",
    )


def make_month_table(study: Study) -> Table | None:
    """Return the hours of sun a day in each month; None where months are not kept."""
    return lay_out_month_table(list_months(study), tell_hours_counted(study))


def lay_out_month_table(rows: Sequence[dict[str, Any]], counted: str) -> Table | None:
    """Lay out the rows of months, whose figures are of what is ``counted``; None without any."""
    if not rows:
        return None
    return Table(
        "Month by month",
        ("month", "dates", "possible [h a day]", "mean sun [h a day]", "share of the possible [%]",
         "least [h]", "most [h]"),
        [
            (calendar.month_name[row["month"]], row["dates"], round(row["up_hours"], 2),
             round(row["mean_sun_hours"], 2), round(100 * row["share_of_possible"], 1),
             round(row["least_sun_hours"], 2), round(row["most_sun_hours"], 2))
            for row in rows
        ],
        f"{counted}Hours a day, means of each month's dates. Possible is what an "
        "open place has in the hours of the day that count.",
    )  # fmt: skip


def find_sun_areas(study: Study) -> Table | None:
    """
    Return the areas of open ground, or of all surfaces, by their least hours of sun.

    One table of all dates; None where the sun is not up for an hour.
    """
    return join_dates(study, _find_sun_areas)


def _find_sun_areas(study: Study) -> Table | None:
    """Return the table of one date, or of sums."""
    whole = int(study.up_hours + 1e-6)
    counted = study.kind.find_counted(study)
    if whole < 1 or counted is None:
        return None
    sun, all_of_it = study.sun_hours, counted.whole
    step = max(1, -(-whole // 8))
    rows = []
    for hours in range(step, whole + 1, step):
        some = counted.add_up(sun >= hours - 1e-3)
        figure = round(some, 1) if counted.unit == "m²" else round(some)
        rows.append((f"{hours} h", figure, round(100 * some / all_of_it, 1)))
    if counted.unit != "m²":
        note = f"Of {all_of_it:,.0f} {counted.unit}."
        title = f"{counted.unit.capitalize()} in the sun"
        return Table(title, (_LEAST, counted.unit, "share [%]"), rows, note)
    what = f"{counted.what} [m²]"
    note = f"Of {counted.tell_whole()} of {counted.what}"
    note += ", as far as the plan shows them." if study.kind.is_plan else " here."
    return Table("Area in the sun", (_LEAST, what, "share [%]"), rows, note)


def make_verdict_table(rules: Rules, verdicts: Sequence[Verdict]) -> Table:
    """Lay verdicts out for a report or a CSV file."""
    failed = sum(not verdict.passes for verdict in verdicts)
    outcome = "all pass" if not failed else f"{failed} of {len(verdicts)} fail"
    pins = _find_pins(verdicts)
    places = list(pins)
    return Table(
        f"{rules.name}, {rules.version}: {outcome}",
        ("check", "date", "where", "wanted", "measured", "verdict", "evidence"),
        [
            (v.check, v.date.isoformat(), v.where, v.wanted, v.measured,
             "pass" if v.passes else "fail", v.evidence)
            for v in verdicts
        ],
        f"Source: {rules.source}",
        kind="place" if pins else "",
        index=[None if v.place is None else places.index(v.place) for v in verdicts],
        link=2,
        pins=list(pins.values()),
        answer=_tell_outcome(rules, verdicts),
    )  # fmt: skip


def _tell_outcome(rules: Rules, verdicts: Sequence[Verdict]) -> str:
    """Tell how many checks pass, and the first that does not with its numbers."""
    failed = [v for v in verdicts if not v.passes]
    if not failed:
        return f"{rules.name}: all {len(verdicts)} pass"
    v = failed[0]
    first = f"{v.check}, {v.where} on {name_date(v.date)}: {v.measured}; wanted {v.wanted}"
    return f"{rules.name}: {len(failed)} of {len(verdicts)} fail; first {first}"


def _find_pins(verdicts: Sequence[Verdict]) -> dict[Place, Pin]:
    """Mark each named place once; it passes if all its verdicts do."""
    pins: dict[Place, Pin] = {}
    for v in verdicts:
        if v.place is not None:
            passes = v.passes and (v.place not in pins or pins[v.place].passes)
            pins[v.place] = Pin(v.where, v.place.x, v.place.y, passes, v.standing)
    return pins


def find_comparisons(study: Study) -> list[Table]:
    """Lay out what proposed=, by= and who= have found; nothing where nothing was asked."""
    tables = (join_dates(study, make) for make in (_compare, _list_neighbours, _list_casters))
    return [table for table in tables if table is not None]


def _compare(study: Study) -> Table | None:
    groups = study.kind.list_counted(study)
    if "hours_lost" not in study.more or not groups:
        return None
    is_left = np.isfinite(np.asarray(study.more["hours_lost"][1]))
    both = [replace(one, which=one.which & is_left) for one in groups]
    rows = [row for one in both if one.which.any() for row in _compare_group(study, one)]
    if len(groups) == 1:
        rows = [row[1:] for row in rows]
    whole = both[-1]
    where = "in the whole frame " if study.kind.is_plan else ""
    return Table(
        "Before and after",
        (*(("where",) if len(groups) > 1 else ()), whole.name, "before", "after", "change"),
        rows,
        f"Of the {whole.tell_whole()} {where}that exist before and after.",
    )


def _compare_group(study: Study, both: Counted) -> list[tuple[object, ...]]:
    """Return the rows of some receivers that exist before and after, each with their name."""
    lost = np.nan_to_num(np.asarray(study.more["hours_lost"][1]))
    after = study.sun_hours.astype(np.float64)
    before = after + lost
    unit, under = both.unit, float(study.facts.get("under_hours", 2.0))  # type: ignore[arg-type]
    # Of what is printed, so that before and change add up to after.
    was, left = (round(both.average(hours), 2) + 0.0 for hours in (before, after))
    rows: list[tuple[object, ...]] = [("mean sun [h]", was, left, round(left - was, 2) + 0.0)]
    is_one_date = len(study.period.days) == 1
    limits = (
        (f"at least {under:g} h of sun [{unit}]", lambda sun: sun >= under - _SLACK),
        (f"less than {under:g} h of sun [{unit}]", lambda sun: sun < under - _SLACK),
    )
    for name, test in (
        *(limits if is_one_date else ()),  # a limit holds for a date, never for a sum
        (f"no sun at all [{unit}]", lambda sun: sun <= _SLACK),
        (f"no shadow at all [{unit}]", lambda sun: sun >= study.up_hours - _SLACK),
    ):
        old, new = (round(both.add_up(test(sun))) for sun in (before, after))
        rows.append((name, old, new, new - old))
    touched = round(both.add_up(lost > LEAST))
    rows.append((f"loses sun [{unit}]", 0, touched, touched))
    if won := round(both.add_up(lost < -LEAST)):  # where what was replaced stood in the way
        rows.append((f"wins sun [{unit}]", 0, won, won))
    newly = round(both.add_up(np.asarray(study.more["newly_under"][1]) > 0))
    on = "" if is_one_date else " on at least one date"
    rows.append((f"newly under {under:g} h{on} [{unit}]", 0, newly, newly))
    return [(both.name, *row) for row in rows]


def _list_neighbours(study: Study) -> Table | None:
    if "neighbour" not in study.more or not study.kind.belongs_to_parts:
        return None
    arrays = {n: np.asarray(array) for n, (_, array) in study.more.items() if "neighbour" in n}
    touched = np.flatnonzero(arrays["neighbour_area_touched"] > 0)  # on this date
    arrays = {name: array[touched] for name, array in arrays.items()}
    names = arrays["neighbour"].tolist()
    if not names:
        return None
    under = f"newly under {study.facts.get('under_hours', 2.0):g} h"
    if len(study.period.days) > 1:
        under += " on at least one date"
    where = "in this picture" if study.kind.is_raster else "here"
    columns = {
        "area [m²]": ("neighbour_area", 1),
        "loses sun [m²]": ("neighbour_area_touched", 1),
        f"{under} [m²]": ("neighbour_area_newly_under", 1),
        "most lost [h]": ("neighbour_most_hours_lost", 2),
        "mean lost [h]": ("neighbour_mean_hours_lost", 2),
    }
    rows = [
        (name, *(round(float(arrays[key][k]), digits) for key, digits in columns.values()))
        for k, name in enumerate(names[:_MOST_ROWS])
    ]
    more = f" {len(names) - _MOST_ROWS} more are in study.nc." if len(names) > _MOST_ROWS else ""
    return Table(
        "Who loses sun",
        ("neighbour", *columns),
        rows,
        f"Parts that lose the most hours over most of their area {where} come first.{more}",
    )


def _list_casters(study: Study) -> Table | None:
    counted = study.kind.find_counted(study)
    if "caster" not in study.more or counted is None:
        return None
    arrays = {n: np.asarray(study.more[n][1]) for n in ("caster", "cast_hours", "sole_hours")}
    rows = []
    what = f"all {counted.unit}" if counted.unit != "m²" else counted.what
    for k, name in enumerate(arrays["caster"].tolist()[:_MOST_ROWS]):
        cast, sole = arrays["cast_hours"][k], arrays["sole_hours"][k]
        figures = (counted.average(cast), counted.average(sole), cast[counted.which].max())
        rows.append((name, *(round(float(v), 2) for v in figures)))
    return Table(
        "Who casts the shadow",
        ("caster", "mean cast [h]", "mean of it alone [h]", "most cast [h]"),
        rows,
        f"Over {what}. Alone: hours that would be in the sun without this caster. An hour in the "
        "shadow of several casters counts for each of them, but for none alone.",
    )
