"""
What was counted for verdicts of a city, run by run, so that a run that was ended goes on.

Each piece is a file named by all that decides it: the study, the options and the receivers.
"""

import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.folders.atomic import replace_file

__all__ = ["PIECES", "VerdictPieces"]

PIECES = "verdicts"
"""Folder of the pieces."""

Arrays = dict[str, NDArray[Any]]


@dataclass(eq=False)
class VerdictPieces:
    """
    Pieces in the folder of a city's results.

    Parameters
    ----------
    folder : Path
    fingerprint : str
        Of the city: its files, and how they were read.
    """

    folder: Path
    fingerprint: str
    _used: set[str] = field(default_factory=set)

    def find(self, decides: object, points: NDArray, count: Callable[[], Arrays]) -> Arrays:
        """Return a piece that is kept, or count and keep it; ``decides`` is told by its repr."""
        summed = sha256(self.fingerprint.encode())
        summed.update(repr(decides).encode())
        summed.update(np.ascontiguousarray(points).tobytes())
        name = f"{summed.hexdigest()}.npz"
        self._used.add(name)
        path = self.folder / PIECES / name
        kept = _read(path, len(points))
        if kept is None:
            kept = count()
            path.parent.mkdir(parents=True, exist_ok=True)
            with replace_file(path) as beside, beside.open("wb") as file:
                np.savez(file, **kept)  # type: ignore[arg-type]
        return kept

    def drop_others(self) -> None:
        """Remove the pieces of other rules, receivers and files."""
        for path in (self.folder / PIECES).glob("*.npz"):
            if path.name not in self._used:
                path.unlink(missing_ok=True)


def _read(path: Path, count: int) -> Arrays | None:
    """
    Return the arrays of a file; None if there is none, it is damaged, or not of so many points.

    What is packed is not read: a file takes no more memory than it has bytes.
    """
    try:
        with zipfile.ZipFile(path) as packed:
            if any(info.compress_type != zipfile.ZIP_STORED for info in packed.infolist()):
                return None
        with np.load(path, allow_pickle=False) as file:
            kept = dict(file)
    except (OSError, ValueError, EOFError, MemoryError, zipfile.BadZipFile, zlib.error):
        return None
    return kept if all(values.shape[-1:] == (count,) for values in kept.values()) else None
