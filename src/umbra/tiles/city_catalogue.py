"""
Catalogue of a city's files: what each holds and where, and its meshes as arrays.

Each file is read once. Its facts and arrays are kept in a folder of their own, which is complete or
absent, and is read instead of the file as long as the file is unchanged.
"""

import math
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.ground.feet import Feet
from umbra.ground.level import Bases, Terrain, measure_bases, measure_terrain
from umbra.readers import read
from umbra.readers.apart import check_apart, make_crs_error
from umbra.readers.file_layers import name_layers
from umbra.readers.georeference import is_same_plan
from umbra.scene import Scene, Source
from umbra.tiles.city_file import (
    BASES,
    OUTSIDE,
    WORDS,
    CityFile,
    check_reading,
    list_city_files,
    name_as_read,
    read_outside,
    tell_reading,
)
from umbra.tiles.file_geometry import write_geometry
from umbra.tiles.sealed import read_sealed, sum_files, write_sealed

__all__ = ["Catalogue", "CityFile", "add_scene", "make_catalogue", "read_catalogue"]

_ENTRY = "entry.json"
_INDEX = "index.json"


@dataclass(frozen=True)
class Catalogue:
    """
    Files of a city, in the order in which they were given.

    Parameters
    ----------
    files : tuple of CityFile
    notes : tuple of str
        Of files that are left out.
    """

    files: tuple[CityFile, ...]
    notes: tuple[str, ...] = field(default=())

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest corner of all files, (2, 3) [m]."""
        boxes = np.array([file.bounds for file in self.files])
        return np.stack([boxes[:, 0].min(0), boxes[:, 1].max(0)])

    @property
    def crs(self) -> str | None:
        """Coordinate reference system of all files that name one."""
        return next((file.place["crs"] for file in self.files if file.place["crs"]), None)

    @property
    def terrain(self) -> Terrain:
        """Ground that the files bring."""
        terrains = [Terrain(**file.terrain) for file in self.files]
        return Terrain(any(t.is_relief for t in terrains), sum(t.area for t in terrains))

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the contents of all files, and of how they were read, in hex."""
        summed = sha256()
        for file in self.files:
            words = (file.layer, file.reading, *(source.sha256 for source in file.sources))
            summed.update(repr(words).encode())
        return summed.hexdigest()

    def label_parts(self, file: CityFile) -> list[str]:
        """Name the object of each part of a file, with its layer if another has the name, too."""
        lead, own = f"{file.layer}/" * bool(file.layer), file.words["names"]
        return [lead + name if name in self._shared else name for name in own]

    @cached_property
    def _shared(self) -> set[str]:
        """Names that objects of several layers have."""
        layers: dict[str, str] = {}
        return {
            name
            for file in self.files
            for name in dict.fromkeys(file.words["names"])
            if layers.setdefault(name, file.layer) != file.layer
        }

    def find_bases(self, hanging: Sequence[NDArray[np.integer]] | None = None) -> Bases:
        """Gather the bases of all objects, or of all but some of each file, if others are left."""
        bases = [file.bases for file in self.files]
        if hanging is not None:
            others = [b.without(objects) for b, objects in zip(bases, hanging, strict=True)]
            bases = others if any(len(b.objects) for b in others) else bases
        first = np.cumsum([0, *(len(b.boxes) for b in bases)])
        owners = [b.feet.owner + start for b, start in zip(bases, first)]
        return Bases(
            np.concatenate([b.boxes for b in bases]), np.concatenate([b.floors for b in bases]),
            Feet(np.concatenate([b.feet.corners for b in bases]), np.concatenate(owners)),
            np.concatenate([b.objects for b in bases]),
            np.concatenate([b.floor_objects for b in bases]),
        )  # fmt: skip

    def find_corners(self) -> Iterator[NDArray[np.float64]]:
        """Yield the corners of each file's triangles in its own coordinates, in blocks (n, 3)."""
        for file in self.files:
            vertices = file.geometry.vertices
            for first in range(0, len(vertices), 1 << 20):
                yield vertices[first : first + (1 << 20)] + np.array(file.origin)


