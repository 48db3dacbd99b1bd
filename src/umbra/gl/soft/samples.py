"""
Samples on OpenGL: hard shadows of many points of each light, averaged in floats.

McGuire et al. 2003, section 4; Heckbert and Herf 1997. The points are the CPU's.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from umbra.gl.count import Counter
from umbra.gl.plan import Choices, Plan, Planner
from umbra.gl.projection import Projection
from umbra.gl.soft.visibility import Stack
from umbra.gl.state import State
from umbra.gl.target import Target
from umbra.scene import Light
from umbra.soft.area import AreaLight
from umbra.soft.samples import SAMPLES

__all__ = ["Samples"]

_AT_ONCE = 64  # points whose volumes are kept in memory together, and while nothing moves


class Samples:
    """
    Averages the hard shadows of points of a light, as `umbra.soft.samples` does.

    Parameters
    ----------
    planner : Planner
        Whose casters throw the shadows.
    samples : int
        Points of each light.
    choices : Choices, optional
        What may be left out.
    """

    def __init__(
        self, planner: Planner, samples: int = SAMPLES, choices: Choices | None = None
    ) -> None:
        self.samples = samples
        # What one point's range does not reach another's may, and the light's middle decides.
        self._choices = replace(choices or Choices(), narrow=False)
        self._planner = planner.twin()
        self._counter = Counter(planner.device, planner.geometry, self._planner.indices)
        self._stack = Stack(planner.device)
        self._points: list[Light] = []
        self._projection: Projection | None = None
        self._chunk = -1
        self._plans: list[Plan] = []

    def begin(
        self, projection: Projection, lights: Sequence[AreaLight], plans: Sequence[Plan]
    ) -> None:
        """Make ready for a picture; see `Visibility`."""
        self._points = [point for light in lights for point in light.points(self.samples)]
        self._points = [replace(point, range=np.inf) for point in self._points]
        self._projection, self._chunk = projection, -1

    def draw(self, state: State, target: Target, number: int) -> Target:
        """Draw a light's visibility; see `Visibility`."""
        shares = self._stack.begin(state, target, 0.0)
        for point in range(number * self.samples, (number + 1) * self.samples):
            self._counter.count(state, shares, self._find_plan(point))
            self._stack.add_light(state, 1.0 / self.samples)
        return shares

    def _find_plan(self, point: int) -> Plan:
        """Give the plan of one of all lights' points; plans hold for a chunk of them."""
        chunk, place = divmod(point, _AT_ONCE)
        if chunk != self._chunk:
            assert self._projection is not None
            some = self._points[chunk * _AT_ONCE : (chunk + 1) * _AT_ONCE]
            self._plans = self._planner.plan(self._projection, some, choices=self._choices)
            self._chunk = chunk
        return self._plans[place]

    def release(self) -> None:
        """Free what is held on the device."""
        self._stack.release()
        self._counter.release()
        self._planner.release()
