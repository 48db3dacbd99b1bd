"""Pictures of textures: PNG, JPEG and whatever else Pillow knows, decoded on demand."""

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene import Image

__all__ = ["encoded_image", "image_beside"]

REPEAT = ("repeat", "repeat")


def encoded_image(name: str, fetch: Callable[[], bytes], wrap: tuple[str, str] = REPEAT) -> Image:
    """
    Make an image that is fetched and decoded when its pixels are first asked for.

    Parameters
    ----------
    name : str
        For errors: file and texture.
    fetch : function of () -> bytes
        Of a PNG or JPEG file.
    wrap : (str, str)

    Returns
    -------
    image : Image
        Its ``pixels`` raise `InputError` if they cannot be decoded.
    """
    return Image(name, lambda: _decode(name, fetch), wrap)


def image_beside(path: Path, file: str, wrap: tuple[str, str] = REPEAT) -> Image | None:
    """Make an image of a file beside another; None where there is no such file."""
    beside = path.parent / file
    try:
        if not beside.is_file():
            return None
    except (OSError, ValueError):
        return None
    return encoded_image(f"{path.name}: {file}"[:120], beside.read_bytes, wrap)


def _decode(name: str, fetch: Callable[[], bytes]) -> NDArray[np.uint8]:
    import PIL.Image  # noqa: PLC0415 - only where a texture is drawn

    try:
        with PIL.Image.open(io.BytesIO(fetch())) as picture:
            return np.array(picture.convert("RGBA"))
    except (OSError, ValueError, SyntaxError, EOFError, PIL.Image.DecompressionBombError) as error:
        reason = " ".join(str(error).replace("<_io.BytesIO object at ", "<").split())[:100]
        if isinstance(error, PIL.UnidentifiedImageError):
            reason = "it is no picture that is known"
        msg = f"texture '{name}' cannot be read ({reason}); export it as PNG or JPEG"
        raise InputError(msg, texture=name) from error
