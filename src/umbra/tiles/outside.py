"""Files of a city that lie outside the region that is read: named once, not read again."""

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from umbra.tiles.sealed import read_sealed

__all__ = ["OUTSIDE", "name_as_read", "read_outside", "tell_reading"]

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
    told = {name: value for name, value in options.items() if name != "cache"}
    try:
        path = Path(str(told.get("area") or ""))
        if path.is_file():
            told["area"] = f"{path} sha256:{sha256(path.read_bytes()).hexdigest()}"
    except (OSError, ValueError):  # a polygon as text, not a name
        pass
    return repr(sorted(told.items()))
