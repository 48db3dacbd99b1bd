"""Transparent surfaces, layer by layer from the farthest, each lit like the opaque one."""

import ctypes
from collections.abc import Iterator

from umbra.gl.context import Device, release_all
from umbra.gl.projection import Projection
from umbra.gl.shading import Shading
from umbra.gl.state import State
from umbra.gl.surfaces import SurfaceRenderer
from umbra.gl.target import FACE, LIGHT, PLACE, PictureTargets, Target

__all__ = ["TransparentLayers"]

_SAMPLES_PASSED, _RESULT = 0x8914, 0x8866


class TransparentLayers:
    """
    Peels transparent surfaces from the farthest to the nearest at each pixel.

    A layer has its own depth, normals, reflectance and light, so that volumes are counted
    and lights added as for opaque surfaces.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._targets: list[PictureTargets] = []
        self._query = 0

    def begin(self, targets: PictureTargets) -> Target:
        """Return the target in which a picture's layers are blended."""
        self._make(targets)
        return self._targets[0].sum

    def blend(
        self,
        state: State,
        shading: Shading,
        surfaces: SurfaceRenderer,
        projection: Projection,
        targets: PictureTargets,
        ground: float | None,
    ) -> Iterator[PictureTargets]:
        """
        Yield each layer of a picture to be lit, then blend it over the previous ones.

        Before: ``targets.surface`` holds the lit opaque surface. After: the target of
        ``begin`` holds all layers, as ``Shading.lay`` leaves them.
        """
        shown, behind = self.begin(targets), targets.surface
        shown.fill(state, 0.0)
        shading.lay(state, behind, shown)
        layer, next_one = self._targets
        while True:
            layer.surface.begin(state, depth=0.0)
            for place in (LIGHT, PLACE, FACE):
                layer.surface.clear_color(0.0, place=place)
            self._device.gl.BeginQuery(_SAMPLES_PASSED, self._query)
            is_first = behind is targets.surface
            surfaces.draw_layer(state, projection, behind, ground, is_first=is_first)
            self._device.gl.EndQuery(_SAMPLES_PASSED)
            if not self._count_drawn():
                return
            layer.light.use()
            yield layer
            shading.lay(state, layer.surface, shown)
            behind, layer, next_one = layer.surface, next_one, layer

    def _make(self, like: PictureTargets) -> None:
        """Make the targets of two layers, in the size and format of a picture."""
        if self._targets and self._targets[0].size != like.size:
            self.release()
        if not self._targets:
            self._query = self._device.make("Query")
            self._targets = [
                PictureTargets(self._device, like.size, like.accumulate) for _ in range(2)
            ]

    def _count_drawn(self) -> int:
        """Query the number of pixels in the last layer; waits for the device."""
        count = ctypes.c_uint64()
        self._device.gl.GetQueryObjectui64v(self._query, _RESULT, ctypes.addressof(count))
        return count.value

    def release(self) -> None:
        """Free targets and query."""
        release_all(*self._targets)
        if self._query:
            self._device.delete("Query", self._query)
        self._targets, self._query = [], 0
