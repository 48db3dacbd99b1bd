"""
KML that places models, alone or packed with them (.kmz).

The origin of the first model is the file's own; others lie about it, in metres on the plane that
touches the ellipsoid there.
"""

import io
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from urllib.parse import unquote
from xml.parsers import expat
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.readers.apart import find_offset
from umbra.readers.budget import Budget
from umbra.readers.checks import Losses, errors_of, find_reason, list_counts
from umbra.readers.collada import read_collada
from umbra.readers.content import ZIP, BoundedStream, open_archive
from umbra.readers.gltf import read_gltf_content
from umbra.readers.model import FileModel, FilePlace, ReadChoices, UniqueNames
from umbra.scene import Part

__all__ = ["MODELS", "read_kml"]

MODELS = (".dae", ".glb", ".gltf")
_LONGEST = 4096  # letters of a name or number
_FARTHEST = 100_000.0  # of a model from the first one [m]
_WORDS = {
    "altitudeMode", "Link/href", "Location/altitude", "Location/latitude", "Location/longitude",
    "Orientation/heading", "Orientation/roll", "Orientation/tilt", "Scale/x", "Scale/y", "Scale/z",
}  # fmt: skip
_ADVICE = "ogr2ogr FILE.geojson FILE.kml makes footprints of its polygons"

Matrix = NDArray[np.float64]


@dataclass
class _KmlModel:
    """A model that KML places, with its words as they stand in the file."""

    words: dict[str, str] = field(default_factory=dict)  # by those of _WORDS

    def find(self, word: str, default: float) -> float:
        text = self.words.get(word, "").strip()
        if not text:
            return default
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            msg = f"has a model whose {word} is no number: {show_value(text[:40])}; export it again"
            raise InputError(msg, word=word)
        return number

    @property
    def name(self) -> str:
        """The file of the model, with slashes."""
        return unquote(self.words.get("Link/href", "").strip()).replace("\\", "/")

    @property
    def heading(self) -> float:
        """Clockwise from north, of its y axis [degrees]."""
        return self.find("Orientation/heading", 0.0)

    def find_place(self) -> tuple[float, float]:
        """Return latitude and longitude [degrees]."""
        location = (
            self.find("Location/latitude", math.nan),
            self.find("Location/longitude", math.nan),
        )
        if not (abs(location[0]) <= 90 and abs(location[1]) <= 360):
            text = ", ".join(f"{value:g}" for value in location)
            msg = (
                f"has a model without a place on the earth (latitude, longitude {text}); give it a "
                "Location"
            )
            raise InputError(msg)
        return location

    def find_shape(self) -> Matrix:
        """
        Return the matrix (4, 4) of its scale, then its roll and tilt, without its heading.

        Rotations turn clockwise about the axes y and x, as seen from their ends
        (KML 2.3, ``Orientation``).
        """
        tilt, roll = (-math.radians(self.find(f"Orientation/{w}", 0.0)) for w in ("tilt", "roll"))
        scale = [self.find(f"Scale/{axis}", 1.0) for axis in "xyz"]
        if not all(scale):
            msg = "has a model of scale 0; export it again"
            raise InputError(msg)
        matrix = np.eye(4)
        matrix[:3, :3] = _turn(tilt, 1, 2) @ _turn(roll, 2, 0) @ np.diag(scale)
        return matrix


def _turn(angle: float, first: int, second: int) -> Matrix:
    """Return the rotation (3, 3) from one axis towards another [radians]."""
    matrix = np.eye(3)
    cos, sin = round(math.cos(angle), 15), round(math.sin(angle), 15)
    matrix[[first, second], [first, second]] = cos
    matrix[second, first], matrix[first, second] = sin, -sin
    return matrix


