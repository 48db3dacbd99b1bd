"""Pictures of a whole study in tiles; tiles that are not done are hatched and named."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.folders.atomic import replace_file
from umbra.scene.grid import Grid
from umbra.study.measures import Quantity
from umbra.writers.city.city_plan import CityPlan
from umbra.writers.city.finer_squares import FinerSquares, count_finer_squares
from umbra.writers.city.store_window import CityResult, Months
from umbra.writers.folder.captions import find_mean
from umbra.writers.folder.foot import list_few
from umbra.writers.folder.month_maps import BY_MONTH, MONTHS_MAP, lay_out_months
from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.measure_map import find_end, make_measure_sheet
from umbra.writers.picture_content import DayMap, Plan, Show, find_map_size, name_hours
from umbra.writers.pixels import Ramp
from umbra.writers.sheet import Sheet

__all__ = ["find_squares", "shrink_hours", "write_overviews"]

LONGEST = 1600
"""Cells along the longer side of the picture's raster; each is the mean of those that it holds."""
_LOST = "hours_lost"
_FEW = 12  # missing tiles that are named


def write_overviews(result: CityResult) -> list[Path]:
    """
    Write ``map.png``, hours in shadow of the whole, ``hours_lost.png``, and a map of each measure.

    What each caster takes of it is in the store alone.

    Parameters
    ----------
    result : CityResult

    Returns
    -------
    paths : list of Path
        Without hours lost where nothing is.
    """
    plan = CityPlan.of(result)
    paths = _draw_hours(result, plan) if result.has_hours else []
    quantities = () if plan is None else plan.study.quantities
    taker = _name_taker(plan)
    for quantity in (quantity for quantity in quantities if quantity.is_drawn and not quantity.per):
        values, times, roofs = shrink_hours(result, quantity.name, plan=plan)
        drawn = _Drawing(result, plan, times, roofs)
        paths.append(drawn.draw_measure(values, f"{quantity.name}.png", quantity))
        if f"{quantity.name}_lost" in result.bands:
            lost, *_ = shrink_hours(result, f"{quantity.name}_lost", plan=plan)
            if np.nanmax(lost, initial=0.0) > 0:
                paths.append(
                    drawn.draw_measure(lost, f"{quantity.name}_lost.png", quantity.of_loss(taker))
                )
    return paths


def _name_taker(plan: CityPlan | None) -> str:
    """Name a proposal by its patterns."""
    asked = () if plan is None else plan.job.options.proposed
    return list_few(asked) if asked else "the proposal"


def _draw_hours(result: CityResult, plan: CityPlan | None) -> list[Path]:
    """Draw the hours, and what a proposal takes of them."""
    hours, times, roofs = shrink_hours(result, plan=plan)
    show: Show = "shadow"
    divisor, words = 1, ""
    if plan is not None:
        divisor, words = find_mean(plan.study, plan.job.options)
        if len(plan.study.period.days) > 1:  # long days have more of both: those of sun compare
            show = "sun"
    what = f"{name_hours(show)}{words}" if words else ""
    end = dark = result.up_hours / divisor
    finer = None
    if plan is not None:
        finer = count_finer_squares(plan, find_squares(plan.lattice.grid, times), hours)
    nothing = np.isnan(hours) if roofs is None else np.isnan(hours) & (roofs <= 0)
    drawn = _Drawing(result, plan, times, roofs, finer, nothing)
    if finer is not None:
        hours, dark = finer.refine(hours, finer.shadow_hours), finer.up_hours / divisor
    hours = hours / np.float32(divisor)
    paths = [drawn.draw(hours, "map.png", what, end, dark_from=dark, show=show)]
    if _LOST in result.bands:
        lost, *_ = shrink_hours(result, _LOST, plan=plan)
        lost = (lost if finer is None else finer.refine(lost, finer.lost)) / np.float32(divisor)
        most = float(np.nanmax(lost, initial=0.0))
        if most > 0:
            what = f"hours of sun lost to {_name_taker(plan)}{words}"
            paths.append(drawn.draw(lost, f"{_LOST}.png", what, most, ramp="loss"))
    if result.months is not None:
        paths.append(_draw_months(result.months, replace(drawn, finer=None)))
    return paths


