"""
Adds the lights of a picture: each where its stencil is 0, or by its picture of visibility.

Lights whose volumes cannot meet in the picture share the stencil: those without any volume in view,
and those whose scissors are apart. They are counted one after another, and added by one draw of
their rectangles.

Transparent surfaces, layer by layer from the farthest, each lit like the opaque one.
"""

import ctypes
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass

from numpy.typing import NDArray

from umbra.gl.context import Device, release_all
from umbra.gl.masks import Counts
from umbra.gl.projection import CameraProjection, find_scissors
from umbra.gl.shading import MOST_LAMPS, Lamp, Lamps, Scissor, Shading
from umbra.gl.soft import SoftLights
from umbra.gl.state import State
from umbra.gl.surface_renderer import SurfaceRenderer
from umbra.gl.target import FACE, LIGHT, PLACE, PictureTargets, Target
from umbra.gl.transmitters import TransmitterTables
from umbra.gl.volume_counter import VolumeCounter
from umbra.gl.volume_plan import VolumePlan
from umbra.scene import Light
from umbra.scene.exposure import find_exposure
from umbra.soft import AreaLight, find_middles

__all__ = ["LightPasses", "ShownLights", "TransparentLayers"]

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
        projection: CameraProjection,
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
            for attachment in (LIGHT, PLACE, FACE):
                layer.surface.clear_color(0.0, attachment=attachment)
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


@dataclass(frozen=True, eq=False)
class ShownLights:
    """
    The lights of a picture, and how their shadows are found.

    Parameters
    ----------
    lights : sequence of Light or AreaLight
    plans : sequence of VolumePlan or None
        Of each light; None without shadows.
    counter : Counts
    softened : SoftLights
    tables : TransmitterTables, optional
        What weakens the lights.
    spares_turned : bool
        Any part has smooth normals, and the stencil holds counts.
    """

    lights: Sequence[Light | AreaLight]
    plans: Sequence[VolumePlan | None]
    counter: Counts
    softened: SoftLights
    tables: TransmitterTables | None
    spares_turned: bool


