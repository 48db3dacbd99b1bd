"""Interface of soft shadow methods: pictures of each light's visibility."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

from umbra.gl.projection import CameraProjection
from umbra.gl.state import State
from umbra.gl.target import Target
from umbra.gl.volume_plan import VolumePlan
from umbra.soft import AreaLight

__all__ = ["Visibility"]


class Visibility(ABC):
    """Visibility of each light of a picture at each pixel, by one method."""

    def take_turn(self, turn: int, turns: int) -> None:  # noqa: B027
        """Draw one of several pictures that will be averaged; those that sample take a share."""

    @abstractmethod
    def begin(
        self, projection: CameraProjection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Prepare a picture; plans are the hard volumes of the lights' centres."""

    @abstractmethod
    def draw(self, state: State, target: Target, number: int) -> Target:
        """
        Draw the visibility of a light by number.

        Before: the target's depth holds the scene. After: the returned target, shared by all
        lights, holds the visibility in attachment 0, from 0 to 1; the stencil is undefined.
        """

    @abstractmethod
    def release(self) -> None:
        """Free the device objects."""
