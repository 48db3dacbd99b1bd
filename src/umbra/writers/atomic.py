"""
Replace a file, or the files of a results folder, only when all that is new is complete.

A single file is written beside its old self and renamed. A run writes into a temporary folder
inside the results folder, so on the same file system, and every file is renamed over its old
namesake at the end.
"""

import errno
import os
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from umbra.errors import InputError, UmbraError
from umbra.writers.unfinished_folder import UnfinishedFolder, lock_folder

__all__ = ["FULL", "hold_signals", "replace_file", "replace_results"]

FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
"""Errors of a disk, or what a user may have of it, that is full."""


@contextmanager
def replace_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """
    Yield a temporary file beside ``path``, made on entry, that replaces it on success.

    Enter before long work, since the place is tried then. On any exception the new file is dropped
    and the old one stays whole. An `InputError` says that nothing can be written there, an
    `UmbraError` that the disk, or the user's share of it, is full.
    """
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
        if isinstance(error, FileExistsError):  # only where a file stands for a folder
            reason = f"'{target.parent}' is not a folder"
        msg = f"cannot write '{target}' ({reason}); choose another place"
        raise InputError(msg, path=target) from error
    try:
        yield Path(name)
        Path(name).replace(target)
    except OSError as error:
        if error.errno not in FULL:
            raise
        reason = (error.strerror or str(error)).lower()
        msg = f"could not write '{target}' ({reason}); free some space or choose another place"
        raise UmbraError(msg, path=target) from error
    finally:
        with suppress(OSError):
            Path(name).unlink()


KEPT = "earlier results are as they were"


@contextmanager
def replace_results(folder: str | os.PathLike[str]) -> Iterator[Path]:
    """
    Yield a temporary folder whose files, subfolders too, replace those of ``folder`` on success.

    On entry ``folder`` is made, with its parents, and tried: so enter before long work. On any
    exception, Ctrl-C included, the new files are dropped and the old ones stay whole; so they do
    when the process is killed, and a later run sweeps up after it. A run that is killed while it
    renames is finished by the next one into that folder. Ctrl-C and requests to end wait for the
    renames; two runs into one folder do them one after the other. Files that the run did not write
    are not touched.

    Raises
    ------
    InputError
        If ``folder`` is a file, cannot be made or written to, or holds a folder by the
        name of a new file.
    UmbraError
        If the disk, or what the user may have of it, is full.
    KeyboardInterrupt
        Its text says whether the earlier results or the new ones are there.
    """
    target = Path(folder).absolute()
    unfinished, made = _make_unfinished(target)
    is_moved = False
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
        if error.errno not in FULL and not unfinished.is_sealed:
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
    """Make the temporary folder, or say why that cannot be; tell which folders were missing."""
    try:
        if target.exists() and not target.is_dir():
            msg = f"'{target}' is a file, not a folder; name another output folder"
            raise InputError(msg, path=target)
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
    """Let Ctrl-C and requests to end wait for the end of the block; then they do what they do."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python lets the main thread alone answer signals
        return
    held: list[int] = []
    numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    previous = {}
    try:
        for number in numbers:
            # One that was ignored (nohup) stays so; one set by other than Python is left alone.
            if signal.getsignal(number) not in {signal.SIG_IGN, None}:
                previous[number] = signal.signal(number, lambda number, _: held.append(number))
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        for number in held:
            signal.raise_signal(number)
