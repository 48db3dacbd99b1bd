"""
Reading through the cache: which scenes are stored, and under which key.

The key sums up what a scene depends on: the files' bytes and names, the choices, and the
versions of umbra and of the packages that read. The files that models name, such as buffers
and material libraries, are recorded with the scene as they were, and looked at again. Kept
are scenes of text formats, which take long to parse; binary ones read as fast as a cache.
"""

from collections.abc import Callable
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from umbra import __version__
from umbra.cache import Beside, keep_scene, load_scene
from umbra.readers.model import ReadChoices
from umbra.scene import Scene

__all__ = ["LEAST", "read_kept"]

Files = list[tuple[str, Path, bytes]]

LEAST = 200_000
"""Files of fewer bytes are read in a few hundredths of a second."""

_ENDINGS = {".json", ".jsonl", ".cityjson", ".geojson", ".ifc", ".obj", ".off"}
_PACKAGES = ("ifcopenshell", "mapbox-earcut", "pyproj", "shapely")


def read_kept(
    files: Files, choices: ReadChoices, read: Callable[[Files, ReadChoices], Scene]
) -> Scene:
    """Take the scene of files (layer, path, content) from the cache, or read and store it."""
    key = _find_key(files, choices)
    if key is None:
        return read(files, choices)
    scene = load_scene(key, lambda beside: _are_current(beside, files, choices))
    if scene is None:
        choices.opened.clear()
        scene = read(files, choices)
        keep_scene(key, scene, _record(files, choices))
    return scene


def _find_key(files: Files, choices: ReadChoices) -> str | None:
    """Return the key of the scene that files make; None if it is not stored."""
    if any(path.suffix.lower() not in _ENDINGS for _, path, _ in files):
        return None
    if sum(len(data) for *_, data in files) < LEAST:
        return None
    summed = sha256(f"{_find_versions()} {choices}".encode())
    for layer, path, data in files:
        for word in (layer, path.name, path.suffix):
            summed.update(f"{word!r} ".encode())
        summed.update(sha256(data).digest())
    return summed.hexdigest()


def _record(files: Files, choices: ReadChoices) -> Beside:
    """Return each file that a model named: whose, its name, whether it was read, how it is."""
    number = {path: n for n, (_, path, _) in enumerate(files)}
    return [
        [number[one.path], name, found is not None, found or one.look(name, is_read=False)]
        for one in choices.opened
        for name, found in sorted(one.record.items())
    ]


def _are_current(beside: Beside, files: Files, choices: ReadChoices) -> bool:
    """Return whether the files that models named are as they were."""
    return all(
        choices.companions_of(files[number][1]).look(name, is_read=is_read) == word
        for number, name, is_read, word in beside
    )


def _find_versions() -> str:
    """Name what reads: umbra, the files of its readers as they stand, and packages."""
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
