"""The CPU: kernels of numba, which count on all receivers."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any

from umbra.devices.device import CountingDevice, FrameCounts, TileCounters

if TYPE_CHECKING:
    from umbra.scene import Scene

__all__ = ["CpuDevice"]


class _CpuTiles(TileCounters):
    """Tiles bring the kernels that count on them."""

    def make(self, tile: Any) -> Any:
        return tile.make_counter()


class CpuDevice(CountingDevice):
    """The processor's cores."""

    name = "cpu"

    def open_tiles(self, casters: list[int]) -> TileCounters:
        """Begin a study; tiles know their casters."""
        return _CpuTiles()

    def open_frames(
        self,
        scene: "Scene",
        ground: float | None = None,
        *,
        threads: int = 1,
        warn: Callable[[str], object] = lambda _: None,
    ) -> AbstractContextManager[FrameCounts]:
        """Begin counting in frames of a scene, see `CountingDevice`."""
        from umbra.cpu.frame import FrameCounter  # noqa: PLC0415

        return nullcontext(FrameCounter(scene, ground=ground, threads=threads, warn=warn))
