"""
Temporary folders inside a results folder: made, locked, sealed, cleaned up.

A lock file distinguishes a live run's folder from a killed run's: the system releases the
lock when the process ends. A seal, written when every file is complete, marks the files to
be moved: the next run finishes the renames of a killed one, and folders without a seal are
dropped.

The results folder may be untrusted. No link in it is followed, and only this user's folders
are cleaned up. A seal names the folder's inode, which no archive can carry.
"""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Self

from umbra.errors import InputError

try:
    import fcntl
except ImportError:  # Windows has no fcntl; there an open file cannot be removed, which serves
    fcntl = None  # type: ignore[assignment]

__all__ = ["UnfinishedFolder", "lock_folder"]

PREFIX = ".umbra-unfinished-"
LOCK, SEAL = ".lock", ".complete"
_BLOCKING_NOT = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0)


class UnfinishedFolder:
    """One run's temporary folder in a results folder, held by an open and locked file."""

    def __init__(self, path: Path, lock: IO[bytes]) -> None:
        self.path = path
        self._lock = lock

    @classmethod
    def make(cls, target: Path) -> Self:
        """Make the folder in ``target``, made if missing; clean up after killed runs."""
        for attempts_left in reversed(range(20)):
            try:
                target.mkdir(parents=True, exist_ok=True)
                path = Path(tempfile.mkdtemp(prefix=PREFIX, dir=target))
                lock = (path / LOCK).open("wb")
            except FileNotFoundError:
                if attempts_left:
                    continue  # another run may have swept the folder away before it was locked
                raise
            if _lock(lock) is not False and (path / LOCK).exists():
                break
            lock.close()
        made = cls(path, lock)
        try:
            with lock_folder(target):
                made.finish_others()
        except BaseException:
            made.remove()
            raise
        return made

    def check_places(self) -> None:
        """Refuse a folder where a file goes, or a file where a folder goes: InputError."""
        for name in self._names():
            place = self.path.parent / name
            if place.is_dir() and not place.is_symlink():
                msg = f"'{place}' is a folder where a result goes; remove or rename it"
                raise InputError(msg, path=place)
            for folder in place.relative_to(self.path.parent).parents[:-1]:
                there = self.path.parent / folder
                if there.is_symlink() or (there.exists() and not there.is_dir()):
                    msg = f"'{there}' is no folder, and results go into it; remove or rename it"
                    raise InputError(msg, path=there)

    def move(self) -> None:
        """Rename every file into the results folder; if killed, the next run finishes."""
        seal = self.path / SEAL
        if not self.is_sealed:
            unsealed = seal.with_suffix(".part")
            unsealed.write_text(self._word(), encoding="ascii")
            unsealed.replace(seal)
        for name in self._names():
            place = self.path.parent / name
            place.parent.mkdir(parents=True, exist_ok=True)
            (self.path / name).replace(place)
        seal.unlink()

    @property
    def is_sealed(self) -> bool:
        """Whether its files are complete and some may be moved already."""
        try:
            file = os.open(self.path / SEAL, os.O_RDONLY | _BLOCKING_NOT)
        except OSError:
            return False
        with open(file, "rb") as seal:  # noqa: PTH123 - a descriptor
            return seal.read(100) == self._word().encode()

    def remove(self) -> None:
        """Remove the folder, its lock last; files not moved stay for the next run."""
        if self.is_sealed:
            self._lock.close()
            return
        if fcntl is None:
            self._lock.close()  # an open file stays there
        # It follows no links, and takes no link for the folder.
        shutil.rmtree(self.path, ignore_errors=True)
        self._lock.close()

    def finish_others(self) -> None:
        """
        Finish the runs that were killed while they moved, drop those killed before.

        Live runs, links and other users' folders stay. Call with the results folder locked.
        """
        mine = self.path.lstat().st_uid
        for path in sorted(self.path.parent.glob(f"{PREFIX}*")):
            with suppress(FileNotFoundError):
                is_folder = path.is_dir() and not path.is_symlink()
                if path == self.path or not is_folder or path.lstat().st_uid != mine:
                    continue
                lock = _take_abandoned(path)
                if lock is None:
                    continue
                other = UnfinishedFolder(path, lock)
                try:
                    if other.is_sealed:
                        other.check_places()
                        other.move()
                finally:
                    other.remove()

    def _names(self) -> list[Path]:
        """Return the results, relative to the folder."""
        found = []
        for folder, _, names in os.walk(self.path):  # follows no links
            found += [(Path(folder) / name).relative_to(self.path) for name in names]
        own = {LOCK, SEAL, Path(SEAL).with_suffix(".part").name}
        return sorted(name for name in found if str(name) not in own)

    def _word(self) -> str:
        """Return the unique content of this folder's seal."""
        status = self.path.lstat()
        return f"{status.st_dev} {status.st_ino}"


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Lock a folder for this run: renames of two runs would mix."""
    if fcntl is None:
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


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


def _take_abandoned(path: Path) -> IO[bytes] | None:
    """Return the lock of a killed run's folder; None if the run lives, or the folder is gone."""
    lock = _open_lock(path)
    if lock is None:
        return None
    if fcntl is not None:
        if _lock(lock):
            return lock
        lock.close()
        return None
    lock.close()
    with suppress(OSError):
        (path / LOCK).unlink()  # raises while a live run holds it open
        return (path / LOCK).open("wb")
    return None


def _open_lock(path: Path) -> IO[bytes] | None:
    """Open the lock of a folder; make it if a killed run had none yet."""
    try:
        return open(os.open(path / LOCK, os.O_RDWR | _BLOCKING_NOT), "rb+")  # noqa: PTH123
    except FileNotFoundError:
        # Of a run that has just made it, or that was killed while it removed it.
        with suppress(OSError):
            path.rmdir()
            return None
        return None if (path / LOCK).exists() else (path / LOCK).open("wb")
    except OSError:  # a link, or another hand's
        return None
