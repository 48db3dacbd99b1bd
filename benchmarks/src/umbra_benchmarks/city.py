"""What a city or a country costs: constants measured on made-up cities, and worked out."""

import os
import resource
import shutil
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls

from umbra.study.options import StudyOptions
from umbra.tiles.city_options import CityOptions
from umbra.tiles.count import count_tile
from umbra.tiles.job import CATALOGUE, CityJob
from umbra.tiles.prepare import prepare_city
from umbra.tiles.store import CityStore
from umbra_benchmarks.city_files import Written, write_city
from umbra_benchmarks.city_marks import CITY, HEAD, CityMark, measure_marks, time_workers
from umbra_benchmarks.city_model import City
from umbra_benchmarks.measure import Spent
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
)

__all__ = ["REGIONS", "CityReport", "Constants", "Region", "bench_city", "work_out"]

_DAY: dict[str, Any] = {"date": "2026-01-15", "start": "08:00", "end": "16:15"}
_EVERY = ("1h", "2min")
_NO_CAST = {"ground": ("TINRelief",), "top": ()}  # hills would hide a level plane
_DENSITIES = ((580.0, 0.5), (60.0, 0.05))  # buildings on a km², share of places with a tree
_YEAR = 17_500  # suns of a year at 15 minutes
_KINDS = ("ground", "top")


@dataclass(frozen=True)
class Region:
    """
    A region to work the costs out for.

    Parameters
    ----------
    name : str
    area : float
        [km2]
    triangles : float
        On a square kilometre.
    note : str
        Where these come from.
    """

    name: str
    area: float
    triangles: float
    note: str


REGIONS = (
    Region("Munich", 310, 21_200, "the made-up city: 580 buildings a km², trees, terrain at 25 m"),
    Region("the Netherlands", 41_500, 10_400, "10.8 million buildings of 40 triangles, no terrain"),
    Region("Germany", 357_600, 6_400, "58 million buildings of 20 triangles, terrain at 25 m"),
)


@dataclass(frozen=True)
class Constants:
    """
    Measured costs of one kind of receivers, of one core.

    Parameters
    ----------
    cell, triangle : float
        Once for each cell, and each casting triangle that is read for a tile [s].
    cell_sun, triangle_sun : float
        For each of them and each sun [s].
    read : float
        Casting triangles that a tile of 1 km reads, for each that lies in it.
    written : float
        Store, compressed [byte a cell].
    """

    cell: float
    triangle: float
    cell_sun: float
    triangle_sun: float
    read: float
    written: float

    def find_seconds(self, cells: float, triangles: float, suns: int) -> float:
        """Return the processor time of some cells among some triangles [s]."""
        read = triangles * self.read
        return (
            cells * (self.cell + suns * self.cell_sun)
            + read * (self.triangle + suns * self.triangle_sun)
        )  # fmt: skip


