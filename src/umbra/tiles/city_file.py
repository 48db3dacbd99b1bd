"""
One file of a city, as the catalogue keeps it.

The files of a city: names, folders and patterns.

Files of a city that lie outside the region that is read: named once, not read again.

The memory that reading one file takes, from its size: a file is read whole before it is cut.
"""

import glob
import math
import os
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from umbra.errors import InputError
from umbra.ground.feet import Feet
from umbra.ground.level import Bases
from umbra.machine import find_memory
from umbra.readers.apart import FilePlan
from umbra.readers.content import GZIP, ZIP, FileContent
from umbra.readers.formats import (
    find_format_kind,
    has_reader,
    list_citygml_members,
    tell_formats,
)
from umbra.scene import Source
from umbra.tiles.file_geometry import FileGeometry
from umbra.tiles.sealed import read_sealed

__all__ = [
    "BASES",
    "OUTSIDE",
    "WORDS",
    "CityFile",
    "check_reading",
    "list_city_files",
    "name_as_read",
    "read_outside",
    "tell_reading",
]

_OWN = 3e8  # of the process [byte]
_FACTORS = {"citygml": 2.5, "json": 22, "obj": 20, "glb": 20, "ply": 20, "off": 20, "stl": 9}
"""Memory for each byte of a file, measured and rounded up; other formats are read in pieces."""
_EXPANSION = 12  # bytes of CityGML for one that is compressed


def check_reading(path: Path, memory: float, options: Mapping[str, Any]) -> None:
    """
    Refuse a file whose reading takes more than the memory of the run.

    Parameters
    ----------
    path : Path
    memory : float
        Most memory of the run [byte].
    options : mapping
        Options of ``umbra.read``.

    Raises
    ------
    InputError
    """
    try:
        content = FileContent(path) if path.is_file() else None
        kind = "" if content is None else find_format_kind(content)
    except (InputError, OSError):
        return  # the reader says so
    has_region = options.get("bbox") is not None or options.get("area") is not None
    if content is None or kind not in _FACTORS or (kind == "citygml" and has_region):
        return  # CityGML is read an object at a time, and only those in the region are kept
    needed = _OWN + _FACTORS[kind] * _find_size(content)
    if needed <= memory:
        return
    remedies = ["cut it into several files"]
    if kind == "citygml":
        remedies.append("read a part of it with bbox=")
    if needed < find_memory():
        remedies.append(f"give memory='{math.ceil(needed / 2**30)}GB'")
    msg = (
        f"{path}: reading it takes about {needed / 2**30:.1f} GB, and the run may use "
        f"{memory / 2**30:.1f} GB; {', or '.join(remedies)}"
    )
    raise InputError(msg, option="memory", path=path, needed=needed)


def _find_size(content: FileContent) -> float:
    """Return the size of a file, unpacked [byte]."""
    if content.head.startswith(ZIP):
        with content.open() as file, zipfile.ZipFile(file) as archive:
            return sum(archive.getinfo(name).file_size for name in list_citygml_members(archive))
    return content.size * (_EXPANSION if content.head.startswith(GZIP) else 1)


OUTSIDE = "outside.json"


def read_outside(folder: Path) -> dict[str, str]:
    """Return the notes of the files that are known to lie outside, by ``name_as_read``."""
    return read_sealed(folder / OUTSIDE) or {}


def name_as_read(layer: str, path: Path, options: Mapping[str, Any]) -> str:
    """Name a file as it is now, and how it is read."""
    try:
        status = path.stat()
        state = f"{status.st_size} {status.st_mtime_ns}"
    except (OSError, ValueError):  # the reader says so
        state = ""
    return f"{path.absolute()!r} {layer!r} {state} {tell_reading(options)}"


def tell_reading(options: Mapping[str, Any]) -> str:
    """Name the options of ``umbra.read``, with the content of the file of a polygon."""
    values = {name: value for name, value in options.items() if name != "cache"}
    try:
        path = Path(str(values.get("area") or ""))
        if path.is_file():
            values["area"] = f"{path} sha256:{sha256(path.read_bytes()).hexdigest()}"
    except (OSError, ValueError):  # a polygon as text, not a name
        pass
    return repr(sorted(values.items()))


_PACKED = {".gz", ".zip", ".xml"}


