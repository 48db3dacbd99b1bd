"""The report's tables of measures besides hours: over all, and by part, named area or caster."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.counted import Counted
from umbra.study import Study
from umbra.study.measures import Measure, Quantity, guard
from umbra.study.options import StudyOptions
from umbra.writers.report.markup import Table

__all__ = [
    "caption_measures", "count_decimals", "find_columns_of_points", "find_means", "list_measures",
    "tell_unit",
]  # fmt: skip

_MOST_ROWS = 200
_MOST_CASTERS = 40
_KEPT = 6  # column of the share that is kept [%]


@dataclass(frozen=True, eq=False)
class _Columns:
    """Values of a quantity at each receiver, beside a proposal also before it."""

    after: NDArray[np.float64]
    before: NDArray[np.float64] | None = None

    @classmethod
    def of(cls, study: Study, quantity: Quantity) -> "_Columns":
        after = np.asarray(study.more[quantity.name][1], np.float64)
        before = study.more.get(f"{quantity.name}_before")
        return cls(after, None if before is None else np.asarray(before[1], np.float64))

    @property
    def is_known(self) -> NDArray[np.bool_]:
        """Where there is a value, beside a proposal both before and after."""
        known = np.isfinite(self.after)
        return known if self.before is None else known & np.isfinite(self.before)


@dataclass(frozen=True)
class _Rows:
    """Rows of a table, and what a click on each of them shows."""

    kind: str
    rows: list[tuple[object, ...]]
    index: list[int | None]


def list_measures(study: Study, options: StudyOptions) -> list[Table]:
    """
    Lay out each measure besides hours: a table for each of its variables, below its maps.

    Rows are of all receivers together, then of each part or named area. Beside a proposal they
    have the mean before it, and what it takes.
    """
    tables = []
    for measure in options.measures:
        for quantity in guard(measure, lambda measure=measure: measure.quantities):
            if quantity.per:
                tables.append(_list_casters(study, quantity))
            else:
                tables.append(_list_quantity(study, options, measure, quantity))
    return [table for table in tables if table is not None]


def caption_measures(quantities: Sequence[Quantity]) -> dict[str, str]:
    """Return the captions of the pictures of measures, by the names of their files."""
    words: dict[str, str] = {}
    for one in quantities:
        name = one.long_name[:1].upper() + one.long_name[1:]
        words |= {one.name: name, f"{one.name}_lost": f"{name}: what the proposal takes"}
    return words


def find_means(study: Study) -> list[tuple[str, str]]:
    """Return the mean of each measure with its unit, for the figures at the top."""
    found, counted = [], study.kind.find_counted(study)
    for quantity in study.quantities if counted is not None else ():
        if quantity.per:
            continue
        values = np.asarray(study.more[quantity.name][1])
        known = counted.with_value(values)  # type: ignore[union-attr]
        if known.which.any() and known.whole > 0:
            found.append((f"mean {quantity.long_name}", quantity.show(known.average(values))))
    return found


def find_columns_of_points(study: Study) -> dict[str, NDArray[Any]]:
    """Return the values of each measure at single points by heading, with what a proposal takes."""
    columns = {}
    for quantity in study.quantities:
        for ending, words in ("", ""), ("_lost", ", lost"):
            if f"{quantity.name}{ending}" in study.more and not quantity.per:
                values = np.asarray(study.more[f"{quantity.name}{ending}"][1], np.float64)
                heading = f"{quantity.long_name}{words}{tell_unit(quantity)}"
                columns[heading] = np.round(values, count_decimals(values))
    return columns


def _list_quantity(
    study: Study, options: StudyOptions, measure: Measure, quantity: Quantity
) -> Table | None:
    """Lay out a variable; None if nothing has a value."""
    columns = _Columns.of(study, quantity)
    digits = count_decimals(columns.after)
    groups = _find_groups(study, columns)
    rows = [(one.tell_whole_of(), *_tell(columns, one, digits)) for one in groups]
    if not rows:
        return None
    each = _list_areas(study, quantity, digits) or _list_parts(study, columns, digits)
    headings = ["mean", "least", "most"]
    if columns.before is not None:
        headings += ["mean before", "mean lost", "most lost", "kept [%]"]
    told = guard(measure, measure.tell, options)
    shown, more = each.rows[:_MOST_ROWS], len(each.rows) - _MOST_ROWS
    notes = [f"{told[:1].upper()}{told[1:]}."] if told else []
    notes += [f"{more:,} more rows are in study.nc."] if more > 0 else []
    return Table(
        f"{quantity.long_name[:1].upper()}{quantity.long_name[1:]}{tell_unit(quantity)}",
        ("where", *headings),
        [*rows, *shown],
        " ".join(notes),
        each.kind if shown else "",
        [*[None] * len(rows), *each.index[:_MOST_ROWS]],
        sheets=(quantity.name, f"{quantity.name}_lost"),
    )


def _find_groups(study: Study, columns: _Columns) -> list[Counted]:
    """Return the receivers of the first rows; beside a proposal those that it leaves, as hours."""
    if columns.before is None:
        groups = list(filter(None, [study.kind.find_counted(study)]))
    else:
        groups = study.kind.list_counted(study)
    groups = [replace(one, which=one.which & columns.is_known) for one in groups]
    return [one for one in groups if one.which.any() and one.whole > 0]


def _tell(columns: _Columns, counted: Counted, digits: int) -> list[float | None]:
    """Return the figures of some receivers: mean, least, most; before and lost with a proposal."""
    after = columns.after
    known = after[counted.which]
    figures: list[float | None] = [counted.average(after), known.min(), known.max()]
    if columns.before is not None:
        both = counted.with_value(columns.before)
        compared: list[float | None] = [None] * 4  # of the proposal's own parts
        if both.which.any() and both.whole > 0:
            lost = columns.before - after
            mean, gone = both.average(columns.before), both.average(lost)
            kept = 100 * (mean - gone) / mean if mean > 0 else None
            compared = [mean, gone, lost[both.which].max(), kept]
        figures += compared
    return [None if value is None else round(float(value), 1 if column == _KEPT else digits) + 0.0
            for column, value in enumerate(figures)]  # fmt: skip


def _list_parts(study: Study, columns: _Columns, digits: int) -> _Rows:
    """Return a row for each part of the model that single receivers lie on, by its name."""
    counted = study.kind.find_counted(study)
    if study.kind.is_raster or counted is None:
        return _Rows("", [], [])
    scene, part = study.model.scene, np.asarray(study.laid.part)  # type: ignore[attr-defined]
    labels, owner = np.unique(np.array(scene.labels()), return_inverse=True)
    has_part = (part >= 0) & counted.which & np.isfinite(columns.after)
    group = np.where(has_part, owner.ravel()[np.maximum(part, 0)], -1)
    order = np.argsort(group, kind="stable")
    names, starts = np.unique(group[order], return_index=True)
    rows: list[tuple[object, ...]] = []
    index: list[int | None] = []
    known = np.asarray(study.more["part"][1]).tolist() if "part" in study.more else []
    for k, members in zip(names.tolist(), np.split(order, starts[1:]), strict=True):
        if k < 0:
            continue
        before = None if columns.before is None else columns.before[members]
        weight = counted.weight[members]
        own = Counted(np.ones(len(members), np.bool_), weight, counted.unit, "")
        if own.whole > 0:
            name = str(labels[k])
            rows.append((name, *_tell(_Columns(columns.after[members], before), own, digits)))
            index.append(known.index(name) if study.samples is not None else None)
    return _Rows("part" if study.samples is not None else "", rows, index)


def _list_areas(study: Study, quantity: Quantity, digits: int) -> _Rows | None:
    """Return a row for each named area, of which means are kept; None without areas."""
    areas, name = study.areas, f"mean_{quantity.name}"
    if areas is None or name not in areas.columns:
        return None
    rows: list[tuple[object, ...]] = []
    for k, area in enumerate(areas.names):
        mean = float(areas.columns[name][k])
        row: list[object] = [area, round(mean, digits), None, None]
        if f"{name}_before" in areas.columns:
            before = float(areas.columns[f"{name}_before"][k])
            kept = round(100 * mean / before, 1) if before > 0 else None
            row += [round(before, digits), round(before - mean, digits) + 0.0, None, kept]
        rows.append(tuple(row))
    kind = "area" if study.is_plan else ""
    return _Rows(kind, rows, list(range(len(rows))))


def _list_casters(study: Study, quantity: Quantity) -> Table | None:
    """Lay out what each group of casters takes, the most first; None if nothing is counted."""
    counted = study.kind.find_counted(study)
    values = np.asarray(study.more[quantity.name][1], np.float64)
    if counted is None or not counted.which.any():
        return None
    digits = count_decimals(values)
    names = np.asarray(study.more[quantity.per][1]).tolist()
    rows = [(name, counted.average(one), one[counted.which].max())
            for name, one in zip(names, values, strict=True)]  # fmt: skip
    rows.sort(key=lambda row: -row[1])
    shown = [(name, *(round(float(v), digits) for v in figures)) for name, *figures in rows]
    more = len(rows) - _MOST_CASTERS
    return Table(
        f"{quantity.long_name[:1].upper()}{quantity.long_name[1:]}{tell_unit(quantity)}",
        (quantity.per, "mean", "most"),
        shown[:_MOST_CASTERS],
        f"{more:,} more rows are in study.nc." if more > 0 else "",
        sheets=tuple(f"{quantity.name}_{n}" for n in range(1, len(rows) + 1)),
    )


def tell_unit(quantity: Quantity) -> str:
    """Return the unit in brackets, to follow a heading; nothing of a bare number."""
    unit = quantity.suffix.strip()
    return f" [{unit}]" if unit else ""


def count_decimals(values: NDArray[np.floating]) -> int:
    """Return the decimals with which the largest of some values has three digits, at most 3."""
    most = float(np.nanmax(np.abs(values), initial=0.0))
    return min(max(3 - math.ceil(math.log10(most)), 0), 3) if most > 0 else 0