class LightPasses:
    """
    Adds lights to a lit surface.

    Parameters
    ----------
    shading : Shading
    lamps : Lamps
    measure : callable
        Measures a named pass while its result is open.
    """

    def __init__(
        self,
        shading: Shading,
        lamps: Lamps,
        measure: Callable[[str], AbstractContextManager[None]],
    ) -> None:
        self._shading, self._lamps, self._measure = shading, lamps, measure

    def add(
        self,
        state: State,
        targets: PictureTargets,
        projection: CameraProjection,
        shown: ShownLights,
        origin: NDArray,
    ) -> None:
        """
        Add all lights of a picture.

        Before: ``targets.light`` is in use. After: it includes the lights; its stencil is
        undefined.
        """
        middles = find_middles(shown.lights)
        exposure = find_exposure(len(middles))
        planned = [plan.scissor for plan in shown.plans if plan is not None]
        scissors = planned or find_scissors(projection.camera, origin, middles)
        lamps = {
            number: self._lamps.make(light, projection, origin, exposure)
            for number, (light, scissor) in enumerate(zip(middles, scissors, strict=True))
            if scissor is None or 0 not in scissor[2:]
        }
        alike, is_ready = self._find_alike(shown, lamps, scissors), False
        for group in alike:
            batch = [(number, lamps[number]) for number in group]
            is_ready = self._add_group(state, targets, projection, shown, batch, is_ready=is_ready)
        done = {number for group in alike for number in group}
        for number, lamp in lamps.items():
            if number not in done:
                arguments = (number, lamp, scissors[number])
                self._add_one(state, targets, projection, shown, *arguments, origin)

    def _find_alike(
        self, shown: ShownLights, lamps: dict[int, Lamp], scissors: Sequence[Scissor | None]
    ) -> list[list[int]]:
        """Group lights that share the stencil, and are added by one draw."""
        if shown.tables is not None or not isinstance(shown.counter, VolumeCounter):
            return []
        unshadowed: dict[tuple[str, ...], list[int]] = {}
        groups: dict[tuple[str, ...], list[list[int]]] = {}
        for number, lamp in lamps.items():
            plan = shown.plans[number]
            if number in shown.softened.areas or lamp.slide is not None:
                continue
            if plan is None or not (plan.draws or plan.start):
                unshadowed.setdefault(lamp.needs, []).append(number)
            elif plan.statistics.counts_in == "stencil":
                alike = groups.setdefault(lamp.needs, [])
                _join(alike, number, scissors)
        merged = [*unshadowed.values(), *(group for alike in groups.values() for group in alike)]
        return [list(batch) for group in merged for batch in _chop(group)]

    def _add_group(
        self,
        state: State,
        targets: PictureTargets,
        projection: CameraProjection,
        shown: ShownLights,
        group: list[tuple[int, Lamp]],
        *,
        is_ready: bool,
    ) -> bool:
        """
        Count the volumes of lights that share the stencil, and add the lights.

        Returns whether volumes were counted; then the counter ``is_ready`` for the next group.
        """
        plans = [plan for number, _ in group if (plan := shown.plans[number]) is not None]
        counted = [plan for plan in plans if plan.draws or plan.start]
        if counted:
            assert isinstance(shown.counter, VolumeCounter)
            with self._measure("shadows"):
                shown.counter.count_apart(state, counted, is_ready=is_ready)
        scissors = [None if (plan := shown.plans[n]) is None else plan.scissor for n, _ in group]
        given = (state, targets.surface, projection, [lamp for _, lamp in group], scissors)
        with self._measure("light"):
            self._shading.add_lights(*given, is_counted=bool(counted))
            if counted and shown.spares_turned:
                self._shading.add_lights(*given, is_counted=True, is_turned=True)
        return is_ready or bool(counted)

    def _add_one(
        self,
        state: State,
        targets: PictureTargets,
        projection: CameraProjection,
        shown: ShownLights,
        number: int,
        lamp: Lamp,
        scissor: Scissor | None,
        origin: NDArray,
    ) -> None:
        """Add one light by its stencil or its visibility."""
        plan, softened, counter = shown.plans[number], shown.softened, shown.counter
        with self._measure("shadows"):
            shares = softened.draw(state, targets.light, number)
            if shares is None and plan is not None:
                counter.count(state, targets.light, plan)
            elif shares is None:
                state.clear(stencil=0)
        with self._measure("light"):
            targets.light.use()
            if plan is not None and shown.tables is not None:
                lamp = shown.tables.weaken(lamp, shown.lights[number], projection, origin)
            given = (state, targets.surface, projection, lamp, scissor)
            in_stencil = plan is not None and plan.statistics.counts_in != "float"
            if plan is None or not (shown.spares_turned and in_stencil):
                self._shading.add_light(*given, shares)
                return
            extent = None if shares is None else softened.areas[number].radius
            self._shading.add_light(*given, shares, extent)
            if shares is not None:
                counter.count(state, targets.light, plan)
                targets.light.use()
            self._shading.add_turned(*given, least=1 if shares is None else 0)


def _join(groups: list[list[int]], number: int, scissors: Sequence[Scissor | None]) -> None:
    """Add a light to the first group whose scissors are all apart from its own."""
    own = scissors[number]
    for group in groups:
        if own is not None and all(_are_apart(own, scissors[other]) for other in group):
            group.append(number)
            return
    groups.append([number])


def _are_apart(first: Scissor, second: Scissor | None) -> bool:
    if second is None:
        return False
    left, bottom, cols, rows = first
    x, y, width, height = second
    return left >= x + width or x >= left + cols or bottom >= y + height or y >= bottom + rows


def _chop(group: list[int]) -> Iterator[list[int]]:
    """Cut a group into as many lights as one draw takes."""
    for first in range(0, len(group), MOST_LAMPS):
        yield group[first : first + MOST_LAMPS]
