"""
Shadow counts of the visible surface: in the stencil, or in floats beyond 255.

Volumes are wound outward. In front of the surface (z-pass) a front face increments and a
back face decrements; behind it (z-fail) the reverse (docs/papers.md, M1). Operations wrap, so
the order of faces does not matter. A fragment on the surface counts as behind it:
the depth test is LESS, and light caps, which lie in the surface, use NEVER.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device, release_all
from umbra.gl.foreign import ForeignTarget, check_counting
from umbra.gl.geometry import FIRST_UNIT, Geometry
from umbra.gl.multisampling import draw_samples
from umbra.gl.programs import Program, Programs
from umbra.gl.resources import Indices
from umbra.gl.state import ALL_BITS, Pass, State, Stencil, one_sided
from umbra.gl.target import SharedDepthTarget, Target
from umbra.gl.volume_plan import LIGHT_CAP, Z_FAIL, Z_PASS, Draw, VolumePlan

if TYPE_CHECKING:
    from umbra.gl.soft.growth import GrownPoints

__all__ = ["COUNT_BITS", "Stack", "VolumeCounter", "find_slack", "mark_shadow"]

_BEFORE = Stencil(front_depth_pass="up", back_depth_pass="down")
_BEHIND = Stencil(front_depth_fail="down", back_depth_fail="up")

# Depth is clamped: z-fail needs all faces behind, to infinity, and z-pass in perspective all
# in front, from ``Projection.clipping``'s near plane, where the shader clips: z-pass starts
# with the count in that plane. The depth buffer's own near plane is at the nearest surface.
_VOLUME = Pass(depth_clamp=True, clip_near=True)
IN_STENCIL = {
    Z_PASS: replace(_VOLUME, depth_test="less", stencil=_BEFORE),
    Z_FAIL: replace(_VOLUME, depth_test="less", stencil=_BEHIND),
    LIGHT_CAP: replace(_VOLUME, depth_test="never", stencil=_BEHIND),
}
"""Passes that count in the stencil."""
COUNT_BITS = 0x7F
"""Of a stencil whose highest bit is kept."""
_BESIDE_KEPT = {
    kind: replace(how, stencil=replace(how.stencil, bits=COUNT_BITS))
    for kind, how in IN_STENCIL.items()
    if how.stencil is not None
}

IN_FLOATS = {
    kind: replace(_VOLUME, depth_test=test, color_write=True, blend="add")
    for kind, test in ((Z_PASS, "less"), (Z_FAIL, "gequal"), (LIGHT_CAP, "always"))
}
"""The same, adding to a float: what would fail the depth test there passes here."""

_IN_SHADOW, _LIT = Stencil(test="notequal"), Stencil(test="equal")
_FRONT = {Z_PASS: 1.0, Z_FAIL: -1.0, LIGHT_CAP: -1.0}
_MARK = Pass(stencil=Stencil(front_depth_pass="replace", back_depth_pass="replace", reference=1))
_NEARBY_UNIT = FIRST_UNIT + 3


class VolumeCounter:
    """
    Counts planned shadow volumes.

    Parameters
    ----------
    device : Device
    geometry : Geometry
    indices : Indices
        Index lists of the plans' draws.
    two_sided : bool
        Count fronts and backs in one pass; in two where drivers are wrong.
    grows : bool
        The geometry is of enlarged casters (``umbra.gl.soft``).
    """

    def __init__(
        self,
        device: Device,
        geometry: "Geometry | GrownPoints",
        indices: Indices,
        *,
        two_sided: bool = True,
        grows: bool = False,
    ) -> None:
        self._device, self._geometry, self._indices = device, geometry, indices
        self._two_sided = two_sided
        self._needs = ("GROWS",) if grows else ()
        self._in_stencil, self._in_floats = (
            Programs(device, "volume.vert.glsl", fragment)
            for fragment in ("nothing.frag.glsl", "count.frag.glsl")
        )
        self._mark = Programs(device, "picture.vert.glsl", "mask.frag.glsl")
        self._floats = SharedDepthTarget(device, "r32f")

    def count(
        self,
        state: State,
        target: "Target | ForeignTarget",
        plan: VolumePlan,
        *,
        is_clear: bool = False,
        bits: int = ALL_BITS,
        wraps: bool = False,
    ) -> None:
        """
        Count, in the stencil, the shadow volumes that hold each visible surface.

        Before: the target's depth holds the scene in ``plan.projection``. After: stencil 0
        means lit. It holds the count, or 1 for any other count where more than 255 volumes
        may overlap (``plan.statistics.counts_in``); the target is in use. Outside
        ``plan.scissor`` the stencil is undefined.

        Parameters
        ----------
        state : State
        target : Target
        plan : VolumePlan
        is_clear : bool
            The target is in use and its stencil is 0.
        bits : int
            Of the stencil: all, or `COUNT_BITS`, for counts in it that these can hold.
        wraps : bool
            Count modulo 256 where more volumes may overlap.
        """
        if not isinstance(target, Target):  # another program's, which made itself no promise
            target.use()
            check_counting(self._device, plan, wraps=wraps)
        if plan.statistics.counts_in == "float" and isinstance(target, Target) and not wraps:
            floats = self.count_in_floats(state, target, plan)
            target.use()
            state.clear(stencil=0)
            floats.bind(0)
            draw_samples(state, _MARK, self._mark, (), floats.samples, counts=0)
            return
        start = plan.start & 0xFF
        if start or not is_clear:
            target.use()
            state.clear(stencil=start, scissor=plan.scissor, bits=bits)
        if plan.draws:
            passes = IN_STENCIL if bits == ALL_BITS else _BESIDE_KEPT
            self._draw(state, self._in_stencil, passes, [plan])

    def count_apart(
        self, state: State, plans: Sequence[VolumePlan], *, is_ready: bool = False
    ) -> None:
        """
        Count, in the stencil of the target in use, several lights within scissors that are apart.

        As ``count`` does, for plans whose counts fit; passes are in the order of their kinds.
        ``is_ready`` says that this was called before for the same picture, and nothing else drew
        volumes since.
        """
        state.clear(stencil=0)
        for plan in plans:
            if plan.start:
                state.clear(stencil=plan.start & 0xFF, scissor=plan.scissor)
        self._draw(state, self._in_stencil, IN_STENCIL, plans, is_ready=is_ready)

    def count_in_floats(self, state: State, target: Target, plan: VolumePlan) -> Target:
        """
        Count in a separate float target, exact up to 16 million volumes.

        It is one ``r32f``, reused by later calls, over the depth of ``target``; it is in use.
        """
        floats = self._floats.over(target)
        floats.fill(state, float(plan.start))
        self.add_in_floats(state, plan)
        return floats

    def add_in_floats(self, state: State, plan: VolumePlan) -> None:
        """Add the counts of a plan to the float target in use, which holds ``plan.start``."""
        self._draw(state, self._in_floats, IN_FLOATS, [plan])

    def read(self, target: Target, plan: VolumePlan) -> NDArray[np.int32]:
        """Read the counts of the last ``count``, (rows, cols), row 0 at the top."""
        if plan.statistics.counts_in == "float" and self._floats.target is not None:
            return np.rint(self._floats.target.read()).astype(np.int32)
        counts = target.read_stencil().astype(np.int32)
        if plan.statistics.deepest < 128:
            # No count is so high: a pixel on an edge went below 0 and wrapped.
            counts[counts > 127] -= 256
        return counts

    def _draw(
        self,
        state: State,
        programs: Programs,
        passes: dict[str, Pass],
        plans: Sequence[VolumePlan],
        *,
        is_ready: bool = False,
    ) -> None:
        """Draw the volumes of plans into the target in use, kind by kind if there are several."""
        find = self._find_program if is_ready else self.prepare
        program = find(programs, plans[0])
        draws = [(draw, plan) for plan in plans for draw in plan.draws]
        if len(plans) > 1:
            draws.sort(key=lambda entry: (entry[0].kind, entry[0].is_cut))
        last = None if is_ready else plans[0]
        for draw, plan in draws:
            if plan is not last:
                program.set(**plan.uniforms())
                last = plan
            program.set(is_cut=draw.is_cut, is_low=draw.is_low, slack=find_slack(plan, draw))
            program.set(bottom=plan.find_bottom(draw))
            if programs is self._in_floats:
                program.set(front=_FRONT[draw.kind])
            for how in self._list_passes(self._find_pass(passes, plan, draw)):
                state.use(how)
                if plan.scissor is not None:
                    state.limit(plan.scissor)
                self._indices.draw(program, draw.first, draw.count)

    def _list_passes(self, how: Pass) -> list[Pass]:
        """List the passes that a pass takes: two where fronts and backs are counted apart."""
        if self._two_sided or how.stencil is None:
            return [how]
        return [
            replace(how, stencil=one_sided(how.stencil, side), cull=other)
            for side, other in (("front", "back"), ("back", "front"))
        ]

    def _find_pass(self, passes: dict[str, Pass], plan: VolumePlan, draw: Draw) -> Pass:
        """Choose the pass of a draw, limited to the light's depths."""
        depths = plan.depth_bounds if self._device.has_depth_bounds else None
        clamps = draw.kind != Z_PASS or plan.projection.camera.is_perspective
        if depths is None and clamps:
            return passes[draw.kind]
        return replace(passes[draw.kind], depth_bounds=depths, depth_clamp=clamps)

    def _find_program(self, programs: Programs, plan: VolumePlan) -> Program:
        """Choose the program by what the plans of a picture need."""
        needs = self._needs if self._indices.nearby is None else (*self._needs, "HAS_NEARBY")
        return programs.find(*needs, *(("HAS_LEVELS",) if any(plan.slack) else ()))

    def prepare(self, programs: Programs, plan: VolumePlan) -> Program:
        """Choose the program for a plan's draws, and set the inputs that they share."""
        nearby, program = self._indices.nearby, self._find_program(programs, plan)
        self._geometry.bind(program)
        if nearby is not None:
            nearby.bind(_NEARBY_UNIT)
            program.set(nearby=_NEARBY_UNIT, first_nearby=self._indices.first_nearby)
        program.set(**plan.uniforms())
        return program

    def release(self) -> None:
        """Free the programs and the float target."""
        release_all(self._floats, self._in_stencil, self._in_floats, self._mark)


