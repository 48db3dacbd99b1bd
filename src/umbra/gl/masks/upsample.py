"""Laying a mask of fewer pixels over a picture."""

import numpy as np

from umbra.gl.context import Device
from umbra.gl.indices import draw_plain
from umbra.gl.masks.tally import Tally
from umbra.gl.programs import Program
from umbra.gl.projection import Projection
from umbra.gl.state import Pass, State
from umbra.gl.surfaces import find_rays
from umbra.gl.target import Target

__all__ = ["FILTERS", "Upsampler"]

FILTERS = ("nearest", "bilinear", "joint")
"""``joint`` is bilinear between pixels that lie in the plane of what is seen."""

_TEXTURE0, _TEXTURE_2D, _LINEAR = 0x84C0, 0x0DE1, 0x2601


class Upsampler:
    """
    Multiplies a picture by a mask.

    Parameters
    ----------
    device : Device
    kind : str
        Of ``FILTERS``.
    is_plain : bool
        Masks hold 0 and 1 in eight bits: the texture unit can do what is bilinear.
    """

    def __init__(self, device: Device, kind: str, *, is_plain: bool = False) -> None:
        self._device, self.kind = device, kind
        self._is_linear = is_plain and kind == "bilinear"
        needs = {"IS_JOINT": kind == "joint", "IS_LINEAR": self._is_linear}
        defines = {name: 1 for name, needed in needs.items() if needed}
        self._program = Program(device, "picture.vert.glsl", "upsample.frag.glsl", defines)

    def apply(
        self,
        state: State,
        projection: Projection,
        mask: Target,
        picture: Target,
        tally: Tally,
        *,
        channel: int,
        lit: tuple[float, float],
        dark: float,
    ) -> None:
        """
        Multiply the target in use, one rectangle.

        Parameters
        ----------
        state : State
        projection : Projection
            Of the picture.
        mask, picture : Target
            Attachment 0 of the mask holds it; attachments 1 of both hold normals and keys
            where the filter asks for them.
        tally : Tally
        channel : int
            Of the mask.
        lit : (float, float)
            Between which what is lit lies.
        dark : float
            By which what is in shadow is multiplied.
        """
        state.use(Pass(color_write="rgb", blend="multiply"))
        textures = [mask.textures[0]]
        if self.kind == "joint":
            textures += [picture.textures[1], mask.textures[1]]
        for unit, texture in enumerate(textures):
            self._device.gl.ActiveTexture(_TEXTURE0 + unit)
            self._device.gl.BindTexture(_TEXTURE_2D, texture)
        if self._is_linear:
            self._device.gl.ActiveTexture(_TEXTURE0)
            for parameter in (0x2800, 0x2801):
                self._device.gl.TexParameteri(_TEXTURE_2D, parameter, _LINEAR)
        mask_size = np.array(mask.size, float)
        self._program.set(
            scale=np.array(picture.size) / mask_size, mask_size=mask_size,
            mask=0, places=1, low_places=2, channel=channel, low=lit[0], high=lit[1], dark=dark,
            is_smooth=int(self.kind != "nearest"), **find_rays(projection),
        )  # fmt: skip
        draw_plain(self._device, self._program, 3)
        tally.rectangles.append("apply")

    def release(self) -> None:
        """Free the program."""
        self._program.release()
