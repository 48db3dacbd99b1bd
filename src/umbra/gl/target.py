"""
Framebuffers: render targets and readback.

A *shared depth target* has its own colours over another target's depth and stencil.
"""

import ctypes
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, UmbraError
from umbra.gl.context import Device
from umbra.gl.functions import TEXTURE_2D, TEXTURE_2D_MULTISAMPLE
from umbra.gl.state import DEFAULT, Pass, State

__all__ = [
    "ALBEDO",
    "DARK",
    "FACE",
    "FORMATS",
    "LIGHT",
    "LIT",
    "PLACE",
    "PictureTargets",
    "SharedDepthTarget",
    "Target",
]

_FLOAT, _INT, _BYTE = 0x1406, 0x1404, 0x1401
# OpenGL's internal format, format and type; numpy's type and channels.
FORMATS: dict[str, tuple[int, int, int, type, int]] = {
    "rgba16f": (0x881A, 0x1908, _FLOAT, np.float32, 4),
    "rgba32f": (0x8814, 0x1908, _FLOAT, np.float32, 4),
    "rgba8": (0x8058, 0x1908, _BYTE, np.uint8, 4),
    "r16f": (0x822D, 0x1903, _FLOAT, np.float32, 1),
    "r32f": (0x822E, 0x1903, _FLOAT, np.float32, 1),
    "r32i": (0x8235, 0x8D94, _INT, np.int32, 1),
}
"""What a colour attachment may hold."""

_FRAMEBUFFER, _READ_FRAMEBUFFER, _RENDERBUFFER = 0x8D40, 0x8CA8, 0x8D41
_DEPTH24_STENCIL8, _DEPTH32F_STENCIL8 = 0x88F0, 0x8CAD
_DEPTH_STENCIL_ATTACHMENT, _COLOR = 0x821A, 0x8CE0
_COMPLETE = 0x8CD5
_STENCIL_SIZE, _TEXTURE_SAMPLES = 0x8217, 0x9106


