"""
Checksums of the files that are written of each tile, in their folder.

A file of an earlier run is kept only if it is as it was written, of the same results.
"""

import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from umbra.tiles.sealed import read_sealed, sum_files, write_sealed

__all__ = ["SealedFiles"]

_NAME = "checksums.json"
_EACH = 10.0  # [s] after which the checksums are written again, so that a killed run keeps them


class SealedFiles:
    """
    Files of tiles in one folder; a context that writes their checksums at its end.

    Parameters
    ----------
    folder : Path
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / _NAME
        self._known: dict[str, Any] = read_sealed(self._path) or {}
        self._kept: dict[str, list[Any]] = {}
        self._due = time.monotonic() + _EACH

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self._known = {}  # files of tiles that are no more
        if self._kept:
            self._write()

    def is_whole(self, path: Path, mark: Path) -> bool:
        """Return whether a file is as it was written of a tile's results, which its mark names."""
        held = self._known.get(path.name)
        if held is None or not path.is_file() or held != [*_find_origin(mark), sum_files([path])]:
            return False
        self._kept[path.name] = held
        return True

    def add(self, path: Path, mark: Path) -> None:
        """Keep the checksum of a file that was written."""
        self._kept[path.name] = [*_find_origin(mark), sum_files([path])]
        if time.monotonic() > self._due:
            self._write()
            self._due = time.monotonic() + _EACH

    def _write(self) -> None:
        # Files that this run has not come to yet stay as they are known.
        write_sealed(self._path, {**self._known, **self._kept})


def _find_origin(mark: Path) -> list[Any]:
    """Return what names a tile's results: the fingerprint of its study, and their checksum."""
    facts = read_sealed(mark) or {}
    return [facts.get("study"), facts.get("files_checksum")]
