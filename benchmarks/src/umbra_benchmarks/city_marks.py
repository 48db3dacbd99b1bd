"""A city's year and its walls, extrapolated from tiles chosen by chance."""

import os
import shutil
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from umbra.calls.openness import find_sky_directions
from umbra.study.options import StudyOptions
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.city_options import CityOptions
from umbra.tiles.cluster import open_engine
from umbra.tiles.count import count_tile
from umbra.tiles.job import CATALOGUE, CityJob
from umbra.tiles.prepare import prepare_city
from umbra.tiles.run import Engine
from umbra.tiles.store import CityStore
from umbra.tiles.surface_pieces import SurfacePieces
from umbra_benchmarks.measure import Spent

__all__ = ["CITY", "DIRECTIONS", "HEAD", "YEAR", "CityMark", "choose_tiles", "measure_marks",
           "time_workers"]  # fmt: skip

CITY = 310.0
"""Area that is extrapolated to [km2]."""
YEAR = 17_500
"""Suns of a year at 15 minutes."""
HEAD = [
    "work", "tiles", "their receivers", "lights: processor time", "lights wanted",
    "receivers of the city", "core hours",
]  # fmt: skip
"""Heading of ``CityMark.to_row``."""
DIRECTIONS = 96
"""Of the sky, on walls and roofs."""
_YEARS = {"ground": (10, 20), "top": (30, 60)}  # every how many days, finer and coarser
_WHOLE_YEAR: dict[str, Any] = {
    "date": "2026", "start": "00:00", "end": "24:00", "every": "15min", "by_day": False,
}  # fmt: skip
# As many steps as there are directions, which take the place of the suns.
_STEPS: dict[str, Any] = {"date": "2026-06-21", "start": "09:00", "end": "17:00", "every": "5min"}


@dataclass(frozen=True)
class CityMark:
    """
    Processor time of a whole city, from some of its tiles.

    Parameters
    ----------
    work : str
    tiles : int
        Counted, of ``area`` together [km2].
    area : float
    lights : tuple of int
        Counted; two of them are drawn out in a line to ``wanted``.
    seconds : tuple of float
        Processor time of each, one core [s].
    wanted : int
        Lights of the mark.
    receivers : float
        Of the tiles.
    """

    work: str
    tiles: int
    area: float
    lights: tuple[int, ...]
    seconds: tuple[float, ...]
    wanted: int
    receivers: float

    @property
    def hours(self) -> float:
        """Processor time of a city of ``CITY`` and all lights [h]."""
        found = self.seconds[0]
        if len(self.lights) > 1 and self.lights[0] > self.lights[1]:
            slope = (self.seconds[0] - self.seconds[1]) / (self.lights[0] - self.lights[1])
            found += slope * (self.wanted - self.lights[0])
        return found * CITY / self.area / 3600

    def to_row(self) -> list[str]:
        """Return the line of a table."""
        return [
            self.work, f"{self.tiles}, {self.area:.3g} km²", f"{self.receivers:,.0f}",
            ", ".join(f"{n:,}: {s:.3g} s" for n, s in zip(self.lights, self.seconds, strict=True)),
            f"{self.wanted:,}", f"{CITY * self.receivers / self.area:.3g}", f"{self.hours:.2g}",
        ]  # fmt: skip