@dataclass(frozen=True)
class CityReport(BenchmarkReport):
    """
    Constants, and what they make of a city and two countries.

    Parameters
    ----------
    constants : dict of Constants
        By kind of receivers.
    reading : Spent
        Of one megabyte of CityGML, into the catalogue.
    bytes_a_triangle : float
        Of the catalogue.
    files : Written
        What was read.
    tiles : int
        Counted for each measurement.
    memory : float
        Most memory of this process [byte].
    one, two : Spent
        A run on one worker and on two.
    marks : list of CityMark
        A year on a plan, and the sky on walls and roofs.
    """

    constants: dict[str, Constants]
    reading: Spent
    bytes_a_triangle: float
    files: Written
    tiles: int
    memory: float
    one: Spent
    two: Spent
    marks: list[CityMark]

    @property
    def efficiency(self) -> tuple[float, float]:
        """Efficiency of two workers: by the clock, and by processor time."""
        return self.one.wall / (2 * self.two.wall), self.one.processor / self.two.processor

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        regions = {
            region.name: {
                kind: {
                    "day_hours": work_out(one, region, 33) / 3600,
                    "year_hours": work_out(one, region, _YEAR) / 3600,
                }
                for kind, one in self.constants.items()
            }
            for region in REGIONS
        }
        wall, processor = self.efficiency
        return self.head(
            "city", constants={kind: vars(one) for kind, one in self.constants.items()},
            reading_seconds_a_megabyte=self.reading._asdict(), tiles=self.tiles,
            catalogue_bytes_a_triangle=self.bytes_a_triangle, files=vars(self.files),
            memory_bytes=self.memory, efficiency={"wall": wall, "processor": processor},
            core_hours=regions, marks=[{**vars(one), "hours": one.hours} for one in self.marks],
        )  # fmt: skip

    def to_table(self) -> str:
        """Return Markdown tables that can be read as they stand."""
        head = [
            "receivers", "ns a cell", "ns a cell and sun", "ns a triangle", "ns a triangle and sun",
            "triangles read for one of its own", "bytes a cell",
        ]  # fmt: skip
        lines = [
            [
                kind, *(f"{1e9 * v:.3g}" for v in (c.cell, c.cell_sun, c.triangle, c.triangle_sun)),
                f"{c.read:.2f}", f"{c.written:.2f}",
            ]
            for kind, c in self.constants.items()
        ]  # fmt: skip
        wanted = ["region", "km²", "receivers", "core hours, day of 33 suns", "of a year", "store"]
        rows = [
            [
                region.name, f"{region.area:,.0f}", kind,
                *(f"{work_out(c, region, suns) / 3600:,.2g}" for suns in (33, _YEAR)),
                f"{region.area * 1e6 * c.written / 1e9:,.3g} GB",
            ]
            for region in REGIONS
            for kind, c in self.constants.items()
        ]  # fmt: skip
        wall, processor = self.efficiency
        return (
            f"umbra bench city: {self.machine}. Processor time of {self.tiles} tiles of 1 km "
            f"for each measurement.{self.small}\n\n{lay_out_table(head, lines)}\n\n"
            f"Reading CityGML: {1 / self.reading.processor:.3g} MB a second and core; catalogue: "
            f"{self.bytes_a_triangle:.0f} bytes a triangle. Memory of a process: "
            f"{self.memory / 1e9:.2f} GB at most. Efficiency of two workers: {wall:.2f} by the "
            f"clock, {processor:.2f} by processor time.\n\n{lay_out_table(wanted, rows)}"
            f"\n\nA city of {CITY:.0f} km², extrapolated from random tiles, one core:\n\n"
            f"{lay_out_table(HEAD, [one.to_row() for one in self.marks])}"
        )


def work_out(constants: Constants, region: Region, suns: int) -> float:
    """Return the processor time of a region at 1 m [s]."""
    return constants.find_seconds(region.area * 1e6, region.area * region.triangles, suns)


def bench_city(run: BenchmarkRun) -> CityReport:
    """Measure what tiles of a dense and a sparse city cost with few suns and with many."""
    area, count, cell = (1, 1, 10.0) if run.quick else (49, 10, 1.0)
    with tempfile.TemporaryDirectory() as folder:
        measured: dict[str, list[_Measured]] = {kind: [] for kind in _KINDS}
        reading, files, size = [], Written(), 0.0
        for buildings, trees in _DENSITIES:
            place = Path(folder) / f"{buildings:g}"
            run.say(f"{area} km² with {buildings:g} buildings each")
            files = write_city(City(area, 1, buildings, trees), place / "files")
            for kind in _KINDS:
                out = place / kind
                out.mkdir()
                if kind != _KINDS[0]:
                    shutil.move(place / _KINDS[0] / CATALOGUE, out / CATALOGUE)
                job, spent = _prepare(place / "files", out, kind, cell)
                if kind == _KINDS[0]:
                    reading.append(_divide(spent, files.bytes / 1e6))
                    size = _find_size(out / CATALOGUE) / files.triangles
                own = files.triangles / area
                for every in _EVERY:
                    run.say(f"{kind}, every {every}")
                    measured[kind].append(_count(job, every, count, own))
        dense = Path(folder) / f"{_DENSITIES[0][0]:g}" / _KINDS[-1]
        run.say("one worker, two workers")
        job, _ = _prepare(dense.parent / "files", dense, _KINDS[-1], cell)
        one, two = (_time_workers(job, n, count) for n in (1, 2))
        marks = Path(folder) / "marks"
        (marks / "start").mkdir(parents=True)
        shutil.move(dense / CATALOGUE, marks / "start" / CATALOGUE)
        found = measure_marks(
            dense.parent / "files", marks, count=2 * count, cell=cell, no_cast=_NO_CAST, say=run.say
        )
        return CityReport(
            run, {kind: _fit(each) for kind, each in measured.items()}, reading[0], size, files,
            count, _find_memory(), one, two, found,
        )  # fmt: skip


