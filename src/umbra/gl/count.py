"""
Shadow counts of the visible surface: in the stencil, or in floats beyond 255.

Volumes are wound outward. Before the surface (z-pass) a front adds and a back takes
away; behind it (z-fail) the other way round (docs/papers.md, M1). Operations wrap, so
the order of faces does not matter. A fragment at the surface itself counts as behind:
the depth test is LESS, and light caps, which lie in the surface, use NEVER.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device
from umbra.gl.geometry import FIRST_UNIT, Geometry
from umbra.gl.plan import LIGHT_CAP, Z_FAIL, Z_PASS, Draw, VolumePlan
from umbra.gl.programs import Program
from umbra.gl.resources import Indices, draw_plain
from umbra.gl.state import Pass, State, Stencil, one_sided
from umbra.gl.target import Target

if TYPE_CHECKING:
    from umbra.gl.soft.growth import GrownPoints

__all__ = ["VolumeCounter"]

_BEFORE = Stencil(front_depth_pass="up", back_depth_pass="down")
_BEHIND = Stencil(front_depth_fail="down", back_depth_fail="up")

# What lies before the near plane is before every visible point, and clipped: z-pass starts
# with the count in that plane. z-fail must see all that is behind, to infinity: depth is
# clamped there, which would turn off clipping at the near plane, too.
IN_STENCIL = {
    Z_PASS: Pass(depth_test="less", stencil=_BEFORE),
    Z_FAIL: Pass(depth_test="less", stencil=_BEHIND, depth_clamp=True, clip_near=True),
    LIGHT_CAP: Pass(depth_test="never", stencil=_BEHIND, depth_clamp=True, clip_near=True),
}
"""Passes that count in the stencil."""

IN_FLOATS = {
    Z_PASS: Pass(depth_test="less", color_write=True, blend="add"),
    Z_FAIL: Pass(
        depth_test="gequal", color_write=True, blend="add", depth_clamp=True, clip_near=True
    ),
    LIGHT_CAP: Pass(
        depth_test="always", color_write=True, blend="add", depth_clamp=True, clip_near=True
    ),
}
"""The same, adding to a float: what would fail the depth test there passes here."""

_FRONT = {Z_PASS: 1.0, Z_FAIL: -1.0, LIGHT_CAP: -1.0}
_MARK = Pass(stencil=Stencil(front_depth_pass="replace", back_depth_pass="replace", reference=1))
_TEXTURE_2D, _TEXTURE0 = 0x0DE1, 0x84C0
_IN_STENCIL, _IN_FLOATS = "nothing.frag.glsl", "count.frag.glsl"
_NEARBY_UNIT = FIRST_UNIT + 3


class VolumeCounter:
    """
    Draws planned volumes.

    Parameters
    ----------
    device : Device
    geometry : Geometry
    indices : Indices
        In which the draws of plans lie.
    two_sided : bool
        Count fronts and backs in one pass; else in two, where drivers are wrong.
    grows : bool
        The geometry is that of casters that are enlarged (``umbra.gl.soft``).
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
        # Some drivers clip by gl_ClipDistance wherever it is written, though not enabled.
        self._needs = {"GROWS": 1} if grows else {}
        self._in_stencil, self._in_floats = (
            {(clips, False): self._make(fragment, clips) for clips in (False, True)}
            for fragment in (_IN_STENCIL, _IN_FLOATS)
        )
        self._mark = Program(device, "picture.vert.glsl", "mask.frag.glsl")
        self._floats: Target | None = None

    def _make(self, fragment: str, clips: bool, has_nearby: bool = False) -> Program:
        flags = {"CLIP_NEAR": clips, "HAS_NEARBY": has_nearby}
        needs = self._needs | {name: 1 for name, is_set in flags.items() if is_set}
        return Program(self._device, "volume.vert.glsl", fragment, needs)

    def count(
        self, state: State, target: Target, plan: VolumePlan, *, is_clear: bool = False
    ) -> None:
        """
        Count, in the stencil, the shadow volumes that hold each visible surface.

        Before: the target's depth holds the scene as ``plan.projection`` shows it. After:
        stencil 0 means lit. It holds the count itself, or 1 for any other count where more
        than 255 volumes may overlap (``plan.statistics.counts_in``); the target is in use.
        Outside ``plan.scissor`` the stencil means nothing.

        Parameters
        ----------
        state : State
        target : Target
        plan : VolumePlan
        is_clear : bool
            The target is in use, and its stencil 0.
        """
        if plan.statistics.counts_in == "float":
            self.count_in_floats(state, target, plan)
            self._mark_shadow(state, target)
            return
        start = plan.start & 0xFF
        if start or not is_clear:
            target.use()
            state.clear(stencil=start, scissor=plan.scissor)
        for draw in plan.draws:
            program = self._prepare(self._in_stencil, plan, draw)
            passes = [self._narrow(IN_STENCIL[draw.kind], plan)]
            if not self._two_sided:
                one = passes[0]
                passes = [
                    replace(one, stencil=one_sided(one.stencil, side), cull=other)  # type: ignore[arg-type]
                    for side, other in (("front", "back"), ("back", "front"))
                ]
            for each in passes:
                state.use(each)
                self._indices.draw(program, draw.first, draw.count)

    def count_in_floats(self, state: State, target: Target, plan: VolumePlan) -> Target:
        """
        Count in a float target of its own, exact up to 16 million volumes.

        It is of one ``r32f``, shared by later calls, over the depth of ``target``; it is in use.
        """
        if self._floats is None or self._floats.depth_of is not target:
            self._release_floats()
            self._floats = Target(self._device, target.size, ("r32f",), depth_of=target)
        self._floats.use()
        state.use(Pass(color_write=True))
        self._floats.clear_color(float(plan.start))
        for draw in plan.draws:
            program = self._prepare(self._in_floats, plan, draw)
            program.set(front=_FRONT[draw.kind])
            state.use(self._narrow(IN_FLOATS[draw.kind], plan))
            self._indices.draw(program, draw.first, draw.count)
        return self._floats

    def read(self, target: Target, plan: VolumePlan) -> NDArray[np.int32]:
        """Read the counts that ``count`` just made for a plan, (rows, cols), row 0 at the top."""
        if plan.statistics.counts_in == "float" and self._floats is not None:
            return np.rint(self._floats.read()).astype(np.int32)
        counts = target.read_stencil().astype(np.int32)
        if plan.statistics.deepest < 128:
            # None can be so high: what is was below 0 by a pixel on an edge, and wrapped.
            counts[counts > 127] -= 256
        return counts

    def _narrow(self, whole: Pass, plan: VolumePlan) -> Pass:
        """Keep a pass to where the light's range reaches."""
        bounds = plan.depth_bounds if self._device.has_depth_bounds else None
        if plan.scissor is None and bounds is None:
            return whole
        return replace(whole, scissor=plan.scissor, depth_bounds=bounds)

    def _prepare(
        self, programs: dict[tuple[bool, bool], Program], plan: VolumePlan, draw: Draw
    ) -> Program:
        """Choose the program for a draw, and tell it where everything is."""
        nearby = self._indices.nearby
        key = draw.kind != Z_PASS, nearby is not None
        if key not in programs:
            fragment = _IN_STENCIL if programs is self._in_stencil else _IN_FLOATS
            programs[key] = self._make(fragment, *key)
        program = programs[key]
        self._geometry.bind(program)
        if nearby is not None:
            nearby.bind(_NEARBY_UNIT)
            program.set(nearby=_NEARBY_UNIT, first_nearby=self._indices.first_nearby)
        program.set(
            **plan.projection.uniforms(),
            light=plan.light.astype(np.float32),
            bottom=plan.bottom,
            is_cut=draw.is_cut,
        )
        return program

    def _mark_shadow(self, state: State, target: Target) -> None:
        """Set the stencil to 1 where the float count is not 0, to 0 elsewhere."""
        if self._floats is None:
            return
        target.use()
        state.clear(stencil=0)
        state.use(_MARK)
        self._device.gl.ActiveTexture(_TEXTURE0)
        self._device.gl.BindTexture(_TEXTURE_2D, self._floats.textures[0])
        self._mark.set(counts=0)
        draw_plain(self._device, self._mark, 3)

    def _release_floats(self) -> None:
        if self._floats is not None:
            self._floats.release()
        self._floats = None

    def release(self) -> None:
        """Free the programs and the float target."""
        self._release_floats()
        for program in (*self._in_stencil.values(), *self._in_floats.values(), self._mark):
            program.release()
