"""A city's run as a record that any process can count tiles of."""

from ast import literal_eval
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from hashlib import sha256
from pathlib import Path

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.devices import DEFAULT
from umbra.lights import Lights, Period
from umbra.machine import count_cores
from umbra.receivers import name_kind
from umbra.receivers.kind import ReceiverKind
from umbra.scene import Scene
from umbra.scene.grid import Grid
from umbra.scene.named_places import Area
from umbra.study.accumulators.arrays import ResultOptions
from umbra.study.accumulators.attribution import AttributionOptions
from umbra.study.options import StudyOptions
from umbra.study.setup import Setup
from umbra.study.study_period import find_period
from umbra.sun import Site
from umbra.tiles.city_catalogue import Catalogue, read_catalogue
from umbra.tiles.city_lattice import CityTile, Lattice
from umbra.tiles.roles import CityGroups, Roles
from umbra.tiles.sealed import read_sealed

__all__ = [
    "CATALOGUE",
    "STORE",
    "STUDY",
    "CityFrame",
    "CityJob",
    "WorkerContext",
    "make_city_period",
    "read_job",
    "sees_whole_sky",
]

STORE, CATALOGUE, STUDY = "study.zarr", "catalogue", "city.json"


@dataclass(frozen=True)
class CityFrame:
    """
    Local frame of a run, and its ground.

    Parameters
    ----------
    origin : tuple of float
        In the city's own coordinates, whole metres [m].
    bounds : tuple of tuple of float
        Of all files, in the city's own coordinates [m].
    ground : float
        z of the ground plane, in the city's own coordinates [m].
    lowest : float
        z of the lowest place of the ground, in the city's own coordinates [m].
    has_end : bool
        Whether only the visible parts receive.
    is_added : bool
        Whether the ground is a surface that no file brings.
    is_plane : bool
        Whether the ground is the plane; else a surface.
    """

    origin: tuple[float, float, float]
    bounds: tuple[tuple[float, ...], tuple[float, ...]]
    ground: float
    lowest: float
    has_end: bool
    is_added: bool = False
    is_plane: bool = True

    @property
    def floor(self) -> float:
        """Height below which nothing receives, local frame [m]."""
        return min(self.ground, self.lowest) - self.origin[2] - self.has_end


@dataclass(frozen=True)
class CityJob:
    """
    A city's run: what a process needs to count any of its tiles.

    Parameters
    ----------
    folder : str
        Of the results, with the catalogue and the store.
    options : StudyOptions
    site : Site, optional
        None where no measure is of the sun and nothing says it.
    kind : str
        Name of the kind of receivers.
    frame : CityFrame
    lattice : Lattice or None
        Of plans.
    fingerprint : str
        SHA-256 of everything that decides the results.
    min_altitude : float
        Altitude below which suns count for nothing [degrees].
    memory : float
        Memory that a process may use [byte].
    threads : int
        Of a process.
    merged : tuple of (int, int)
        Objects that another file brings, too: number of the file, and of the object.
    square : float, optional
        Side of the squares whose named receivers are counted together [m].
    """

    folder: str
    options: StudyOptions
    site: Site | None
    kind: str
    frame: CityFrame
    lattice: Lattice | None
    fingerprint: str
    min_altitude: float = 0.0
    memory: float = 4e9
    threads: int = 1
    merged: tuple[tuple[int, int], ...] = field(default=(), repr=False)
    square: float | None = None

    def tiles(self) -> list[CityTile]:
        """Return all tiles."""
        return list(self.lattice.tiles()) if self.lattice is not None else []

    @property
    def store(self) -> Path:
        """Folder of the Zarr store."""
        return Path(self.folder) / STORE

    def open(self) -> "WorkerContext":
        """Open what a process keeps between tiles."""
        return _open(_Key(self))

    def with_resources(self, memory: float, threads: int) -> "CityJob":
        """Return the job for processes with other resources; results stay the same."""
        return replace(self, memory=memory, threads=threads)


class _Key:
    """Key of a job in a cache, equal for jobs of one run."""

    def __init__(self, job: CityJob) -> None:
        self.job = job

    def __hash__(self) -> int:
        job = self.job
        return hash((job.folder, job.fingerprint, job.threads, job.memory))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and hash(self) == hash(other)


@lru_cache(maxsize=1)
def _open(key: _Key) -> "WorkerContext":
    return WorkerContext(key.job)


