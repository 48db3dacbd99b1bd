"""Pictures of a whole study in tiles; tiles that are not done are hatched and named."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.writers.atomic import replace_file
from umbra.writers.city.result import CityResult
from umbra.writers.hours import make_hours_sheet
from umbra.writers.plan import DayMap, Plan, find_map_size

__all__ = ["shrink_hours", "write_overviews"]

LONGEST = 1600
"""Cells along the longer side of the picture's raster; each is the mean of those that it holds."""
_LOST = "hours_lost"
_FEW = 12  # missing tiles that are named


def write_overviews(result: CityResult) -> list[Path]:
    """
    Write ``map.png``, hours in shadow of the whole, and ``hours_lost.png`` of a proposal.

    Parameters
    ----------
    result : CityResult

    Returns
    -------
    paths : list of Path
        Without hours lost where nothing is.
    """
    hours, times = shrink_hours(result)
    paths = [_draw(result, hours, times, "map.png", "Hours in shadow", "", result.up_hours)]
    if _LOST in result.bands:
        lost, times = shrink_hours(result, _LOST)
        most = float(np.nanmax(lost, initial=0.0))
        if most > 0:
            words = "Hours of sun lost to the proposal"
            paths.append(_draw(result, lost, times, f"{_LOST}.png", words, words.lower(), most))
    return paths


def _draw(
    result: CityResult, hours: NDArray[np.float32], times: int, name: str, title: str, what: str,
    most: float,
) -> Path:  # fmt: skip
    """Draw hours, each the mean of squares of cells so many times as long."""
    rows, cols = hours.shape
    west, south, *_ = result.extent
    x, y = (
        start + times * side * (np.arange(n, dtype=np.float64) + 0.5)
        for start, side, n in zip((west, south), result.cell, (cols, rows), strict=True)
    )
    missing = result.missing
    hatched = np.zeros(hours.shape, np.bool_)
    for tile in missing:
        hatched[_shrink(tile.rows, times), _shrink(tile.cols, times)] = True
    facts, days = result.facts, np.unique(result.times.astype("datetime64[D]"))
    date = str(days[0]) if len(days) == 1 else f"{days[0]} to {days[-1]}, {len(days)} dates (UTC)"
    cell = "x".join(dict.fromkeys(f"{side:.4g}" for side in result.cell))
    note = f"umbra {facts.get('umbra_version', '')} · cells of {cell} m"
    if times > 1:
        note += f", drawn as means of {times} x {times}"
    if facts.get("ground"):
        note += f" · {facts['ground']}"
    subtitle = f"{len(result.tiles) - len(missing):,} of {len(result.tiles):,} tiles"
    if missing:
        names = ", ".join(str(tile.number) for tile in missing[:_FEW])
        more = f" and {len(missing) - _FEW:,} more" if len(missing) > _FEW else ""
        subtitle += f"; not counted (hatched): {names}{more}"
    latitude, longitude = (facts.get(name) for name in ("latitude", "longitude"))
    plan = _shade(result, Plan(
        x, y, true_north=facts.get("true_north_deg", 0.0), title=title,
        subtitle=subtitle, date=date, note=note,
        place="" if latitude is None else f"{latitude:.3f}° N, {longitude:.3f}° E",
    ))  # fmt: skip
    sheet = make_hours_sheet(
        plan, [DayMap(hours, hatched=hatched)], most, what,
        hatch="tiles not counted" if missing else "",
        has_lines=times == 1,  # around means lines would show noise
    )  # fmt: skip
    path = result.folder / name
    with replace_file(path) as beside:
        sheet.save(beside)
    return path


def _shade(result: CityResult, plan: Plan) -> Plan:
    """Add the shade and the edges of the topmost surface, as pictures of one scene have them."""
    if not result.has_heights:
        return plan
    from umbra.writers.edges import find_relief  # noqa: PLC0415  (kernels)

    heights, _ = shrink_hours(result, "receiver_z")
    if np.isnan(heights).all():
        return plan
    return replace(plan, appearance=find_relief(heights, min(plan.cell), find_map_size(plan)))


def shrink_hours(result: CityResult, name: str = "shadow_hours") -> tuple[NDArray[np.float32], int]:
    """
    Average the hours of whole squares of cells, whatever the tiles.

    Parameters
    ----------
    result : CityResult
    name : str
        Of the variable.

    Returns
    -------
    hours : (rows, cols) float32
        Means of the cells that have hours; NaN where none has.
    times : int
        Cells along a square.
    """
    shape = len(result.y), len(result.x)
    times = max(1, math.ceil(max(shape) / LONGEST))
    small = math.ceil(shape[0] / times), math.ceil(shape[1] / times)
    total, count = np.zeros(small), np.zeros(small, np.int64)
    for tile in result.find_done():
        hours = result.read(name, tile).astype(np.float64)
        is_there = np.isfinite(hours)
        where = _shrink(tile.rows, times), _shrink(tile.cols, times)
        total[where] += _add_squares(np.where(is_there, hours, 0.0), tile.rows, tile.cols, times)
        count[where] += _add_squares(is_there.astype(np.int64), tile.rows, tile.cols, times)
    mean = np.full(small, np.nan, np.float32)
    np.divide(total, count, out=mean, where=count > 0, casting="unsafe")
    return mean, times


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
