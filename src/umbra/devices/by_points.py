"""
A device that needs one thing alone: which points see which lights.

From it follow all that studies and pictures ask: the masks of any receivers' tiles, as their places
are points, and the counts of frames, as the visible surface has a point at each pixel. Packages
that bring a device begin here, and may count what they know better in a way of their own.
"""

from abc import abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any

from umbra.devices.device import CountingDevice, TileCounters, blame
from umbra.errors import UmbraError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from umbra.scene import Scene
    from umbra.soft.frames import FrameCounts

__all__ = ["PointDevice"]

_POINTS = 1 << 18
"""Points passed to the device at a time, so that work arrays stay small."""


def _is_mask(found: "NDArray[Any]") -> bool:
    """Return whether all whole numbers are 0 or 1."""
    return not found.size or bool(found.min() >= 0 and found.max() <= 1)


class PointDevice(CountingDevice):
    """
    Base of devices that find, for single points, which lights are hidden.

    Canopies, which weaken light, are counted by the default device, and a line says so.
    """

    @abstractmethod
    def find_hidden(
        self, triangles: "NDArray[np.float64]", points: "NDArray[np.float64]",
        normals: "NDArray[np.float64]", lights: "NDArray[np.float64]",
    ) -> "NDArray[np.uint8]":  # fmt: skip
        """
        Find the points that a light does not reach.

        Parameters
        ----------
        triangles : (m, 3, 3) float64
            Corners of all casting triangles, in any winding, in the points' frame [m].
        points : (n, 3) float64
            On their surfaces, which may be among the triangles [m].
        normals : (n, 3) float64
            Unit normals of the visible side; NaN for points that have none.
        lights : (k, 4) float64
            Unit directions toward lights, w = 0; or positions of lamps, w = 1 [m].

        Returns
        -------
        hidden : (k, n) uint8
            1 where a triangle lies between, or the light is not above the surface.
        """

    def can_count(self, tile: Any) -> bool:
        """Return whether it counts such receivers; if not, the default device does."""
        return True

    def ask(
        self, triangles: "NDArray", points: "NDArray", normals: "NDArray", lights: "NDArray"
    ) -> "NDArray[np.uint8]":
        """Find hidden points, ``_POINTS`` at a time; name the device where it fails."""
        import numpy as np  # noqa: PLC0415 - the command's help needs no NumPy

        hidden = np.zeros((len(lights), len(points)), np.uint8)
        for first in range(0, len(points), _POINTS):
            batch = slice(first, first + _POINTS)
            hidden[:, batch] = self._ask(triangles, points[batch], normals[batch], lights)
        return hidden

    def _ask(
        self, triangles: "NDArray", points: "NDArray", normals: "NDArray", lights: "NDArray"
    ) -> "NDArray[np.uint8]":
        """Find some hidden points, and check what the device returns."""
        import numpy as np  # noqa: PLC0415 - the command's help needs no NumPy

        unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        try:
            masks = np.asarray(self.find_hidden(triangles, points, unit, lights))
        except UmbraError:
            raise
        except Exception as error:
            raise blame(self.name, error) from error
        wanted = len(lights), len(points)
        if masks.shape != wanted:
            raise blame(
                self.name, ValueError(f"its masks have the shape {masks.shape}, not {wanted}")
            )
        if masks.dtype.kind not in "bui" or (masks.dtype.kind != "b" and not _is_mask(masks)):
            wrong = np.unique(masks)[:3].tolist() if masks.dtype.kind in "uif" else masks.dtype
            msg = f"its masks hold {wrong}; return bool, or whole numbers 0 and 1"
            raise blame(self.name, ValueError(msg))
        return masks.astype(np.uint8)

    def open_tiles(self, casters: list[int]) -> TileCounters:
        """Start a study; tiles hold their casters."""
        return _PointTiles(self)

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
        """Make a counter of frames, whose visible surface the CPU finds; see `CountingDevice`."""
        from umbra.devices.point_frames import PointFrames  # noqa: PLC0415 - loads kernels

        how = (scene, casters, ground, threads, warn, transmits)
        return nullcontext(PointFrames(self.ask, self.methods, *how))


class _PointTiles(TileCounters):
    """Counters of tiles by their places."""

    def __init__(self, device: PointDevice) -> None:
        self._device = device

    def can_count(self, tile: Any) -> bool:
        """Return whether the device counts such receivers."""
        return self._device.can_count(tile)

    def make(self, tile: Any) -> "PointCounter":
        return PointCounter(self._device, tile)


class PointCounter:
    """Counter of a tile's receivers as points, on a device."""

    def __init__(self, device: PointDevice, tile: Any) -> None:
        self._device, self._tile = device, tile
        caster = tile.casting.caster
        self._triangles = caster.vertices[caster.faces]

    def masks(self, lights: "NDArray[np.float64]") -> "NDArray[np.uint8]":
        """Return for each light, (k, 3) suns or (k, 4) any, the receivers in shadow."""
        import numpy as np  # noqa: PLC0415 - the command's help needs no NumPy

        where = self._tile.places
        whole = np.zeros((len(lights), 4))
        whole[:, : lights.shape[1]] = lights
        masks = self._device.ask(self._triangles, where.points, where.normals, whole)
        return masks.reshape(-1, *self._tile.shape)

    def add_weights(
        self,
        suns: "NDArray[np.float64]",
        weights: "NDArray[np.int32]",
        sums: "NDArray[np.int32]",
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each receiver the weights (n, k) of the suns that leave it in shadow."""
        from umbra.rays.masks import add_masks  # noqa: PLC0415

        add_masks(self.masks, suns, weights, sums, progress)
