"""Pictures of textures: PNG, JPEG and whatever else Pillow knows, decoded on demand."""

import io
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.companions import Companions
from umbra.scene import Image

__all__ = ["encoded_image", "image_beside"]

REPEAT = ("repeat", "repeat")
LARGEST = 1 << 28  # [byte] of a picture's file

# Not all that Pillow opens: for PostScript it would run a program.
FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA", "GIF", "TIFF", "DDS", "PPM", "JPEG2000")


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


def image_beside(companions: Companions, file: str, wrap: tuple[str, str] = REPEAT) -> Image:
    """
    Make an image of a file beside a model.

    Raises
    ------
    InputError
        If there is no such file, or it is none that may be read (`OutsideError`).
    """
    companions.find(file)  # told now, and looked at again when it is read
    name = f"{companions.path.name}: {file}"[:120]
    return encoded_image(name, lambda: companions.read(file, LARGEST), wrap)


def _decode(name: str, fetch: Callable[[], bytes]) -> NDArray[np.uint8]:
    import PIL.Image  # noqa: PLC0415 - only where a texture is drawn

    try:
        with PIL.Image.open(io.BytesIO(fetch()), formats=FORMATS) as picture:
            return np.array(picture.convert("RGBA"))
    except InputError as error:
        msg = f"texture {error}"
        raise InputError(msg, texture=name, **error.data) from error
    except (OSError, ValueError, SyntaxError, EOFError, PIL.Image.DecompressionBombError) as error:
        reason = " ".join(str(error).replace("<_io.BytesIO object at ", "<").split())[:100]
        if isinstance(error, PIL.UnidentifiedImageError):
            reason = "it is no picture that is known"
        msg = f"texture '{name}' cannot be read ({reason}); export it as PNG or JPEG"
        raise InputError(msg, texture=name) from error
