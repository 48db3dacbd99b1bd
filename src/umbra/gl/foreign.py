"""Framebuffers of other programs, in which umbra counts if they can hold what it needs."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from umbra.errors import InputError, UmbraError
from umbra.gl.context import Device
from umbra.gl.volume_plan import STENCIL_MOST, VolumePlan

__all__ = ["ForeignTarget", "check_counting"]

_FRAMEBUFFER, _DRAW_FRAMEBUFFER = 0x8D40, 0x8CA9
_DEPTH, _TYPE, _NAME, _TEXTURE_LEVEL = 0x8D00, 0x8CD0, 0x8CD1, 0x8CD2
_RENDERBUFFER, _TEXTURE, _NEAREST = 0x8D41, 0x1702, 0x2600
_COMPLETE = 0x8CD5


@dataclass(frozen=True, eq=False)
class ForeignTarget:
    """
    A framebuffer of another program, as what passes draw into.

    Parameters
    ----------
    device : Device
    framebuffer : int
        OpenGL's name of it; 0 is the window's own.
    viewport : (int, int, int, int)
        Left, bottom, columns, rows [pixels].
    """

    device: Device
    framebuffer: int
    viewport: tuple[int, int, int, int]

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of the viewport."""
        return self.viewport[2:]

    def use(self) -> None:
        """Draw here, into the viewport."""
        self.device.gl.BindFramebuffer(_FRAMEBUFFER, self.framebuffer)
        self.device.gl.Viewport(*self.viewport)

    def check_depth(self) -> None:
        """Raise `UmbraError` if the framebuffer in use has no depth."""
        if not _count_bits(self.device, _DEPTH if self.framebuffer else 0x1801, 0x8216):
            msg = (
                "the framebuffer has no depth, and counting needs the depth of what is seen; "
                "attach a depth buffer and draw the scene into it"
            )
            raise UmbraError(msg, depth=0)

    def make_counts(self, size: tuple[int, int], texture: Any = None) -> tuple[Any, int]:
        """
        Make a float texture of the framebuffer's size, or take one, over its own depth.

        Returns
        -------
        texture : moderngl.Texture
        framebuffer : int
            Of both, to be deleted; it is in use.
        """
        gl = self.device.gl
        self.use()
        self.check_depth()
        if not self.framebuffer:
            msg = (
                "the window's own framebuffer lends its depth to no texture; draw the scene into "
                "a framebuffer of your own, or count in a stencil"
            )
            raise UmbraError(msg, framebuffer=0)
        kind, name = self._ask(_TYPE), self._ask(_NAME)
        level = 0 if kind == _RENDERBUFFER else self._ask(_TEXTURE_LEVEL)
        if texture is None:
            texture = self.device.context.texture(size, 1, dtype="f4")
            texture.filter = _NEAREST, _NEAREST
        elif (texture.size, texture.components, texture.dtype) != (size, 1, "f4"):
            msg = (
                f"into= is a texture of {size[0]}x{size[1]} pixels and one float32 channel; got "
                f"{texture.size[0]}x{texture.size[1]} and {texture.components} of {texture.dtype}"
            )
            raise InputError(msg, option="into")
        framebuffer = self.device.make("Framebuffer")
        gl.BindFramebuffer(_FRAMEBUFFER, framebuffer)  # the viewport stays
        gl.FramebufferTexture2D(_FRAMEBUFFER, 0x8CE0, 0x0DE1, texture.glo, 0)
        if kind == _RENDERBUFFER:
            gl.FramebufferRenderbuffer(_FRAMEBUFFER, _DEPTH, _RENDERBUFFER, name)
        else:
            gl.FramebufferTexture2D(_FRAMEBUFFER, _DEPTH, 0x0DE1, name, level)
        status = gl.CheckFramebufferStatus(_FRAMEBUFFER)
        if gl.GetError() or status != _COMPLETE:
            self.device.delete("Framebuffer", framebuffer)
            msg = (
                "no counts can be drawn over the framebuffer's depth, which has several samples or "
                f"is no picture of its own (status {status:#x}); count in a stencil"
            )
            raise UmbraError(msg, status=status)
        return texture, framebuffer

    def _ask(self, what: int) -> int:
        """Query the depth attachment of the framebuffer in use."""
        value = np.zeros(1, np.int32)
        self.device.gl.GetFramebufferAttachmentParameteriv(
            _DRAW_FRAMEBUFFER, _DEPTH, what, value.ctypes.data
        )
        return int(value[0])


def check_counting(device: Device, plan: VolumePlan, *, wraps: bool = False) -> None:
    """
    Raise `UmbraError` if the framebuffer in use lacks depth or stencil for a plan's counts.

    If these may wrap, 8 bits hold any.
    """
    is_default = not device.gl.integers(0x8CA6)[0]
    # The default framebuffer's attachments have other names.
    depth = _count_bits(device, 0x1801 if is_default else 0x8D00, 0x8216)
    stencil = _count_bits(device, 0x1802 if is_default else 0x8D20, 0x8217)
    if stencil < 8 or not depth:
        msg = (
            f"the framebuffer has {depth} bits of depth and {stencil} of stencil, and counting "
            "needs depth and 8 bits; attach a depth-stencil buffer, or draw into umbra's own Target"
        )
        raise UmbraError(msg, bits=stencil, depth=depth)
    if plan.statistics.counts_in == "float" and not wraps:
        most = plan.statistics.deepest
        msg = (
            f"up to {most:,} volumes may overlap, and another program's framebuffer counts "
            f"{STENCIL_MOST}; draw into umbra's own Target"
        )
        raise UmbraError(msg, most=most)


def _count_bits(device: Device, attachment: int, size: int) -> int:
    """Query the size of an attachment of the framebuffer in use, 0 if there is none [bits]."""
    kind, bits = np.zeros(1, np.int32), np.zeros(1, np.int32)
    for name, value in ((0x8CD0, kind), (size, bits)):
        if name == 0x8CD0 or kind[0]:
            device.gl.GetFramebufferAttachmentParameteriv(
                0x8CA9, attachment, name, value.ctypes.data
            )
    return int(bits[0])
