"""
Scenes of files kept in the cache: the key of their content, and what they depend on besides.

The key is a digest of the files' bytes and names, the options, and the versions of umbra and of
its parsers. Files that models name, such as buffers and material libraries, are recorded with
the scene and checked for changes. Only text formats, which are slow to parse, are cached.
"""

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from umbra.readers.content import FileContent
from umbra.readers.model import ReadChoices
from umbra.scene import Scene
from umbra.version import __version__

if TYPE_CHECKING:
    from umbra.cache import Beside

__all__ = ["LEAST", "Files", "read_kept"]

Files = list[tuple[str, FileContent]]
"""Layers and their files."""

LEAST = 200_000
"""Files of fewer bytes are read in a few hundredths of a second."""

_ENDINGS = {".json", ".jsonl", ".cityjson", ".geojson", ".gml", ".ifc", ".obj", ".off"}
_PACKAGES = ("ifcopenshell", "lxml", "mapbox-earcut", "pyproj", "shapely")


def read_kept(
    files: Files, choices: ReadChoices, read: Callable[[Files, ReadChoices], Scene]
) -> Scene:
    """Take the scene of files from the cache, or read and store it."""
    key = _find_key(files, choices)
    if key is None:
        return read(files, choices)
    from umbra.cache import keep_scene, load_scene  # noqa: PLC0415 - only with a cache

    scene = load_scene(key, lambda beside: _are_current(beside, files, choices))
    if scene is None:
        choices.opened.clear()
        scene = read(files, choices)
        keep_scene(key, scene, _record(files, choices))
    return scene


def _find_key(files: Files, choices: ReadChoices) -> str | None:
    """Return the key of the scene that files make; None if it is not stored."""
    if any(file.path.suffix.lower() not in _ENDINGS for _, file in files):
        return None
    if sum(file.size for _, file in files) < LEAST:
        return None
    summed = sha256(f"{_find_versions()} {choices}".encode())
    for layer, file in files:
        for word in (layer, file.path.name, file.path.suffix):
            summed.update(f"{word!r} ".encode())
        summed.update(file.digest)
    return summed.hexdigest()


def _record(files: Files, choices: ReadChoices) -> "Beside":
    """Return each file named by a model: model, name, whether it was read, fingerprint."""
    number = {file.path: n for n, (_, file) in enumerate(files)}
    return [
        [
            number[companions.path],
            name,
            fingerprint is not None,
            fingerprint or companions.look(name, is_read=False),
        ]
        for companions in choices.opened
        for name, fingerprint in sorted(companions.record.items())
    ]


def _are_current(beside: "Beside", files: Files, choices: ReadChoices) -> bool:
    """Return whether the files named by models are unchanged."""
    return all(
        choices.companions_of(files[number][1].path).look(name, is_read=is_read) == word
        for number, name, is_read, word in beside
    )


def _find_versions() -> str:
    """Name the versions of umbra, of its readers' files and of the packages that read."""
    from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415 - only for a cache

    words = [__version__]
    house = Path(__file__).parents[1]
    for path in sorted(
        [*house.glob("readers/*.py"), *house.glob("scene/*.py"), house / "cache.py"]
    ):
        status = path.stat()
        words.append(f"{path.name} {status.st_size} {status.st_mtime_ns}")
    for package in _PACKAGES:
        try:
            words.append(version(package))
        except PackageNotFoundError:
            words.append("-")
    return " ".join(words)
