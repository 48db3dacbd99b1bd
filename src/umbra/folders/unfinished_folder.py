"""
Temporary folders inside a results folder: made, locked, sealed, cleaned up.

A lock file distinguishes a live run's folder from a killed run's: the system releases the
lock when the process ends. A second run is refused while the first is running. A seal, written when
every file is complete, marks the files to be moved: the next run finishes the renames of a
killed one, and folders without a seal are dropped.

The results folder may be untrusted. No link in it is followed, and only this user's folders
are cleaned up. A seal names the folder's inode, which no archive can carry.
"""

import os
import re
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, Self

from umbra.errors import InputError

try:
    import fcntl
except ImportError:  # Windows has no fcntl; there an open file cannot be removed, which serves
    fcntl = None  # type: ignore[assignment]

__all__ = ["UnfinishedFolder", "lock_folder", "make_refusal", "sign", "take_lock"]

_LOCKED = 1 << 30  # the byte that a run locks on Windows
PREFIX = ".umbra-unfinished-"
LOCK, SEAL = ".lock", ".complete"
_BLOCKING_NOT = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0)


class UnfinishedFolder:
    """
    One run's temporary folder in a results folder, held by an open and locked file.

    ``is_alone`` is whether the file system keeps other runs away while this one lives.
    """

    def __init__(self, path: Path, lock: IO[bytes], *, is_alone: bool = True) -> None:
        self.path, self.is_alone = path, is_alone
        self._lock = lock

    @classmethod
    def make(cls, target: Path) -> Self:
        """
        Make the folder in ``target``, made if missing; clean up after killed runs.

        Raises InputError if another run into ``target`` lives.
        """
        for attempts_left in reversed(range(20)):
            try:
                target.mkdir(parents=True, exist_ok=True)
                with lock_folder(target):
                    return cls._make_alone(target)
            except FileNotFoundError:
                if not attempts_left:
                    raise  # another run may have removed the folder that it had made
        raise AssertionError

    @classmethod
    def _make_alone(cls, target: Path) -> Self:
        """Make the folder if no other run is active. Call with ``target`` locked."""
        path = Path(tempfile.mkdtemp(prefix=PREFIX, dir=target))
        lock = (path / LOCK).open("wb")
        made = cls(path, lock, is_alone=take_lock(lock) is not None)
        sign(lock)
        try:
            live = made.finish_others()
        except BaseException:
            made.remove()
            raise
        if live:
            made.remove()
            raise make_refusal(live[0] / LOCK, target)
        return made

    def check_places(self) -> None:
        """Refuse a folder where a file goes, or a file where a folder goes: InputError."""
        for name in self._names():
            path = self.path.parent / name
            if path.is_dir() and not path.is_symlink():
                msg = f"'{path}' is a folder where a result goes; remove or rename it"
                raise InputError(msg, path=path)
            for folder in path.relative_to(self.path.parent).parents[:-1]:
                there = self.path.parent / folder
                if there.is_symlink() or (there.exists() and not there.is_dir()):
                    msg = f"'{there}' is not a folder, and results go into it; remove or rename it"
                    raise InputError(msg, path=there)

    def move(self) -> None:
        """Rename every file into the results folder; if killed, the next run finishes."""
        seal = self.path / SEAL
        if not self.is_sealed:
            unsealed = seal.with_suffix(".part")
            unsealed.write_text(self._word(), encoding="ascii")
            unsealed.replace(seal)
        for name in self._names():
            target = self.path.parent / name
            target.parent.mkdir(parents=True, exist_ok=True)
            (self.path / name).replace(target)
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

    def finish_others(self) -> list[Path]:
        """
        Finish the runs that were killed while they moved, drop those killed before.

        Links and other users' folders stay, and those of live runs, which are returned. Call with
        the results folder locked.
        """
        user, live = self.path.lstat().st_uid, []
        for path in sorted(self.path.parent.glob(f"{PREFIX}*")):
            with suppress(FileNotFoundError):
                is_folder = path.is_dir() and not path.is_symlink()
                if path == self.path or not is_folder or path.lstat().st_uid != user:
                    continue
                lock = _take_abandoned(path)
                if isinstance(lock, bool):
                    live += [path] if lock else []
                    continue
                other = UnfinishedFolder(path, lock)
                try:
                    if other.is_sealed:
                        other.check_places()
                        other.move()
                finally:
                    other.remove()
        return live

    def _names(self) -> list[Path]:
        """Return the results, relative to the folder."""
        paths = []
        for folder, _, names in os.walk(self.path):  # follows no links
            paths += [(Path(folder) / name).relative_to(self.path) for name in names]
        own = {LOCK, SEAL, Path(SEAL).with_suffix(".part").name}
        return sorted(name for name in paths if str(name) not in own)

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


def take_lock(file: IO[bytes]) -> bool | None:
    """Take a file's lock: True, False where a live process has it, None where none exist."""
    if fcntl is None:
        return _take_on_windows(file)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return None
    return True


def _take_on_windows(file: IO[bytes]) -> bool | None:
    """Take the lock of a byte far beyond the file's end: locked bytes cannot be read."""
    import msvcrt  # noqa: PLC0415

    windows: Any = msvcrt  # other systems' type checkers know nothing of it
    position = file.tell()
    try:
        file.seek(_LOCKED)
        windows.locking(file.fileno(), windows.LK_NBLCK, 1)
    except PermissionError:
        return False
    except OSError:
        return None
    finally:
        file.seek(position)
    return True


def sign(lock: IO[bytes]) -> None:
    """Write this process into its lock file."""
    lock.truncate(0)
    lock.write(f"{os.getpid()} {socket.gethostname()}\n".encode())
    lock.flush()


def make_refusal(lock: Path, folder: Path) -> InputError:
    """Return the error of a run into a folder that another run holds, by its lock file."""
    msg = f"{_describe(lock)} writes into '{folder}'; wait for its end, or name another folder"
    return InputError(msg, option="out", path=folder)


def _describe(path: Path) -> str:
    """Name the run that holds a lock file: its process and, if another, its machine."""
    with suppress(OSError):
        with open(os.open(path, os.O_RDONLY | _BLOCKING_NOT), "rb") as file:  # noqa: PTH123
            match = re.match(rb"(\d{1,9}) ([\w.-]{1,64})\n$", file.read(100))
        if match:
            number, machine = (part.decode() for part in match.groups())
            return f"another run (process {number}" + (
                ")" if machine == socket.gethostname() else f" on {machine})"
            )
    return "another run"


def _take_abandoned(path: Path) -> IO[bytes] | bool:
    """Return the lock of a killed run's folder; True if the run is active, False if unknown."""
    lock = _open_lock(path)
    if lock is None:
        return False
    if fcntl is not None:
        taken = take_lock(lock)
        if taken:
            return lock
        lock.close()
        return taken is False
    lock.close()
    try:
        (path / LOCK).unlink()  # raises while a live run holds it open
    except OSError as error:
        return isinstance(error, PermissionError)
    return (path / LOCK).open("wb")


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
    except OSError:  # a link, or another user's
        return None
