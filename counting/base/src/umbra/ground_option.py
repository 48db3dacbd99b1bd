"""A ground as a caller asks for it: a word, a height, or the file of a terrain."""

import math
import os

from umbra.errors import InputError, show_value

__all__ = ["FEET", "LEVEL", "Asked", "check_ground", "is_file"]

FEET, LEVEL = "feet", "level"
"""Words that ask for a surface through the feet, or for a plane at their median."""
Asked = float | str | None


def check_ground(name: str, ground: object) -> Asked:
    """
    Return a ground as asked for: a height [m], ``'feet'``, ``'level'``, a file's name, or None.

    Parameters
    ----------
    name : str
        Of the option.
    ground : float, str or path, optional

    Raises
    ------
    InputError
        If it is something else, or not finite.
    """
    if ground is None or isinstance(ground, str):
        if ground == "":
            msg = f"{name}= is an empty name; give 'feet', 'level', a height [m] or a terrain file"
            raise InputError(msg, option=name)
        return ground
    if isinstance(ground, os.PathLike):
        return os.fspath(ground)
    try:
        height = math.nan if isinstance(ground, bool) else float(ground)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        msg = f"{name} is 'feet', 'level', a height [m] or a terrain file; got {show_value(ground)}"
        raise InputError(msg, option=name) from None
    if not math.isfinite(height):
        msg = f"the ground's height must be a finite number; got {show_value(ground)}"
        raise InputError(msg, option=name, ground=ground)
    return height


def is_file(ground: object) -> bool:
    """Return whether a ground is the name of a file."""
    return isinstance(ground, str) and ground not in {FEET, LEVEL}
