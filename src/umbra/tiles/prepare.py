"""Preparation of a study in tiles: from files and options to a job and its store."""

import datetime as dt
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from umbra.errors import InputError, show_count
from umbra.lights import Horizon
from umbra.option_fields import list_options
from umbra.scene import Scene
from umbra.scene.grid import Grid
from umbra.scene.named_places import Area
from umbra.study.options import StudyOptions
from umbra.study.remarks import tell_sources
from umbra.sun import Site
from umbra.sun.date_words import tell_skipped
from umbra.sun.site import tell_moved
from umbra.tiles.city_catalogue import Catalogue
from umbra.tiles.city_ground import CityGround
from umbra.tiles.city_layout import lay_out_lattice
from umbra.tiles.city_options import CityOptions
from umbra.tiles.city_proposal import tell_tiled_proposal
from umbra.tiles.count import count_window, find_needs
from umbra.tiles.job import (
    STUDY,
    CityJob,
    WorkerContext,
    make_city_period,
)
from umbra.tiles.matched_parts import name_city_replaced
from umbra.tiles.roles import Roles
from umbra.tiles.sealed import read_sealed, write_sealed
from umbra.tiles.settle import locate_city, settle_city
from umbra.tiles.store import CityStore
from umbra.version import __version__

__all__ = ["Preparation", "make_plain", "prepare_city"]

_FORMAT = 3  # of the folder
_FAR = -1e9  # x of the cell that shows a study's variables [m]
_LISTED = 50  # files that the attribute source names, and notes


