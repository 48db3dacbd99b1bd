"""
A place for compiled kernels, if numba finds none.

numba keeps them beside the source, else in the user's cache folder, and refuses to compile
where it can write to neither: in a container that is read-only, of a user without a home.
"""

import atexit
import os
import shutil
import tempfile
from functools import cache
from importlib import import_module
from pathlib import Path

from umbra.children import HOME

__all__ = ["find_kernel_cache"]


@cache
def find_kernel_cache() -> str | None:
    """Make kernels compile wherever umbra runs; return a note if they cannot be stored."""
    if os.environ.get("NUMBA_CACHE_DIR") or _is_writable(HOME / "cpu") or _has_user_folder():
        return None
    try:
        folder = tempfile.mkdtemp(prefix="umbra-kernels-")
    except OSError:
        dispatcher = import_module("numba.core.dispatcher").Dispatcher
        dispatcher.enable_caching = lambda _: None
    else:
        os.environ["NUMBA_CACHE_DIR"] = folder  # for children, too
        atexit.register(_remove, folder, os.getpid())
    return (
        "compiled kernels cannot be kept beside umbra or in a home folder, so every run compiles "
        "them anew, for about a minute; set NUMBA_CACHE_DIR to a folder that may be written to"
    )


def _is_writable(folder: Path) -> bool:
    kept = folder / "__pycache__"
    return os.access(kept if kept.exists() else folder, os.W_OK)


def _has_user_folder() -> bool:
    from platformdirs import user_cache_path  # noqa: PLC0415 - only where it is asked

    folder = user_cache_path("numba", appauthor=False)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return folder.is_absolute() and os.access(folder, os.W_OK)


def _remove(folder: str, owner: int) -> None:
    if os.getpid() == owner:  # not a fork of it
        shutil.rmtree(folder, ignore_errors=True)
