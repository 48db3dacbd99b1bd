"""
How long the device takes for each pass of a frame, by timer queries.

A device in software bins all passes and draws them together, so its queries say nothing of
a single pass: there each pass is waited for and the clock is read.
"""

import ctypes
import time
from collections.abc import Iterator
from contextlib import contextmanager

from umbra.gl.context import Device

__all__ = ["Timers"]

_TIME_ELAPSED, _RESULT = 0x88BF, 0x8866


class Timers:
    """
    Timer queries by the names of passes; a pass that comes several times a frame is summed up.

    Parameters
    ----------
    device : Device
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._free: list[int] = []
        self._asked: list[tuple[str, int]] = []
        self._clocked: list[tuple[str, float]] = []

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Measure what is drawn within; such blocks cannot be nested."""
        gl = self._device.gl
        if self._device.is_software:
            gl.Finish()
            start = time.perf_counter()
            yield
            gl.Finish()
            self._clocked.append((name, 1e3 * (time.perf_counter() - start)))
            return
        query = self._free.pop() if self._free else self._make()
        self._asked.append((name, query))
        gl.BeginQuery(_TIME_ELAPSED, query)
        try:
            yield
        finally:
            gl.EndQuery(_TIME_ELAPSED)

    def collect(self) -> dict[str, float]:
        """
        Give the time of each pass since the last call, in the order in which they began [ms].

        Waits until the device is done with them.
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
            self._device.gl.DeleteQueries(1, ctypes.addressof(ctypes.c_uint(query)))
            self._device.forget("query", query)
        self._free, self._asked = [], []

    def _make(self) -> int:
        number = ctypes.c_uint()
        self._device.gl.GenQueries(1, ctypes.addressof(number))
        self._device.keep("query", number.value)
        return number.value
