"""
Files of a results folder that carry their own checksum, and checksums of other files.

What a later run reads must be as it was written: a damaged file is found, and made again.
"""

import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import orjson

from umbra.errors import InputError
from umbra.folders.atomic import replace_file

__all__ = ["read_sealed", "refuse_links", "sum_files", "write_json", "write_sealed"]

_SEAL = "checksum"
_BLOCK = 1 << 24
OWN = (
    "study.zarr", "catalogue", "tiles", "geotiff", "3dtiles", "cityjson", "city.json",
    "failed.json", "verdicts",
)  # fmt: skip
"""What a run writes in its folder."""


def write_json(path: Path, facts: object, option: int = 0) -> None:
    """Replace a small file whole; ``option`` is orjson's."""
    with replace_file(path) as beside:
        beside.write_bytes(orjson.dumps(facts, option=option))


def write_sealed(path: Path, facts: dict[str, Any], option: int = 0) -> None:
    """Replace a JSON object whole, with its CRC-32 in it; ``option`` is orjson's."""
    write_json(path, _seal(facts), option)


def read_sealed(path: Path, option: int = 0) -> dict[str, Any] | None:
    """Return what ``write_sealed`` wrote; None if the file is missing or not as it was written."""
    try:
        data = path.read_bytes()
        facts = orjson.loads(data)
        facts.pop(_SEAL)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return facts if orjson.dumps(_seal(facts), option=option) == data else None


def _seal(facts: dict[str, Any]) -> dict[str, Any]:
    return {**facts, _SEAL: zlib.crc32(orjson.dumps(facts))}


def sum_files(paths: Iterable[Path]) -> int:
    """Return the CRC-32 of files with their names, in the order of their paths."""
    total = 0
    for path in sorted(paths):
        total = zlib.crc32(path.name.encode("utf-8", "surrogateescape"), total)
        with path.open("rb") as file:
            while data := file.read(_BLOCK):
                total = zlib.crc32(data, total)
    return total


def refuse_links(folder: Path) -> None:
    """
    Refuse a results folder with links in it: what is written through one lands elsewhere.

    Raises
    ------
    InputError
    """
    links: list[Path] = []
    for own in map(folder.joinpath, OWN):
        inside = () if own.is_symlink() else own.rglob("*")
        links += [path for path in (own, *inside) if path.is_symlink()]
    if links:
        msg = (
            f"'{folder}' holds {len(links)} links where a study in tiles keeps its files (first: "
            f"'{links[0]}'); remove them, or name another output folder"
        )
        raise InputError(msg, option="out", path=links[0])
