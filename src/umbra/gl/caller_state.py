"""
The OpenGL state of a program that lends its context: kept, set aside and given back.

A context that umbra opened has one user. In another's, whatever a pass does not set itself may be
unusual (sRGB framebuffers, discarded primitives, another front face), and must be as it was when a
call returns. `umbra.gl.context` does both around each outermost public call.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from umbra.errors import UmbraError
from umbra.gl.functions import TEXTURE_2D, TEXTURE_2D_MULTISAMPLE, Functions

__all__ = ["CallerState"]

# Switches, and whether OpenGL's own default is on.
_SWITCHES = {
    0x0BE2: False, 0x0B44: False, 0x0B71: False, 0x0B90: False, 0x0C11: False,  # blend to scissor
    0x0BD0: True, 0x809D: True, 0x0BF2: False,  # dither, multisample, colour logic
    0x864F: False, 0x8037: False, 0x2A01: False, 0x2A02: False,  # depth clamp, polygon offsets
    0x0B20: False, 0x0B41: False, 0x8642: False,  # smooth lines and polygons, point size
    0x8DB9: False, 0x8C89: False, 0x8F9D: False,  # sRGB, discard, primitive restart
    0x809E: False, 0x809F: False, 0x80A0: False, 0x8E51: False,  # coverage, sample mask
    **dict.fromkeys(range(0x3000, 0x3008), False),  # clip distances
}  # fmt: skip
_DEPTH_BOUNDS, _BLEND = 0x8890, 0x0BE2
_SAMPLES_PASSED, _ANY_SAMPLES_PASSED, _CURRENT_QUERY = 0x8914, 0x8C2F, 0x8865
_TARGETS = range(8)  # draw buffers, each with its own blending and colour mask
_UNITS = range(20)  # texture units that passes use
_TEXTURE_BUFFER = 0x8C2A
_TEXTURES = {TEXTURE_2D: 0x8069, TEXTURE_2D_MULTISAMPLE: 0x9104, _TEXTURE_BUFFER: 0x8C2C}
_BUFFERS = {0x8892: 0x8894, 0x8C2A: 0x8C2A, 0x8A11: 0x8A28, 0x88EB: 0x88ED, 0x88EC: 0x88EF,
            0x8F36: 0x8F36, 0x8F37: 0x8F37}  # fmt: skip
_PIXEL_STORE = {
    # How pixels lie in memory, read and written: swapped, low bit first, rows, skips, alignment.
    **dict.fromkeys((0x0D00, 0x0D01, 0x0D02, 0x0D03, 0x0D04, 0x806B, 0x806C), 0),
    **dict.fromkeys((0x0CF0, 0x0CF1, 0x0CF2, 0x0CF3, 0x0CF4, 0x806D, 0x806E), 0),
    0x0D05: 4, 0x0CF5: 4,
}  # fmt: skip
_FRONT, _BACK, _BOTH = 0x0404, 0x0405, 0x0408
_STENCILS = {
    _FRONT: ((0x0B92, 0x0B97, 0x0B93), (0x0B94, 0x0B95, 0x0B96), 0x0B98),
    _BACK: ((0x8800, 0x8CA3, 0x8CA4), (0x8801, 0x8802, 0x8803), 0x8CA5),
}  # functions, operations and write masks

Restore = Callable[[], object]


def _check_queries(gl: Functions) -> None:
    """Raise `UmbraError` if a query is open that would count umbra's samples as its own."""
    number = np.zeros(1, np.int32)
    for query in (_SAMPLES_PASSED, _ANY_SAMPLES_PASSED):
        gl.GetQueryiv(query, _CURRENT_QUERY, number.ctypes.data)
        if number[0]:
            msg = (
                "an occlusion query is open in this OpenGL context, and would count what umbra "
                "draws; end it before umbra is called"
            )
            raise UmbraError(msg, query=int(number[0]))


