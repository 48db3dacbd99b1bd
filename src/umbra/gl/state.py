"""
The sole owner of OpenGL state: every pass sets all of it, and none leaks.

A pass is a frozen record. ``State.use`` sets the differences from the previous pass, so
nothing depends on earlier drawing; leaving the ``with`` block restores OpenGL's defaults.
No other code calls glEnable, glDepthFunc and the like.

Clip spaces, umbra's own or a caller's: how depth runs, and whether the picture is mirrored.
"""

from dataclasses import dataclass, fields, replace
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import UmbraError
from umbra.gl.context import Device

__all__ = ["ALL_BITS", "DEFAULT", "ClipSpace", "Pass", "State", "Stencil", "one_sided"]


@dataclass(frozen=True)
class ClipSpace:
    """
    A clip space as OpenGL's state must match it.

    Parameters
    ----------
    is_reversed : bool
        Depth is largest at the near plane.
    is_zero_to_one : bool
        Depth is from 0 to w; else from -w to w.
    is_mirrored : bool
        Triangles wind the other way in the picture.
    """

    is_reversed: bool = False
    is_zero_to_one: bool = False
    is_mirrored: bool = False

    @property
    def near_plane(self) -> NDArray[np.float32]:
        """Factors (2,) of z and w, whose sum is the distance behind the near plane."""
        if self.is_reversed:
            return _BEHIND_REVERSED
        return _BEHIND_ZERO if self.is_zero_to_one else _BEHIND


_BEHIND_REVERSED, _BEHIND_ZERO, _BEHIND = (
    np.array(factors, np.float32) for factors in ((-1.0, 1.0), (1.0, 0.0), (0.5, 0.5))
)


_FUNCTIONS = {
    "never": 0x0200, "less": 0x0201, "equal": 0x0202, "lequal": 0x0203, "greater": 0x0204,
    "notequal": 0x0205, "gequal": 0x0206, "always": 0x0207,
}  # fmt: skip
_OPERATIONS = {
    "keep": 0x1E00, "zero": 0, "replace": 0x1E01, "up": 0x8507, "down": 0x8508, "invert": 0x150A,
}  # fmt: skip
_BLENDS = {
    "add": (1, 1), "over": (0x0302, 0x0303), "premultiplied": (1, 0x0303), "multiply": (0x0306, 0),
    "double": (0x0306, 1), "invert": (0x0307, 0), "lift": (0x0307, 1), "max": (1, 1),
    "by alpha": (0, 0x0304),
}  # fmt: skip
_ADD, _MAX = 0x8006, 0x8008  # equations
_LOWER_LEFT, _BOTH_WAYS, _ZERO_TO_ONE = 0x8CA1, 0x935E, 0x935F  # clip control
_COUNTER_CLOCKWISE, _CLOCKWISE = 0x0901, 0x0900
_REVERSED = {"less": "greater", "lequal": "gequal", "greater": "less", "gequal": "lequal"}
_FRONT, _BACK, _BOTH = 0x0404, 0x0405, 0x0408
_DEPTH_TEST, _STENCIL_TEST, _SCISSOR_TEST, _CULL_FACE = 0x0B71, 0x0B90, 0x0C11, 0x0B44
_SAMPLE_MASK, _ALL_SAMPLES = 0x8E51, 0xFFFFFFFF
_BLEND, _DEPTH_CLAMP, _DEPTH_BOUNDS, _CLIP_NEAR, _OFFSET = 0x0BE2, 0x864F, 0x8890, 0x3000, 0x8037


ALL_BITS = 0xFF
"""Of the stencil."""


@dataclass(frozen=True, kw_only=True)
class Stencil:
    """
    Stencil test and operations; ``up`` and ``down`` wrap around.

    Parameters
    ----------
    test : str
        Comparison of the reference with the stencil: ``always``, ``equal`` ...
    reference : int
    front_depth_fail, front_depth_pass, back_depth_fail, back_depth_pass : str
        ``keep``, ``zero``, ``replace``, ``up``, ``down`` or ``invert``; a fragment that
        fails the stencil test keeps.
    bits : int
        Bits that are compared and written.
    """

    test: str = "always"
    reference: int = 0
    front_depth_fail: str = "keep"
    front_depth_pass: str = "keep"
    back_depth_fail: str = "keep"
    back_depth_pass: str = "keep"
    bits: int = ALL_BITS

    @property
    def is_written(self) -> bool:
        """Whether any operation changes the stencil."""
        front = {self.front_depth_fail, self.front_depth_pass}
        return front | {self.back_depth_fail, self.back_depth_pass} != {"keep"}