def _draw_months(months: Months, drawn: "_Drawing") -> Path:
    """Draw the hours a day of each month on one scale."""
    hours, *_ = shrink_hours(drawn.result, BY_MONTH, plan=drawn.told)

    def read(k: int, lack: np.float32) -> NDArray[np.float32]:
        return hours[k] + lack

    maps, most, what = lay_out_months(*months, read, "sun")
    return drawn.draw_maps(maps, MONTHS_MAP, what, most, "sun")


@dataclass(frozen=True)
class _Drawing:
    """
    What the pictures of a run share.

    Parameters
    ----------
    result : CityResult
    told : CityPlan or None
    times : int
        Cells along a square of the pictures.
    roofs : (rows, cols) float32 or None
        Height of what stands over each square [m].
    finer : FinerSquares, optional
        From which hours are drawn, if not from the store's steps.
    nothing : (rows, cols) bool, optional
        Squares without hours, those of missing tiles among them.
    """

    result: CityResult
    told: CityPlan | None
    times: int
    roofs: NDArray[np.float32] | None
    finer: FinerSquares | None = None
    nothing: NDArray[np.bool_] | None = None

    def draw(
        self,
        hours: NDArray[np.float32],
        name: str,
        what: str,
        most: float,
        dark_from: float = math.inf,
        ramp: Ramp = "shade",
        show: Show = "shadow",
    ) -> Path:
        """Draw hours on squares, those of a place without any sun from ``dark_from`` on."""
        return self.draw_maps([DayMap(hours, dark_from=dark_from)], name, what, most, show, ramp)

    def draw_maps(
        self, maps: Sequence[DayMap], name: str, what: str, most: float, show: Show,
        ramp: Ramp = "shade",
    ) -> Path:  # fmt: skip
        """Draw maps of hours on squares on one scale."""
        title = f"sun lost to {_name_taker(self.told)}" if ramp == "loss" else show
        plan, hatched = self._lay_out(maps[0].hours.shape, title)
        sheet = make_hours_sheet(
            plan, [replace(map_, hatched=hatched) for map_ in maps], most, what,
            hatch="tiles not counted" if self.result.missing else "",
            show=show,
            # Around means of coarse steps lines would show noise.
            has_lines=self.times == 1 or self.finer is not None,
            ramp=ramp,
        )  # fmt: skip
        return self._save(sheet, name)

    def draw_measure(self, values: NDArray[np.float32], name: str, quantity: Quantity) -> Path:
        """Draw a measure on squares."""
        plan, _ = self._lay_out(values.shape, quantity.long_name)
        return self._save(
            make_measure_sheet(plan, values, quantity, find_end(quantity, values)), name
        )

    def _save(self, sheet: Sheet, name: str) -> Path:
        path = self.result.folder / name
        with replace_file(path) as beside:
            sheet.save(beside)
        return path

    def _lay_out(self, shape: tuple[int, ...], what: str) -> tuple[Plan, NDArray[np.bool_]]:
        """Return the plan of squares, ``what`` it shows in its title, and those not counted."""
        result, times = self.result, self.times
        rows, cols = shape
        west, south, *_ = result.extent
        x, y = (
            start + times * side * (np.arange(n, dtype=np.float64) + 0.5)
            for start, side, n in zip((west, south), result.cell, (cols, rows), strict=True)
        )
        missing = result.missing
        hatched = np.zeros(shape, np.bool_)
        for tile in missing:
            hatched[_shrink(tile.rows, times), _shrink(tile.cols, times)] = True
        words: dict[str, Any] = {}
        if self.told is not None:
            dx, dy = (times * side for side in result.cell)
            squares = Grid(float(x[0]), float(y[0]), dx, dy, cols, rows)
            words = self.told.describe(what, self.finer)
            words["proposed"] = self.told.find_proposed(squares)
            words["nothing_name"] = self.told.context.kind.nothing
        if self.nothing is not None and (self.nothing & ~hatched).any():
            words["nothing"] = self.nothing & ~hatched
        if times > 1:
            drawn = f"drawn as means of {times} x {times} cells"
            if self.finer is not None:
                drawn = f"drawn at the middles of {times} x {times} cells"
            words["note"] = " · ".join(filter(None, [words.get("note"), drawn]))
        subtitle = ""
        if missing:
            subtitle = f"{len(result.tiles) - len(missing):,} of {len(result.tiles):,} tiles"
            names = ", ".join(str(tile.number) for tile in missing[:_FEW])
            more = f" and {len(missing) - _FEW:,} more" if len(missing) > _FEW else ""
            subtitle += f"; not counted (hatched): {names}{more}"
        return _shade(result, Plan(
            x, y, self.roofs, true_north=result.facts.get("true_north_deg", 0.0),
            subtitle=subtitle, **words,
        )), hatched  # fmt: skip


