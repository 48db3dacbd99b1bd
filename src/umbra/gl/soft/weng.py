"""
Scaled layers of the hard volume on OpenGL, after Weng, Daman and Rahim (2008).

As `umbra.soft.weng`, which says what a layer is: each is counted in the stencil by the saved
triangles of all of them, with one number changed, and darkens what it holds; the hard
volume comes last. Fragments of a layer fall away where its own component is seen.
"""

from collections.abc import Sequence

import numpy as np

from umbra.gl.context import release_all
from umbra.gl.count import Stack, VolumeCounter
from umbra.gl.plan import VolumeOptions, VolumePlan
from umbra.gl.planner import Planner
from umbra.gl.projection import Projection, find_source
from umbra.gl.resources import Indices
from umbra.gl.soft.growth import GrownPoints, Shown, part_bodies
from umbra.gl.soft.layers import LightLayers, grow, list_layers, plan_layers
from umbra.gl.state import State
from umbra.gl.target import Target
from umbra.soft.area import AreaLight
from umbra.soft.weng import GAP, LENGTH, count_layers, find_opacities

__all__ = ["ScaledLayers"]


class ScaledLayers:
    """
    Stacks the shadows of enlarged casters.

    Parameters
    ----------
    planner : Planner
        Whose casters throw the shadows.
    counter : VolumeCounter
        Of its plans.
    length, gap : float
        As in ``Softness``; `InputError` if they make no layer, or more than 1,000.
    choices : VolumeOptions, optional
    """

    def __init__(
        self,
        planner: Planner,
        counter: VolumeCounter,
        *,
        length: float = LENGTH,
        gap: float = GAP,
        choices: VolumeOptions | None = None,
    ) -> None:
        layers = count_layers(length, gap)
        self._opacities = find_opacities(layers)
        self._steps = [m * gap / 10 for m in range(1, layers + 1)]
        self._planner, self._hard = planner, counter
        self._choices = choices or VolumeOptions()
        device, scene = planner.device, planner.scene
        self._bodies, self._instances = part_bodies(planner.bodies)
        self._points = GrownPoints(device, self._instances)
        self._shown = Shown(device, scene, planner.geometry, self._instances, planner.casters)
        self._indices = Indices(device, 2 * self._points.n_points)
        self._counter = VolumeCounter(device, self._points, self._indices, grows=True)
        self._stack = Stack(device)
        self._layers: list[LightLayers] = []
        self._key = b""
        self._plans: list[list[VolumePlan]] = []
        self._middles: list[VolumePlan] = []
        self._projection: Projection | None = None
        self._is_shown = False

    def begin(
        self, projection: Projection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Make ready for a picture; see `Visibility`."""
        self._projection, self._middles, self._is_shown = projection, list(plans), False
        grown = self._grow(lights, plans)
        key = projection.matrix.tobytes() + projection.eye.tobytes()
        if (
            not grown
            and key == self._key
            and all(
                mine[0].scissor == plan.scissor
                for mine, plan in zip(self._plans, plans, strict=True)
            )
        ):
            return
        self._key = key
        origin, floor = self._planner.scene.origin, self._planner.floor
        lists, self._plans = [np.zeros(0, np.uint32)], []
        for layers, area, plan in zip(self._layers, lights, plans, strict=True):
            selection, draws, found = list_layers(
                layers, projection, area.light, origin, floor, self._choices, sum(map(len, lists))
            )
            lists += found
            self._plans.append(plan_layers(layers, plan, projection, selection, draws, self._steps))
        self._indices.write(np.concatenate(lists))

    def draw(self, state: State, target: Target, number: int) -> Target:
        """Draw a light's visibility; see `Visibility`."""
        if not self._is_shown:
            assert self._projection is not None
            self._points.shown = self._shown.draw(state, target, self._projection)
            self._is_shown = True
        shares = self._stack.begin(state, target, 1.0)
        points, scissor = self._points, self._middles[number].scissor
        points.light = number
        steps = zip(self._steps, self._plans[number], self._opacities[1:], strict=True)
        for growing, plan, opacity in reversed(list(steps)):
            points.growing = growing
            self._counter.count(state, shares, plan)
            self._stack.add_shadow(state, 1.0 - float(opacity), scissor)
        self._hard.count(state, shares, self._middles[number])
        self._stack.add_shadow(state, 1.0 - float(self._opacities[0]), scissor)
        return shares

    def _grow(self, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]) -> bool:
        """Find the layers of lights that moved; tell whether there were any."""
        found = []
        for number, (area, plan) in enumerate(zip(lights, plans, strict=True)):
            source = find_source(area.light, self._planner.scene.origin)
            old = self._layers[number] if number < len(self._layers) else None
            if old is not None and old.is_of(source, plan.volumes):
                found.append(old)
            else:
                found.append(
                    grow(self._bodies, self._instances, source, plan.volumes, self._steps[-1])
                )
        same = len(found) == len(self._layers) and all(
            one is two for one, two in zip(found, self._layers, strict=True)
        )
        self._layers = found
        if not same:
            growth = np.stack([each.growth for each in found]) if found else np.zeros(0)
            self._points.write(growth.astype(np.float32))
        return not same

    def release(self) -> None:
        """Free what is held on the device."""
        release_all(self._stack, self._counter, self._indices, self._shown, self._points)
