"""
Methods of soft shadows: the protocol, the picture of a light's visibility, and samples.

Samples are hard shadows of many points of each light, averaged in floats (McGuire et al.
2003, section 4; Heckbert and Herf 1997). The points are the CPU's.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from umbra.gl.context import Device
from umbra.gl.count import VolumeCounter
from umbra.gl.plan import VolumeOptions, VolumePlan
from umbra.gl.planner import Planner
from umbra.gl.programs import Program
from umbra.gl.projection import Projection
from umbra.gl.state import Pass, State, Stencil
from umbra.gl.target import SharedDepthTarget, Target
from umbra.scene import Light
from umbra.soft.area import AreaLight
from umbra.soft.samples import SAMPLES

__all__ = ["SampledShadows", "Stack", "Visibility"]

_IN_SHADOW = Stencil(test="notequal", reference=0)
_LIT = Stencil(test="equal", reference=0)


class Visibility(Protocol):
    """What share of each light of a picture reaches each pixel, by one method."""

    def begin(
        self, projection: Projection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Make ready for a picture; plans are the hard volumes of the lights' middles."""

    def draw(self, state: State, target: Target, number: int) -> Target:
        """
        Draw the visibility of the light of a number.

        Before: the target's depth holds the scene. After: the target that is returned, shared
        by all lights, holds the visibility in attachment 0, from 0 to 1; the stencil means
        nothing.
        """

    def release(self) -> None:
        """Free what is held on the device."""


class Stack:
    """
    A picture of one number a pixel, on which the stencil's shadows are laid one by one.

    Counts are made in the picture itself, which has the scene's depth: a device in software
    finishes all that was asked for whenever another framebuffer is used.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._tint = Program(device, "picture.vert.glsl", "tint.frag.glsl")
        self.picture = SharedDepthTarget(device, "r32f")

    def begin(self, state: State, target: Target, value: float) -> Target:
        """Fill the picture that goes with a target's depth with a value; it is in use."""
        shown = self.picture.over(target)
        shown.fill(state, value)
        return shown

    def add_light(self, state: State, share: float, scissor: tuple | None = None) -> None:
        """Add a share of the light where the stencil is 0."""
        self._lay(state, Pass(color_write=True, blend="add", stencil=_LIT, scissor=scissor), share)

    def add_shadow(self, state: State, left: float, scissor: tuple | None = None) -> None:
        """Leave a part of the light where the stencil is not 0."""
        blend = Pass(color_write=True, blend="multiply", stencil=_IN_SHADOW, scissor=scissor)
        self._lay(state, blend, left)

    def _lay(self, state: State, how: Pass, value: float) -> None:
        state.use(how)
        self._tint.set(tint=np.full(4, value))
        self._tint.draw(3)

    def release(self) -> None:
        """Free the picture and the program."""
        self.picture.release()
        self._tint.release()


_AT_ONCE = 64  # points whose volumes are kept in memory together, and while nothing moves


class SampledShadows:
    """Averages the hard shadows of many points of each light, as `umbra.soft.samples` does."""

    def __init__(
        self, planner: Planner, samples: int = SAMPLES, choices: VolumeOptions | None = None
    ) -> None:
        self.samples = samples
        # What one point's range does not reach another's may, and the light's middle decides.
        self._choices = replace(choices or VolumeOptions(), narrow=False)
        self._planner = planner.twin()
        self._counter = VolumeCounter(planner.device, planner.geometry, self._planner.indices)
        self._stack = Stack(planner.device)
        self._points: list[Light] = []
        self._projection: Projection | None = None
        self._chunk = -1
        self._plans: list[VolumePlan] = []

    def begin(
        self, projection: Projection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
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

    def _find_plan(self, point: int) -> VolumePlan:
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
