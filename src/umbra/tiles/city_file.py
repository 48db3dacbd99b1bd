"""One file of a city, as the catalogue keeps it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from umbra.ground.feet import Feet
from umbra.ground.level import Bases
from umbra.readers.apart import FilePlan
from umbra.scene import Source
from umbra.tiles.geometry import FileGeometry

__all__ = ["BASES", "WORDS", "CityFile"]

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
        ``crs``, ``latitude``, ``longitude``, ``elevation``, ``true_north`` and ``ground``, as far
        as the file states them.
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
        for name, thing in zip(self.words["names"], self.geometry.object_of.tolist(), strict=True):
            names[thing] = name
        return names

    @property
    def words(self) -> dict[str, list]:
        """Names, kinds and tags of its parts."""
        return _read_words(f"{self.folder}/{WORDS}", self.sources[0].sha256)


@lru_cache(maxsize=16)
def _read_words(path: str, _: str) -> dict[str, list]:
    """Read the words of a file's parts; its content is a key of the cache, too."""
    return orjson.loads(Path(path).read_bytes())
