"""Index buffers, and draws of vertices that have no attributes but their number."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device
from umbra.gl.geometry import TextureBuffer
from umbra.gl.programs import Program

__all__ = ["Indices", "draw_plain"]

_TRIANGLES = 4
_RGBA32F = 0x8814


class Indices:
    """
    Triangles as lists of vertex numbers, 2 bytes each where they fit, else 4.

    Parameters
    ----------
    device : Device
    n_vertices : int
        All numbers are below it, but those of ``nearby``.

    Attributes
    ----------
    nearby : TextureBuffer, optional
        Points of the last list that name their far ends themselves.
    first_nearby : int
        Number of the first of them.
    """

    def __init__(self, device: Device, n_vertices: int) -> None:
        self._device = device
        self.dtype = np.dtype(np.uint16 if n_vertices <= 1 << 16 else np.uint32)
        self.n_bytes = 0
        self.first_nearby = n_vertices // 2
        self.nearby: TextureBuffer | None = None
        self._buffer: Any = None
        self._arrays: dict[int, Any] = {}

    def write(self, numbers: NDArray, nearby: NDArray[np.float64] | None = None) -> None:
        """
        Replace the list, in one upload.

        Parameters
        ----------
        numbers : (n,) unsigned int
        nearby : (n, 2, 3) float64, optional
            Points after those of the geometry, as in ``umbra.gl.nearby``.
        """
        self._device.use()
        self._write_nearby(nearby)
        if nearby is not None and self.dtype == np.uint16:
            self._free()  # they may need larger numbers
            self.dtype = np.dtype(np.uint32)
        data = np.ascontiguousarray(numbers, self.dtype).tobytes()
        self.n_bytes = len(data)
        if self._buffer is None or self._buffer.size < len(data):
            self._free()
            room = max(1 << 12, len(data) + len(data) // 2)
            self._buffer = self._device.context.buffer(reserve=room, dynamic=True)
            self._device.keep("buffer", self._buffer.glo)
        else:
            self._buffer.orphan()  # the driver need not wait for earlier draws
        if data:
            self._buffer.write(data)

    def draw(self, program: Program, first: int, count: int) -> None:
        """Draw ``count`` numbers from the ``first`` on as triangles."""
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
        array.render(_TRIANGLES, vertices=count, first=first)

    def _write_nearby(self, nearby: NDArray[np.float64] | None) -> None:
        if self.nearby is not None:
            self.nearby.release()
            self.nearby = None
        if nearby is not None:
            rows = np.zeros((2 * len(nearby), 4), np.float32)
            rows[:, :3] = nearby.reshape(-1, 3)
            self.nearby = TextureBuffer(self._device, rows, _RGBA32F)

    def release(self) -> None:
        """Free the buffers."""
        self._device.use()
        self._write_nearby(None)
        self._free()

    def _free(self) -> None:
        for array in self._arrays.values():
            self._device.forget("vertex array", array.glo)
            array.release()
        self._arrays = {}
        if self._buffer is not None:
            self._device.forget("buffer", self._buffer.glo)
            self._buffer.release()
        self._buffer = None


def draw_plain(device: Device, program: Program, count: int) -> None:
    """Draw triangles whose vertices a shader makes from their numbers alone."""
    array = device.context.vertex_array(program.handle, [])
    array.render(_TRIANGLES, vertices=count)
    array.release()
