"""
Which scenes are kept from run to run, and by which key.

The key sums up all that a scene depends on: the files' bytes and names, the choices, and
the versions of umbra and of the packages that read. Kept are scenes of text formats,
which take long to parse and are whole in themselves; binary ones read as fast as a cache.
"""

import re
from collections.abc import Callable
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from umbra import __version__
from umbra.cache import keep_scene, load_scene
from umbra.errors import InputError
from umbra.readers.companions import Companions
from umbra.readers.model import Choices
from umbra.scene import Scene

__all__ = ["LEAST", "read_kept"]

Files = list[tuple[str, Path, bytes]]

LEAST = 200_000
"""Files of fewer bytes are read in a few hundredths of a second."""

_ENDINGS = {".json", ".jsonl", ".cityjson", ".geojson", ".ifc", ".obj", ".off"}
_PACKAGES = ("ifcopenshell", "mapbox-earcut", "pyproj", "shapely")
_LIBRARY = re.compile(rb"^[ \t]*mtllib[ \t]+(.*)$", re.MULTILINE)


def read_kept(files: Files, choices: Choices, read: Callable[[Files, Choices], Scene]) -> Scene:
    """
    Take a scene from the cache, or read it and keep it there.

    Parameters
    ----------
    files : list of (str, Path, bytes)
        Layer, path and content of each.
    choices : Choices
    read : function of (files, choices) -> Scene

    Returns
    -------
    scene : Scene
    """
    key = _find_key(files, choices)
    if key is None:
        return read(files, choices)
    scene = load_scene(key)
    if scene is None:
        scene = read(files, choices)
        keep_scene(key, scene)
    return scene


def _find_key(files: Files, choices: Choices) -> str | None:
    """Give the key of the scene that files make; None if it is not to be kept."""
    if any(path.suffix.lower() not in _ENDINGS for _, path, _ in files):
        return None
    if sum(len(data) for *_, data in files) < LEAST:
        return None
    summed = sha256(f"{_find_versions()} {choices}".encode())
    for layer, path, data in files:
        beside = _read_libraries(path, data, choices) if path.suffix.lower() == ".obj" else []
        if beside is None:
            return None
        for word in (layer, path.name, path.suffix):
            summed.update(f"{word!r} ".encode())
        for content in (data, *beside):
            summed.update(sha256(content).digest())
    return summed.hexdigest()


def _read_libraries(path: Path, data: bytes, choices: Choices) -> list[bytes] | None:
    """Give the contents of an OBJ file's material libraries; None if they name textures."""
    companions = Companions(path, allow_outside=choices.allow_outside)
    contents = []
    for name in _LIBRARY.findall(data):
        try:
            text = companions.read(name.strip().decode().replace("\\", "/"))
        except InputError as error:
            text = str(error).encode()  # which the scene's notes say
        except UnicodeDecodeError:
            return None
        if b"map_" in text:
            return None
        contents.append(text)
    return contents


def _find_versions() -> str:
    """Name what reads: umbra, the files of its readers as they stand, and packages."""
    words = [__version__]
    for room in ("readers", "scene", "cache"):
        for path in sorted((Path(__file__).parents[1] / room).glob("*.py")):
            status = path.stat()
            words.append(f"{path.name} {status.st_size} {status.st_mtime_ns}")
    for package in _PACKAGES:
        try:
            words.append(version(package))
        except PackageNotFoundError:
            words.append("-")
    return " ".join(words)
