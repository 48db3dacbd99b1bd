"""What a method of soft shadows is, and the picture in which a light's visibility is laid up."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from umbra.gl.companion import Companion
from umbra.gl.context import Device
from umbra.gl.indices import draw_plain
from umbra.gl.plan import Plan
from umbra.gl.programs import Program
from umbra.gl.projection import Projection
from umbra.gl.state import Pass, State, Stencil
from umbra.gl.target import Target
from umbra.soft.area import AreaLight

__all__ = ["Stack", "Visibility"]

_IN_SHADOW = Stencil(test="notequal", reference=0)
_LIT = Stencil(test="equal", reference=0)


class Visibility(Protocol):
    """What share of each light of a picture reaches each pixel, by one method."""

    def begin(
        self, projection: Projection, lights: Sequence[AreaLight], plans: Sequence[Plan]
    ) -> None:
        """
        Make ready for a picture.

        Parameters
        ----------
        projection : Projection
        lights : sequence of AreaLight
        plans : sequence of Plan
            The hard volumes of their middles, by any method.
        """

    def draw(self, state: State, target: Target, number: int) -> Target:
        """
        Draw a light's visibility.

        Before: the target's depth holds the scene. After: the target that is returned, shared
        by all lights, holds the visibility in attachment 0, from 0 to 1; the stencil means
        nothing.

        Parameters
        ----------
        state : State
        target : Target
        number : int
            Of the light.
        """

    def release(self) -> None:
        """Free what is held on the device."""


class Stack:
    """
    A picture of one number a pixel, on which the stencil's shadows are laid one by one.

    Counts are made in the picture itself, which has the scene's depth: a device in software
    finishes all that was asked for whenever another framebuffer is used.

    Parameters
    ----------
    device : Device

    Attributes
    ----------
    picture : Companion
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._tint = Program(device, "picture.vert.glsl", "tint.frag.glsl")
        self.picture = Companion(device, "r32f")

    def begin(self, state: State, target: Target, value: float) -> Target:
        """Fill the picture that goes with a target's depth with a value; it is in use."""
        shown = self.picture.over(target)
        shown.use()
        state.use(Pass(color_write=True))
        shown.clear_color(value)
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
        draw_plain(self._device, self._tint, 3)

    def release(self) -> None:
        """Free the picture and the program."""
        self.picture.release()
        self._tint.release()