class Target:
    """
    A framebuffer of colour attachments, depth and 8 bits of stencil.

    Parameters
    ----------
    device : Device
    size : (int, int)
        Columns and rows.
    colors : sequence of str
        Keys of ``FORMATS``; attachment k is the fragment shader's output at location k.
    depth_of : Target, optional
        Share this target's depth and stencil.
    shows : (Target, int), optional
        Draw into this attachment of another target, without own colours.
    samples : int
        Per pixel; as ``depth_of`` if given. A multisampled target cannot be read, only
        fetched by shaders sample by sample.

    Raises
    ------
    InputError
        If the size exceeds the driver's limit.
    UmbraError
        If the driver has no such framebuffer, or no 8 bits of stencil.
    """

    def __init__(
        self,
        device: Device,
        size: tuple[int, int],
        colors: tuple[str, ...] = ("rgba16f",),
        depth_of: "Target | None" = None,
        shows: "tuple[Target, int] | None" = None,
        samples: int = 1,
    ) -> None:
        gl = device.gl
        if shows is not None:
            colors = (shows[0].colors[shows[1]],)
        limit = min(gl.integers(0x0D33)[0], gl.integers(0x84E8)[0])
        if max(size) > limit:
            msg = (
                f"a picture of {size[0]}x{size[1]} pixels is too large for {device.renderer}, "
                f"which draws at most {limit}x{limit}; choose a smaller size="
            )
            raise InputError(msg, option="size", limit=limit)
        self.size = size
        self.colors: tuple[str, ...] = tuple(colors)
        self._device = device
        self.depth_of = depth_of
        self.samples: int = samples if depth_of is None else depth_of.samples
        self._owns_colors = shows is None
        self.framebuffer = device.make("Framebuffer")
        gl.BindFramebuffer(_FRAMEBUFFER, self.framebuffer)
        self.textures: list[int] = (
            [self._add_texture(name) for name in self.colors]
            if shows is None
            else [shows[0].textures[shows[1]]]
        )
        for attachment, texture in enumerate(self.textures):
            gl.FramebufferTexture2D(
                _FRAMEBUFFER, _COLOR + attachment, self._texture_kind, texture, 0
            )
        self._depth: int = self._add_depth() if depth_of is None else depth_of._depth
        gl.FramebufferRenderbuffer(
            _FRAMEBUFFER, _DEPTH_STENCIL_ATTACHMENT, _RENDERBUFFER, self._depth
        )
        status = gl.CheckFramebufferStatus(_FRAMEBUFFER)
        device.check("a framebuffer was made")
        if status != _COMPLETE or self.stencil_bits() < 8:
            bits = self.stencil_bits() if status == _COMPLETE else 0
            self.release()
            msg = (
                f"{device.renderer} has no framebuffer of {', '.join(colors) or 'no colour'} with "
                f"{32 if device.reverses_depth else 24} bits of depth and 8 of stencil "
                f"(status {status:#x}, {bits} stencil bits); use device='cpu'"
            )
            raise UmbraError(msg, option="device", status=status)

    @property
    def _texture_kind(self) -> int:
        return TEXTURE_2D if self.samples == 1 else TEXTURE_2D_MULTISAMPLE

    def _add_texture(self, name: str) -> int:
        gl = self._device.gl
        internal, layout, kind, _, _ = FORMATS[name]
        texture = self._device.make("Texture")
        if self.samples > 1:
            gl.BindTexture(TEXTURE_2D_MULTISAMPLE, texture)
            gl.TexImage2DMultisample(TEXTURE_2D_MULTISAMPLE, self.samples, internal, *self.size, 1)
            # A driver may allocate more samples than requested; all attachments must match.
            self.samples = gl.level_integer(TEXTURE_2D_MULTISAMPLE, _TEXTURE_SAMPLES)
            gl.BindTexture(TEXTURE_2D_MULTISAMPLE, 0)
            return texture
        gl.BindTexture(TEXTURE_2D, texture)
        for parameter in (0x2800, 0x2801):
            gl.TexParameteri(TEXTURE_2D, parameter, 0x2600)  # nearest
        for parameter in (0x2802, 0x2803):
            gl.TexParameteri(TEXTURE_2D, parameter, 0x812F)  # clamped to the edge
        gl.TexImage2D(TEXTURE_2D, 0, internal, *self.size, 0, layout, kind, None)
        gl.BindTexture(TEXTURE_2D, 0)
        return texture

    def _add_depth(self) -> int:
        gl = self._device.gl
        depth = self._device.make("Renderbuffer")
        gl.BindRenderbuffer(_RENDERBUFFER, depth)
        form = _DEPTH32F_STENCIL8 if self._device.reverses_depth else _DEPTH24_STENCIL8
        if self.samples > 1:
            gl.RenderbufferStorageMultisample(_RENDERBUFFER, self.samples, form, *self.size)
        else:
            gl.RenderbufferStorage(_RENDERBUFFER, form, *self.size)
        gl.BindRenderbuffer(_RENDERBUFFER, 0)
        return depth

    def stencil_bits(self) -> int:
        """Query the number of stencil bits."""
        bits = np.zeros(1, np.int32)
        self._device.gl.GetFramebufferAttachmentParameteriv(
            _FRAMEBUFFER, 0x8D20, _STENCIL_SIZE, bits.ctypes.data
        )
        return int(bits[0])

    def use(self) -> None:
        """Draw here, over the whole picture."""
        gl = self._device.gl
        gl.BindFramebuffer(_FRAMEBUFFER, self.framebuffer)
        gl.Viewport(0, 0, *self.size)
        places = [_COLOR + attachment for attachment in range(len(self.colors))] or [0]
        array = (ctypes.c_uint * len(places))(*places)
        gl.DrawBuffers(len(places), ctypes.addressof(array))

    def bind(self, unit: int, attachment: int = 0) -> None:
        """Bind a colour attachment to a texture unit."""
        self._device.gl.bind_texture(unit, self.textures[attachment], self._texture_kind)

    def begin(self, state: State, *values: float, depth: float = 1.0) -> None:
        """Use the target; clear depth and stencil, and fill the first attachment with values."""
        self.use()
        state.use(DEFAULT)
        state.clear(depth=depth, stencil=0)
        if values:
            self.clear_color(*values)

    def fill(self, state: State, *values: float) -> None:
        """Use the target, and fill its first colour attachment with values."""
        self.use()
        state.use(Pass(color_write=True))
        self.clear_color(*values)

    def copy(self, other: "Target") -> None:
        """Use the target, and copy another's first attachment, of its size, into its own."""
        self.use()
        self._device.gl.BindFramebuffer(_READ_FRAMEBUFFER, other.framebuffer)
        self._device.gl.ReadBuffer(_COLOR)
        self._device.gl.BlitFramebuffer(0, 0, *self.size, 0, 0, *self.size, 0x4000, 0x2600)
        self._device.gl.BindFramebuffer(_READ_FRAMEBUFFER, self.framebuffer)

    def clear_color(self, *values: float, attachment: int = 0) -> None:
        """
        Fill a colour attachment, whatever its type; the target must be in use.

        Colour writes must be on (``Pass.color_write``); the pass's scissor applies.
        """
        kind = FORMATS[self.colors[attachment]][2]
        if kind == _INT:
            whole = np.resize(np.array(values, np.int32), 4)
            self._device.gl.ClearBufferiv(0x1800, attachment, whole.ctypes.data)
        else:
            filled = np.resize(np.array(values, np.float32), 4)
            self._device.gl.ClearBufferfv(0x1800, attachment, filled.ctypes.data)

    def read(self, attachment: int = 0) -> NDArray:
        """Read a colour attachment, (rows, cols) or (rows, cols, 4); row 0 is the top."""
        _, layout, kind, dtype, channels = FORMATS[self.colors[attachment]]
        cols, rows = self.size
        values: NDArray = np.zeros((rows, cols, channels), dtype)
        self._device.gl.BindFramebuffer(_FRAMEBUFFER, self.framebuffer)
        self._device.gl.ReadBuffer(_COLOR + attachment)
        self._device.gl.read_pixels(self.size, layout, kind, values)
        self._device.check("a picture was read back")
        return values[::-1, :, 0] if channels == 1 else values[::-1]

    def read_stencil(self) -> NDArray[np.uint8]:
        """Read the stencil, (rows, cols) uint8; row 0 is the top."""
        return self._read_depth_stencil(0x1901, _BYTE, np.uint8)

    def read_depth(self) -> NDArray[np.float64]:
        """Read depths from 0 (near) to 1, (rows, cols) float64; row 0 is the top."""
        depths = self._read_depth_stencil(0x1902, _FLOAT, np.float32).astype(np.float64)
        return 1.0 - depths if self._device.reverses_depth else depths

    def _read_depth_stencil(self, layout: int, kind: int, dtype: type) -> NDArray:
        values: NDArray = np.zeros(self.size[::-1], dtype)
        self._device.gl.BindFramebuffer(_FRAMEBUFFER, self.framebuffer)
        self._device.gl.read_pixels(self.size, layout, kind, values)
        self._device.check("depth or stencil was read back")
        return values[::-1]

    def release(self) -> None:
        """Free the framebuffer and its own attachments."""
        gl = self._device.gl
        gl.BindFramebuffer(_FRAMEBUFFER, 0)
        owned = [("Framebuffer", self.framebuffer)]
        if self._owns_colors:
            owned += [("Texture", texture) for texture in self.textures]
        if self.depth_of is None and self._depth:
            owned.append(("Renderbuffer", self._depth))
        for kind, number in owned:
            if number:
                self._device.delete(kind, number)
        self.framebuffer, self.textures, self._depth = 0, [], 0

    def __enter__(self) -> "Target":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


