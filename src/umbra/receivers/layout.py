"""Layout of a study's raster: extent, cell size, and memory."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.scene.grid import Grid

__all__ = ["LONGEST_SHADOW", "TILE", "Skyline", "lay_out"]

LONGEST_SHADOW = 4.0
"""The default extent follows shadows up to this many times the model's height."""
TILE = 4096
"""Tile side of a large raster [cell], to keep work arrays small."""
_PIECES = 256  # pieces of the model along each axis, for its skyline
_LONG_SIDE = 1024  # cells of the default raster
_VAST = 50_000.0  # [m]; widest default plan, unless parts lie far apart
NEARBY = 10_000.0  # [m]; an extent may lie this far from a model, plus
LOWEST_SUN = 100  # times its height: the shadow's reach at half a degree of altitude
_BYTES = 32  # per cell: heights, hours, and copies made in writing
LEAST_CELL = 1e-9  # [m]; below the resolution of coordinates
_WORK = 30  # bytes per cell of the current tile,
_THREAD_WORK = 4  # and per cell and thread
_BASE = 0.4e9  # memory of the program and of drawing without any cell [byte]


@dataclass(frozen=True, eq=False)
class Skyline:
    """
    Bounds of a model's plan, and how high it rises along each axis.

    Parameters
    ----------
    low, high : (2,) float64
        In the model's own coordinates [m].
    tall : float
        Of the highest point above the ground [m]; 0 if all is below.
    edges : (2, n + 1) float64
        Ends of the pieces along x and y [m].
    tops : (2, n) float64
        Height above the ground of the highest point over each piece [m].
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    tall: float
    edges: NDArray[np.float64]
    tops: NDArray[np.float64]

    @classmethod
    def of(cls, points: NDArray[np.float64], ground: float) -> Self:
        """Find the skyline of a model's corners, (n, 3) in its own coordinates [m]."""
        return cls.gather([points], points[:, :2].min(0), points[:, :2].max(0), ground)

    @classmethod
    def gather(
        cls,
        several: Iterable[NDArray[np.float64]],
        low: NDArray[np.float64],
        high: NDArray[np.float64],
        ground: float,
    ) -> Self:
        """Find the skyline of corners given in arrays (n, 3), whose plan has bounds (2,)."""
        edges = np.stack([np.linspace(a, b, _PIECES + 1) for a, b in zip(low, high, strict=True)])
        tops = np.zeros((2, _PIECES))
        for points in several:
            x, y, z = np.ascontiguousarray(points.T)
            tall = np.maximum(z - ground, 0.0)
            for v, ends, top in zip((x, y), edges, tops, strict=True):
                wide = max(float(ends[-1] - ends[0]), 1e-300)
                piece = np.minimum((v - ends[0]) / wide * _PIECES, _PIECES - 1).astype(np.intp)
                np.maximum.at(top, piece, tall)
        return cls(edges[:, 0], edges[:, -1], float(tops.max()), edges, tops)


def lay_out(
    skyline: Skyline,
    suns: NDArray[np.float64],
    *,
    held: NDArray[np.float64] | None = None,
    extent: Sequence[float] | None = None,
    cell: float | None = None,
    size: tuple[int, int] | None = None,
    masks: int = 0,
    bytes_kept: int = 0,
    threads: int = 1,
    by_day: bool = False,
    is_cut: bool = False,
) -> tuple[Grid, NDArray[np.float64], NDArray[np.float64]]:
    """
    Choose the cells of a plan.

    Parameters
    ----------
    skyline : Skyline
        Of the model.
    suns : (n, 3) float64
        Directions toward the sun whose shadows the default extent holds.
    held : (2, 2) float64, optional
        Lower left and upper right corner of a rectangle that the default extent holds, too [m].
    extent : (4,) float, optional
        xmin, ymin, xmax, ymax [m].
    cell : float, optional
        Side of a cell [m].
    size : (int, int), optional
        Columns and rows, instead of ``cell``.
    masks : int
        Memory of a cell's masks [byte]: one for eight instants.
    bytes_kept : int
        Memory of a cell's other results [byte].
    threads : int
        Each holds its own counts.
    by_day : bool
        Whether results by day are kept, which errors suggest leaving out.
    is_cut : bool
        Whether parts are counted alone, so that the raster need not fit in memory.

    Returns
    -------
    grid : Grid
        In the model's own coordinates.
    x : (cols,) float64
    y : (rows,) float64
        Cell centres [m], ascending.

    Raises
    ------
    InputError
        If the options contradict each other, or the raster does not fit in memory.
    """
    if cell is not None and size is not None:
        msg = "give either a cell size or a raster size, not both"
        raise InputError(msg)
    if cell is not None and not LEAST_CELL <= cell < math.inf:
        msg = f"a cell must be larger than 0 m, {LEAST_CELL:g} at least; got {cell:g}"
        raise InputError(msg, cell=cell)
    if size is not None and min(size) < 1:
        msg = f"a raster needs at least 1x1 cells; got {size[0]}x{size[1]}"
        raise InputError(msg, size=size)
    if extent is None:
        low, high = _reach(skyline, suns, held)
    else:
        low, high = np.array(extent[:2], np.float64), np.array(extent[2:], np.float64)
        with np.errstate(all="ignore"):
            is_right = bool((high > low).all() and np.isfinite(high - low).all())
        if not is_right:
            msg = (
                "the extent must be XMIN,YMIN,XMAX,YMAX with XMIN < XMAX and YMIN < YMAX; "
                f"got {','.join(f'{v:g}' for v in extent)}"
            )
            raise InputError(msg, extent=tuple(extent))
        _check_near(low, high, skyline)
    most = _most_cells(masks + bytes_kept, threads)
    wide, deep = (float(length) for length in high - low)
    if size is None:
        side = cell or _round_up(max(wide, deep) / _LONG_SIDE)
        if extent is None:
            low = np.floor(low / side) * side
            wide, deep = (float(length) for length in high - low)
        cols, rows = _count_cells(wide, side), _count_cells(deep, side)
        dx = dy = side
    else:
        cols, rows = size
        dx, dy = wide / cols, deep / rows
    if cols * rows > most and not is_cut:
        is_vast = extent is None and max(wide, deep) > _VAST
        raise _too_large(
            cols, rows, most, wide, deep, masks, bytes_kept, threads, by_day=by_day, is_vast=is_vast
        )
    grid = Grid(float(low[0] + dx / 2), float(low[1] + dy / 2), float(dx), float(dy), cols, rows)
    return grid, grid.x, grid.y


