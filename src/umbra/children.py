"""
Child processes of umbra, which import nothing from the current folder.

Python looks for modules in the current folder when it is given ``-c`` or ``-m``, and
numba and matplotlib look there for settings. The folder may be a stranger's, unpacked to
see what his model is; so a child imports from where this process does, less that folder,
and stands in umbra's own.
"""

import os
import sys
from pathlib import Path

__all__ = ["HOME", "make_command"]

HOME = Path(__file__).parent
"""Where children stand, so paths that they are given must be absolute."""


def make_command(code: str, *arguments: str) -> list[str]:
    """
    Make the command of a child that runs a few statements; start it in ``HOME``.

    What the current folder holds is not imported, unless ``PYTHONPATH`` names it or umbra itself
    lies there. Arguments are its ``sys.argv[1:]``.
    """
    path = [entry for entry in sys.path if entry and not _is_here(entry)]
    root = str(HOME.parent)
    if root not in path:
        path.append(root)
    # Python's own folders, should one be the current folder, come back from the child's path.
    start = f"import sys; p = {path!r}; sys.path[:] = p + [e for e in sys.path if e not in p]"
    return [sys.executable, "-P", "-c", f"{start}\n{code}", *arguments]


def _is_here(entry: str) -> bool:
    """Return whether an entry of ``sys.path`` is the current folder."""
    try:
        return Path(entry).samefile(os.curdir)
    except OSError:  # it is not there, or the current folder is not
        return False
