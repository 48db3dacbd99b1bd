"""The memory that reading one file takes, from its size: a file is read whole before it is cut."""

import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from umbra.errors import InputError
from umbra.machine import find_memory
from umbra.readers.content import GZIP, ZIP, FileContent
from umbra.readers.formats import find_format_kind, list_citygml_members

__all__ = ["check_reading"]

_OWN = 3e8  # of the process [byte]
_FACTORS = {"citygml": 2.5, "json": 22, "obj": 20, "glb": 20, "ply": 20, "off": 20, "stl": 9}
"""Memory for each byte of a file, measured and rounded up; other formats are read in pieces."""
_PACKED = 12  # bytes of CityGML for one that is compressed


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
    return content.size * (_PACKED if content.head.startswith(GZIP) else 1)
