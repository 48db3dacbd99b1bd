"""
Results of the readers: parts in the file's own coordinates, and the file's facts.

Files are placed by their up axis, and by the site that files and CRS agree on.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.readers.budget import Budget
from umbra.readers.checks import Companions
from umbra.readers.georeference import show_crs
from umbra.scene import Light, Part, Scene, Source
from umbra.scene.making import move_parts

if TYPE_CHECKING:
    from umbra.readers.placing import Placing
    from umbra.readers.region import Region

__all__ = [
    "APART",
    "HEIGHTS",
    "NO_CRS",
    "RASTERS",
    "TRUNK",
    "CrownRaster",
    "Crowns",
    "FileModel",
    "FilePlace",
    "ReadChoices",
    "UniqueNames",
    "state_site",
    "tell_doubt",
    "turn_up",
    "turning",
]

HEIGHTS = ("above-ground", "absolute")
TRUNK = 0.25
"""Share of a tree's height below which there is no crown, UMEP's default."""
NO_CRS = "no CRS is named, so coordinates are taken as metres (crs= names one)"
"""Note on a map's file without a CRS."""
RASTERS = (".tif", ".tiff")
APART = 0.05
"""Sites farther apart than this [degrees] differ; the sun moves as much."""
LEVEL = 0.01  # heights that differ by less [m] are equal
TURNED = 1.0  # true norths that differ by more [degrees] are noted


@dataclass(frozen=True)
class Crowns:
    """Selection of canopy rasters, and their options."""

    patterns: tuple[str, ...]  # shell patterns of layers or of files' names without their ending
    trunk: str = str(TRUNK)  # where crowns begin: a share of the height, or the file of a raster
    # of HEIGHTS: above the ground, or zero
    heights: str = HEIGHTS[0]

    def matches(self, layer: str, path: Path) -> bool:
        """Return whether a file is a canopy raster."""
        words = (layer, path.stem)
        return path.suffix.lower() in RASTERS and any(
            fnmatchcase(word, pattern) for word in words for pattern in self.patterns
        )


@dataclass(frozen=True, eq=False)
class CrownRaster:
    """A raster of tree tops, before its ground is known."""

    cells: NDArray[np.int32]  # (rows, cols): index of each cell's canopy; -1 for none
    # (n, 4): vertices of the model's part about each: at row and column, column + 1, both
    # + 1, row + 1
    corners: NDArray[np.int32]
    tops: NDArray[np.float64]  # (n,): heights [m]
    trunk: NDArray[np.float64] | None  # (n,): heights of the trunk zone [m]
    share: float  # of the height below which there is no crown, without ``trunk``
    is_absolute: bool  # whether heights are above zero and not above the ground


@dataclass(frozen=True)
class ReadChoices:
    """A caller's options for facts that a file does not state."""

    up: str | None = None  # x, y or z: the axis that points up
    # Columns of footprints: the height above the base, the base's own height, the name
    height_column: str | None = None
    base_column: str | None = None
    name_column: str | None = None
    crowns: Crowns | None = None  # which rasters are canopies
    crs: str | None = None  # of files that name none
    geometric_error: float | None = None  # of 3D Tiles that are fine enough [m]
    placings: "tuple[Placing, ...]" = ()  # where layers are wanted
    is_placed: bool = False  # whether a file is to be read in its own coordinates, not on its map
    region: "Region | None" = None  # only objects whose bounds meet it are wanted
    allow_outside: bool = False  # whether a model may name files outside its own folder
    # What the whole reading may take
    budget: Budget = field(default_factory=Budget, repr=False, compare=False)
    # Companions of each model read: the scene depends on their records
    opened: list[Companions] = field(default_factory=list, repr=False, compare=False)

    def companions_of(self, path: Path) -> Companions:
        """Return the companions of a model, which open the files that it names."""
        self.opened.append(Companions(path, self.budget, allow_outside=self.allow_outside))
        return self.opened[-1]


@dataclass(frozen=True)
class FilePlace:
    """Position that a file states beside or instead of a CRS."""

    latitude: float | None = None  # [degrees]
    longitude: float | None = None  # [degrees]
    elevation: float | None = None  # above the sea, or the ellipsoid (see below) [m]
    # Azimuth of true north in the file's plan, clockwise from +y [degrees]
    true_north: float | None = None
    ground: float | None = None  # height of the level ground in the file's own coordinates [m]
    ground_source: str = "the top of its site"  # what states it
    altitude: float | None = None  # of its origin, if it is to stand there [m]
    is_ellipsoidal: bool = False  # whether heights are above the ellipsoid, not the sea
    doubt: str | None = None  # why the site is not known although the file states it


NOWHERE = FilePlace()


@dataclass(frozen=True, eq=False)
class FileModel:
    """The contents of one file."""

    format: str  # for people: ``CityJSON 2.0``, ``OBJ``
    parts: tuple[Part, ...]  # in the file's own coordinates; z is up
    crs: str | None = None  # as ``EPSG:7415`` where the file names a code, else its own words
    notes: tuple[str, ...] = ()  # losses, one line each
    companions: tuple[Source, ...] = ()  # further files that hold a piece of it (glTF buffers)
    lights: tuple[Light, ...] = ()  # in the file's own coordinates
    place: FilePlace = NOWHERE  # its site, stated beside the CRS
    # Whether the file does not say how high its parts stand: they stand on 0, or on a terrain
    # if another file brings one
    is_afloat: bool = False
    is_high_in_metres: bool = False  # whether heights are in metres even where the CRS is in feet
    is_terrain: bool = False  # whether parts without a height may be stood on it
    # Of a canopy, whose one part is remade when the ground is known
    crowns: CrownRaster | None = None
    outside: int = 0  # objects that the reader left out, as they do not meet the region

    @property
    def is_sited(self) -> bool:
        """Whether the file states a site and no CRS."""
        return self.crs is None and self.place.latitude is not None


