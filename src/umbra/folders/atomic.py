"""
Atomic replacement of a file, or of a results folder's files.

A single file is written to a temporary file beside it, then renamed. A run writes into a
temporary folder inside the results folder, so on the same file system, and renames every file
over the old one at the end.
"""

import errno
import os
import re
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from umbra.errors import InputError, UmbraError
from umbra.folders.unfinished_folder import UnfinishedFolder, lock_folder
from umbra.option_fields import read_path

__all__ = [
    "NO_LOCKS",
    "check_folder_name",
    "check_is_here",
    "hold_signals",
    "is_full",
    "replace_file",
    "replace_results",
]

_ADDRESS = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+):/+(.*)", re.DOTALL)
"""Such as s3://bucket/x; a drive of Windows has one letter, and a Path one slash."""


def check_is_here(path: str | os.PathLike[str]) -> None:
    """Refuse the address of a store elsewhere, which would become a folder named ``s3:``."""
    is_path = isinstance(path, (str, os.PathLike))  # a null byte is reported on writing
    address = _ADDRESS.fullmatch(str(path if is_path else read_path("out", path)))
    if address:
        msg = (
            f"out='{address[1]}://{address[2]}' is an address, and umbra writes to this machine's "
            "files; name a file or folder, and copy it there afterwards"
        )
        raise InputError(msg, option="out", path=path)


_OF_FILES = {
    ".csv", ".dxf", ".geojson", ".gif", ".glb", ".gpkg", ".html", ".json", ".mp4", ".nc", ".pdf",
    ".png", ".svg", ".tif", ".tiff", ".toml",
}  # fmt: skip
"""Endings that no folder of results has."""


def check_folder_name(folder: Path) -> None:
    """Refuse a new folder of results that is named as a file, such as ``out.png``."""
    if folder.suffix.lower() in _OF_FILES and not folder.exists():
        msg = (
            f"'{folder.name}' names a file, and results are several files in a folder; name a "
            f"folder, such as '{folder.stem}' (in Python, study.plot().save('{folder.stem}.png') "
            "writes one picture)"
        )
        raise InputError(msg, option="out", path=folder)


def is_full(error: OSError) -> bool:
    """Return whether a disk or quota is full; numpy's errors have no number."""
    is_of_numpy = error.errno is None and "requested and" in str(error)
    return is_of_numpy or error.errno in {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


@contextmanager
def replace_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """
    Yield a temporary file beside ``path``, made on entry, that replaces it on success.

    Enter before long work: write access is checked on entry. On any exception the new file is
    dropped and the old one kept. Raises InputError if the path is an address or cannot be written,
    UmbraError if the disk or quota is full.
    """
    check_is_here(path)
    target = Path(path)
    try:
        if target.is_dir():
            raise IsADirectoryError(21, "it is a folder")
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(target.suffix, f".{target.stem}-", target.parent)
        os.close(handle)
        mask = os.umask(0)
        os.umask(mask)
        Path(name).chmod(0o666 & ~mask)  # as any new file; mkstemp's are private
    except (OSError, ValueError) as error:  # ValueError: a null byte in its name
        reason = getattr(error, "strerror", None) or str(error)
        if isinstance(error, FileExistsError):  # only if a file has a folder's name
            reason = f"'{target.parent}' is not a folder"
        msg = f"cannot write '{target}' ({reason}); choose another place"
        raise InputError(msg, path=target) from error
    try:
        yield Path(name)
        Path(name).replace(target)
    except OSError as error:
        if not is_full(error):
            raise
        reason = (error.strerror or str(error)).lower()
        msg = f"could not write '{target}' ({reason}); free some space or choose another place"
        raise UmbraError(msg, path=target) from error
    finally:
        with suppress(OSError):
            Path(name).unlink()


NO_LOCKS = (
    "note: the file system of '{folder}' has no locks, as some network folders; another run into "
    "it at the same time is not noticed, and their files would mix"
)
KEPT = "earlier results are unchanged"


@contextmanager
def replace_results(
    folder: str | os.PathLike[str], say: Callable[[str], object] = lambda _line: None
) -> Iterator[Path]:
    """
    Yield a temporary folder whose files, subfolders too, replace those of ``folder`` on success.

    Enter before long work: ``folder`` is made, with its parents, and checked on entry. On any
    exception, including Ctrl-C, the new files are dropped and the old ones kept; likewise if the
    process is killed, and a later run cleans up. Renames of a killed run are finished by the next
    one. Ctrl-C and termination wait for the renames. Files that the run did not write are not
    touched. Where the file system has no locks, another run is not noticed, and ``say`` is called
    with a line about it.

    Raises
    ------
    InputError
        If ``folder`` is an address or a file, cannot be made or written to, or holds a folder
        by the name of a new file, or if another run writes into it.
    UmbraError
        If the disk or quota is full.
    KeyboardInterrupt
        Its text states whether the earlier or the new results are in place.
    """
    check_is_here(folder)
    target = Path(folder).absolute()
    unfinished, made = _make_unfinished(target)
    is_moved = False
    if not unfinished.is_alone:
        say(NO_LOCKS.format(folder=target))
    try:
        yield unfinished.path
        unfinished.check_places()
        with lock_folder(target), hold_signals():
            unfinished.finish_others()
            unfinished.move()
            is_moved = True
            unfinished.remove()
    except KeyboardInterrupt as error:
        held = f"the new results in '{target}' are complete" if is_moved else KEPT
        raise KeyboardInterrupt(held) from error
    except OSError as error:
        if not is_full(error) and not unfinished.is_sealed:
            raise
        reason = (error.strerror or str(error)).lower()
        msg = f"could not write the results to '{target}' ({reason}); "
        if unfinished.is_sealed:
            msg += "some are in place and the next run into that folder moves the others there"
        else:
            msg += f"free some space or name another folder; {KEPT}"
        raise UmbraError(msg, path=target) from error
    finally:
        if not is_moved:
            unfinished.remove()
            for path in made:  # innermost first; a folder that holds anything stays
                with suppress(OSError):
                    path.rmdir()


def _make_unfinished(target: Path) -> tuple[UnfinishedFolder, list[Path]]:
    """Make the temporary folder; return it and the folders that were missing."""
    try:
        if target.exists() and not target.is_dir():
            msg = f"'{target}' is a file, not a folder; name another output folder"
            raise InputError(msg, path=target)
        check_folder_name(target)
        made = [path for path in (target, *target.parents) if not path.exists()]
        return UnfinishedFolder.make(target), made
    except (OSError, ValueError) as error:  # ValueError: a null byte in its name
        if isinstance(error, InputError):
            raise
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        msg = (
            f"cannot write to the output folder '{target}' ({reason}); "
            "name a folder that you may write to"
        )
        raise InputError(msg, path=target) from None


_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # Windows has the last instead of SIGHUP


@contextmanager
def hold_signals() -> Iterator[None]:
    """Delay Ctrl-C and termination signals until the end of the block."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only Python's main thread handles signals
        return
    held: list[int] = []
    numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    previous = {}
    try:
        for number in numbers:
            # Ignored signals (nohup) stay so; handlers not set by Python are kept.
            if signal.getsignal(number) not in {signal.SIG_IGN, None}:
                previous[number] = signal.signal(number, lambda number, _: held.append(number))
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        for number in held:
            signal.raise_signal(number)