@dataclass(frozen=True)
class _Measured:
    """What some tiles cost."""

    seconds: float
    cells: float
    triangles: float  # read
    own: float  # triangles that lie in them
    suns: int
    written: float  # [byte a cell]


def _prepare(files: Path, out: Path, kind: str, cell: float) -> tuple[CityJob, Spent]:
    """Prepare a city's run, and time it."""
    options = StudyOptions(
        **_DAY, every="15min", receivers=kind, no_cast=_NO_CAST[kind], cell=cell, threads=1
    )
    begun = time.perf_counter(), time.process_time()
    given = [os.fspath(files)]
    found = prepare_city(given, None, options, CityOptions(tiles="1km"), out)
    spent = Spent(time.perf_counter() - begun[0], time.process_time() - begun[1])
    return found.job.with_resources(4e9, 1), spent


def _count(job: CityJob, every: str, count: int, own: float) -> _Measured:
    """Count tiles chosen by chance, after one that does not count."""
    job = replace(
        job, options=replace(job.options, every=every), fingerprint=job.fingerprint + every
    )
    tiles = _choose(job, count)
    count_tile(job, tiles[0])
    begun = time.process_time()
    records = [count_tile(job, tile) for tile in tiles]
    seconds = time.process_time() - begun
    cells = sum(tile.cells for tile in tiles)
    area = cells * job.lattice.grid.dx * job.lattice.grid.dy / 1e6 if job.lattice else 0.0
    return _Measured(
        seconds, cells, sum(record.triangles for record in records), own * area,
        len(job.open().lights), _find_size(job.store / "shadow_hours") / max(_find_written(job), 1),
    )  # fmt: skip


def _choose(job: CityJob, count: int) -> list[Any]:
    """Return some tiles, the same each time."""
    tiles = job.tiles()
    chosen = np.random.default_rng(1).choice(len(tiles), min(count, len(tiles)), replace=False)
    return [tiles[k] for k in chosen]


def _find_written(job: CityJob) -> int:
    """Return the number of cells that the store holds."""
    done = CityStore(job.store).find_done()
    return sum(tile.cells for tile in job.tiles() if tile.number in done)


def _fit(measured: list[_Measured]) -> Constants:
    """Fit costs of cells and triangles, none of them negative."""
    rows = [
        [m.cells, m.triangles, m.cells * m.suns, m.triangles * m.suns] for m in measured
    ]  # fmt: skip
    scale = np.abs(rows).max(0)
    found, _ = nnls(np.array(rows) / scale, np.array([m.seconds for m in measured]))
    cell, triangle, cell_sun, triangle_sun = (found / scale).tolist()
    read = sum(m.triangles for m in measured) / max(sum(m.own for m in measured), 1.0)
    # Hours in shadow and in the sun take the same; heights take more on slopes.
    written = 2 * float(np.mean([m.written for m in measured]))
    return Constants(cell, triangle, cell_sun, triangle_sun, read, written)


def _time_workers(job: CityJob, workers: int, count: int) -> Spent:
    """Time a run of some tiles on processes that are ready."""
    job = replace(job, fingerprint=f"{job.fingerprint} {workers}")
    tiles = _choose(job, 2 * count)
    return time_workers(job, tiles, workers)


def _divide(spent: Spent, by: float) -> Spent:
    return Spent(spent.wall / by, spent.processor / by)


def _find_size(folder: Path) -> float:
    return float(sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()))


def _find_memory() -> float:
    """Return the most memory that this process has held [byte]."""
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