class SharedDepthTarget:
    """Colour target that shares another target's depth, rebuilt when that changes."""

    def __init__(self, device: Device, *colors: str) -> None:
        self._device, self._colors = device, colors
        self.target: Target | None = None

    def over(self, target: Target) -> Target:
        """Return the target that shares this one's depth and stencil."""
        if self.target is None or self.target.depth_of is not target:
            self.release()
            self.target = Target(self._device, target.size, self._colors, depth_of=target)
        return self.target

    def release(self) -> None:
        """Free the picture."""
        if self.target is not None:
            self.target.release()
        self.target = None


LIGHT, PLACE, ALBEDO, FACE = range(4)
"""Attachments of a surface target: light, normal and depth key, reflectance, the face's normal."""

LIT, DARK = range(2)
"""Attachments where the only light is drawn at once: the picture in it, and in its shadow."""


@dataclass(eq=False)
class PictureTargets:
    """
    The framebuffers for one picture size, with shared depth and stencil.

    Parameters
    ----------
    device : Device
    size : (int, int)
        Columns and rows.
    accumulate : {'rgba16f', 'rgba8'}
        Format of light sums.
    samples : int
        Per pixel, in all but ``picture``.

    Attributes
    ----------
    both : Target
        The picture in its only light, and in shadow.
    drawn : Target
        The first attachment of ``both``.
    picture : Target
        Final picture: ``drawn``, or the mean of its samples.
    surface, light : Target
        G-buffer of visible surfaces, and the accumulated light; made on first use.
    """

    device: Device
    size: tuple[int, int]
    accumulate: str = "rgba16f"
    samples: int = 1
    both: Target = field(init=False)
    drawn: Target = field(init=False)

    def __post_init__(self) -> None:
        self.both = Target(self.device, self.size, ("rgba8", "rgba8"), samples=self.samples)
        self.drawn = Target(self.device, self.size, depth_of=self.both, shows=(self.both, LIT))

    @classmethod
    def fit(
        cls,
        held: "PictureTargets | None",
        device: Device,
        size: tuple[int, int],
        accumulate: str,
        samples: int,
    ) -> "PictureTargets":
        """Return the held targets if they fit; else release them and make others."""
        if held is not None:
            if (held.size, held.accumulate, held.samples) == (tuple(size), accumulate, samples):
                return held
            held.release()
        return cls(device, (int(size[0]), int(size[1])), accumulate, samples)

    @cached_property
    def picture(self) -> Target:
        """Final picture."""
        return self.drawn if self.samples == 1 else Target(self.device, self.size, ("rgba8",))

    @cached_property
    def sum(self) -> Target:
        """Sum of the samples' linear colours."""
        return Target(self.device, self.size, ("rgba32f",), depth_of=self.picture)

    @cached_property
    def surface(self) -> Target:
        """Normals, depth keys, reflectance and accumulated light."""
        formats = find_surface_formats(self.accumulate)
        return Target(self.device, self.size, formats, depth_of=self.both)

    @cached_property
    def light(self) -> Target:
        """Accumulated light only."""
        shown = self.surface, LIGHT
        return Target(self.device, self.size, depth_of=self.both, shows=shown)

    def release(self) -> None:
        """Free the targets."""
        names = ("sum", "light", "surface", "picture", "drawn", "both")
        held = [self.__dict__[name] for name in names if name in self.__dict__]
        for target in dict.fromkeys(held):
            target.release()


def find_surface_formats(accumulate: str) -> tuple[str, ...]:
    """
    Return the formats of a surface target's attachments; light is summed in ``accumulate``.

    Normals are whole floats: whether a face is turned from a grazing light must be the same as
    where surfaces are lit at once.
    """
    return accumulate, "rgba32f", "rgba8", "rgba32f"
