"""
OpenGL entry points that moderngl lacks, from the context's own loader.

moderngl has no stencil and no depth-stencil framebuffer. The context's loader resolves
the addresses, so this works with EGL, OSMesa and windows.
"""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["TEXTURE_2D", "TEXTURE_2D_MULTISAMPLE", "Functions"]

TEXTURE_2D, TEXTURE_2D_MULTISAMPLE = 0x0DE1, 0x9100

# One letter per argument: enum or unsigned, integer, size, float, double, boolean, pointer.
_KINDS = {
    "e": ctypes.c_uint, "i": ctypes.c_int, "z": ctypes.c_ssize_t, "f": ctypes.c_float,
    "d": ctypes.c_double, "b": ctypes.c_ubyte, "p": ctypes.c_void_p,
}  # fmt: skip

_ARGUMENTS = {
    "ActiveTexture": "e",
    "BeginQuery": "ee",
    "BindBuffer": "ee",
    "BindFramebuffer": "ee",
    "BindRenderbuffer": "ee",
    "BindSampler": "ee",
    "BindTexture": "ee",
    "BindVertexArray": "e",
    "BlendColor": "ffff",
    "BlendEquation": "e",
    "BlendEquationSeparate": "ee",
    "BlendFunc": "ee",
    "BlendFuncSeparate": "eeee",
    "BlitFramebuffer": "iiiiiiiiee",
    "CheckFramebufferStatus": "e",
    "Clear": "e",
    "ClearBufferfv": "eip",
    "ClearBufferiv": "eip",
    "ClearColor": "ffff",
    "ClearDepth": "d",
    "ClearStencil": "i",
    "ClipControl": "ee",
    "ColorMask": "bbbb",
    "ColorMaski": "ebbbb",
    "CullFace": "e",
    "DeleteFramebuffers": "ip",
    "DeleteQueries": "ip",
    "DeleteRenderbuffers": "ip",
    "DeleteTextures": "ip",
    "DepthBoundsEXT": "dd",
    "DepthFunc": "e",
    "DepthMask": "b",
    "DepthRange": "dd",
    "Disable": "e",
    "Disablei": "ee",
    "DrawBuffers": "ip",
    "Enable": "e",
    "Enablei": "ee",
    "EndQuery": "e",
    "Finish": "",
    "Flush": "",
    "FramebufferRenderbuffer": "eeee",
    "FramebufferTexture2D": "eeeei",
    "FrontFace": "e",
    "GenFramebuffers": "ip",
    "GenQueries": "ip",
    "GenRenderbuffers": "ip",
    "GenSamplers": "ip",
    "GenTextures": "ip",
    "GetBooleani_v": "eep",
    "GetBooleanv": "ep",
    "GetError": "",
    "GetFloatv": "ep",
    "GetFramebufferAttachmentParameteriv": "eeep",
    "GetIntegeri_v": "eep",
    "GetIntegerv": "ep",
    "GetQueryObjectui64v": "eep",
    "GetQueryiv": "eep",
    "GetTexLevelParameteriv": "eiep",
    "IsBuffer": "e",
    "IsEnabled": "e",
    "IsEnabledi": "ee",
    "IsFramebuffer": "e",
    "IsProgram": "e",
    "IsRenderbuffer": "e",
    "IsTexture": "e",
    "PixelStorei": "ei",
    "PolygonMode": "ee",
    "PolygonOffset": "ff",
    "ProvokingVertex": "e",
    "ReadBuffer": "e",
    "ReadPixels": "iiiieep",
    "RenderbufferStorage": "eeii",
    "RenderbufferStorageMultisample": "eieii",
    "SampleMaski": "ee",
    "Scissor": "iiii",
    "StencilFuncSeparate": "eeie",
    "StencilMask": "e",
    "StencilMaskSeparate": "ee",
    "StencilOpSeparate": "eeee",
    "TexBuffer": "eee",
    "TexImage2D": "eiiiiieep",
    "TexImage2DMultisample": "eieiib",
    "TexParameteri": "eei",
    "Uniform1f": "if",
    "Uniform1i": "ii",
    "UseProgram": "e",
    "Viewport": "iiii",
}
_PLURALS = {"Query": "Queries"}
_RESULTS = {
    "CheckFramebufferStatus": ctypes.c_uint,
    "GetError": ctypes.c_uint,
    **dict.fromkeys(
        (
            "IsBuffer",
            "IsEnabled",
            "IsEnabledi",
            "IsFramebuffer",
            "IsProgram",
            "IsRenderbuffer",
            "IsTexture",
        ),
        ctypes.c_ubyte,
    ),
}


class Functions:
    """Entry points as methods, named as in OpenGL without ``gl``; ``load`` finds addresses."""

    def __init__(self, load: Callable[[str], int]) -> None:
        self._load = load

    def __getattr__(self, name: str) -> Any:
        """Load an entry point on first use."""
        if name not in _ARGUMENTS:
            raise AttributeError(name)
        address = self._load(f"gl{name}")
        if not address:
            msg = f"this OpenGL has no gl{name}"
            raise AttributeError(msg)
        kinds: list[Any] = [_KINDS[letter] for letter in _ARGUMENTS[name]]
        function = ctypes.CFUNCTYPE(_RESULTS.get(name), *kinds)(address)
        setattr(self, name, function)
        return function

    def make(self, kind: str) -> int:
        """Make a ``Framebuffer``, ``Renderbuffer``, ``Texture`` or ``Query``; return its number."""
        number = ctypes.c_uint()
        getattr(self, f"Gen{_PLURALS.get(kind, kind + 's')}")(1, ctypes.addressof(number))
        return number.value

    def delete(self, kind: str, number: int) -> None:
        """Delete an object of ``make``."""
        handle = ctypes.c_uint(number)
        getattr(self, f"Delete{_PLURALS.get(kind, kind + 's')}")(1, ctypes.addressof(handle))

    def bind_texture(self, unit: int, texture: int, kind: int = TEXTURE_2D) -> None:
        """Bind a texture to a texture unit."""
        self.ActiveTexture(0x84C0 + unit)
        self.BindTexture(kind, texture)

    def integers(self, name: int, count: int = 1) -> list[int]:
        """Query integer state."""
        values = np.zeros(max(count, 4), np.int32)
        self.GetIntegerv(name, values.ctypes.data)
        return values[:count].tolist()

    def level_integer(self, kind: int, name: int) -> int:
        """Query a property of the bound texture's first level."""
        value = np.zeros(1, np.int32)
        self.GetTexLevelParameteriv(kind, 0, name, value.ctypes.data)
        return int(value[0])

    def floats(self, name: int, count: int = 1) -> list[float]:
        """Query floating-point state."""
        values = np.zeros(max(count, 4), np.float32)
        self.GetFloatv(name, values.ctypes.data)
        return values[:count].tolist()

    def read_pixels(self, size: tuple[int, int], layout: int, kind: int, into: NDArray) -> None:
        """Read the bound framebuffer, lowest row first, into a contiguous array of its size."""
        self.PixelStorei(PACK_ALIGNMENT, 1)
        self.ReadPixels(0, 0, *size, layout, kind, into.ctypes.data)


PACK_ALIGNMENT = 0x0D05