@dataclass(frozen=True, kw_only=True)
class Pass:
    """
    All state of a pass.

    Parameters
    ----------
    depth_test : str, optional
        ``less`` (nearer, whichever way depth runs), ``never``, ``equal`` ...; None lets every
        fragment pass and writes none.
    depth_write : bool
    color_write : bool or {'rgb', 'alpha'}
        Channels to write.
    blend : str, optional
        ``add``, ``over``, ``multiply``. ``premultiplied`` is ``over`` for colours that are
        multiplied by their alpha already, and keeps the target's own alpha right. With a
        source s and a target d: ``double`` is d + s d, ``invert`` is s (1 - d), ``lift`` is
        d + s (1 - d), ``max`` the larger, ``by alpha`` d times the target's own alpha.
    cull : {'front', 'back'}, optional
        Faces to leave out.
    stencil : Stencil, optional
    scissor : (int, int, int, int), optional
        Left, bottom, columns, rows [pixels], row 0 lowest.
    depth_clamp : bool
        Draw beyond the near and far planes, at those planes' depths.
    clip_near : bool
        Clip by ``gl_ClipDistance[0]``: the near plane, while depth is clamped.
    depth_bounds : (float, float), optional
        Draw only where depth, from 0 near to 1, is between; needs ``Device.has_depth_bounds``.
    polygon_offset : (float, float), optional
        Slope factor and units.
    sample : int, optional
        Draw only into this sample of each pixel.
    """

    depth_test: str | None = None
    depth_write: bool = False
    color_write: bool | str = False
    blend: str | None = None
    cull: str | None = None
    stencil: Stencil | None = None
    scissor: tuple[int, int, int, int] | None = None
    depth_clamp: bool = False
    clip_near: bool = False
    depth_bounds: tuple[float, float] | None = None
    polygon_offset: tuple[float, float] | None = None
    sample: int | None = None


_NAMES = tuple(field.name for field in fields(Pass))
_list_values = attrgetter(*_NAMES)

DEFAULT = Pass(depth_write=True, color_write=True)
"""OpenGL's own initial state."""


