"""
Figures of a whole study in tiles: of what area they are, means, least and most, tile by tile.

They are of what counts in those of one study: of a plan the cells near buildings, under no roof.
"""

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.counted import Counted, choose_near, find_near, reach_from_centres
from umbra.receivers.plan import PlanKind
from umbra.study.accumulators.attribution import AttributionOptions
from umbra.study.compare import LEAST
from umbra.sun import name_date
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.count import lay_out_window
from umbra.tiles.job import WorkerContext
from umbra.tiles.matched_parts import find_matching
from umbra.tiles.neighbourhood import Neighbourhood
from umbra.writers.city.city_plan import CityPlan
from umbra.writers.city.city_surfaces import CitySurfaces
from umbra.writers.city.store_window import (
    CityResult,
    Months,
    StoredTile,
    is_of_plan,
    read_stored_array,
)
from umbra.writers.folder.month_maps import BY_MONTH, make_month_row
from umbra.writers.folder.summary import tell_sun
from umbra.writers.folder.taken_sun import TakenSun, name_proposal

__all__ = [
    "CityFigures", "PlanFigures", "SurfaceFigures", "find_figures", "list_city_months",
    "name_taker", "tell_city_hours",
]  # fmt: skip

_SAMPLES = 4_000_000  # that are read at a time
_SUN = "sun_hours"
_TAKEN = "hours_lost", "newly_under"
_NEVER = 1e-4  # hours that are none [h]
_MOST_DATES = 8


class CityFigures(Protocol):
    """What counts of a study in tiles."""

    @property
    def counted(self) -> Counted | None:
        """What counts, and its area as one weight; None where nothing does."""

    def holds(self, name: str) -> bool:
        """Return whether there is such a variable."""

    def read(self, name: str) -> Iterator[tuple[NDArray, NDArray[np.float64] | float]]:
        """Yield a variable's values (..., n) of what counts, with the area of each [m2]."""

    def find_taken(self, ending: str) -> list[TakenSun]:
        """Return the sun that a proposal takes of all receivers, on each date or in sums."""