def make_catalogue(
    given: Sequence[str | os.PathLike[str]],
    folder: Path,
    reading: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
    memory: float = math.inf,
) -> Catalogue:
    """
    Read every file of a city that is not in a folder yet, or has changed.

    Parameters
    ----------
    given : sequence of str or path
        As ``list_city_files`` takes them.
    folder : Path
        Of the catalogue; made if missing.
    reading : mapping, optional
        Options of ``umbra.read``.
    progress : callable
        Called with the number of files done and the total.
    memory : float
        Most memory of this process [byte].

    Raises
    ------
    InputError
        If a file cannot be read, or takes too much memory, or two are in different coordinate
        reference systems.
    """
    options = {"cache": True, **(reading or {})}
    for option in ("place", "lift", "move"):
        if options.get(option):
            msg = f"{option}= is not for tiles, whose files are read alone; study without tiles="
            raise InputError(msg, option=option)
    named = name_layers(list_city_files(given))
    folder.mkdir(parents=True, exist_ok=True)
    files: list[CityFile] = []
    known, outside, damaged = read_outside(folder), {}, []
    for done, (layer, path) in enumerate(named, 1):
        key = name_as_read(layer, path, options)
        try:
            if key in known and (files or done < len(named)):
                outside[key] = known[key]
            else:
                entry_folder = folder / f"{len(files):06}"
                entry = _load(entry_folder)
                if entry is None and entry_folder.exists():
                    damaged.append(f"'{entry_folder}' was damaged; {path} was read again")
                files.append(_enter(entry, len(files), layer, path, folder, options, memory))
                _check_crs(files)
        except InputError as error:
            # A file without an object in the region is left out, unless all files are.
            if "outside" not in error.data or (done == len(named) and not files):
                raise
            outside[key] = str(error.outside)
        progress(done, len(named))
    catalogue = Catalogue(tuple(files))
    apart = check_apart([file.plan for file in files], catalogue.crs)
    for leftover in folder.iterdir():  # of runs with more files, and of killed runs
        if leftover.is_dir() and leftover.name not in {Path(file.folder).name for file in files}:
            shutil.rmtree(leftover, ignore_errors=True)
    write_sealed(folder / OUTSIDE, outside)
    write_sealed(folder / _INDEX, {"files": [Path(file.folder).name for file in files]})
    return replace(catalogue, notes=(*damaged, *outside.values(), *apart))


def read_catalogue(folder: Path) -> Catalogue:
    """
    Read the catalogue in a folder.

    Raises
    ------
    InputError
        If it is damaged.
    """
    index = read_sealed(folder / _INDEX)
    entries = [_load(folder / name) for name in index["files"]] if index is not None else [None]
    files = tuple(file for file in entries if file is not None)
    if len(files) < len(entries):
        msg = f"'{folder}' is damaged or incomplete; run the same study again: it is made anew"
        raise InputError(msg, option="out", path=folder)
    return Catalogue(files)


def _enter(
    known: CityFile | None, number: int, layer: str, path: Path, folder: Path,
    options: Mapping[str, Any], memory: float,
) -> CityFile:  # fmt: skip
    """Return a file's entry: the known one if it holds, else a new one."""
    entry_folder = folder / f"{number:06}"
    reading = tell_reading(options)
    if (
        known is not None
        and (known.path, known.layer, known.reading) == (str(path.resolve()), layer, reading)
        and _is_unchanged(known, path)
    ):
        return known
    check_reading(path, memory, options)
    scene = read(path, **options)
    status = path.stat()
    return _write_entry(
        scene, entry_folder, number=number, path=str(path.resolve()), layer=layer,
        size=status.st_size, mtime=status.st_mtime_ns, reading=reading,
    )  # fmt: skip


