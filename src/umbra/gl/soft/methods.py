"""The methods of soft shadows of one scene, and which lights of a picture they are for."""

from collections.abc import Sequence
from dataclasses import dataclass

from umbra.gl.context import release_all
from umbra.gl.count import VolumeCounter
from umbra.gl.plan import VolumeOptions, VolumePlan
from umbra.gl.planner import Planner
from umbra.gl.projection import Projection
from umbra.gl.soft.visibility import SampledShadows, Visibility
from umbra.gl.soft.wedges import Wedges
from umbra.gl.soft.weng import ScaledLayers
from umbra.gl.state import State
from umbra.gl.target import Target
from umbra.methods import METHODS
from umbra.scene import Light
from umbra.soft.area import AreaLight
from umbra.soft.samples import SAMPLES
from umbra.soft.weng import GAP, LENGTH

__all__ = ["SoftLights", "SoftMethods", "Softness"]


@dataclass(frozen=True, kw_only=True)
class Softness:
    """
    How finely methods work.

    Parameters
    ----------
    samples : int
        Points that stand for a light.
    length, gap : float
        How far the widest scaled layer goes, and from each to the next, in tenths of the
        silhouette's radius.
    """

    samples: int = SAMPLES
    length: float = LENGTH
    gap: float = GAP


class SoftLights:
    """Those of a picture's lights that have a size, by number, and what draws their visibility."""

    def __init__(self, method: Visibility | None, areas: dict[int, AreaLight]) -> None:
        self._method, self.areas = method, areas
        self._places = {number: place for place, number in enumerate(areas)}

    def begin(self, projection: Projection, plans: Sequence[VolumePlan | None]) -> None:
        """Make ready for a picture; plans are the hard volumes of all its lights."""
        found = [plan for number in self.areas if (plan := plans[number]) is not None]
        if self._method is not None:
            self._method.begin(projection, list(self.areas.values()), found)

    def draw(self, state: State, target: Target, number: int) -> Target | None:
        """Draw a light's visibility, as `Visibility` does; None where its shadows are hard."""
        if self._method is None or number not in self.areas:
            return None
        return self._method.draw(state, target, self._places[number])


class SoftMethods:
    """Soft shadows beside the hard ones of a planner's plans."""

    def __init__(
        self,
        planner: Planner,
        counter: VolumeCounter,
        softness: Softness | None = None,
        choices: VolumeOptions | None = None,
    ) -> None:
        self._planner, self._counter = planner, counter
        self._softness, self._choices = softness or Softness(), choices
        self._made: dict[str, Visibility] = {}

    def select(self, lights: Sequence[Light | AreaLight], name: str) -> SoftLights:
        """Find the lights with a size, and choose what draws them; raises as ``choose``."""
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
        return ScaledLayers(
            self._planner, self._counter, length=softness.length, gap=softness.gap,
            choices=self._choices,
        )  # fmt: skip

    def release(self) -> None:
        """Free them; they are made anew when asked for again."""
        release_all(*self._made.values())
        self._made = {}