def read_kml(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read the models that KML places: packed with it, or beside a file that is not packed."""
    counts = Losses()
    if data.startswith(ZIP):
        archive, (note, *models) = open_archive(io.BytesIO(data), choices.budget, _choose)
        with archive:
            text = _unpack(archive, note, choices.budget)
            placed = _list_models(text, counts, choices.budget)

            def fetch(name: str) -> tuple[str, bytes] | None:
                member = _find_member(name, note, models)
                return (member, _unpack(archive, member, choices.budget)) if member else None

            return _assemble(placed, fetch, path, choices, counts)
    placed = _list_models(data, counts, choices.budget)
    companions = choices.companions_of(path)
    return _assemble(
        placed, lambda name: (name, companions.read(name)) if name else None, path, choices, counts
    )


def _choose(archive: ZipFile) -> list[str]:
    """Return an archive's first KML file, and all files of models."""
    names = [name for name in archive.namelist() if not Path(name).name.startswith(".")]
    notes = [name for name in names if name.lower().endswith(".kml")]
    return [*notes[:1], *(name for name in names if name.lower().endswith(MODELS))]


def _unpack(archive: ZipFile, name: str, budget: Budget) -> bytes:
    with BoundedStream(archive.open(name), budget) as file:
        return file.readall()


def _find_member(name: str, note: str, models: list[str]) -> str | None:
    """Find the model that a KML file means: by its path from there, else a model of that name."""
    if not name:
        return models[0] if models else None  # of writers that name none
    steps: list[str] = []
    for step in (PurePosixPath(note).parent / name).parts:
        if step == ".." and steps:
            steps.pop()
        elif step not in {"..", "."}:
            steps.append(step)
    whole, last = "/".join(steps), PurePosixPath(name).name
    alike = [member for member in models if PurePosixPath(member).name == last]
    return whole if whole in models else alike[0] if len(alike) == 1 else None


def _list_models(text: bytes, counts: Losses, budget: Budget) -> list[_KmlModel]:
    """List the models of a KML file; what else it draws is counted."""
    models: list[_KmlModel] = []
    path: list[str] = []
    words: list[str] = []

    def begin(name: str, _: object) -> None:
        word = name.rpartition(":")[2]
        path.append(word)
        words.clear()
        if word == "Model":
            budget.count("models of KML")
            models.append(_KmlModel())
        elif word in {"Polygon", "LineString", "NetworkLink", "GroundOverlay"}:
            counts.add(f"{word} left out", "/".join(path[-3:]))

    def take(piece: str) -> None:
        if "Model" in path[-4:] and sum(map(len, words)) < _LONGEST:
            words.append(piece)

    def end(_: str) -> None:
        last = path.pop()
        if "Model" in path[-2:]:
            key = last if path[-1] == "Model" else f"{path[-1]}/{last}"
            if key in _WORDS:
                models[-1].words.setdefault(key, "".join(words))
        words.clear()

    def refuse(*_: object) -> None:
        msg = "declares a document type, which KML does not need; remove it"
        raise InputError(msg)

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = take, refuse
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        msg = f"is damaged XML ({find_reason(error)}); export it again"
        raise InputError(msg) from error
    if not models:
        drawn = f" ({'; '.join(list_counts(counts))})" if counts else ""
        msg = f"is KML that places no model{drawn}; {_ADVICE}"
        raise InputError(msg)
    return models


def _assemble(
    placed: list[_KmlModel],
    fetch: Callable[[str], tuple[str, bytes] | None],
    path: Path,
    choices: ReadChoices,
    counts: Losses,
) -> FileModel:
    """Read each model once, and place it as often as the KML does."""
    read: dict[str, FileModel | None] = {}
    parts: list[Part] = []
    unique = UniqueNames()
    formats: list[str] = []
    first: _KmlModel | None = None
    for model in placed:
        name = model.name
        if re.match(r"\w{2,}:", name):
            counts.add("models on the network left out", name)
            continue
        if name not in read:
            read[name] = _read_model(name, fetch, path, choices)
        geometry = read[name]
        if geometry is None:
            counts.add("models that are not in the archive left out", name or "one without a file")
            continue
        first = first or model
        if not _is_level(model, first):
            counts.add("models at the first's height, as one is above the sea, one on land", name)
        formats.append(geometry.format)
        parts += _place(geometry, model, first, unique, choices.budget)
    if first is None:
        lost = "; ".join(list_counts(counts))
        msg = f"has none of the models that its KML places ({lost}); pack it again with them"
        raise InputError(msg)
    latitude, longitude = first.find_place()
    mode, altitude = _find_altitude(first)
    is_absolute = mode == "absolute" and altitude is not None
    rise = altitude or 0.0 if mode == "relativeToGround" else 0.0
    site = FilePlace(
        latitude, longitude, altitude if is_absolute else None, -first.heading % 360,
        None if is_absolute else 0.0 - rise, "as its KML places it",
        altitude=altitude if is_absolute else None,
    )  # fmt: skip
    notes = [note for geometry in read.values() if geometry is not None for note in geometry.notes]
    kinds = ", ".join(dict.fromkeys(formats))
    return FileModel(
        f"KML ({kinds})", tuple(parts), notes=(*notes, *list_counts(counts)), place=site
    )


def _find_altitude(model: _KmlModel) -> tuple[str, float | None]:
    """Return how a model stands, and its height [m]; on the ground unless it says otherwise."""
    mode = model.words.get("altitudeMode", "").strip() or "clampToGround"
    altitude = model.find("Location/altitude", math.nan)
    return mode, altitude if math.isfinite(altitude) else None


def _find_height(model: _KmlModel) -> float:
    """Return the height of a model above the sea or the ground [m]; 0 on the ground."""
    mode, altitude = _find_altitude(model)
    return 0.0 if mode == "clampToGround" else altitude or 0.0


def _is_level(model: _KmlModel, other: _KmlModel) -> bool:
    """Return whether the heights of two models begin at the same level: the sea, or the ground."""
    return (_find_altitude(model)[0] == "absolute") == (_find_altitude(other)[0] == "absolute")


def _read_model(
    name: str, fetch: Callable[[str], tuple[str, bytes] | None], path: Path, choices: ReadChoices
) -> FileModel | None:
    geometry = fetch(name)
    if geometry is None:
        return None
    inside, data = geometry
    with errors_of(f"its model '{inside[:80]}' "):
        if inside.lower().endswith(".gltf"):
            msg = "is glTF, whose files are not packed with it; make a GLB of it"
            raise InputError(msg)
        return read_gltf_content(data, path, choices) or read_collada(data, path, choices)


def _place(
    geometry: FileModel, model: _KmlModel, first: _KmlModel, unique: UniqueNames, budget: Budget
) -> Iterator[Part]:
    """Yield the parts of a model in the axes of the first one, about its origin [m]."""
    matrix = model.find_shape()
    if model is not first:
        turned = np.eye(4)
        turned[:3, :3] = _turn(-math.radians(model.heading), 0, 1)
        east, north = find_offset(first.find_place(), model.find_place())
        if not math.hypot(east, north) <= _FARTHEST:
            msg = f"places two models {math.hypot(east, north) / 1000:,.0f} km apart; split it"
            raise InputError(msg)
        up = _find_height(model) - _find_height(first) if _is_level(model, first) else 0.0
        turned[:3, 3] = east, north, up
        back = np.eye(4)
        back[:3, :3] = _turn(math.radians(first.heading), 0, 1)
        matrix = back @ turned @ matrix
    names: dict[str, str] = {}
    for part in geometry.parts:
        budget.count("parts")
        own = np.eye(4) if part.transform is None else part.transform
        if part.name not in names:
            names[part.name] = unique.add(part.name)
        yield replace(part, name=names[part.name], transform=matrix @ own, binding=None)
