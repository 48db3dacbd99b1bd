"""Writing one file beside its old self, then renaming it."""

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from umbra.errors import InputError, UmbraError

__all__ = ["FULL", "replace_file"]

FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
"""Errors of a disk, or what a user may have of it, that is full."""


@contextmanager
def replace_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """
    Give a temporary file beside ``path`` that replaces it on success.

    The place is tried on entry, so enter before long work. On any exception the new
    file is dropped and the old one stays whole.

    Parameters
    ----------
    path : path
        Its folder is made if missing.

    Yields
    ------
    unfinished : Path
        Write here.

    Raises
    ------
    InputError
        If nothing can be written there.
    UmbraError
        If the disk, or what the user may have of it, is full.
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