def add_scene(catalogue: Catalogue, folder: Path, scene: Scene) -> None:
    """
    Add parts that no file of a city holds to the catalogue in a folder, as its last file.

    Parameters
    ----------
    catalogue : Catalogue
        Of the files.
    folder : Path
    scene : Scene
    """
    number = len(catalogue.files)
    entry_folder = folder / f"{number:06}"
    if not scene.sources:
        summed = sha256()
        for part in scene.parts:
            summed.update(part.mesh.vertices.tobytes() + part.mesh.faces.tobytes())
        scene = replace(scene, sources=(Source("ground", summed.hexdigest(), "assumed"),))
    _write_entry(
        scene, entry_folder, number=number, path="", layer="", size=0, mtime=0, reading="",
    )  # fmt: skip
    names = [Path(file.folder).name for file in catalogue.files]
    write_sealed(folder / _INDEX, {"files": [*names, entry_folder.name]})


def _write_entry(scene: Scene, entry_folder: Path, **own: Any) -> CityFile:
    """Write the facts and arrays of a file into a folder, whole or not at all."""
    shutil.rmtree(entry_folder, ignore_errors=True)
    unfinished = entry_folder.with_name(f".{entry_folder.name}")
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir()
    geometry = write_geometry(scene, unfinished)
    bases = measure_bases(scene)
    arrays = (
        bases.boxes, bases.floors, bases.feet.corners, bases.feet.owner, bases.objects,
        bases.floor_objects,
    )  # fmt: skip
    for name, array in zip(BASES, arrays, strict=True):
        np.save(unfinished / f"{name}.npy", array)
    words = {
        "names": [part.name for part in scene.parts],
        "kinds": [part.kind for part in scene.parts],
        "tags": [part.tags for part in scene.parts],
    }
    (unfinished / WORDS).write_bytes(orjson.dumps(words))
    entry = CityFile(
        **own, folder=str(entry_folder), sources=scene.sources,
        place=_find_place(scene), notes=scene.notes, origin=tuple(scene.origin.tolist()),
        bounds=(tuple(scene.bounds()[0].tolist()), tuple(scene.bounds()[1].tolist())),
        counts={
            "parts": len(scene.parts), "objects": int(geometry.object_of.max()) + 1,
            "units": len(geometry.boxes), "triangles": len(geometry.faces),
        },
        kinds=tuple(sorted({part.kind for part in scene.parts})),
        terrain=asdict(measure_terrain(scene)), files_checksum=sum_files(unfinished.iterdir()),
    )  # fmt: skip
    facts = asdict(entry)
    del facts["folder"]  # which may be moved
    write_sealed(unfinished / _ENTRY, facts)
    unfinished.rename(entry_folder)
    return entry


def _find_place(scene: Scene) -> dict[str, Any]:
    names = (
        "crs", "latitude", "longitude", "elevation", "is_ellipsoidal", "true_north", "ground",
    )  # fmt: skip
    return {name: getattr(scene, name) for name in names}


def _load(entry_folder: Path) -> CityFile | None:
    """Return the entry in a folder; None if there is none, or it is damaged."""
    facts = read_sealed(entry_folder / _ENTRY)
    if facts is None:
        return None
    facts["sources"] = tuple(Source(**source) for source in facts["sources"])
    for name in ("notes", "kinds", "origin"):
        facts[name] = tuple(facts[name])
    facts["bounds"] = tuple(map(tuple, facts["bounds"]))
    try:
        entry = CityFile(**{**facts, "folder": str(entry_folder)})
        total = sum_files(path for path in entry_folder.iterdir() if path.name != _ENTRY)
    except (OSError, TypeError):  # TypeError: of another version
        return None
    return entry if total == entry.files_checksum else None


def _is_unchanged(known: CityFile, path: Path) -> bool:
    """Return whether a file has the size and time of its entry, or else the same bytes."""
    status = path.stat() if path.exists() else None
    if status is None:
        return False  # the reader names it
    is_as_long = status.st_size == known.size
    if is_as_long and status.st_mtime_ns == known.mtime:
        return True
    return is_as_long and sha256(path.read_bytes()).hexdigest() == known.sources[0].sha256


def _check_crs(files: Sequence[CityFile]) -> None:
    """Refuse a file whose CRS differs from that of the files before it."""
    new = files[-1]
    first = next((file for file in files if file.place["crs"]), new)
    crs = (first.place["crs"], new.place["crs"])
    if all(crs) and not is_same_plan(*crs):
        raise make_crs_error(first.path, new.path, crs)