class UniqueNames:
    """
    Names in use, so that each further one differs: ``Tower``, ``Tower (2)``.

    Parameters
    ----------
    used : iterable of str
        Names that are in use already.
    ignores_case : bool
        Whether names that differ by case alone are one, as to many file systems and SQLite.

    Attributes
    ----------
    numbered : int
        Number of words that were in use before.
    """

    def __init__(self, used: Iterable[str] = (), *, ignores_case: bool = False) -> None:
        self._fold: Callable[[str], str] = str.casefold if ignores_case else str
        self._used = set(map(self._fold, used))
        self._counts: dict[str, int] = {}
        self.numbered = 0

    def add(self, word: str) -> str:
        """Return the word, numbered if it is in use."""
        key = self._fold(word)
        name, count = word, self._counts.get(key, 1)
        while self._fold(name) in self._used:
            count += 1
            name = f"{word} ({count})"
        self._counts[key] = count
        self.numbered += name != word
        self._used.add(self._fold(name))
        return name


def tell_doubt(doubt: str) -> str:
    """Return the note on a site that is stated, and not known."""
    return f"{doubt}, so the site is not known; give latitude= and longitude="


def state_site(scene: Scene, places: Mapping[str, FilePlace]) -> Scene:
    """Fill in the site that the files state, after the CRS; none, with a note, if two disagree."""
    notes = list(scene.notes)
    said = {
        name: (site.latitude, site.longitude)
        for name, site in places.items()
        if site.latitude is not None and site.longitude is not None
    }
    latitude, longitude, north = scene.latitude, scene.longitude, scene.true_north
    doubts = [f"{name}: {site.doubt}" for name, site in places.items() if site.doubt]
    if latitude is not None and longitude is not None:
        shown = show_crs(scene.crs or "")
        for name, (a, b) in said.items():
            if not _is_near((latitude, longitude), (a, b)):
                notes.append(
                    f"{name}: its site says {a:.4f}°, {b:.4f}°, but {shown} says "
                    f"{latitude:.4f}°, {longitude:.4f}°, which is used"
                )
    elif said:
        (first, here), *others = said.items()
        wrong = [name for name, there in others if not _is_near(here, there)]
        if wrong:
            shrunk = np.array([1.0, np.cos(np.radians(here[0]))])  # a degree eastward is shorter
            apart = max(np.linalg.norm((np.subtract(there, here)) * shrunk) for _, there in others)
            listed = "; ".join(f"{name} at {a:.4f}°, {b:.4f}°" for name, (a, b) in said.items())
            doubts.append(f"the files' sites disagree by up to {apart * 111.2:,.0f} km ({listed})")
            notes.append(tell_doubt(doubts[-1]))
        else:
            latitude, longitude = here
    norths = {n: p.true_north for n, p in places.items() if p.true_north is not None}
    if north is None and norths:
        (first, north), *turned = norths.items()
        for name, other in turned:
            if abs((other - north + 180) % 360 - 180) > TURNED:
                notes.append(
                    f"true north is at {north:.2f}° in {first} and at {other:.2f}° in {name}; "
                    "the first is used (true_north=)"
                )
    high = next((site for site in places.values() if site.elevation is not None), None)
    ground = _find_ground(places, notes)
    return scene.with_facts(
        latitude=latitude, longitude=longitude, true_north=north, notes=tuple(notes),
        elevation=scene.elevation if high is None else high.elevation, ground=ground,
        is_ellipsoidal=scene.is_ellipsoidal if high is None else high.is_ellipsoidal,
        site_doubt="; ".join(doubts) or scene.site_doubt,
    )  # fmt: skip


def _find_ground(places: Mapping[str, FilePlace], notes: list[str]) -> float | None:
    """Return the level ground that the files state; None unless every file states it."""
    levels = {name: site.ground for name, site in places.items() if site.ground is not None}
    if not levels or len(places) > len(levels):
        return None
    (name, ground), *others = levels.items()
    if all(abs(other - ground) < LEVEL for _, other in others):
        notes.append(
            f"{name}: the ground is taken at z = {ground:g} m, {places[name].ground_source} "
            "(ground=)"
        )
        return ground
    return None


def _is_near(site: tuple[float | None, float | None], other: tuple[float, float]) -> bool:
    return all(a is not None and abs(a - b) <= APART for a, b in zip(site, other, strict=True))


# Rotations, not reflections, and whole numbers: windings and digits stay.
TURNS = {
    "x": np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]),
    "y": np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
    "z": np.eye(4),
}


def turning(up: str) -> NDArray[np.float64]:
    """Return the rotation (4, 4) that brings the axis ``up`` to z: y gives (x, -z, y)."""
    return TURNS[up]


def turn_up(parts: tuple[Part, ...], up: str | None) -> tuple[Part, ...]:
    """Turn parts so that their axis ``up`` (z if None) is z; shared meshes stay shared."""
    if up is None or up == "z":
        return parts
    matrix = TURNS[up]
    turn = partial(_turn, matrix=matrix)
    return move_parts(
        parts, turn, lambda part: replace(part, transform=matrix @ part.transform), turn
    )


def _turn(array: NDArray[Any], matrix: NDArray[np.float64]) -> NDArray[Any]:
    # By columns, not by a product: 0 times infinity would spread NaN.
    axes, signs = np.abs(matrix[:3, :3]).argmax(1), matrix[:3, :3].sum(1)
    return np.ascontiguousarray(array[:, axes] * signs)