@dataclass(frozen=True)
class Preparation:
    """
    A job, and what its result says besides hours.

    Parameters
    ----------
    job : CityJob
    catalogue : Catalogue
    ground : CityGround
    damaged : sequence of Path
        Files of the folder that were damaged, and are made anew.
    told : tuple of str
        Notes on files that are named beside the city's.
    """

    job: CityJob
    catalogue: Catalogue
    ground: CityGround
    damaged: Sequence[Path] = ()
    told: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Losses and assumptions of the files, one line each, and what was merged."""
        notes = [note for file in self.catalogue.files for note in file.notes]
        notes += [*self.catalogue.notes, *self.told]
        if self.damaged:
            count = show_count(len(self.damaged), "file was", "files were")
            notes.append(
                f"{count} damaged among the results and made anew (first: '{self.damaged[0]}')"
            )
        if self.job.site is not None:
            notes += tell_moved(locate_city(self.catalogue), self.job.site)
        if self.job.options.date is not None:
            notes += tell_skipped(self.job.options.date)
        notes += tell_sources(self.job.options, self.job.site)
        land = self.job.options.horizon
        notes += land.told if land is not None else ()
        notes += tell_tiled_proposal(self.job.open())
        if len(notes) > _LISTED:
            notes = [*notes[:_LISTED], f"and {len(notes) - _LISTED:,} more notes of files"]
        if self.job.merged:
            file, index = self.job.merged[0]
            name = self.catalogue.files[file].names_of_objects[index]
            count = show_count(len(self.job.merged), "object is", "objects are")
            notes.append(
                f"{count} held by two files, with one name, size and place, and taken once "
                f"(first: '{name}')"
            )
        if self.job.options.asks_hours and not len(self.job.open().lights):
            notes.append(
                "the sun is below the horizon, or below min_altitude=, all this time; there are "
                "no hours of sun or shadow"
            )
        return tuple(notes)

    def describe(self, done: Mapping[int, Mapping[str, Any]]) -> dict[str, Any]:
        """Return the attributes of the result, given the marks of all tiles."""
        job, context = self.job, self.job.open()
        lattice = job.lattice
        cells = lattice.grid.rows * lattice.grid.cols if lattice else 1
        share = sum(int(facts["bare"]) for facts in done.values()) / cells
        scene = Scene((), context.origin, crs=self.catalogue.crs)
        facts = replace(context.setup, scene=scene).describe(
            job.kind, 0.0, ground_z=job.frame.ground
        )
        # Results are the same whatever counts them, and however long it takes.
        for name in ("threads", "prepare_seconds", "count_seconds", "source"):
            facts.pop(name, None)
        if context.kind.is_plan:
            facts |= context.kind.describe_level(
                scene, job.frame.ground, self.ground.assumed, share
            )
        facts |= {"ground": self.ground.known.name, **self.ground.known.describe()}
        facts.pop("ground_z" if not context.kind.is_plan else "", None)
        if gone := name_city_replaced(self.catalogue, job.options):
            facts["replaced"] = ", ".join(gone)
        facts["command"] = "umbra.city_study"
        facts["source"] = _name_sources(self.catalogue)
        if job.min_altitude:
            facts["min_altitude_deg"] = job.min_altitude
        if job.merged:
            facts["merged_objects"] = len(job.merged)
        return facts


def prepare_city(
    files: Sequence[Any],
    site: Site | Mapping[str, Any] | None,
    options: StudyOptions,
    city: CityOptions,
    folder: Path,
    reading: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> Preparation:
    """
    Read the files that are new, lay out the city, and make or check its store.

    Parameters
    ----------
    files : sequence of str or path
        Files, folders and patterns.
    site : Site, or mapping, optional
        Mapping: arguments of ``find_site`` that override the files.
    options : StudyOptions
    city : CityOptions
    folder : Path
        Of the results; exists, and is held by ``lock_run``.
    reading : mapping, optional
        Options of ``umbra.read``.
    progress : callable
        Called with the number of files read and of all.

    Raises
    ------
    InputError
        If an option, a file or the folder is wrong.
    """
    job, catalogue, ground, told, kind = settle_city(
        files, site, options, city, folder, reading, progress
    )
    options, frame = job.options, job.frame
    period = make_city_period(options, job.site, city.min_altitude or 0.0)
    limit = partial(WorkerContext(job).setup.attribution.limit_tiles, days=len(period.days))
    roles = Roles(catalogue, options, job.merged)
    lattice, x, y = lay_out_lattice(
        catalogue, roles, kind, frame, period, options, city.tiles, limit
    )
    job = replace(job, lattice=lattice)
    _check_memory(job, city)
    facts = _describe_run(job, catalogue, ground)
    job = replace(job, fingerprint=sha256(orjson.dumps(facts)).hexdigest())
    described = folder / STUDY
    is_damaged = not _check_same(described, facts) and described.exists()
    damaged = [described] * is_damaged
    if kind.is_plan:
        template = _find_template(WorkerContext(job))
        template |= {"x": (("x",), x), "y": (("y",), y)}
        sizes = {"y": len(y), "x": len(x)}
        known = {"crs": catalogue.crs, "days": len(period.days)}
        side = dict.fromkeys(sizes, lattice.side)
        damaged += CityStore(job.store).mend(template, sizes, side, known, options.quantities)
    write_sealed(described, facts, orjson.OPT_INDENT_2)
    return Preparation(job, catalogue, ground, damaged, told)


def _check_memory(job: CityJob, city: CityOptions) -> None:
    """Refuse tiles of a plan whose results fill more than half of a process's memory."""
    if job.lattice is None or not job.tiles() or not WorkerContext(job).kind.is_plan:
        return
    size, share = WorkerContext(job).bytes_kept, city.bytes / (city.workers or 1) / 2
    held = size * max(tile.cells for tile in job.tiles())
    if held > share:
        side = int(np.sqrt(share / size) * job.lattice.grid.dx)
        msg = (
            f"results of a tile take {held / 2**30:.1f} GB, {size:,} bytes a cell, and a process "
            f"may hold {share / 2**30:.1f} GB of them; choose tiles='{side}m', or fewer groups "
            "with who=, or leave masks= out"
        )
        raise InputError(msg, option="tiles")


def _find_template(context: WorkerContext) -> dict[str, Any]:
    """Return the variables of one cell far from everything."""
    grid = Grid(_FAR, _FAR, 1.0, 1.0, 1, 1)
    variables, *_ = count_window(context, grid, find_needs(context, grid))
    return {name: (dims, np.asarray(array)) for name, (dims, array) in variables.items()}


