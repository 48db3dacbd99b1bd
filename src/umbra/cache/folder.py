"""
The cache's folder: arrays by name, bounded, safe to lose.

Every file is numpy's ``.npz`` without pickles, written beside and renamed, so that runs at
one time and runs that are killed leave whole files only. A file that cannot be read is
removed and made anew. Nothing here fails: where nothing can be kept, nothing is kept.
"""

import os
import shutil
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["LIMIT", "drop", "find_folder", "keep", "load", "measure"]

LIMIT = 1_000_000_000
"""The files together have at most so many bytes, and so many stay free on the disk."""

_ENDING, _UNFINISHED = ".npz", ".unfinished"
_ABANDONED = 3600.0  # a file that was not finished in so long is of a run that was killed [s]


def find_folder() -> Path:
    """Give the folder: what ``UMBRA_CACHE`` says, else the user's cache folder of this system."""
    given = os.environ.get("UMBRA_CACHE")
    if given:
        return Path(given).absolute()
    from platformdirs import user_cache_path  # noqa: PLC0415 - only where it is asked

    return user_cache_path("umbra", appauthor=False)


def load(name: str) -> dict[str, NDArray] | None:
    """Give the arrays that were kept by a name; None if there are none, or not whole (CRC-32)."""
    try:
        with _find_path(name).open("rb") as file, np.load(file, allow_pickle=False) as found:
            arrays = {key: found[key] for key in found.files}
    except FileNotFoundError:
        return None
    except Exception:  # noqa: BLE001 - damage can raise anything
        drop(name)
        return None
    with suppress(OSError):
        os.utime(_find_path(name))  # what is used stays longest
    return arrays


def keep(name: str, arrays: Mapping[str, NDArray]) -> None:
    """Keep arrays by a name, if there is room; then let the oldest go."""
    size = sum(array.nbytes for array in arrays.values())
    if size > LIMIT // 4:
        return
    unfinished = None
    try:
        folder = find_folder()
        if not folder.is_absolute():
            return  # of a user without a home
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if shutil.disk_usage(folder).free < size + LIMIT:
            return
        handle, unfinished = tempfile.mkstemp(_UNFINISHED, dir=folder)
        with os.fdopen(handle, "wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]
        Path(unfinished).replace(_find_path(name))
        _sweep(folder)
    except OSError:
        pass  # a cache that cannot be written is none
    finally:
        if unfinished is not None:
            with suppress(OSError):
                Path(unfinished).unlink()


def drop(name: str) -> None:
    """Remove what was kept by a name."""
    with suppress(OSError):
        _find_path(name).unlink()


def measure() -> tuple[int, int]:
    """Give the number of files, and what they take [byte]."""
    sizes = [size for _, size, _ in _list(find_folder())]
    return len(sizes), sum(sizes)


def _find_path(name: str) -> Path:
    return find_folder() / f"{name}{_ENDING}"


def _list(folder: Path) -> list[tuple[float, int, Path]]:
    """Give when each file was last used, its bytes and its path."""
    found = []
    with suppress(OSError):
        for path in folder.glob(f"*{_ENDING}"):
            with suppress(OSError):  # another run may have removed it
                status = path.stat()
                found.append((status.st_mtime, status.st_size, path))
    return found


def _sweep(folder: Path) -> None:
    """Remove the files that were not used for longest, and those of killed runs."""
    files = sorted(_list(folder), key=lambda one: one[0])
    excess = sum(size for _, size, _ in files) - LIMIT
    for _, size, path in files:
        if excess <= 0:
            break
        excess -= size
        with suppress(OSError):
            path.unlink()
    for path in folder.glob(f"*{_UNFINISHED}"):
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > _ABANDONED:
                path.unlink()