class WorkerContext:
    """
    What a process keeps between the tiles of a run.

    Parameters
    ----------
    job : CityJob
    """

    def __init__(self, job: CityJob) -> None:
        self.job = job
        self.origin = np.array(job.frame.origin)

    @cached_property
    def catalogue(self) -> Catalogue:
        """The city's files."""
        return read_catalogue(Path(self.job.folder) / CATALOGUE)

    @cached_property
    def roles(self) -> Roles:
        """Roles of the files' parts."""
        return Roles(self.catalogue, self.job.options, self.job.merged)

    @cached_property
    def groups(self) -> CityGroups | None:
        """Groups of casters whose hours are told apart; None if none are asked for."""
        options = self.job.options
        if not (options.by or options.who or options.proposed):
            return None
        return CityGroups(self.catalogue, self.roles, options)

    @cached_property
    def sees_whole_sky(self) -> bool:
        """Whether a tile needs all that rises above its receivers."""
        return sees_whole_sky(self.job.options)

    @cached_property
    def adds_exactly(self) -> bool:
        """Whether hours are the same whether or not they are added up date by date."""
        hours = self.lights.weights[:, 0] * 1024
        results = self.setup.results
        is_exact = self.roles.season is None and bool((hours == np.rint(hours)).all())
        return is_exact or results.by_day or results.is_streamed

    @cached_property
    def kind(self) -> ReceiverKind:
        """Kind of the receivers."""
        return name_kind(self.job.kind, is_added=self.job.frame.is_added)

    @cached_property
    def shifts(self) -> NDArray[np.float64]:
        """Each file's origin in the run's local frame, (n_files, 3) [m]."""
        return np.array([file.origin for file in self.catalogue.files]) - self.origin

    @cached_property
    def boxes(self) -> NDArray[np.float64]:
        """Each file's bounds in the run's local frame, (n_files, 2, 3) [m]."""
        return np.array([file.bounds for file in self.catalogue.files]) - self.origin

    @cached_property
    def period(self) -> Period:
        """The time axis."""
        return make_city_period(self.job.options, self.job.site, self.job.min_altitude)

    @cached_property
    def setup(self) -> Setup:
        """Setup of the study of a tile, without its scene."""
        job = self.job
        nowhere = Scene((), self.origin)
        options = job.options
        results = ResultOptions.of(self.period, options)
        canopy = Canopy((), (), (), self.roles.season) if self.roles.season is not None else None
        attribution = AttributionOptions()
        if self.groups is not None and (options.asks_hours or self.sees_whole_sky):
            attribution = self.groups.placeholder
        return Setup(
            nowhere, job.site, options, self.period, results, attribution, [],
            job.threads, DEFAULT, canopy,
        )  # fmt: skip

    @cached_property
    def bytes_kept(self) -> int:
        """Memory of a receiver's results [byte]; hours of sun by month stand beside shadow's."""
        months = 4 * len(self.period.months) * self.setup.results.by_month
        return 24 + self.setup.bytes_kept + self.setup.bytes_of_masks + 2 * months

    @cached_property
    def lights(self) -> Lights:
        """The lights that are counted, by which casters are chosen, too."""
        return self.setup.make_lights()


def sees_whole_sky(options: StudyOptions) -> bool:
    """Return whether a study needs all that rises above a receiver, in whatever direction."""
    by_caster = any(
        measure.by_caster or (options.exact and measure.has_exact) for measure in options.measures
    )
    return by_caster or options.disc


def read_job(folder: Path, receivers: str) -> CityJob | None:
    """
    Read the job of a run from its folder, as far as its files and pictures need it.

    Parameters
    ----------
    folder : Path
    receivers : str
        Name of the kind of receivers.

    Returns
    -------
    job : CityJob or None
        None if the folder names none, or it is damaged.
    """
    known = read_sealed(folder / STUDY, orjson.OPT_INDENT_2)
    if known is None or known["lattice"] is None:
        return None
    options = {name: literal_eval(text) for name, text in known["options"].items()}
    if options["areas"] is not None:
        options["areas"] = [Area.of_plain(area) for area in options["areas"]]
    lattice = known["lattice"]
    return CityJob(
        str(folder.absolute()), StudyOptions(**{**options, "device": "auto"}),
        None if known["site"] is None else Site(**known["site"]),
        receivers, CityFrame(**known["frame"]),
        Lattice(Grid(**lattice["grid"]), lattice["side"], lattice["block"]),
        f"{sha256(orjson.dumps(known)).hexdigest()} to be read",  # it names no merged objects
        min_altitude=known["min_altitude"],
        threads=count_cores(),
    )  # fmt: skip


def make_city_period(options: StudyOptions, site: Site | None, min_altitude: float) -> Period:
    """Return the time axis of a study; suns below an altitude [degrees] are as if not up."""
    period = find_period(options, site)
    if not min_altitude:
        return period
    is_up = period.sun.is_up & (period.sun.altitude >= min_altitude)
    return replace(period, sun=replace(period.sun, is_up=is_up))