class CallerState:
    """
    State of a context as it is now; `restore` brings it back.

    Parameters
    ----------
    gl : Functions
        Of the context, which is current.
    has_depth_bounds, has_clip_control : bool

    Raises
    ------
    UmbraError
        If an occlusion query is open.
    """

    def __init__(self, gl: Functions, *, has_depth_bounds: bool, has_clip_control: bool) -> None:
        self._gl = gl
        while gl.GetError():  # what went wrong before is not umbra's to report
            pass
        _check_queries(gl)
        self._restores: list[Restore] = []
        self._switches = dict(_SWITCHES)
        if has_depth_bounds:
            self._switches[_DEPTH_BOUNDS] = False
        self._keep_switches()
        self._keep_drawing(has_depth_bounds=has_depth_bounds, has_clip_control=has_clip_control)
        self._keep_bindings()

    def set_aside(self) -> None:
        """Set OpenGL's defaults where passes rely on them."""
        gl = self._gl
        for switch, is_on in self._switches.items():
            (gl.Enable if is_on else gl.Disable)(switch)
        gl.PolygonMode(_BOTH, 0x1B02)
        gl.FrontFace(0x0901)
        gl.DepthRange(0.0, 1.0)
        gl.ProvokingVertex(0x8E4E)
        for name, value in _PIXEL_STORE.items():
            gl.PixelStorei(name, value)
        for target in (0x88EB, 0x88EC):  # else addresses would be offsets in the caller's buffers
            gl.BindBuffer(target, 0)
        for unit in _UNITS:
            gl.BindSampler(unit, 0)

    def restore(self) -> None:
        """Give the state back."""
        for restore in self._restores:
            restore()

    def _keep(self, function: str, *values: Any) -> None:
        """Call a function with these values when the state is given back."""
        call = getattr(self._gl, function)
        self._restores.append(lambda: call(*values))

    def _keep_switches(self) -> None:
        gl = self._gl
        for switch in self._switches:
            self._keep("Enable" if gl.IsEnabled(switch) else "Disable", switch)
        mask = np.zeros(4, np.uint8)
        for target in _TARGETS:
            self._keep("Enablei" if gl.IsEnabledi(_BLEND, target) else "Disablei", _BLEND, target)
            gl.GetBooleani_v(0x0C23, target, mask.ctypes.data)
            self._keep("ColorMaski", target, *mask.tolist())

    def _keep_drawing(self, *, has_depth_bounds: bool, has_clip_control: bool) -> None:
        """Keep how fragments are made, tested and blended."""
        gl = self._gl
        functions = [gl.integers(name)[0] for name in (0x80C9, 0x80C8, 0x80CB, 0x80CA)]
        self._keep("BlendFuncSeparate", *functions)
        self._keep("BlendEquationSeparate", *(gl.integers(n)[0] for n in (0x8009, 0x883D)))
        self._keep("BlendColor", *gl.floats(0x8005, 4))
        self._keep("ClearColor", *gl.floats(0x0C22, 4))
        self._keep("DepthFunc", gl.integers(0x0B74)[0])
        self._keep("DepthMask", gl.integers(0x0B72)[0])
        self._keep("DepthRange", *gl.floats(0x0B70, 2))
        self._keep("ClearDepth", gl.floats(0x0B73)[0])
        self._keep("ClearStencil", gl.integers(0x0B91)[0])
        for side, (test, operations, mask) in _STENCILS.items():
            values = [gl.integers(name)[0] for name in test]
            self._keep("StencilFuncSeparate", side, *(n & 0xFFFFFFFF for n in values[:1]),
                       values[1], values[2] & 0xFFFFFFFF)  # fmt: skip
            self._keep("StencilOpSeparate", side, *(gl.integers(name)[0] for name in operations))
            self._keep("StencilMaskSeparate", side, gl.integers(mask)[0] & 0xFFFFFFFF)
        self._keep("CullFace", gl.integers(0x0B45)[0])
        self._keep("FrontFace", gl.integers(0x0B46)[0])
        self._keep("PolygonMode", _BOTH, gl.integers(0x0B40, 2)[0])
        self._keep("PolygonOffset", gl.floats(0x8038)[0], gl.floats(0x2A00)[0])
        self._keep("ProvokingVertex", gl.integers(0x8E4F)[0])
        word = np.zeros(4, np.int32)
        gl.GetIntegeri_v(0x8E52, 0, word.ctypes.data)
        self._keep("SampleMaski", 0, int(word[0]) & 0xFFFFFFFF)
        self._keep("Viewport", *gl.integers(0x0BA2, 4))
        self._keep("Scissor", *gl.integers(0x0C10, 4))
        if has_depth_bounds:
            self._keep("DepthBoundsEXT", *gl.floats(0x8891, 2))
        if has_clip_control:
            self._keep("ClipControl", gl.integers(0x935C)[0], gl.integers(0x935D)[0])

    def _keep_bindings(self) -> None:
        """Keep what is bound: framebuffers, program, arrays, buffers and textures."""
        gl = self._gl
        for target, name in ((0x8CA9, 0x8CA6), (0x8CA8, 0x8CAA)):
            self._keep("BindFramebuffer", target, gl.integers(name)[0])
        self._keep("BindRenderbuffer", 0x8D41, gl.integers(0x8CA7)[0])
        self._keep("UseProgram", gl.integers(0x8B8D)[0])
        self._keep("BindVertexArray", gl.integers(0x85B5)[0])
        for target, name in _BUFFERS.items():
            self._keep("BindBuffer", target, gl.integers(name)[0])
        for name in _PIXEL_STORE:
            self._keep("PixelStorei", name, gl.integers(name)[0])
        active = gl.integers(0x84E0)[0]
        for unit in _UNITS:
            gl.ActiveTexture(0x84C0 + unit)
            self._keep("ActiveTexture", 0x84C0 + unit)
            for kind, name in _TEXTURES.items():
                self._keep("BindTexture", kind, gl.integers(name)[0])
            self._keep("BindSampler", unit, gl.integers(0x8919)[0])
        gl.ActiveTexture(active)
        self._keep("ActiveTexture", active)