def _describe_run(job: CityJob, catalogue: Catalogue, ground: CityGround) -> dict[str, Any]:
    """Return everything that decides the bytes of a result, as JSON has it."""
    options = {
        name: repr(make_plain(getattr(job.options, name)))
        for name, said, _ in list_options(job.options)
        if said.is_kept
    }
    weather = {"weather": job.options.weather_year.sha256} if job.options.weather else {}
    return {
        "umbra": __version__,
        "format": _FORMAT,
        **weather,
        "files": [
            [Path(file.path).name, file.layer, file.reading, *(s.sha256 for s in file.sources)]
            for file in catalogue.files
        ],
        "ground": [source.sha256 for source in ground.known.scene.sources],
        "options": options,
        "min_altitude": job.min_altitude,
        "site": None if job.site is None else asdict(job.site),
        "frame": asdict(job.frame),
        "lattice": None if job.lattice is None else asdict(job.lattice),
    }


def make_plain(value: Any) -> Any:
    """Return an option's value with dates, clock times and shapes as text."""
    if isinstance(value, dt.timedelta):
        return f"{value.total_seconds():g}s"
    if isinstance(value, (list, tuple)):
        return tuple(map(make_plain, value))
    if isinstance(value, (Horizon, Area)):
        return value.plain
    return str(value) if isinstance(value, (dt.date, dt.time)) else value


def _check_same(path: Path, facts: Mapping[str, Any]) -> bool:
    """
    Return whether a folder holds this study, begun or complete; False if it holds none.

    Raises
    ------
    InputError
        If it holds another.
    """
    held = read_sealed(path, orjson.OPT_INDENT_2)
    now = orjson.loads(orjson.dumps(facts))
    if held is None:
        held = _read_unsealed(path)
        if held is None:
            return False  # none, or damaged: marks of tiles name their study, too
    if held == now:
        return True
    what = next((name for name in now if held.get(name) != now[name]), "format")
    if what == "options":
        name = next(key for key in now[what] if held[what].get(key) != now[what][key])
        was, wanted = (_show(str(options.get(name))) for options in (held[what], now[what]))
        change = "" if name in {"horizon", "areas", "roads"} else f" ({was}, now {wanted})"
        what = f"another {name}={change}"
    elif what == "files":
        known = {entry[0]: entry for entry in held[what]}
        # The layer of a file also changes with the number of files, which is no change of it.
        changed = [entry[0] for entry in now[what] if known.get(entry[0], [])[2:] != entry[2:]]
        gone = sorted(set(known) - {entry[0] for entry in now[what]})
        moved = [entry[0] for entry in now[what] if known.get(entry[0]) != entry]
        first = (changed or gone or moved or [now[what][0][0]])[0]
        state = (
            "changed or new" if changed else "now missing" if gone else "of other layer or order"
        )
        what = f"other files (first: {first}, {state})"
    elif what == "lattice":
        what = "other tiles or cells"
    else:
        what = f"another {what}"
    msg = (
        f"'{path.parent}' holds a study with {what}; name another output folder, or remove this "
        "one to begin again"
    )
    raise InputError(msg, option="out", path=path.parent)


def _read_unsealed(path: Path) -> dict[str, Any] | None:
    """Return what an earlier version wrote, which had no seal; None if it is none of these."""
    try:
        held = orjson.loads(path.read_bytes())
        return held if "format" in held and held["format"] != _FORMAT else None
    except (OSError, ValueError, TypeError, KeyError):
        return None


def _show(value: str) -> str:
    """Write an option's value, as Python shows it, as a person types it."""
    return re.sub(r"[\[\]()']", "", value).rstrip(",").replace(", ", ",")


def _name_sources(catalogue: Catalogue) -> str:
    """Name the files and their SHA-256; of many files their number and the SHA-256 of all."""
    if len(catalogue.files) > _LISTED:
        return f"{len(catalogue.files)} files sha256:{catalogue.fingerprint}"
    sources = [source for file in catalogue.files for source in file.sources]
    return "; ".join(f"{source.name} sha256:{source.sha256}" for source in sources)
