"""Writing one file beside its old self, then renaming it."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from umbra.errors import InputError

__all__ = ["replace_file"]


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
    except OSError as error:
        reason = error.strerror or str(error)
        if isinstance(error, FileExistsError):  # only where a file stands for a folder
            reason = f"'{target.parent}' is not a folder"
        msg = f"cannot write '{target}' ({reason}); choose another place"
        raise InputError(msg, path=target) from error
    try:
        yield Path(name)
        Path(name).replace(target)
    finally:
        with suppress(OSError):
            Path(name).unlink()
