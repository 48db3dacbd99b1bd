"""
Depth complexity on OpenGL: casters counted at sample points of the light, per pixel.

Laine et al. 2005; Forest, Barthe and Paulin 2008. As `umbra.soft.complexity`: each edge's wedge is
drawn as for `Wedges`, and a pixel adds the edge to the counts of the spots that it separates
from the light's centre. Several counts are packed in a float as digits of a number; additive
blending then adds to all at once, exactly below 2^24.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import release_all
from umbra.gl.planner import Planner
from umbra.gl.programs import Programs
from umbra.gl.projection import CameraProjection
from umbra.gl.soft.visibility import Visibility
from umbra.gl.soft.wedge_pictures import WedgePainter
from umbra.gl.state import Pass, State
from umbra.gl.target import SharedDepthTarget, Target
from umbra.gl.volume_counter import VolumeCounter
from umbra.gl.volume_plan import VolumePlan
from umbra.soft import AreaLight
from umbra.soft.complexity import make_spots

__all__ = ["SpotCounts", "find_digits"]

_PICTURES = 7  # of counts drawn at once; with the edges' 8, which every driver supports
_DIGITS = {4: 64, 3: 256, 2: 4096, 1: 1 << 24}  # base by digits per float, exact up to 2^24


class SpotCounts(Visibility):
    """
    Counts the casters that hide sample points (spots) of each light.

    Parameters
    ----------
    planner : Planner
        Planner of the casters.
    counter : VolumeCounter
        Counter of its plans.
    spots : int
        As in ``Softness``; `InputError` if there is none, or more than 4,096.
    """

    def __init__(self, planner: Planner, counter: VolumeCounter, spots: int) -> None:
        self._device, self._counter, self._n_spots = planner.device, counter, spots
        self._painter = WedgePainter(planner)
        self._sum = Programs(self._device, "picture.vert.glsl", "spots.frag.glsl")
        self._estimate = Programs(self._device, "picture.vert.glsl", "complexity.frag.glsl")
        self._counts: dict[int, SharedDepthTarget] = {}
        self._sums = SharedDepthTarget(self._device, "rgba32f", "rgba32f")
        self._shares = SharedDepthTarget(self._device, "r32f")
        self._lights: Sequence[AreaLight] = ()
        self._plans: Sequence[VolumePlan] = ()

    def begin(
        self, projection: CameraProjection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Prepare a picture; see `Visibility`."""
        self._lights, self._plans = lights, plans
        self._painter.begin(projection, lights, plans)

    def draw(self, state: State, target: Target, number: int) -> Target:
        """Draw a light's visibility; see `Visibility`."""
        self._painter.draw_keys(state, target)
        plan = self._plans[number]
        hard = self._counter.count_in_floats(state, target, plan)
        sums, shares = self._sums.over(target), self._shares.over(target)
        _clear(state, sums)
        spots = make_spots(self._lights[number], self._n_spots)
        digits = find_digits(plan.statistics.deepest)
        most = 4 * digits * _PICTURES
        for first in range(0, len(spots), most):
            batch = spots[first : first + most]
            pictures = -(-len(batch) // (4 * digits))
            counts = self._find_counts(pictures).over(target)
            _clear(state, counts)
            self._draw_counts(state, number, batch, pictures, digits)
            self._add_up(state, hard, counts, sums, len(batch), digits)
        shares.use()
        state.use(Pass(color_write=True))
        for unit, (picture, attachment) in enumerate(
            ((hard, 0), (counts, 0), (sums, 0), (sums, 1))
        ):
            picture.bind(unit, attachment)
        self._painter.bind_keys(4)
        for needs in ((), ("IS_DOUBTED",)):
            program = self._estimate.find(*needs)
            program.set(
                hard=0, parts=1, hidden=2, sums=3, keys=4, n_spots=float(len(spots)),
                **plan.projection.rays,
            )  # fmt: skip
            program.draw(3)
        return shares

    def _draw_counts(
        self, state: State, number: int, spots: NDArray[np.float64], pictures: int, digits: int
    ) -> None:
        """Add all edges to the counts of ``spots``, in the target in use."""
        padded = np.zeros((4 * digits * pictures, 2), np.float32)
        padded[: len(spots)] = spots
        x, y = (np.ascontiguousarray(column.reshape(-1, 4)) for column in padded.T)
        self._painter.draw(
            state, number, self._plans[number], "HAS_SPOTS",
            uniforms={"spots_x": x, "spots_y": y},
            PICTURES=pictures, DIGITS=digits, BASE=f"{_DIGITS[digits]}.0",
        )  # fmt: skip

    def _add_up(
        self, state: State, hard: Target, counts: Target, sums: Target, n: int, digits: int
    ) -> None:
        """Add the sum of the counts of n spots."""
        pictures = len(counts.textures) - 1
        program = self._sum.find(PICTURES=pictures, DIGITS=digits, BASE=f"{_DIGITS[digits]}.0")
        sums.use()
        state.use(Pass(color_write=True, blend="add"))
        hard.bind(0)
        for attachment in range(pictures):
            counts.bind(1 + attachment, 1 + attachment)
        names = {f"counts{attachment}": 1 + attachment for attachment in range(pictures)}
        program.set(hard=0, n_spots=n, **names)
        program.draw(3)

    def _find_counts(self, pictures: int) -> SharedDepthTarget:
        if pictures not in self._counts:
            formats = ("rgba32f",) * (1 + pictures)
            self._counts[pictures] = SharedDepthTarget(self._device, *formats)
        return self._counts[pictures]

    def release(self) -> None:
        """Free the device objects."""
        release_all(*self._counts.values(), self._sums, self._shares)
        release_all(self._painter, self._sum, self._estimate)
        self._counts = {}


def find_digits(deepest: int) -> int:
    """Find how many counts fit a float; partial sums may reach twice the final count."""
    return next((n for n, base in _DIGITS.items() if 4 * deepest <= base), 1)


def _clear(state: State, target: Target) -> None:
    """Use a target, and fill all its attachments with 0."""
    target.fill(state, 0.0)
    for attachment in range(1, len(target.textures)):
        target.clear_color(0.0, attachment=attachment)
