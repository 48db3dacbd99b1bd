"""
Passes of masks: volumes, rectangles, and the scene as drawn in 2002.

A ``Tally`` counts them as they are issued.
"""

from dataclasses import KW_ONLY, dataclass, field

import numpy as np

from umbra.gl.context import Device, release_all
from umbra.gl.geometry import Geometry
from umbra.gl.masks import MaskStep, Method
from umbra.gl.masks.volume_pieces import VolumeBatch, VolumePieces
from umbra.gl.programs import Program, Programs
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import Indices, TextureBuffer
from umbra.gl.state import Pass, State, Stencil
from umbra.gl.volume_plan import LIGHT_CAP, Z_FAIL, Z_PASS, VolumePlan
from umbra.scene import Scene
from umbra.scene.exposure import AMBIENT

__all__ = ["Forward", "Look", "MaskPainter", "Tally"]


@dataclass(eq=False)
class Tally:
    """
    Passes and rectangles of the last picture, as in the paper's Table 1.

    Parameters
    ----------
    passes : list of str
        Purpose of each drawing of the scene.
    rectangles : list of str
        Purpose of each full-window rectangle.
    batches, draws : int
        Batches of volumes, each complete in itself, and their draw calls.
    """

    passes: list[str] = field(default_factory=list)
    rectangles: list[str] = field(default_factory=list)
    batches: int = 0
    draws: int = 0

    def clear(self) -> None:
        """Reset the tally for a new picture."""
        self.passes, self.rectangles, self.batches, self.draws = [], [], 0, 0

    @property
    def table(self) -> tuple[int, int]:
        """The paper's entry: passes / rectangles."""
        return len(self.passes), len(self.rectangles)


# Faces behind a surface must pass the depth test here, since colours change only then.
_DEPTH = {Z_PASS: "less", Z_FAIL: "gequal", LIGHT_CAP: "always"}
# Before the surface a volume begins with its front; behind it, with its back.
_BEGINS = {Z_PASS: "front", Z_FAIL: "back", LIGHT_CAP: "back"}
_OTHER = {"front": "back", "back": "front"}


class MaskPainter:
    """Draws volumes and rectangles of uniform brightness, and counts them in ``tally``."""

    def __init__(self, device: Device, geometry: Geometry) -> None:
        self._device, self._geometry = device, geometry
        self._indices = Indices(device, 2 * geometry.n_points)
        self._volume = Program(device, "volume.vert.glsl", "tint.frag.glsl")
        self._rectangle = Program(device, "picture.vert.glsl", "tint.frag.glsl")
        self._pieces: VolumePieces | None = None
        self.tally = Tally()

    def draw_volumes(
        self, state: State, method: Method, plan: VolumePlan, pieces: VolumePieces
    ) -> None:
        """
        Count all volumes in the target in use.

        Before: its depth holds the scene, its mask channels ``method.start`` where counting
        starts. After: they encode the count by ``method``.
        """
        if self._pieces is not pieces:
            self._indices.write(pieces.numbers)
            self._pieces = pieces
        self._geometry.bind(self._volume)
        self._volume.set(**plan.uniforms())
        order = ("up", "down") if method.first == "up" else ("down", "up")
        for batch in pieces.batches:
            self.tally.batches += 1
            for way in order:
                self._draw_batch(state, method, plan, batch, way)

    def _draw_batch(
        self, state: State, method: Method, plan: VolumePlan, batch: VolumeBatch, way: str
    ) -> None:
        """Draw the faces of a batch at which volumes begin (``up``) or end (``down``)."""
        step = method.up if way == "up" else method.down
        for draw in batch.draws:
            side = _BEGINS[draw.kind] if way == "up" else _OTHER[_BEGINS[draw.kind]]
            clamps = draw.kind != Z_PASS or plan.projection.camera.is_perspective
            self._volume.set(is_cut=draw.is_cut, tint=np.full(4, step.brightness))
            state.use(
                Pass(
                    depth_test=_DEPTH[draw.kind], color_write=method.write, blend=step.blend,
                    cull=_OTHER[side], depth_clamp=clamps, clip_near=True, scissor=plan.scissor,
                )
            )  # fmt: skip
            self._indices.draw(self._volume, draw.first, draw.count)
            self.tally.draws += 1
        for _ in range(batch.ends if way == "up" else 0):
            self.draw_rectangle(state, step, method.write, "end", scissor=plan.scissor)

    def draw_rectangle(
        self,
        state: State,
        step: MaskStep,
        write: str | bool,
        purpose: str = "normalise",
        *,
        stencil: Stencil | None = None,
        scissor: tuple[int, int, int, int] | None = None,
    ) -> None:
        """Draw a rectangle over the whole window, or within a stencil or scissor."""
        state.use(Pass(color_write=write, blend=step.blend, stencil=stencil, scissor=scissor))
        self._rectangle.set(tint=np.full(4, step.brightness))
        self._rectangle.draw(3)
        self.tally.rectangles.append(purpose)

    def release(self) -> None:
        """Free the programs and the index list."""
        release_all(self._indices, self._volume, self._rectangle)