class State:
    """
    Sets state for one device.

    Parameters
    ----------
    device : Device
    clip : ClipSpace, optional
        Of another program's pictures; the device's own by default.

    Examples
    --------
    >>> with State(device) as state:  # doctest: +SKIP
    ...     state.use(Pass(depth_test="less", depth_write=True, color_write=True))
    ...     draw()
    """

    def __init__(self, device: Device, clip: ClipSpace | None = None) -> None:
        self._device = device
        own = ClipSpace(device.reverses_depth, device.reverses_depth)
        self._clip = own if clip is None else clip
        self._now: Pass | None = None
        self._is_limited = False

    def use(self, wanted: Pass) -> None:
        """Set all state of a pass."""
        if wanted.depth_bounds is not None and not self._device.has_depth_bounds:
            msg = f"{self._device.renderer} has no depth bounds test; leave depth_bounds out"
            raise UmbraError(msg)
        if self._is_limited:
            self._set_scissor(wanted.scissor)
            self._is_limited = False
        if wanted is self._now:
            return
        values = _list_values(wanted)
        if self._now is None:
            changed = list(zip(_NAMES, values, strict=True))
        else:
            now = _list_values(self._now)
            pairs = zip(_NAMES, values, now, strict=True)
            changed = [(name, new) for name, new, old in pairs if new is not old and new != old]
        for name, value in changed:
            getattr(self, f"_set_{name}")(value)
        self._now = wanted

    def limit(self, scissor: tuple[int, int, int, int] | None) -> None:
        """Change the scissor alone, until the next pass is used."""
        self._set_scissor(scissor)
        self._is_limited = True

    def clear(
        self,
        *,
        depth: float | None = None,
        stencil: int | None = None,
        scissor: tuple[int, int, int, int] | None = None,
        bits: int = ALL_BITS,
    ) -> None:
        """
        Clear depth, ``bits`` of the stencil or both of the bound framebuffer, within a scissor.

        The pass in use stays; neither its write masks nor its scissor matter.
        """
        gl, now, buffers = self._device.gl, self._now or DEFAULT, 0
        self._set_scissor(scissor)
        if depth is not None:
            gl.ClearDepth(1.0 - depth if self._clip.is_reversed else depth)
            gl.DepthMask(1)
            buffers |= 0x0100
        if stencil is not None:
            gl.ClearStencil(stencil)
            gl.StencilMask(bits)
            buffers |= 0x0400
        gl.Clear(buffers)
        gl.DepthMask(now.depth_write)
        if now.stencil is not None and stencil is not None:
            gl.StencilMask(now.stencil.bits if now.stencil.is_written else 0)
        self._set_scissor(now.scissor)
        self._is_limited = False

    def reset(self) -> None:
        """Restore OpenGL's own defaults."""
        self._now = None
        self.use(DEFAULT)
        gl = self._device.gl
        gl.DepthFunc(_FUNCTIONS["less"])
        gl.BlendFunc(1, 0)
        gl.BlendEquation(_ADD)
        gl.CullFace(_BACK)
        gl.ClearDepth(1.0)
        gl.ClearStencil(0)
        gl.PolygonOffset(0.0, 0.0)
        gl.SampleMaski(0, _ALL_SAMPLES)
        self._set_stencil(Stencil())
        gl.StencilMask(ALL_BITS)
        gl.Disable(_STENCIL_TEST)
        self._control_clip(_BOTH_WAYS)
        gl.FrontFace(_COUNTER_CLOCKWISE)

    def __enter__(self) -> "State":
        self._now, self._is_limited = None, False
        self._control_clip(_ZERO_TO_ONE if self._clip.is_zero_to_one else _BOTH_WAYS)
        if self._clip.is_mirrored:
            self._device.gl.FrontFace(_CLOCKWISE)
        return self

    def __exit__(self, *_: object) -> None:
        self.reset()

    def _control_clip(self, depths: int) -> None:
        if self._device.reverses_depth:
            self._device.gl.ClipControl(_LOWER_LEFT, depths)

    def _switch(self, what: int, on: bool) -> None:
        (self._device.gl.Enable if on else self._device.gl.Disable)(what)

    def _set_depth_test(self, test: str | None) -> None:
        self._switch(_DEPTH_TEST, test is not None)
        if test is not None:
            name = _REVERSED.get(test, test) if self._clip.is_reversed else test
            self._device.gl.DepthFunc(_FUNCTIONS[name])

    def _set_depth_write(self, on: bool) -> None:
        self._device.gl.DepthMask(on)

    def _set_color_write(self, on: bool | str) -> None:
        rgb, alpha = on in (True, "rgb"), on in (True, "alpha")
        self._device.gl.ColorMask(rgb, rgb, rgb, alpha)

    def _set_blend(self, blend: str | None) -> None:
        self._switch(_BLEND, blend is not None)
        if blend is not None:
            self._device.gl.BlendEquation(_MAX if blend == "max" else _ADD)
            self._device.gl.BlendFunc(*_BLENDS[blend])

    def _set_cull(self, cull: str | None) -> None:
        self._switch(_CULL_FACE, cull is not None)
        if cull is not None:
            self._device.gl.CullFace({"front": _FRONT, "back": _BACK}[cull])

    def _set_stencil(self, stencil: Stencil | None) -> None:
        gl = self._device.gl
        self._switch(_STENCIL_TEST, stencil is not None)
        if stencil is None:
            return
        # Where a pass only tests, a software device need not write all of it back.
        gl.StencilMask(stencil.bits if stencil.is_written else 0)
        test = _FUNCTIONS[stencil.test]
        gl.StencilFuncSeparate(_BOTH, test, stencil.reference, stencil.bits)
        for side, depth_fail, depth_pass in (
            (_FRONT, stencil.front_depth_fail, stencil.front_depth_pass),
            (_BACK, stencil.back_depth_fail, stencil.back_depth_pass),
        ):
            gl.StencilOpSeparate(
                side, _OPERATIONS["keep"], _OPERATIONS[depth_fail], _OPERATIONS[depth_pass]
            )

    def _set_scissor(self, box: tuple[int, int, int, int] | None) -> None:
        self._switch(_SCISSOR_TEST, box is not None)
        if box is not None:
            self._device.gl.Scissor(*box)

    def _set_depth_clamp(self, on: bool) -> None:
        self._switch(_DEPTH_CLAMP, on)

    def _set_clip_near(self, on: bool) -> None:
        self._switch(_CLIP_NEAR, on)

    def _set_depth_bounds(self, bounds: tuple[float, float] | None) -> None:
        if not self._device.has_depth_bounds:
            return
        self._switch(_DEPTH_BOUNDS, bounds is not None)
        if bounds is not None:
            low, high = bounds
            if self._clip.is_reversed:
                low, high = 1.0 - high, 1.0 - low
            self._device.gl.DepthBoundsEXT(low, high)

    def _set_polygon_offset(self, offset: tuple[float, float] | None) -> None:
        self._switch(_OFFSET, offset is not None)
        if offset is not None:
            sign = -1.0 if self._clip.is_reversed else 1.0
            self._device.gl.PolygonOffset(sign * offset[0], sign * offset[1])

    def _set_sample(self, sample: int | None) -> None:
        self._switch(_SAMPLE_MASK, sample is not None)
        if sample is not None:
            self._device.gl.SampleMaski(0, 1 << sample)


def one_sided(stencil: Stencil, side: str) -> Stencil:
    """Keep one side's operations, to draw fronts and backs in two passes."""
    other = {"front": "back", "back": "front"}[side]
    operations: dict[str, Any] = dict.fromkeys(
        (f"{other}_depth_fail", f"{other}_depth_pass"), "keep"
    )
    return replace(stencil, **operations)
