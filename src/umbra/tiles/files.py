"""The files of a city: names, folders and patterns."""

import glob
import os
from collections.abc import Sequence
from pathlib import Path

from umbra.errors import InputError
from umbra.readers.formats import BY_ENDING, FORMATS

__all__ = ["list_files"]

_PACKED = {".gz", ".zip", ".xml"}


def list_files(given: Sequence[str | os.PathLike[str]]) -> list[str]:
    """
    List the files of a city: names, folders (all files in them that umbra reads), and patterns.

    Parameters
    ----------
    given : sequence of str or path
        ``layer=FILE`` names a layer.

    Raises
    ------
    InputError
        If a folder or a pattern holds no file, or there is none at all.
    """
    found: list[str] = []
    for one in [os.fspath(path) for path in given]:
        path = Path(one)
        if path.is_dir():
            inside = sorted(str(p) for p in path.iterdir() if _is_model(p))
            if not inside:
                msg = f"{one}: the folder holds no model; name files, or a folder of {FORMATS}"
                raise InputError(msg, path=one)
            found += inside
        elif glob.has_magic(one) and not path.exists():
            inside = sorted(p for p in glob.glob(one, recursive=True) if Path(p).is_file())  # noqa: PTH207
            if not inside:
                msg = f"{one}: no file has such a name; check the pattern"
                raise InputError(msg, path=one)
            found += inside
        else:
            found.append(one)
    if not found:
        msg = f"no file given; name one or more of {FORMATS}, a folder or a pattern"
        raise InputError(msg)
    unique = dict.fromkeys(found)
    return list(unique)


def _is_model(path: Path) -> bool:
    return path.is_file() and path.suffix.lower() in {*BY_ENDING, *_PACKED}
