"""
Hard shadows counted at reduced resolution: upsampled visibility of each light.

Same result as `find_shares` of a frame, kept on the device.
"""

from collections.abc import Callable, Sequence

from umbra.gl.context import release_all
from umbra.gl.count import Stack, VolumeCounter
from umbra.gl.masks.counter import MaskCounters
from umbra.gl.masks.passes import Tally
from umbra.gl.masks.upsampling import Upsampler, shrink
from umbra.gl.plan import VolumePlan
from umbra.gl.planner import Planner
from umbra.gl.projection import Projection
from umbra.gl.soft import SoftLights
from umbra.gl.soft.visibility import Visibility
from umbra.gl.state import State
from umbra.gl.surfaces import SurfaceRenderer
from umbra.gl.target import LIGHT, PLACE, Target, find_surface_formats
from umbra.scene import Light
from umbra.soft import AreaLight

__all__ = ["SmallMasks"]

_LIT = (0.5, 1.0)


class SmallMasks(Visibility):
    """
    Visibility of each hard light at each pixel, from a mask of reduced resolution.

    Its lights are chosen by ``select``.

    Parameters
    ----------
    planner : Planner
    surfaces : SurfaceRenderer
    masks : MaskCounters
    find_surface : callable
        Returns the picture's own surface target.
    """

    def __init__(
        self,
        planner: Planner,
        surfaces: SurfaceRenderer,
        masks: MaskCounters,
        find_surface: Callable[[], Target],
    ) -> None:
        self._scene, self._surfaces, self._masks = planner, surfaces, masks
        self._find_surface = find_surface
        self._choice = ("auto", 1, "joint")
        self._plans: list[VolumePlan] = []
        self._projections: tuple[Projection, Projection] | None = None
        self._is_drawn = False
        self._held: _Held | None = None

    def select(
        self, lights: Sequence[Light], method: str, scale: int, kind: str = "joint"
    ) -> SoftLights:
        """Count all lights by a method, in ``scale`` times fewer columns and rows."""
        self._choice = method, scale, kind
        return SoftLights(self, {n: AreaLight(light, 0.0) for n, light in enumerate(lights)})

    def begin(
        self, projection: Projection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Plan the reduced picture; see `Visibility`."""
        method, scale, _ = self._choice
        held = self._held = self._held or _Held(self._scene)
        small = held.planner.project(shrink(projection.asked, scale))
        _, method = self._masks.choose(method, held.counter)
        self._plans = held.planner.plan(small, [light.light for light in lights], method)
        self._projections, self._is_drawn = (projection, small), False

    def draw(self, state: State, target: Target, number: int) -> Target:
        """Draw a light's visibility; see `Visibility`."""
        assert self._held is not None
        assert self._projections is not None
        held, (projection, small) = self._held, self._projections
        surface = held.find_target(small.camera.size)
        if not self._is_drawn:
            surface.begin(state)
            for place in (LIGHT, PLACE):
                surface.clear_color(0.0, place=place)
            self._surfaces.draw(state, small, self._scene.ground)
            self._is_drawn = True
        method, _, kind = self._choice
        counter, _ = self._masks.choose(method, held.counter)
        mask = held.small.begin(state, surface, 1.0)
        counter.count(state, mask, self._plans[number])
        mask.use()
        held.small.add_shadow(state, 0.0, self._plans[number].scissor)
        shares = held.large.begin(state, target, 1.0)
        held.find_upsampler(kind).apply(
            state, projection, mask, self._find_surface(), Tally(), mask_places=surface,
            channel=0, lit=_LIT, dark=0.0, scale=target.size[1] / mask.size[1],
        )  # fmt: skip
        return shares

    def release(self) -> None:
        """Free the device objects; later use makes them again."""
        release_all(self._held)
        self._held = None


class _Held:
    """Device objects of small masks."""

    def __init__(self, planner: Planner) -> None:
        self._device = device = planner.device
        self.planner = planner.twin()
        self.counter = VolumeCounter(device, planner.geometry, self.planner.indices)
        self.small, self.large = Stack(device), Stack(device)
        self._upsamplers: dict[str, Upsampler] = {}
        self._target: Target | None = None

    def find_target(self, size: tuple[int, int]) -> Target:
        """Return the target of small surfaces."""
        if self._target is None or self._target.size != size:
            self.small.release()
            self.small = Stack(self._device)
            release_all(self._target)
            self._target = Target(self._device, size, find_surface_formats("rgba16f"))
        return self._target

    def find_upsampler(self, kind: str) -> Upsampler:
        """Return the upsampler of a filter."""
        if kind not in self._upsamplers:
            self._upsamplers[kind] = Upsampler(self._device, kind)
        return self._upsamplers[kind]

    def release(self) -> None:
        """Free the device objects."""
        release_all(*self._upsamplers.values(), self.small, self.large, self._target)
        release_all(self.counter, self.planner)
