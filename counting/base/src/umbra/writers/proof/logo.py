"""An office's logo: a PNG that was named, small, and nothing else."""

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError

__all__ = ["read_logo"]

_LARGEST = 2_000_000  # [byte]
_WIDEST = 3000  # [pixel]
_PNG = b"\x89PNG\r\n\x1a\n"


def read_logo(path: Path) -> NDArray[np.uint8]:
    """
    Read a logo.

    Parameters
    ----------
    path : Path

    Returns
    -------
    image : (rows, cols, 4) uint8
        Row 0 the top.

    Raises
    ------
    InputError
        If it is no PNG, or too large. SVG may hold scripts and addresses and is refused.
    """
    from PIL import Image  # noqa: PLC0415

    try:
        with path.open("rb") as file:
            data = file.read(_LARGEST + 1)
    except OSError as error:
        msg = f"cannot read the logo '{path}' ({error.strerror}); check the name"
        raise InputError(msg, option="logo") from error
    if len(data) > _LARGEST:
        msg = f"the logo '{path}' is larger than {_LARGEST / 1e6:g} MB; give a smaller one"
        raise InputError(msg, option="logo")
    if not data.startswith(_PNG):
        msg = f"the logo '{path}' is not a PNG; export it as one"
        raise InputError(msg, option="logo")
    try:
        with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
            size = image.size
            pixels = np.asarray(image.convert("RGBA")) if max(size) <= _WIDEST else None
    except Exception as error:
        msg = f"the logo '{path}' is damaged ({error}); export it again"
        raise InputError(msg, option="logo") from error
    if pixels is None:
        msg = f"the logo '{path}' has {size[0]} x {size[1]} pixels; give {_WIDEST} at most"
        raise InputError(msg, option="logo")
    return pixels
