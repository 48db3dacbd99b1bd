"""
Replace the files of a results folder only when all the new ones are complete.

A run writes into a temporary folder inside the results folder, so on the same file
system, and every file is renamed over its old namesake at the end. A lock file in the
temporary folder tells a live run from one that was killed: the system lets go of the
lock with the process, whatever ended it.
"""

import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from umbra.errors import InputError, UmbraError
from umbra.writers.beside import FULL

try:
    import fcntl
except ImportError:  # Windows has no fcntl; there an open file cannot be removed, which serves
    fcntl = None  # type: ignore[assignment]

__all__ = ["replace_results"]

PREFIX = ".umbra-unfinished-"
LOCK = ".lock"


@contextmanager
def replace_results(folder: str | os.PathLike[str]) -> Iterator[Path]:
    """
    Give a temporary folder whose files replace those of ``folder`` on success.

    On entry ``folder`` is made, with its parents, and tried: so enter before long work.
    On any exception, Ctrl-C included, the new files are dropped and the old ones stay
    whole; so they do when the process is killed, and a later run sweeps up after it.
    Files that the run did not write are not touched.

    Parameters
    ----------
    folder : path
        Where the results shall be in the end.

    Yields
    ------
    unfinished : Path
        Write here; subfolders are kept.

    Raises
    ------
    InputError
        If ``folder`` is a file, cannot be made or written to, or holds a folder by the
        name of a new file.
    UmbraError
        If the disk, or what the user may have of it, is full.
    """
    target = Path(folder).absolute()
    made = [path for path in (target, *target.parents) if not path.exists()]
    unfinished, lock = _make_unfinished(target)
    try:
        yield unfinished
        _move_files(unfinished, target)
    except OSError as error:
        if error.errno not in FULL:
            raise
        reason = (error.strerror or str(error)).lower()
        msg = (
            f"could not write the results to '{target}' ({reason}); free some space or name "
            "another folder; earlier results are as they were"
        )
        raise UmbraError(msg, path=target) from error
    finally:
        _remove_unfinished(unfinished, lock)
        for path in made:  # innermost first; a folder that holds anything stays
            with suppress(OSError):
                path.rmdir()


def _make_unfinished(target: Path) -> tuple[Path, IO[bytes]]:
    """Make the locked temporary folder in ``target``, or say why that cannot be."""
    if target.exists() and not target.is_dir():
        msg = f"'{target}' is a file, not a folder; name another output folder"
        raise InputError(msg, path=target)
    for attempts_left in reversed(range(20)):
        try:
            target.mkdir(parents=True, exist_ok=True)
            _remove_abandoned(target)
            unfinished = Path(tempfile.mkdtemp(prefix=PREFIX, dir=target))
            lock = (unfinished / LOCK).open("wb")
        except OSError as error:
            if isinstance(error, FileNotFoundError) and attempts_left:
                continue  # another run may have swept the folder away before it was locked
            reason = (error.strerror or str(error)).lower()
            msg = (
                f"cannot write to the output folder '{target}' ({reason}); "
                "name a folder that you may write to"
            )
            raise InputError(msg, path=target) from None
        if _lock(lock) is not False and (unfinished / LOCK).exists():
            break
        lock.close()
    return unfinished, lock


def _lock(file: IO[bytes]) -> bool | None:
    """Take a file's lock: True, False where a live process has it, None where none exist."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return None
    return True


def _remove_abandoned(target: Path) -> None:
    """Remove the temporary folders of runs that were killed; leave those of live ones."""
    for unfinished in target.glob(f"{PREFIX}*"):
        with suppress(OSError):
            if not (unfinished / LOCK).exists():
                unfinished.rmdir()  # refuses one that is not empty
                continue
            with (unfinished / LOCK).open("rb+") as lock:
                is_abandoned = _lock(lock)
            if fcntl is None:
                (unfinished / LOCK).unlink()  # raises while a live run holds it open
                is_abandoned = True
            if is_abandoned:
                _remove_unfinished(unfinished)


def _remove_unfinished(unfinished: Path, lock: IO[bytes] | None = None) -> None:
    """Remove a temporary folder, its lock last, so that a kill half way is swept up later."""
    with suppress(OSError):
        for path in unfinished.iterdir():
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            elif path.name != LOCK:
                path.unlink(missing_ok=True)
    if lock is not None:
        lock.close()
    with suppress(OSError):
        (unfinished / LOCK).unlink(missing_ok=True)
        unfinished.rmdir()


def _move_files(unfinished: Path, target: Path) -> None:
    """Rename every finished file over its old namesake, in one go."""
    names = [
        path.relative_to(unfinished)
        for path in sorted(unfinished.rglob("*"))
        if path.is_file() and path.name != LOCK
    ]
    for name in names:
        if (target / name).is_dir():
            msg = f"'{target / name}' is a folder where a result goes; remove or rename it"
            raise InputError(msg, path=target / name)
    with _hold_interrupts():
        for name in names:
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            (unfinished / name).replace(target / name)


@contextmanager
def _hold_interrupts() -> Iterator[None]:
    """Let Ctrl-C wait for the end of the block: half of the renames would mix two runs."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python interrupts the main thread only
        return
    held: list[int] = []
    previous = signal.signal(signal.SIGINT, lambda number, _frame: held.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
        if held:
            signal.raise_signal(signal.SIGINT)
