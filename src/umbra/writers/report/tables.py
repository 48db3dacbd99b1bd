"""Tables of a report: of several dates under one another, of figures, of verdicts."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from umbra.study import Study, split_dates, tell_dates
from umbra.study.rules import Place, Rules, Verdict
from umbra.sun import find_daylight
from umbra.writers.report.markup import Pin, Table

__all__ = ["find_figures", "find_sun_areas", "join_dates", "list_dates", "make_verdict_table"]


NEVER = 1e-4
"""Hours that are none [h]."""


def join_dates(study: Study, make: Callable[[Study], Table | None]) -> Table | None:
    """
    Make a table of each of a study's dates, and put them under one another.

    Parameters
    ----------
    study : Study
    make : callable
        Makes the table of a study of one date, or of the sums of several.

    Returns
    -------
    table : Table, optional
        Of several dates with a first column that names them; of sums the title says so.
        None where no date has one.
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
    """Give a study's figures: what each is, its value, and its unit."""
    figures = [("sun above the horizon", study.up_hours, "h")]
    counted = study.kind.find_counted(study)
    hours = study.shadow_hours
    if counted is None:  # a camera's pixels stand for nothing but themselves
        seen = np.isfinite(hours)
        if isinstance(study, Study):
            seen &= study.is_of_model
        weight, what = seen.astype(np.float64), "surfaces"
    else:
        seen, weight, what = counted.which, counted.weight, counted.what.partition(",")[0]
    if not seen.any():
        return figures
    share = weight[seen] / weight[seen].sum()
    if what.startswith("all that"):
        what = "surfaces"
    return [
        *figures,
        (f"mean sun, {what}", float(share @ study.sun_hours[seen]), "h"),
        ("never in the sun", float(100 * share @ (study.sun_hours[seen] <= NEVER)), "%"),
        ("never in shadow", float(100 * share @ (hours[seen] <= NEVER)), "%"),
    ]


def list_dates(study: Study) -> Table | None:
    """Give the figures of each of several dates, with sunrise and sunset; None of a single one."""
    dates = split_dates(study)
    if len(dates) == 1:
        return None
    figures = [find_figures(one) for one in dates]
    rows: list[Sequence[object]] = []
    for one, found in zip(dates, figures, strict=True):
        daylight = str(find_daylight(study.site, one.period.days[0]))
        values = [round(value, 1 if unit == "%" else 2) for _, value, unit in found]
        rows.append((tell_dates(one), daylight, *values))
    named = [f"{name} [{unit}]" for name, _, unit in figures[0]]
    return Table(
        "Date by date",
        ("date", "daylight", *named),
        rows,
        "Sunrise and sunset are those of the sun's upper rim on a level horizon, as in almanacs.",
    )


def find_sun_areas(study: Study) -> Table | None:
    """
    Tell how much of the open ground, or of all surfaces, gets at least so many hours of sun.

    One table of all dates; None where the sun is not up for an hour.
    """
    return join_dates(study, _find_sun_areas)


def _find_sun_areas(study: Study) -> Table | None:
    """Tell it of one date, or of sums."""
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
    if counted.unit == "points":
        note = f"Of {all_of_it:,.0f} points."
        return Table("Points in the sun", ("at least", "points", "share [%]"), rows, note)
    note = f"Of {all_of_it:,.0f} m² of {counted.what} here"
    note += "; areas follow the extent." if study.kind.follows_extent else "."
    return Table("Area in the sun", ("at least", "area [m²]", "share [%]"), rows, note)


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
    )  # fmt: skip


def _find_pins(verdicts: Sequence[Verdict]) -> dict[Place, Pin]:
    """Mark each named place once; it passes if all its verdicts do."""
    pins: dict[Place, Pin] = {}
    for v in verdicts:
        if v.place is not None:
            passes = v.passes and (v.place not in pins or pins[v.place].passes)
            pins[v.place] = Pin(v.where, v.place.x, v.place.y, passes, v.standing)
    return pins
