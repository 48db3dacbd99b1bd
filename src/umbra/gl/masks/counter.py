"""
Masks of frames: counts of a plan by one method, instead of the stencil.

The number of volumes that a method supports depends on the device's rounding, and is measured.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device, release_all
from umbra.gl.geometry import Geometry
from umbra.gl.masks import MASKS, Counts, Method
from umbra.gl.masks.passes import MaskPainter
from umbra.gl.masks.volume_pieces import VolumePieces, make_pieces
from umbra.gl.programs import Program
from umbra.gl.state import State
from umbra.gl.target import SharedDepthTarget, Target
from umbra.gl.volume_counter import mark_shadow
from umbra.gl.volume_plan import VolumePlan

__all__ = ["MaskCounter", "MaskCounters", "find_limit"]

_POWER_OF_TWO = 0.5  # mantissa of a power of two, from ``numpy.frexp``
_DEEPEST = 2  # of the initial states: lit, in one shadow, in two


def find_limit(device: Device, method: Method, painter: MaskPainter) -> int:
    """
    Find how many fronts and backs a batch may have before lit and shadow become ambiguous.

    A pixel runs through all states and back in the method's own target, because the driver
    decides whether 255 / 2 is 127 or 128. At most ``method.at_once``; 0 if the method does
    not work on this device.
    """
    steps = (method.up, method.down)
    first, second = steps if method.first == "up" else steps[::-1]
    with Target(device, (1, 1), (method.format,)) as target, State(device) as state:
        for limit in range(method.at_once):
            for before in range(_DEEPEST + 1):
                target.fill(state, method.start)
                for step in [method.up] * before + [first] * (limit + 1) + [second] * (limit + 1):
                    painter.draw_rectangle(state, step, method.write)
                for step in method.black:
                    painter.draw_rectangle(state, step, method.write)
                value = float(target.read()[0, 0, method.channel])
                value /= 255.0 if method.format == "rgba8" else 1.0
                # Half of 255 is not exact: a lit pixel returns to 254 or 255.
                is_lit = method.lit[0] <= value <= method.lit[1]
                if is_lit != (before == 0):
                    return limit
    return method.at_once


class MaskCounter:
    """
    Counts planned volumes by a method; same interface as ``umbra.gl.volume_counter.VolumeCounter``.

    Parameters
    ----------
    device : Device
    geometry : Geometry
    method : Method
    split : bool
        Split casters to stay within the method's domain; otherwise draw them whole, in
        order.
    warn : callable
        Called with one line where the method may be wrong.

    Attributes
    ----------
    limit : int
        Most fronts, or backs, of a batch on one line on this device.
    pieces : Pieces, optional
        Pieces of the last plan.
    painter : MaskPainter
    """

    def __init__(
        self,
        device: Device,
        geometry: Geometry,
        method: Method,
        *,
        split: bool = True,
        warn: Callable[[str], object] = lambda _: None,
    ) -> None:
        self._device, self.method, self._split, self._warn = device, method, split, warn
        self.painter = MaskPainter(device, geometry)
        self._mark = Program(device, "picture.vert.glsl", "unlit.frag.glsl")
        self.limit = find_limit(device, method, self.painter)
        self.pieces: VolumePieces | None = None
        self._plan: VolumePlan | None = None
        self._mask = SharedDepthTarget(device, method.format)

    def find_pieces(self, plan: VolumePlan) -> VolumePieces:
        """Split a plan's volumes; the last plan's pieces are kept."""
        if self.pieces is None or self._plan is not plan:
            self.pieces = make_pieces(plan, max(self._room(plan), 1), split=self._split)
            self._plan = plan
            for line in self._find_faults(self.pieces):
                self._warn(line)
        return self.pieces

    def _room(self, plan: VolumePlan) -> int:
        """Return the batch limit: lower where values determine counts, so that few are lost."""
        if not self.method.counts:
            return self.limit
        return max(self.limit - plan.statistics.deepest, self.limit // 3)

    def _find_faults(self, pieces: VolumePieces) -> list[str]:
        """Describe, one line each, how a plan's pieces exceed the method's domain."""
        name, lines = self.method.name, []
        if self.limit == 0:
            lines.append(f"{name} is wrong on {self._device.renderer}, which rounds otherwise")
        if self.limit and pieces.widest > self.limit:
            wide = sum(batch.weight > self.limit for batch in pieces.batches)
            lines.append(
                f"{name} may be wrong: {wide} casters are not convex and hide a line up to "
                f"{pieces.widest} times, where it bears {self.limit}; let it split casters"
            )
        return lines

    def count(
        self, state: State, target: Target, plan: VolumePlan, *, is_clear: bool = False
    ) -> None:
        """
        Count the shadow volumes that hold each visible surface, and mark shadow in the stencil.

        As ``VolumeCounter.count``, for a plan by the method ``auto``. After: stencil 1 is shadow.
        """
        self.painter.tally.clear()
        mask = self._mask.over(target)
        mask.fill(state, self.method.start)
        self.painter.draw_volumes(state, self.method, plan, self.find_pieces(plan))
        for step in self.method.black:
            self.painter.draw_rectangle(state, step, self.method.write)
        target.use()
        if not is_clear:
            state.clear(stencil=0, scissor=plan.scissor)
        low, high = self.method.lit
        mark_shadow(
            state, self._mark, mask, mask=0, channel=self.method.channel, low=low, high=high
        )

    def read(self, target: Target, plan: VolumePlan) -> NDArray[np.int32]:
        """
        Read the counts of the last ``count``, (rows, cols) int32, row 0 at the top.

        1 for any count but 0, unless the method determines counts: exact at least up to two
        thirds of ``limit``, and ``limit`` + 1 beyond.
        """
        shaded = target.read_stencil().astype(np.int32)
        if not self.method.counts or self._mask.target is None:
            return shaded
        # An overflow is infinite or, on some devices, clamped: never again a power of two.
        values = self._mask.target.read()[..., self.method.channel]
        sound = np.frexp(values)[0] == _POWER_OF_TWO
        counts = np.full(values.shape, self.limit + 1, np.int32)
        counts[sound] = np.rint(np.log2(values[sound] / self.method.start)).astype(np.int32)
        return np.where(shaded == 0, 0, counts).astype(np.int32)

    def release(self) -> None:
        """Free the device objects."""
        self._mask.release()
        self._mark.release()
        self.painter.release()


class MaskCounters:
    """The counters of one scene by method, each made on first use."""

    def __init__(
        self, device: Device, geometry: Geometry, warn: Callable[[str], object] = lambda _: None
    ) -> None:
        self._device, self._geometry, self._warn = device, geometry, warn
        self._made: dict[str, MaskCounter] = {}

    def choose(self, method: str, stencil: Counts) -> tuple[Counts, str]:
        """Find the counter of a method (by default the stencil), and the method to plan by."""
        if method not in MASKS:
            return stencil, method
        if method not in self._made:
            self._made[method] = MaskCounter(
                self._device, self._geometry, MASKS[method], warn=self._warn
            )
        return self._made[method], "mcguire"  # counts start in light

    def release(self) -> None:
        """Free the counters."""
        release_all(*self._made.values())
        self._made = {}
