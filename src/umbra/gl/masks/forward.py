"""Drawing a scene as in 2002: each pass draws all of it, lit as it comes."""

import numpy as np

from umbra.gl.context import Device
from umbra.gl.geometry import Geometry, TextureBuffer
from umbra.gl.indices import Indices
from umbra.gl.masks.tally import Tally
from umbra.gl.programs import Program
from umbra.gl.projection import Projection
from umbra.gl.state import Pass, State
from umbra.gl.surfaces import find_rays
from umbra.scene import Scene
from umbra.scene.look import AMBIENT

__all__ = ["Forward"]

_RGBA8 = 0x8058


class Forward:
    """
    Draws the triangles of a scene, a colour each.

    Parameters
    ----------
    device : Device
    scene : Scene
    geometry : Geometry
        Of the scene.
    has_place : bool
        Write normals and depth keys too, at location 1.
    """

    def __init__(
        self, device: Device, scene: Scene, geometry: Geometry, *, has_place: bool = False
    ) -> None:
        self._geometry = geometry
        self._faces = Indices(device, 2 * geometry.n_points)
        self._faces.write(geometry.faces.ravel())
        colors = [
            np.tile(np.append(np.array(part.material.color), 1.0), (part.triangles, 1))
            for part in scene.parts
        ]
        stored = np.rint(255 * np.concatenate(colors)).astype(np.uint8)
        self._colors = TextureBuffer(device, stored, _RGBA8)
        self._shaded = Program(device, "shaded.vert.glsl", "forward.frag.glsl")
        self._placed = (
            Program(device, "shaded.vert.glsl", "forward.frag.glsl", {"HAS_PLACE": 1})
            if has_place
            else self._shaded
        )
        self._depth = Program(device, "surface.vert.glsl", "nothing.frag.glsl")

    def draw_depth(self, state: State, projection: Projection, tally: Tally) -> None:
        """Draw depth alone; before, it is cleared."""
        state.use(Pass(depth_test="less", depth_write=True))
        self._draw(self._depth, projection)
        tally.passes.append("depth")

    def draw_scene(
        self,
        state: State,
        projection: Projection,
        light: np.ndarray,
        tally: Tally,
        *,
        lights: str = "direct",
        blend: str | None = None,
        alpha: float = 1.0,
        is_white: bool = False,
        with_place: bool = False,
    ) -> None:
        """
        Draw the scene in ambient light, in direct light, or in both.

        Parameters
        ----------
        state : State
        projection : Projection
        light : (4,) float64
            Relative to the eye.
        tally : Tally
        lights : {'direct', 'ambient', 'both'}
        blend : str, optional
            Where depth is there already: how to add to what is.
        alpha : float
            Left in the target's alpha.
        is_white : bool
            Leave out light and colours.
        with_place : bool
            The target takes normals and keys.
        """
        first = blend is None
        state.use(
            Pass(
                depth_test="less" if first else "lequal", depth_write=first, blend=blend,
                color_write=True if first else "rgb",
            )
        )  # fmt: skip
        program = self._placed if with_place else self._shaded
        self._colors.bind(0)
        program.set(
            colors=0,
            alpha=alpha,
            white=float(is_white),
            ambient=AMBIENT if lights != "direct" else 0.0,
            direct=1.0 - AMBIENT if lights != "ambient" else 0.0,
            **find_rays(projection),
        )
        self._draw(program, projection, light)
        tally.passes.append(lights)

    def _draw(
        self, program: Program, projection: Projection, light: np.ndarray | None = None
    ) -> None:
        self._geometry.bind(program)
        program.set(**projection.uniforms())
        if light is not None:
            program.set(light=light)
        self._faces.draw(program, 0, self._geometry.faces.size)

    def release(self) -> None:
        """Free programs and buffers."""
        self._faces.release()
        self._colors.release()
        for program in {self._shaded, self._placed, self._depth}:
            program.release()
