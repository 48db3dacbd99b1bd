"""How far away what each pixel shows is: a depth buffer that shaders can read, in floats."""

import numpy as np

from umbra.gl.companion import Companion
from umbra.gl.indices import Indices, draw_plain
from umbra.gl.plan import Planner
from umbra.gl.programs import Program
from umbra.gl.projection import Projection
from umbra.gl.state import Pass, State
from umbra.gl.surfaces import find_rays
from umbra.gl.target import Target

__all__ = ["Keys"]

# Only what is in the depth buffer: what is seen through is not.
_AGAIN = Pass(depth_test="equal", color_write=True)


class Keys:
    """
    Draws depth keys.

    Parameters
    ----------
    planner : Planner
        Of the scene that is seen.
    """

    def __init__(self, planner: Planner) -> None:
        self._device, self._geometry = planner.device, planner.geometry
        self._planner = planner
        self._indices = Indices(planner.device, 2 * planner.geometry.n_points)
        self._indices.write(planner.geometry.faces.ravel())
        self._faces = Program(planner.device, "surface.vert.glsl", "key.frag.glsl")
        self._ground = Program(
            planner.device, "ground.vert.glsl", "key.frag.glsl", {"IS_GROUND": 1}
        )
        self._picture = Companion(self._device, "r32f")

    def draw(self, state: State, target: Target, projection: Projection) -> int:
        """
        Draw keys where a target's depth says that surfaces are; give the texture.

        They are 1 / depth in perspective and -depth in a parallel view; 0 where nothing is.
        """
        shown = self._picture.over(target)
        shown.use()
        state.use(_AGAIN)
        shown.clear_color(0.0)
        self._geometry.bind(self._faces)
        self._faces.set(
            **projection.uniforms(), **find_rays(projection), depths=_find_depths(projection)
        )
        self._indices.draw(self._faces, 0, self._geometry.faces.size)
        if self._planner.ground is not None:
            self._ground.set(
                projection=projection.matrix,
                height=float(self._planner.ground - projection.eye[2]),
                **find_rays(projection),
            )
            draw_plain(self._device, self._ground, 12)
        return shown.textures[0]

    def release(self) -> None:
        """Free programs, triangles and picture."""
        self._picture.release()
        self._indices.release()
        for program in (self._faces, self._ground):
            program.release()


def _find_depths(projection: Projection) -> np.ndarray:
    """Give the nearest depth of a parallel view, and how much farther it goes [m]."""
    if projection.camera.is_perspective:
        return np.zeros(2)
    # The window's depth is linear: 2 (depth - near) / (far - near) - 1 before it is halved.
    far_less_near = 2.0 / np.linalg.norm(projection.matrix[2, :3])
    near = -0.5 * far_less_near * (projection.matrix[2, 3] + 1.0)
    return np.array([near, far_less_near])
