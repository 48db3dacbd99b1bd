"""Draws what masks are made of: sides of volumes, and rectangles over the window."""

import numpy as np

from umbra.gl.context import Device
from umbra.gl.geometry import Geometry
from umbra.gl.indices import Indices, draw_plain
from umbra.gl.masks.method import Method, Step
from umbra.gl.masks.pieces import Batch, Pieces
from umbra.gl.masks.tally import Tally
from umbra.gl.plan import LIGHT_CAP, Z_FAIL, Z_PASS, Plan
from umbra.gl.programs import Program
from umbra.gl.state import Pass, State, Stencil

__all__ = ["Painter"]

# What would fail the depth test behind a surface must pass here: only then colours change.
_DEPTH = {Z_PASS: "less", Z_FAIL: "gequal", LIGHT_CAP: "always"}
# Before the surface a volume begins with its front; behind it, with its back.
_BEGINS = {Z_PASS: "front", Z_FAIL: "back", LIGHT_CAP: "back"}
_OTHER = {"front": "back", "back": "front"}


class Painter:
    """
    Draws volumes and rectangles with one brightness each, and counts them.

    Parameters
    ----------
    device : Device
    geometry : Geometry

    Attributes
    ----------
    tally : Tally
    """

    def __init__(self, device: Device, geometry: Geometry) -> None:
        self._device, self._geometry = device, geometry
        self._indices = Indices(device, 2 * geometry.n_points)
        self._volume = {
            clips: Program(
                device, "volume.vert.glsl", "tint.frag.glsl", {"CLIP_NEAR": 1} if clips else None
            )
            for clips in (False, True)
        }
        self._rectangle = Program(device, "picture.vert.glsl", "tint.frag.glsl")
        self._pieces: Pieces | None = None
        self.tally = Tally()

    def draw_volumes(self, state: State, method: Method, plan: Plan, pieces: Pieces) -> None:
        """
        Count all volumes in the target in use.

        Before: its depth holds the scene, its mask channels ``method.start`` where counting
        starts. After: they hold what ``method`` says of the count.
        """
        if self._pieces is not pieces:
            self._indices.write(pieces.numbers)
            self._pieces = pieces
        for program in self._volume.values():
            self._geometry.bind(program)
            program.set(
                **plan.projection.uniforms(),
                light=plan.light.astype(np.float32),
                bottom=plan.bottom,
            )
        order = ("up", "down") if method.first == "up" else ("down", "up")
        for batch in pieces.batches:
            self.tally.batches += 1
            for way in order:
                self._draw_batch(state, method, plan, batch, way)

    def _draw_batch(self, state: State, method: Method, plan: Plan, batch: Batch, way: str) -> None:
        """Draw the faces of a batch at which volumes begin (up), or those where they end."""
        step = method.up if way == "up" else method.down
        for draw in batch.draws:
            side = _BEGINS[draw.kind] if way == "up" else _OTHER[_BEGINS[draw.kind]]
            behind = draw.kind != Z_PASS
            program = self._volume[behind]
            program.set(is_cut=draw.is_cut, tint=np.full(4, step.brightness))
            state.use(
                Pass(
                    depth_test=_DEPTH[draw.kind], color_write=method.write, blend=step.blend,
                    cull=_OTHER[side], depth_clamp=behind, clip_near=behind, scissor=plan.scissor,
                )
            )  # fmt: skip
            self._indices.draw(program, draw.first, draw.count)
            self.tally.draws += 1

    def draw_rectangle(
        self,
        state: State,
        step: Step,
        write: str | bool,
        purpose: str = "normalise",
        *,
        stencil: Stencil | None = None,
    ) -> None:
        """Draw a rectangle over the whole window, or where a stencil lets it pass."""
        state.use(Pass(color_write=write, blend=step.blend, stencil=stencil))
        self._rectangle.set(tint=np.full(4, step.brightness))
        draw_plain(self._device, self._rectangle, 3)
        self.tally.rectangles.append(purpose)

    def release(self) -> None:
        """Free programs and the list of triangles."""
        self._indices.release()
        for program in (*self._volume.values(), self._rectangle):
            program.release()