def find_slack(plan: VolumePlan, draw: Draw) -> NDArray[np.float32]:
    """Return how far behind its caster a draw's volumes begin."""
    return np.array(plan.slack if draw.is_coarse else (0.0, 0.0), np.float32)


def mark_shadow(state: State, program: Program, picture: Target, **uniforms: object) -> None:
    """Set the stencil to 1 where a program draws pixels of the picture at unit 0."""
    state.use(_MARK)
    picture.bind(0)
    program.set(**uniforms)
    program.draw(3)


class Stack:
    """
    Float picture in which stencil shadows accumulate.

    Counts are made in the picture itself, over the scene's depth: software devices
    flush whenever the framebuffer changes.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._tint = Program(device, "picture.vert.glsl", "tint.frag.glsl")
        self.picture = SharedDepthTarget(device, "r32f")

    def begin(self, state: State, target: Target, value: float) -> Target:
        """Fill the picture over a target's depth with a value; it is in use."""
        shown = self.picture.over(target)
        shown.fill(state, value)
        return shown

    def add_light(self, state: State, share: float, scissor: tuple | None = None) -> None:
        """Add a share of the light where the stencil is 0."""
        self._lay(state, Pass(color_write=True, blend="add", stencil=_LIT, scissor=scissor), share)

    def add_shadow(self, state: State, left: float, scissor: tuple | None = None) -> None:
        """Keep a fraction of the light where the stencil is not 0."""
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
