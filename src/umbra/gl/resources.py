"""
Resources of a context: index buffers, buffer textures, images and timer queries.

Vertices have no attributes but their number. A software device bins all passes and draws
them together, so its timer queries cannot measure a single pass: there the clock is read
after waiting for each pass.
"""

import ctypes
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device
from umbra.gl.functions import TEXTURE_2D
from umbra.gl.programs import TRIANGLES, Program
from umbra.scene import Image

__all__ = ["Indices", "Texture", "TextureBuffer", "Timers"]

_NEAREST = 0x2600
_TEXTURE_BUFFER, _SRGB8_ALPHA8, _RGBA8 = 0x8C2A, 0x8C43, 0x8058
_FORMATS = {
    "rgba32f": 0x8814, "rg32f": 0x8230, "r32f": 0x822E, "rgba8": 0x8058, "rgba32i": 0x8D82,
    "rg32i": 0x823B, "r32i": 0x8235,
}  # fmt: skip
_WRAPS = {"repeat": 0x2901, "mirror": 0x8370, "clamp": 0x812F}
_LOD_BIAS = 0x8501
_TIME_ELAPSED, _RESULT = 0x88BF, 0x8866


class Indices:
    """
    Index list of triangles, 2 bytes per vertex number where they fit, else 4.

    All numbers are below ``n_vertices`` but those of ``nearby``: points of the last list with
    precomputed far ends, numbered from ``first_nearby`` on.
    """

    def __init__(self, device: Device, n_vertices: int) -> None:
        self._device = device
        self.dtype = np.dtype(np.uint16 if n_vertices <= 1 << 16 else np.uint32)
        self.n_bytes = 0
        self.first_nearby = n_vertices // 2
        self.nearby: TextureBuffer | None = None
        self._buffer: Any = None
        self._arrays: dict[int, Any] = {}

    def widen(self, n_nearby: int) -> np.dtype:
        """Return the type of vertex numbers that has room for n nearby points, too."""
        if self.dtype == np.uint16 and 2 * (self.first_nearby + n_nearby) > 1 << 16:
            self._free()
            self.dtype = np.dtype(np.uint32)
        return self.dtype

    def write(self, *lists: NDArray, nearby: NDArray[np.float64] | None = None) -> None:
        """
        Replace the list by others (n,), joined, in one upload.

        ``nearby`` (n, 2, 3) are points numbered after the geometry's, as in ``Nearby``.
        """
        self._device.use()
        self._write_nearby(nearby)
        if nearby is not None:
            self.widen(len(nearby))
        data = lists[0] if len(lists) == 1 else np.concatenate([np.zeros(0, self.dtype), *lists])
        data = np.ascontiguousarray(data, self.dtype)
        self.n_bytes = data.nbytes
        if self._buffer is None or self._buffer.size < data.nbytes:
            self._free()
            room = max(1 << 12, data.nbytes + data.nbytes // 2)
            self._buffer = self._device.context.buffer(reserve=room, dynamic=True)
            self._device.keep("buffer", self._buffer.glo)
        else:
            self._buffer.orphan()  # the driver need not wait for earlier draws
        if len(data):
            self._buffer.write(data)

    def draw(self, program: Program, first: int, count: int) -> None:
        """Draw ``count`` numbers from ``first`` on as triangles."""
        if not count:
            return
        self._device.use()
        array = self._arrays.get(id(program))
        if array is None:
            array = self._device.context.vertex_array(
                program.handle,
                [],
                index_buffer=self._buffer,
                index_element_size=self.dtype.itemsize,
            )
            self._device.keep("vertex array", array.glo)
            self._arrays[id(program)] = array
        array.render(TRIANGLES, vertices=count, first=first)

    def _write_nearby(self, nearby: NDArray[np.float64] | None) -> None:
        if self.nearby is not None:
            self.nearby.release()
            self.nearby = None
        if nearby is not None:
            rows = np.zeros((2 * len(nearby), 4), np.float32)
            rows[:, :3] = nearby.reshape(-1, 3)
            self.nearby = TextureBuffer(self._device, rows, "rgba32f")

    def release(self) -> None:
        """Free the buffers."""
        self._device.use()
        self._write_nearby(None)
        self._free()

    def _free(self) -> None:
        for array in self._arrays.values():
            self._device.free("vertex array", array)
        self._arrays = {}
        if self._buffer is not None:
            self._device.free("buffer", self._buffer)
        self._buffer = None


class TextureBuffer:
    """Buffer that shaders read by ``texelFetch``; its format is ``rgba32f``, ``r32i`` ..."""

    def __init__(self, device: Device, values: NDArray, form: str) -> None:
        self._device = device
        self._buffer = device.context.buffer(np.ascontiguousarray(values).tobytes())
        device.keep("buffer", self._buffer.glo)
        self._texture = device.make("Texture")
        device.gl.BindTexture(_TEXTURE_BUFFER, self._texture)
        device.gl.TexBuffer(_TEXTURE_BUFFER, _FORMATS[form], self._buffer.glo)
        device.gl.BindTexture(_TEXTURE_BUFFER, 0)
        device.check("a mesh was uploaded")

    def write(self, values: NDArray, first: int = 0) -> None:
        """Replace values from row ``first`` on."""
        self._device.use()
        values = np.ascontiguousarray(values)
        self._buffer.write(values, offset=first * values[:1].nbytes)

    def bind(self, unit: int) -> None:
        """Bind the buffer to a texture unit."""
        self._device.gl.bind_texture(unit, self._texture, _TEXTURE_BUFFER)

    def release(self) -> None:
        """Free the buffer and texture."""
        self._device.delete("Texture", self._texture)
        self._device.free("buffer", self._buffer)


class Texture:
    """
    An image with mipmaps; colours are decoded from sRGB when fetched.

    Wraps as the image specifies by default. Raises `InputError` if it cannot be decoded.
    """

    def __init__(self, device: Device, image: Image, wrap: tuple[str, str] | None = None) -> None:
        pixels = image.pixels
        rows, cols = pixels.shape[:2]
        self._device = device
        self._texture = device.context.texture(
            (cols, rows),
            4,
            pixels.tobytes(),
            internal_format=_RGBA8 if image.is_data else _SRGB8_ALPHA8,
        )
        device.keep("texture", self._texture.glo)
        self._texture.build_mipmaps()
        gl = device.gl
        gl.BindTexture(TEXTURE_2D, self._texture.glo)
        if device.is_software:
            # llvmpipe's anisotropic filter blurs what is magnified. One level finer is nearest to
            # the mean of many samples, for what is seen at a slant is filtered by its longer side.
            gl.TexParameteri(TEXTURE_2D, _LOD_BIAS, -1)
        else:
            self._texture.anisotropy = 8.0
        for side, how in zip((0x2802, 0x2803), wrap or image.wrap, strict=True):
            gl.TexParameteri(TEXTURE_2D, side, _WRAPS[how])
        gl.BindTexture(TEXTURE_2D, 0)
        device.check(f"the texture '{image.name}' was uploaded")

    def bind(self, unit: int) -> None:
        """Let shaders find it at a texture unit."""
        self._device.gl.bind_texture(unit, self._texture.glo)

    def release(self) -> None:
        """Free it."""
        self._device.free("texture", self._texture)


class FloatPicture:
    """Texture of per-pixel values, (rows, cols, k) float32, row 0 at the top."""

    def __init__(self, device: Device, values: NDArray[np.float32]) -> None:
        self._device = device
        rows, cols, channels = values.shape
        pixels = np.ascontiguousarray(values[::-1], np.float32).tobytes()
        self._texture = device.context.texture((cols, rows), channels, pixels, dtype="f4")
        self._texture.filter = _NEAREST, _NEAREST
        device.keep("texture", self._texture.glo)

    def bind(self, unit: int) -> None:
        """Let shaders find it at a texture unit."""
        self._device.gl.bind_texture(unit, self._texture.glo)

    def release(self) -> None:
        """Free it."""
        self._device.free("texture", self._texture)

    def __enter__(self) -> "FloatPicture":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


class Timers:
    """Timer queries by names of passes; passes of one name in a frame are summed."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._free: list[int] = []
        self._asked: list[tuple[str, int]] = []
        self._clocked: list[tuple[str, float]] = []

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Measure the drawing within; such blocks cannot be nested."""
        gl = self._device.gl
        if self._device.is_software:
            gl.Finish()
            start = time.perf_counter()
            yield
            gl.Finish()
            self._clocked.append((name, 1e3 * (time.perf_counter() - start)))
            return
        query = self._free.pop() if self._free else self._device.make("Query")
        self._asked.append((name, query))
        gl.BeginQuery(_TIME_ELAPSED, query)
        try:
            yield
        finally:
            gl.EndQuery(_TIME_ELAPSED)

    def collect(self) -> dict[str, float]:
        """
        Return the time of each pass since the last call, in order of begin [ms].

        Waits for the device.
        """
        times: dict[str, float] = {}
        elapsed = ctypes.c_uint64()
        for name, query in self._asked:
            self._device.gl.GetQueryObjectui64v(query, _RESULT, ctypes.addressof(elapsed))
            times[name] = times.get(name, 0.0) + elapsed.value / 1e6
            self._free.append(query)
        for name, spent in self._clocked:
            times[name] = times.get(name, 0.0) + spent
        self._asked, self._clocked = [], []
        return times

    def release(self) -> None:
        """Free the queries."""
        for query in [*self._free, *(query for _, query in self._asked)]:
            self._device.delete("Query", query)
        self._free, self._asked = [], []