def list_city_files(given: Sequence[str | os.PathLike[str]]) -> list[str]:
    """
    List the files of a city: names, folders (all files in them that umbra reads), and patterns.

    Parameters
    ----------
    given : sequence of str or path
        ``layer=FILE`` names a layer.

    Raises
    ------
    InputError
        If a folder or a pattern holds no file, or there is none at all.
    """
    paths: list[str] = []
    for name in [os.fspath(path) for path in given]:
        path = Path(name)
        if path.is_dir():
            inside = sorted(str(p) for p in path.iterdir() if _is_model(p))
            if not inside:
                formats = tell_formats()
                msg = f"{name}: the folder holds no model; name files, or a folder of {formats}"
                raise InputError(msg, path=name)
            paths += inside
        elif glob.has_magic(name) and not path.exists():
            inside = sorted(p for p in glob.glob(name, recursive=True) if Path(p).is_file())  # noqa: PTH207
            if not inside:
                msg = f"{name}: no file has such a name; check the pattern"
                raise InputError(msg, path=name)
            paths += inside
        else:
            paths.append(name)
    if not paths:
        msg = f"no file given; name one or more of {tell_formats()}, a folder or a pattern"
        raise InputError(msg)
    unique = dict.fromkeys(paths)
    return list(unique)


def _is_model(path: Path) -> bool:
    return path.is_file() and (has_reader(path.suffix) or path.suffix.lower() in _PACKED)


WORDS = "words.json"
"""File of the names, kinds and tags of the parts."""
BASES = ("bases", "floors", "feet", "owners", "standing", "floor_objects")
"""Names of the arrays of the objects' bases."""


@dataclass(frozen=True)
class CityFile:
    """
    A file of a city, as it was read.

    Parameters
    ----------
    number : int
        Index in the catalogue.
    path : str
    layer : str
    size : int
        [byte]
    mtime : int
        Time of the last change [ns].
    folder : str
        Folder of its facts and meshes.
    reading : str
        Options with which it was read.
    sources : tuple of Source
        Its name, SHA-256 and format, and those of its companions.
    place : dict
        ``crs``, ``latitude``, ``longitude``, ``elevation``, ``is_ellipsoidal``, ``true_north`` and
        ``ground``, as far as the file states them.
    notes : tuple of str
    origin : tuple of float
        Of its local frame, in its own coordinates [m].
    bounds : tuple of tuple of float
        Lowest and highest corner, in its own coordinates [m].
    counts : dict
        Numbers of ``parts``, ``objects``, ``units`` and ``triangles``.
    kinds : tuple of str
        Kinds of its parts.
    terrain : dict
        Fields of ``Terrain``.
    files_checksum : int
        CRC-32 of its other files.
    """

    number: int
    path: str
    layer: str
    size: int
    mtime: int
    folder: str
    reading: str
    sources: tuple[Source, ...]
    place: Mapping[str, Any]
    notes: tuple[str, ...]
    origin: tuple[float, float, float]
    bounds: tuple[tuple[float, ...], tuple[float, ...]]
    counts: Mapping[str, int]
    kinds: tuple[str, ...]
    terrain: Mapping[str, Any]
    files_checksum: int = 0

    @property
    def geometry(self) -> FileGeometry:
        """Its meshes."""
        return FileGeometry(Path(self.folder))

    @property
    def plan(self) -> FilePlan:
        """Where it lies in the plan of all files."""
        site = [self.place[name] for name in ("crs", "latitude", "longitude")]
        return FilePlan(Path(self.path).name, np.array(self.bounds)[:, :2], *site)

    @property
    def bases(self) -> Bases:
        """Bases of its objects."""
        boxes, floors, feet, owner, *objects = (
            np.load(Path(self.folder) / f"{name}.npy") for name in BASES
        )
        return Bases(boxes, floors, Feet(feet, owner), *objects)

    @property
    def kinds_of_parts(self) -> list[str]:
        """Kind of each part."""
        return self.words["kinds"]

    @property
    def names_of_objects(self) -> list[str]:
        """Name of each object."""
        names = [""] * self.counts["objects"]
        for name, index in zip(self.words["names"], self.geometry.object_of.tolist(), strict=True):
            names[index] = name
        return names

    @property
    def words(self) -> dict[str, list]:
        """Names, kinds and tags of its parts."""
        return _read_words(f"{self.folder}/{WORDS}", self.sources[0].sha256)


@lru_cache(maxsize=16)
def _read_words(path: str, _: str) -> dict[str, list]:
    """Read the words of a file's parts; its content is a key of the cache, too."""
    return orjson.loads(Path(path).read_bytes())
