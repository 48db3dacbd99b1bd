"""Index buffers, and draws of vertices that have no attributes but their number."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device
from umbra.gl.programs import Program

__all__ = ["Indices", "draw_plain"]

_TRIANGLES = 4


class Indices:
    """
    Triangles as lists of vertex numbers, 2 bytes each where they fit, else 4.

    Parameters
    ----------
    device : Device
    n_vertices : int
        All numbers are below it.
    """

    def __init__(self, device: Device, n_vertices: int) -> None:
        self._device = device
        self.dtype = np.dtype(np.uint16 if n_vertices <= 1 << 16 else np.uint32)
        self.n_bytes = 0
        self._buffer: Any = None
        self._arrays: dict[int, Any] = {}

    def write(self, numbers: NDArray) -> None:
        """
        Replace the list, in one upload.

        Parameters
        ----------
        numbers : (n,) unsigned int
        """
        self._device.use()
        data = np.ascontiguousarray(numbers, self.dtype).tobytes()
        self.n_bytes = len(data)
        if self._buffer is None or self._buffer.size < len(data):
            self.release()
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

    def release(self) -> None:
        """Free the buffer."""
        self._device.use()
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