def _check_near(low: NDArray[np.float64], high: NDArray[np.float64], skyline: Skyline) -> None:
    """Refuse an extent beyond every shadow, whose map would be blank."""
    least, most = skyline.low, skyline.high
    gap = float(np.hypot(*np.maximum(np.maximum(least - high, low - most), 0)))
    if gap <= NEARBY + LOWEST_SUN * skyline.tall:
        return
    where = ", ".join(f"{a} {least[i]:.6g} to {most[i]:.6g}" for i, a in enumerate("xy"))
    msg = (
        f"the extent lies {gap / 1e3:.3g} km from the model, beyond its shadows; the model's own "
        f"coordinates are {where} [m]"
    )
    raise InputError(msg, extent=(*low.tolist(), *high.tolist()))


def _reach(
    skyline: Skyline, suns: NDArray[np.float64], held: NDArray[np.float64] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the bounds of the model, its shadows on the ground cut to a length, and ``held``."""
    low, high = skyline.low.copy(), skyline.high.copy()
    longest = LONGEST_SHADOW * skyline.tall
    flat = np.maximum(np.hypot(suns[:, 0], suns[:, 1]), 1e-12)
    for axis, (edges, top) in enumerate(zip(skyline.edges, skyline.tops, strict=True)):
        reach = top / np.maximum(suns[:, 2:], 1e-9)
        reach = -np.minimum(reach, longest / flat[:, None]) * suns[:, axis : axis + 1]
        low[axis] = min(low[axis], (edges[:-1] + reach).min(initial=math.inf))
        high[axis] = max(high[axis], (edges[1:] + reach).max(initial=-math.inf))
    if held is not None:
        low, high = np.minimum(low, held[0]), np.maximum(high, held[1])
    margin = 0.02 * float(max(high - low)) + 1e-3
    return low - margin, high + margin


def _round_up(value: float, tolerance: float = 0.999) -> float:
    """Round up to 1, 2 or 5 times a power of ten, within a tolerance."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(
        float(f"{step * power:.6g}") for step in (1, 2, 5, 10) if step * power >= value * tolerance
    )


def _count_cells(length: float, side: float) -> int:
    """Return the number of whole cells that cover a length, up to rounding."""
    return max(1, math.ceil(min(length / side, 1e15) - 1e-6))


def _most_cells(bytes_kept: int, threads: int) -> int:
    """Return the number of cells that fit in memory."""
    room = max(find_memory() - _BASE, 0.0)
    work = _WORK + _THREAD_WORK * threads
    in_one_tile = room / (_BYTES + bytes_kept + work)
    if in_one_tile <= TILE**2:
        return int(in_one_tile)
    return int((room - TILE**2 * work) / (_BYTES + bytes_kept))


def _too_large(
    cols: int,
    rows: int,
    most: int,
    wide: float,
    deep: float,
    masks: int,
    bytes_kept: int,
    threads: int,
    *,
    by_day: bool,
    is_vast: bool,
) -> InputError:
    cells = cols * rows
    work = min(cells, TILE**2) * (_WORK + _THREAD_WORK * threads)
    needed = _BASE + cells * (_BYTES + masks + bytes_kept) + work
    side = max(math.sqrt(wide * deep / max(most, 1)), max(wide, deep) / max(most, 1))
    # One more cell than needed each way: a default extent begins at whole cells.
    while (wide / side + 2) * (deep / side + 2) > max(most, 9):
        side *= 1.1
    advice = f"a cell of {_round_up(side, 1.0):g} m would fit"
    if is_vast:  # such cells would be too large to show buildings
        advice = (
            f"the plan is {wide / 1000:.0f} x {deep / 1000:.0f} km: are all parts in the same "
            "coordinates? choose a smaller one (extent=)"
        )
    if masks:
        advice += ", or leave out the masks"
    if by_day:
        advice += ", or keep only the sums of the dates (by_day=False)"
    msg = (
        f"a raster of {cols}x{rows} cells needs {needed / 1e9:.1f} GB "
        f"and {name_memory(find_memory())}; {advice}"
    )
    return InputError(msg, cells=cells, bytes=needed)
