"""
Soft shadows on OpenGL: pictures of each light's visibility.

    __init__.py    samples; the methods and area lights of a scene
    visibility.py  interface of methods
    wedge_pictures.py  hard count, corrected along silhouette edges; depth keys, wedges
    complexity_pictures.py  counts at sample points of the light, from the hard count by edges
    weng_pictures.py   scaled layers of the hard volume, stacked, as one index list
    growth.py      points of enlarged casters, and the visible component at each pixel

Samples are hard shadows of many points of each light, averaged in floats (McGuire et al.
2003, section 4; Heckbert and Herf 1997), at the same points as on the CPU.

The hard volumes are the renderer's. A light's visibility replaces the stencil in its
light pass (``shading.py``). Results are those of ``umbra.soft`` on the CPU.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from umbra.gl.context import release_all
from umbra.gl.planner import Planner
from umbra.gl.projection import CameraProjection
from umbra.gl.selection import VolumeOptions
from umbra.gl.soft.complexity_pictures import SpotCounts
from umbra.gl.soft.visibility import Visibility
from umbra.gl.soft.wedge_pictures import Wedges
from umbra.gl.soft.weng_pictures import ScaledLayers
from umbra.gl.state import State
from umbra.gl.target import Target
from umbra.gl.volume_counter import Stack, VolumeCounter
from umbra.gl.volume_plan import VolumePlan
from umbra.methods import METHODS, Softness
from umbra.scene import Light
from umbra.soft import AreaLight
from umbra.soft.light_samples import SAMPLES

__all__ = ["SampledShadows", "SoftLights", "SoftMethods", "Visibility"]


_AT_ONCE = 64  # points whose volumes are in memory together, kept while nothing moves


class SampledShadows(Visibility):
    """Averages the hard shadows of many points of each light, as `soft/light_samples.py` does."""

    def __init__(
        self, planner: Planner, samples: int = SAMPLES, choices: VolumeOptions | None = None
    ) -> None:
        self._samples, self._turn = samples, (0, 1)
        self._each = samples
        # Points' ranges differ; only that of the light's centre limits the light. A face turned
        # from a point may look to the centre: its count must not be cut short.
        self._choices = replace(choices or VolumeOptions(), narrow=False).keep_exact()
        self._planner = planner.twin()
        self._counter = VolumeCounter(planner.device, planner.geometry, self._planner.indices)
        self._stack = Stack(planner.device)
        self._points: list[Light] = []
        self._projection: CameraProjection | None = None
        self._chunk = -1
        self._plans: list[VolumePlan] = []

    def take_turn(self, turn: int, turns: int) -> None:
        """Take a share of the points; see `Visibility`."""
        self._turn = turn, turns

    def begin(
        self, projection: CameraProjection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Prepare a picture; see `Visibility`."""
        turn, turns = self._turn
        self._each = -(-self._samples // turns)
        span = slice(turn * self._each, (turn + 1) * self._each)
        self._points = [p for light in lights for p in light.points(turns * self._each)[span]]
        self._points = [replace(point, range=np.inf) for point in self._points]
        self._projection, self._chunk = projection, -1

    def draw(self, state: State, target: Target, number: int) -> Target:
        """Draw a light's visibility; see `Visibility`."""
        shares = self._stack.begin(state, target, 0.0)
        for point in range(number * self._each, (number + 1) * self._each):
            self._counter.count(state, shares, self._find_plan(point))
            self._stack.add_light(state, 1.0 / self._each)
        return shares

    def _find_plan(self, point: int) -> VolumePlan:
        """Return the plan of one of all lights' points, which are planned in chunks."""
        chunk, index = divmod(point, _AT_ONCE)
        if chunk != self._chunk:
            assert self._projection is not None
            batch = self._points[chunk * _AT_ONCE : (chunk + 1) * _AT_ONCE]
            self._plans = self._planner.plan(self._projection, batch, choices=self._choices)
            self._chunk = chunk
        return self._plans[index]

    def release(self) -> None:
        """Free the device objects."""
        self._stack.release()
        self._counter.release()
        self._planner.release()


class SoftLights:
    """Area lights of a picture by number, and the method that draws their visibility."""

    def __init__(self, method: Visibility | None, areas: dict[int, AreaLight]) -> None:
        self._method, self.areas = method, areas
        self._places = {number: index for index, number in enumerate(areas)}

    def begin(self, projection: CameraProjection, plans: Sequence[VolumePlan | None]) -> None:
        """Prepare a picture; plans are the hard volumes of all its lights."""
        hard = [plan for number in self.areas if (plan := plans[number]) is not None]
        if self._method is not None:
            self._method.begin(projection, list(self.areas.values()), hard)

    def draw(self, state: State, target: Target, number: int) -> Target | None:
        """Draw a light's visibility, as in `Visibility`; None where its shadows are hard."""
        if self._method is None or number not in self.areas:
            return None
        return self._method.draw(state, target, self._places[number])


class SoftMethods:
    """Soft shadow methods over a planner's hard volumes."""

    def __init__(
        self,
        planner: Planner,
        counter: VolumeCounter,
        softness: Softness | None = None,
        choices: VolumeOptions | None = None,
    ) -> None:
        self._planner, self._counter = planner, counter
        self._softness = softness or Softness()
        self._choices = (choices or VolumeOptions()).keep_exact()
        self._made: dict[str, Visibility] = {}

    def take_turn(self, turn: int, turns: int) -> None:
        """Draw one of several pictures that will be averaged: it takes a share of the samples."""
        for method in self._made.values():
            method.take_turn(turn, turns)

    def refine(self, softness: Softness) -> None:
        """Set the resolution; methods of another resolution are made again."""
        if softness != self._softness:
            self.release()
        self._softness = softness

    def permit(self, choices: VolumeOptions | None) -> None:
        """Set the permitted simplifications; methods with others are made again."""
        if (choices or VolumeOptions()).keep_exact() != self._choices:
            self.release()
        self._choices = (choices or VolumeOptions()).keep_exact()

    def select(self, lights: Sequence[Light | AreaLight], name: str) -> SoftLights:
        """Find the area lights, and choose their method; raises as ``choose``."""
        areas = {
            number: light for number, light in enumerate(lights) if isinstance(light, AreaLight)
        }
        return SoftLights(self.choose(name) if areas else None, areas)

    def choose(self, name: str) -> Visibility:
        """Find the method of a name; `InputError` if the gl device has none."""
        METHODS["gl"].check_soft(name)
        if name not in self._made:
            self._made[name] = self._make(name)
        return self._made[name]

    def _make(self, name: str) -> Visibility:
        softness = self._softness
        if name == "samples":
            return SampledShadows(self._planner, softness.samples, self._choices)
        if name == "wedges":
            return Wedges(self._planner, self._counter)
        if name == "complexity":
            return SpotCounts(self._planner, self._counter, softness.spots)
        return ScaledLayers(
            self._planner, self._counter, length=softness.length, gap=softness.gap,
            choices=self._choices,
        )  # fmt: skip

    def release(self) -> None:
        """Free the methods; later use makes them again."""
        release_all(*self._made.values())
        self._made = {}