@dataclass(frozen=True, eq=False)
class Look:
    """
    Lighting of surfaces.

    Parameters
    ----------
    light : (4,) float64
        Homogeneous, relative to the eye.
    color : (3,) float
        Colour of the light.
    share : float
        Fraction of the ambient light drawn with it.
    is_white : bool
        Leave out light and colours.
    alpha : float
        Alpha to write.
    """

    light: np.ndarray
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    share: float = 1.0
    _: KW_ONLY
    is_white: bool = False
    alpha: float = 1.0


class Forward:
    """Draws the triangles of a scene in flat colours."""

    def __init__(self, device: Device, scene: Scene, geometry: Geometry) -> None:
        self._geometry = geometry
        self._faces = Indices(device, 2 * geometry.n_points)
        self._faces.write(geometry.faces.ravel())
        colors = [
            np.tile(np.append(np.array(part.material.color), 1.0), (part.triangles, 1))
            for part in scene.parts
        ]
        stored = np.rint(255 * np.concatenate(colors)).astype(np.uint8)
        self._colors = TextureBuffer(device, stored, "rgba8")
        self._shaded = Programs(device, "shaded.vert.glsl", "forward.frag.glsl")
        self._depth = Program(device, "surface.vert.glsl", "nothing.frag.glsl")

    def draw_depth(self, state: State, projection: CameraProjection, tally: Tally) -> None:
        """Draw depth only. Before: depth is cleared."""
        state.use(Pass(depth_test="less", depth_write=True))
        self._draw(self._depth, projection)
        tally.passes.append("depth")

    def draw_scene(
        self,
        state: State,
        projection: CameraProjection,
        look: Look,
        tally: Tally,
        *,
        lights: str = "direct",
        blend: str | None = None,
        with_place: bool = False,
    ) -> None:
        """
        Draw the scene in 'direct' light, in 'ambient' light, or in 'both'.

        ``blend`` blends over a picture whose depth is drawn already; ``with_place`` writes
        normals and keys, too.
        """
        first = blend is None
        state.use(
            Pass(
                depth_test="less" if first else "lequal", depth_write=first, blend=blend,
                color_write=True if first else "rgb",
            )
        )  # fmt: skip
        program = self._shaded.find("HAS_PLACE") if with_place else self._shaded.find()
        self._colors.bind(0)
        program.set(
            colors=0,
            alpha=look.alpha,
            white=float(look.is_white),
            ambient=look.share * AMBIENT if lights != "direct" else 0.0,
            direct=(1.0 - AMBIENT) * np.array(look.color) * (lights != "ambient"),
            **projection.rays,
        )
        self._draw(program, projection, light=look.light)
        tally.passes.append(lights)

    def _draw(self, program: Program, projection: CameraProjection, **uniforms: np.ndarray) -> None:
        self._geometry.bind(program)
        program.set(**projection.uniforms, **uniforms)
        self._faces.draw(program, 0, self._geometry.faces.size)

    def release(self) -> None:
        """Free the programs and buffers."""
        release_all(self._faces, self._colors, self._shaded, self._depth)
