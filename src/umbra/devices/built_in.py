"""
The built-in devices: the CPU, OpenGL and WebGPU.

On the CPU, numba kernels count on all kinds of receivers; OpenGL, an optional extra, draws volumes
into the stencil, for plans and pictures.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from umbra.devices.device import CountingDevice, TileCounters
from umbra.errors import UmbraError

if TYPE_CHECKING:
    from umbra.gl.context import Device
    from umbra.scene import Scene
    from umbra.soft.frames import FrameCounts

__all__ = ["CpuDevice", "GlDevice", "WgpuDevice"]


class _CpuTiles(TileCounters):
    """CPU counters of tiles; each tile provides its own kernels."""

    def make(self, tile: Any) -> Any:
        return tile.make_counter()


class CpuDevice(CountingDevice):
    """The CPU."""

    name, title = "cpu", "CPU"

    def open_tiles(self, casters: list[int]) -> TileCounters:
        """Start a study; tiles hold their casters."""
        return _CpuTiles()

    def open_frames(
        self,
        scene: "Scene",
        ground: float | None = None,
        *,
        casters: list[int] | None = None,
        threads: int = 1,
        warn: Callable[[str], object] = lambda _: None,
        transmits: bool = True,
        detail: float = 0.0,
    ) -> "AbstractContextManager[FrameCounts]":
        """Make a counter of frames of a scene, see `CountingDevice`."""
        from umbra.cpu.frame import FrameCounter  # noqa: PLC0415

        return nullcontext(FrameCounter(scene, casters, ground, threads, warn, transmits))


class _GlTiles(TileCounters):
    """OpenGL counters of plans, in one context; one tile is held at a time."""

    def __init__(self, casters: list[int]) -> None:
        self._casters = casters
        self._context: Device | None = None
        self._sweep: Any = None

    def can_count(self, tile: Any) -> bool:
        """Return whether the tile is a plan, whose rim can be counted by rays."""
        return hasattr(tile, "with_rays") and tile.is_topmost

    def is_accelerated(self) -> bool:
        """Return whether there is a real GPU."""
        if find_spec("moderngl") is None:
            return False
        try:
            return not self._open().is_software
        except UmbraError:
            return False

    def make(self, tile: Any) -> Any:
        context = self._open()
        from umbra.gl.plan_sweep import GlSweep  # noqa: PLC0415

        self._release_sweep()
        model = tile.model
        self._sweep = GlSweep(
            model.scene, self._casters, tile.grid, model.ground, tile.on_plane, context
        )
        return tile.with_rays(self._sweep)

    def release(self) -> None:
        self._release_sweep()
        if self._context is not None:
            self._context.release()
        self._context = None

    def _open(self) -> "Device":
        from umbra.gl.context import open_device  # noqa: PLC0415

        self._context = self._context or open_device()
        return self._context

    def _release_sweep(self) -> None:
        if self._sweep is not None:
            self._sweep.release()
        self._sweep = None


class GlDevice(CountingDevice):
    """OpenGL, on a GPU or in software."""

    name, title = "gl", "OpenGL"
    is_window = enlarges_masks = has_levels = True

    def open_tiles(self, casters: list[int]) -> TileCounters:
        """Start a study; the context opens with the first tile."""
        return _GlTiles(casters)

    def open_frames(
        self,
        scene: "Scene",
        ground: float | None = None,
        *,
        casters: list[int] | None = None,
        threads: int = 1,
        warn: Callable[[str], object] = lambda _: None,
        transmits: bool = True,
        detail: float = 0.0,
    ) -> "AbstractContextManager[FrameCounts]":
        """Make a counter of frames, see `CountingDevice`; OpenGL manages its own threads."""
        from umbra.gl.frame_counter import GlFrameCounter  # noqa: PLC0415

        return GlFrameCounter(scene, casters, ground, warn=warn, transmits=transmits, detail=detail)


class _NoTiles(TileCounters):
    """Tiles of a device that counts frames alone: the default device counts them."""

    def can_count(self, tile: Any) -> bool:
        """Return that it counts none."""
        return False

    def make(self, tile: Any) -> Any:
        raise NotImplementedError


class WgpuDevice(CountingDevice):
    """WebGPU, by wgpu: shadows of frames, hard or by samples, on Vulkan, Metal or Direct3D."""

    name, title = "wgpu", "WebGPU"

    def open_tiles(self, casters: list[int]) -> TileCounters:
        """Start a study, whose tiles the default device counts."""
        return _NoTiles()

    def open_frames(
        self,
        scene: "Scene",
        ground: float | None = None,
        *,
        casters: list[int] | None = None,
        threads: int = 1,
        warn: Callable[[str], object] = lambda _: None,
        transmits: bool = True,
        detail: float = 0.0,
    ) -> "AbstractContextManager[FrameCounts]":
        """Make a counter of frames; casters are never coarser meshes."""
        from umbra.webgpu.wgpu_frames import WgpuFrameCounter  # noqa: PLC0415

        return WgpuFrameCounter(scene, casters, ground, warn=warn, transmits=transmits)