def measure_marks(
    files: Path,
    out: Path,
    *,
    count: int,
    cell: float,
    no_cast: dict[str, tuple[str, ...]],
    say: Callable[[str], object],
) -> list[CityMark]:
    """
    Count a year on a plan's tiles, and the sky on those of walls and roofs.

    Parameters
    ----------
    files, out : Path
        Models of the city, and a folder for results.
    count : int
        Number of tiles.
    cell : float
        Side of a cell, and spacing of samples [m].
    no_cast : dict
        Kinds of parts that cast nothing, by receivers.
    say : callable
    """
    marks = []
    for kind, each in _YEARS.items():
        lights, seconds, receivers, area = [], [], 0.0, 0.0
        for days in each:
            say(f"{kind}, a year, every {days} days")
            options = StudyOptions(
                **_WHOLE_YEAR,
                every_days=days,
                receivers=kind,
                no_cast=no_cast[kind],
                cell=cell,
                threads=1,
            )
            job = _prepare(files, out / f"{kind}_{days}", options)
            tiles = choose_tiles(job, count)
            lights.append(len(job.open().lights))
            seconds.append(time_workers(job.with_resources(8e9, 1), tiles, 2).processor)
            receivers = float(sum(tile.cells for tile in tiles))
            area = receivers * cell**2 / 1e6
        marks.append(
            CityMark(
                f"year, {kind}", len(tiles), area, tuple(lights), tuple(seconds), YEAR, receivers
            )
        )
    say(f"walls and roofs, {DIRECTIONS} directions")
    options = StudyOptions(**_STEPS, receivers="surfaces", spacing=cell, threads=1)
    job = _prepare(files, out / "walls", options)
    place = job.open()
    sky = np.column_stack([find_sky_directions(DIRECTIONS), np.zeros(DIRECTIONS)])
    place.lights = replace(place.lights, vectors=sky)
    tiles = choose_tiles(job, count)
    seconds = [_count(job, tiles)]
    store = CityStore(job.store)
    pieces = SurfacePieces([store.find_place(tile.number) for tile in tiles])
    area = len(tiles) * float(job.lattice.grid.dx) ** 2 / 1e6 if job.lattice else 1.0
    marks.append(
        CityMark(
            "walls and roofs, sky",
            len(tiles),
            area,
            (DIRECTIONS,),
            tuple(seconds),
            DIRECTIONS,
            float(pieces.sizes["sample"]),
        )
    )
    return marks


def choose_tiles(job: CityJob, count: int) -> Sequence[CityTile]:
    """Return some of the whole tiles that lie in the city, the same each time."""
    assert job.lattice is not None
    place, grid = job.open(), job.lattice.grid
    most = max(tile.cells for tile in job.tiles())
    inside = []
    for tile in job.tiles():
        x, y = grid.x0 + grid.dx * np.mean(tile.cols), grid.y0 + grid.dy * np.mean(tile.rows)
        low, high = place.boxes[:, 0, :2], place.boxes[:, 1, :2]
        if tile.cells == most and ((low <= (x, y)) & (high >= (x, y))).all(1).any():
            inside.append(tile)
    chosen = np.random.default_rng(1).choice(len(inside), min(count, len(inside)), replace=False)
    return [inside[k] for k in chosen]


def _prepare(files: Path, out: Path, options: StudyOptions) -> CityJob:
    """Prepare a run, with the catalogue of the one before."""
    out.mkdir()
    earlier = [one / CATALOGUE for one in out.parent.iterdir() if (one / CATALOGUE).exists()]
    if earlier:
        shutil.move(earlier[0], out / CATALOGUE)
    found = prepare_city([os.fspath(files)], None, options, CityOptions(tiles="1km"), out)
    return found.job.with_resources(4e9, 1)


def time_workers(job: CityJob, tiles: Sequence[CityTile], workers: int) -> Spent:
    """Time a run of some tiles on processes that are ready: the clock, and all processor time."""
    with open_engine(workers=workers) as engine:
        _finish(engine(job, tiles[:workers]))  # kernels are loaded, files are in memory
        begun = time.perf_counter(), _find_processor_time(engine)
        _finish(engine(job, tiles))
        return Spent(time.perf_counter() - begun[0], _find_processor_time(engine) - begun[1])


def _finish(outcomes: Iterable[tuple[Any, Any]]) -> None:
    """Count all tiles; raise what failed."""
    for _, outcome in outcomes:
        if isinstance(outcome, BaseException):
            raise outcome


def _find_processor_time(engine: Engine) -> float:
    """Return the processor time of this process and all workers, from Linux's /proc [s]."""
    ticks = 0
    for process in engine.processes:  # type: ignore[attr-defined]
        fields = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2]
        ticks += sum(map(int, fields.split()[11:13]))  # user and system
    return time.process_time() + ticks / os.sysconf("SC_CLK_TCK")


def _count(job: CityJob, tiles: Sequence[CityTile]) -> float:
    """Return the processor time of some tiles, after one that does not count [s]."""
    count_tile(job, tiles[0])
    begun = time.process_time()
    for tile in tiles:
        count_tile(job, tile)
    return time.process_time() - begun
