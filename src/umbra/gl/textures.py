"""Pictures on surfaces, as the device samples them."""

from umbra.gl.context import Device
from umbra.scene import Image

__all__ = ["Texture"]

_TEXTURE0, _TEXTURE_2D, _SRGB8_ALPHA8 = 0x84C0, 0x0DE1, 0x8C43
_WRAPS = {"repeat": 0x2901, "mirror": 0x8370, "clamp": 0x812F}


class Texture:
    """
    An image with its smaller copies; decoded from sRGB when it is fetched.

    Parameters
    ----------
    device : Device
    image : Image
    wrap : (str, str), optional
        The image's own by default.

    Raises
    ------
    InputError
        If the image cannot be decoded.
    """

    def __init__(self, device: Device, image: Image, wrap: tuple[str, str] | None = None) -> None:
        pixels = image.pixels
        rows, cols = pixels.shape[:2]
        self._device = device
        self._texture = device.context.texture(
            (cols, rows), 4, pixels.tobytes(), internal_format=_SRGB8_ALPHA8
        )
        device.keep("texture", self._texture.glo)
        self._texture.build_mipmaps()
        self._texture.anisotropy = 8.0
        gl = device.gl
        gl.BindTexture(_TEXTURE_2D, self._texture.glo)
        for side, how in zip((0x2802, 0x2803), wrap or image.wrap, strict=True):
            gl.TexParameteri(_TEXTURE_2D, side, _WRAPS[how])
        gl.BindTexture(_TEXTURE_2D, 0)
        device.check(f"the texture '{image.name}' was uploaded")

    def bind(self, unit: int) -> None:
        """Let shaders find it at a texture unit."""
        self._device.gl.ActiveTexture(_TEXTURE0 + unit)
        self._device.gl.BindTexture(_TEXTURE_2D, self._texture.glo)

    def release(self) -> None:
        """Free it."""
        self._device.use()
        self._device.forget("texture", self._texture.glo)
        self._texture.release()