def _shade(result: CityResult, plan: Plan) -> Plan:
    """Add the shade and the edges of the topmost surface, unless roofs are drawn over a plane."""
    if not result.has_heights or plan.building_height is not None:
        return plan
    from umbra.writers.edges import find_height_appearance  # noqa: PLC0415  (kernels)

    heights, *_ = shrink_hours(result, "receiver_z")
    if np.isnan(heights).all():
        return plan
    return replace(
        plan, appearance=find_height_appearance(heights, min(plan.cell), find_map_size(plan))
    )


def shrink_hours(
    result: CityResult, name: str = "shadow_hours", plan: CityPlan | None = None
) -> tuple[NDArray[np.float32], int, NDArray[np.float32] | None]:
    """
    Average the hours of whole squares of cells, whatever the tiles.

    Parameters
    ----------
    result : CityResult
    name : str
        Of the variable.
    plan : CityPlan, optional
        Of which roofs are left out of the means where they lie over the receivers.

    Returns
    -------
    hours : (..., rows, cols) float32
        Means of the cells that have hours; NaN where none has. Of each month if the variable is.
    times : int
        Cells along a square.
    roofs : (rows, cols) float32 or None
        Mean height of what stands over the squares that are covered by half or more, else 0 [m].
    """
    shape = len(result.y), len(result.x)
    times = max(1, math.ceil(max(shape) / LONGEST))
    small = math.ceil(shape[0] / times), math.ceil(shape[1] / times)
    has_roofs = plan is not None and plan.has_roofs
    lead = result.find_shape(name)[:-2]
    total, count = np.zeros((*lead, *small)), np.zeros(small, np.int64)
    heights, covered = np.zeros(small), np.zeros(small, np.int64)
    for tile in result.find_done():
        hours = result.read(name, tile)
        is_there = np.isfinite(hours.reshape(-1, *hours.shape[-2:])[0])
        where = _shrink(tile.rows, times), _shrink(tile.cols, times)
        if has_roofs:
            above = plan.find_roofs(tile)  # type: ignore[union-attr]
            heights[where] += _add_squares(above, tile.rows, tile.cols, times)
            covered[where] += _add_squares((above > 0).astype(int), tile.rows, tile.cols, times)
            is_there &= above <= 0
        for k in np.ndindex(lead):
            own = np.where(is_there, hours[k], 0.0).astype(np.float64)
            total[(*k, *where)] += _add_squares(own, tile.rows, tile.cols, times)
        count[where] += _add_squares(is_there.astype(np.int64), tile.rows, tile.cols, times)
    mean = np.full(total.shape, np.nan, np.float32)
    is_known = np.broadcast_to(count > 0, total.shape)
    np.divide(total, count, out=mean, where=is_known, casting="unsafe")
    if not has_roofs:
        return mean, times, None
    is_roof = (covered > 0) & (covered >= count)
    roofs = np.where(is_roof, heights / np.maximum(covered, 1), 0.0).astype(np.float32)
    return mean, times, roofs


def find_squares(grid: Grid, times: int) -> Grid:
    """Return the squares of ``times`` cells a side; the last may reach beyond the cells."""
    aside = (times - 1) / 2
    return Grid(
        grid.x0 + aside * grid.dx, grid.y0 + aside * grid.dy, times * grid.dx, times * grid.dy,
        math.ceil(grid.cols / times), math.ceil(grid.rows / times),
    )  # fmt: skip


def _shrink(cells: slice, times: int) -> slice:
    """Return the squares that hold some cells."""
    return slice(cells.start // times, (cells.stop - 1) // times + 1)


def _add_squares(values: NDArray, rows: slice, cols: slice, times: int) -> NDArray:
    """Add up the values of cells in each square."""
    for axis, cells in enumerate((rows, cols)):
        begin = np.arange(_shrink(cells, times).start, _shrink(cells, times).stop) * times
        starts = np.maximum(begin - cells.start, 0)
        values = np.add.reduceat(values, starts, axis=axis)
    return values