class PlanFigures:
    """
    Cells of a plan that count.

    Parameters
    ----------
    plan : CityPlan
    """

    def __init__(self, plan: CityPlan) -> None:
        self._plan, self._result = plan, plan.result
        assert plan.job.lattice is not None
        self._grid = plan.job.lattice.grid
        self._cell = self._grid.dx * self._grid.dy
        self._near = choose_near(plan.context.roles.find_built_bounds())
        self._which: dict[int, NDArray[np.uint8]] = {}
        self._open: dict[int, NDArray[np.uint8]] = {}
        self.counted = self._find()

    def _find(self) -> Counted | None:
        """Find what counts, a row of tiles at a time."""
        kind, result = self._plan.context.kind, self._result
        assert isinstance(kind, PlanKind)
        rows, cols = len(result.y), len(result.x)
        built = np.zeros((rows, (cols + 7) // 8), np.uint8)  # eight cells to a byte
        is_open = np.zeros_like(built)
        for tiles in _list_strips(result):
            strip = tiles[0].rows
            whole = np.zeros((2, strip.stop - strip.start, cols), np.bool_)
            for tile in tiles:
                whole[:, :, tile.cols] = self._look(tile)
            built[strip], is_open[strip] = np.packbits(whole, axis=2)
        has_built, is_cut, count = bool(built.any()), False, 0
        for tiles in _list_strips(result):
            strip = tiles[0].rows
            near = self._find_near(built, strip, (rows, cols))
            sides = [near[:, 0], near[:, -1]]
            sides += [near[0]] * (strip.start == 0) + [near[-1]] * (strip.stop == rows)
            is_cut = is_cut or any(bool(side.any()) for side in sides)
            shown = np.unpackbits(is_open[strip], axis=1, count=cols).astype(np.bool_)
            for tile in tiles:
                own = shown[:, tile.cols] & np.isfinite(result.read(result.counted, tile))
                self._open[tile.number] = np.packbits(own, axis=1)
                which = near[:, tile.cols] & own
                self._which[tile.number] = np.packbits(which, axis=1)
                count += int(which.sum())
        if not count:
            return None
        what, _, _ = kind.what_counts.partition(",")
        if has_built:
            what += f"{' in the frame' if is_cut else ''}, within {self._near:g} m of buildings"
        return Counted(np.ones(1, np.bool_), np.array([count * self._cell]), "m²", what)

    def _look(self, tile: StoredTile) -> NDArray[np.bool_]:
        """Return which cells of a tile are built, and which lie in the open, (2, rows, cols)."""
        context, near = self._plan.context, Neighbourhood(self._plan.context)
        lattice, kind = context.job.lattice, context.kind
        assert lattice is not None
        south, west = tile.rows.start, tile.cols.start
        open_cells = np.zeros((2, tile.rows.stop - south, tile.cols.stop - west), np.bool_)
        cells = CityTile(tile.number, (south, tile.rows.stop), (west, tile.cols.stop))
        for rows, cols in lattice.cut(cells, lattice.block):
            grid = lattice.find_window(rows, cols)
            aside = np.array([grid.dx, grid.dy])
            seen = near.find_seen(np.array([grid.x[0], grid.y[0]]) - aside,
                                  np.array([grid.x[-1], grid.y[-1]]) + aside)  # fmt: skip
            laid = lay_out_window(context, grid, seen, has_kinds=True)
            laid.make_tiles(None)
            laid_part = SimpleNamespace(
                heights=laid.heights, ground=laid.ground, laid=laid,
                shadow_hours=np.zeros(laid.shape, np.float32),
            )  # fmt: skip
            where = (slice(rows.start - south, rows.stop - south),
                     slice(cols.start - west, cols.stop - west))  # fmt: skip
            open_cells[(0, *where)], open_cells[(1, *where)] = (
                laid.is_built,
                kind.find_open(laid_part),
            )
        return open_cells

    def _find_near(
        self, built: NDArray[np.uint8], strip: slice, shape: tuple[int, int]
    ) -> NDArray[np.bool_]:
        """Return the cells of some rows that lie near built ones."""
        cell = self._grid.dx, self._grid.dy
        reach = reach_from_centres(self._near, cell)
        aside = int(reach / cell[1]) + 1
        first, end = max(strip.start - aside, 0), min(strip.stop + aside, shape[0])
        around = np.unpackbits(built[first:end], axis=1, count=shape[1]).astype(np.bool_)
        if built.any() and not around.any():
            return np.zeros((strip.stop - strip.start, shape[1]), np.bool_)
        return find_near(around, cell, reach)[strip.start - first :][: strip.stop - strip.start]

    def holds(self, name: str) -> bool:
        """Return whether there is such a variable."""
        return self._result.holds(name)

    def read(self, name: str) -> Iterator[tuple[NDArray, float]]:
        """Yield a variable's values (..., n) of what counts, with the area of each [m2]."""
        for tile in self._result.find_done():
            which = _unpack(self._which[tile.number], tile)
            if which.any():
                yield self._result.read(name, tile)[..., which], self._cell

    def find_taken(self, ending: str) -> list[TakenSun]:
        """Return the sun that a proposal takes of all receivers, on each date or in sums."""
        result = self._result
        (rows, cols), dates = (len(result.y), len(result.x)), list[list[TakenSun]]()
        for tile in result.find_done():
            which = _unpack(self._open[tile.number], tile)
            counted = Counted(which, np.broadcast_to(np.float64(self._cell), which.shape), "m²", "")
            lost, newly = (
                result.read(f"{name}{ending}", tile).reshape(-1, *which.shape) for name in _TAKEN
            )
            for day, (hours, missed) in enumerate(zip(lost, newly, strict=True)):
                cells = which & (np.abs(np.nan_to_num(hours)) > LEAST)
                ends = (
                    (tile.rows.start == 0, cells[0]),
                    (tile.rows.stop == rows, cells[-1]),
                    (tile.cols.start == 0, cells[:, 0]),
                    (tile.cols.stop == cols, cells[:, -1]),
                )
                is_cut = any(is_end and bool(side.any()) for is_end, side in ends)
                if day == len(dates):
                    dates.append([])
                dates[day].append(TakenSun.of(counted, hours, missed, is_cut=is_cut))
        return [TakenSun.join(parts) for parts in dates]


def _unpack(bits: NDArray[np.uint8], tile: StoredTile) -> NDArray[np.bool_]:
    """Return the cells of a tile, (rows, cols), of eight to a byte."""
    return np.unpackbits(bits, axis=1, count=tile.cols.stop - tile.cols.start).astype(np.bool_)


def _list_strips(result: CityResult) -> Iterator[list[StoredTile]]:
    """Yield the tiles of each row of tiles."""
    strips: dict[int, list[StoredTile]] = {}
    for tile in result.tiles:
        strips.setdefault(tile.rows.start, []).append(tile)
    yield from strips.values()


class SurfaceFigures:
    """
    Samples of surfaces.

    Parameters
    ----------
    surfaces : CitySurfaces
    """

    def __init__(self, surfaces: CitySurfaces) -> None:
        self._surfaces = surfaces
        whole = sum(float(areas.sum()) for _, areas in self.read("area"))
        self.counted = Counted(np.ones(1, np.bool_), np.array([whole]), "m²", "sampled surfaces")

    def holds(self, name: str) -> bool:
        """Return whether there is such a variable."""
        return name in self._surfaces.group

    def read(self, name: str) -> Iterator[tuple[NDArray, NDArray[np.float64]]]:
        """Yield a variable's values (..., n) of what counts, with the area of each [m2]."""
        group = self._surfaces.group
        (count,) = group["area"].shape
        for first in range(0, count, _SAMPLES):
            span = slice(first, first + _SAMPLES)
            areas = read_stored_array(group, "area", span).astype(np.float64)
            yield read_stored_array(group, name, (..., span)), areas

    def find_taken(self, ending: str) -> list[TakenSun]:
        """Return the sun that a proposal takes of all receivers, on each date or in sums."""
        dates = list[list[TakenSun]]()
        both = (self.read(f"{name}{ending}") for name in _TAKEN)
        for (lost, areas), (newly, _) in zip(*both, strict=True):
            counted = Counted(np.ones(len(areas), np.bool_), areas, "m²", "")
            for day, hours in enumerate(lost.reshape(-1, len(areas))):
                if day == len(dates):
                    dates.append([])
                missed = newly.reshape(-1, len(areas))[day]
                dates[day].append(TakenSun.of(counted, hours, missed))
        return [TakenSun.join(parts) for parts in dates]


def find_figures(folder: Path) -> CityFigures | None:
    """Return what counts of the study in a folder; None if no run has described a plan there."""
    if not is_of_plan(folder):
        return SurfaceFigures(CitySurfaces(folder))
    plan = CityPlan.of(CityResult(folder))
    return None if plan is None else PlanFigures(plan)


def name_taker(context: WorkerContext) -> tuple[str, str]:
    """Name a city's proposal, with the verb that follows."""
    labels, layers, catalogue = list[str](), set[str](), context.catalogue
    proposed = context.job.options.proposed
    for file in catalogue.files:
        new = np.flatnonzero(find_matching(file, proposed)).tolist()
        if new:
            names = catalogue.label_parts(file)
            labels += [names[part] for part in new]
            layers.add(file.layer)
    return name_proposal(labels, layers, proposed)


def tell_city_hours(figures: CityFigures | None, context: WorkerContext) -> list[str]:
    """
    Tell what a proposal takes, and the hours of sun, of each date or of all; and of what area.

    As ``tell_answers`` tells them of one study.
    """
    counted, period = None if figures is None else figures.counted, context.period
    if figures is None or counted is None or not figures.holds(_SUN):
        return []
    by_day = figures.holds(f"{_SUN}_by_day")
    ending = "_by_day" * by_day
    up = period.up_hours_by_day if by_day else np.array([period.up_hours_by_day.sum()])
    total, dark, area = np.zeros(len(up)), np.zeros(len(up)), 0.0
    for values, areas in figures.read(f"{_SUN}{ending}"):
        sun = values.reshape(len(up), -1).astype(np.float64)
        total += (sun * areas).sum(1)
        dark += ((sun <= _NEVER) * areas).sum(1)
        area += float(np.broadcast_to(areas, sun.shape[-1:]).sum())
    days, is_sum = period.days, len(up) < len(period.days)
    dates = [f"sum of {len(days)} dates"] if is_sum else [name_date(day) for day in days]
    lines = [
        [tell_sun(date, counted, sun, whole, none, is_sum=is_sum)] if whole > 0 else []
        for date, whole, sun, none in zip(dates, up.tolist(), total / area, dark / area)
    ]
    if figures.holds(_TAKEN[0]):
        taker, under = name_taker(context), AttributionOptions.read_limit(context.job.options)
        for date, told, taken in zip(dates, lines, figures.find_taken(ending), strict=True):
            when = f" ({date})" if is_sum else f" on {date}"
            if told:
                told.insert(0, taken.tell(counted, taker, when, under, is_sum=is_sum))
    shown = [told for told in lines if told]
    answers = [line for told in shown[:_MOST_DATES] for line in told]
    if len(shown) > _MOST_DATES:
        answers.append(f"and {len(shown) - _MOST_DATES} more dates, in the store")
    return answers


def list_city_months(figures: CityFigures, months: Months | None) -> list[dict[str, Any]]:
    """Return a row for each month, as ``list_months`` does of one study; none without months."""
    if months is None or figures.counted is None:
        return []
    count = len(months.month)
    total, area = np.zeros(count), 0.0
    least, most = np.full(count, np.inf), np.full(count, -np.inf)
    up = months.up_hours.astype(np.float32)
    for values, areas in figures.read(BY_MONTH):
        sun = up[:, None] - values
        total += (sun * np.float64(areas)).sum(1)
        area += float(np.broadcast_to(areas, values.shape[-1:]).sum())
        least, most = np.minimum(least, sun.min(1)), np.maximum(most, sun.max(1))
    return [
        make_month_row(
            int(months.month[k]), int(months.dates[k]), float(months.up_hours[k]),
            (float(total[k] / area), float(least[k]), float(most[k])),
        )
        for k in range(count)
    ]  # fmt: skip
