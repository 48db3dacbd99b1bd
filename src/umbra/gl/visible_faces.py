"""The scene's faces at the pixels of a view: which one a pixel shows, or a picture laid on them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device, release_all
from umbra.gl.geometry import RINGS, Geometry, draw_ground
from umbra.gl.programs import Program
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import Indices
from umbra.gl.state import Pass, State
from umbra.gl.target import Target
from umbra.rays.depth import GROUND, NOTHING
from umbra.scene import Camera, Scene
from umbra.scene.mesh import transform_points

if TYPE_CHECKING:
    from umbra.gl.foreign import ForeignTarget

__all__ = ["PickedPoint", "VisibleFaces"]

_NEAREST = Pass(depth_test="less", depth_write=True, color_write=True)
# A second picture of the same surfaces replaces the first.
_LAID = Pass(depth_test="lequal", depth_write=True, color_write=True)


@dataclass(frozen=True, eq=False)
class PickedPoint:
    """
    What a pixel shows.

    Parameters
    ----------
    name : str
        Of the part; ``ground`` is the plane that was asked for.
    position : (3,) float64
        In the scene's own coordinates [m].
    normal : (3,) float64
        Unit normal of the visible side.
    """

    name: str
    position: NDArray[np.float64]
    normal: NDArray[np.float64]


class VisibleFaces:
    """
    Draws all faces of a scene, opaque or not, without materials.

    Parameters
    ----------
    device : Device
    scene : Scene
    geometry : Geometry
        Of the scene; not released here.
    ground : float, optional
        z of a plane drawn, too, relative to the scene's origin [m].
    """

    def __init__(
        self, device: Device, scene: Scene, geometry: Geometry, ground: float | None
    ) -> None:
        self._device, self._geometry, self._ground = device, geometry, ground
        self._indices = Indices(device, 2 * geometry.n_points)
        self._indices.write(geometry.faces.ravel())
        self._pixel = Target(device, (1, 1), ("r32i",))
        self._starts = np.cumsum([0, *(len(part.mesh.faces) for part in scene.parts)])
        self._faces, self._placed = (
            (
                Program(device, "surface.vert.glsl", fragment),
                Program(device, "ground.vert.glsl", fragment, {"RINGS": RINGS}),
            )
            for fragment in ("face.frag.glsl", "placed.frag.glsl")
        )

    def pick(
        self, scene: Scene, projection: CameraProjection, x: int, y: int
    ) -> PickedPoint | None:
        """
        Find what the centre of a pixel shows, row 0 on top; None: nothing.

        The face is found on the device, its point in float64. ``scene`` may have other transforms
        and vertices than that of the start.
        """
        face = self._find_face(projection, x, y)
        if face == NOTHING:
            return None
        origin, ray = _find_ray(projection.camera, x, y)
        if face == GROUND:
            assert self._ground is not None
            name, point = "ground", np.array([0.0, 0.0, self._ground])
            normal = np.array([0.0, 0.0, 1.0])
        else:
            index = int(np.searchsorted(self._starts, face, "right") - 1)
            part = scene.parts[index]
            corners = part.mesh.vertices[part.mesh.faces[face - self._starts[index]]]
            if part.transform is not None:
                corners = transform_points(part.transform, corners)
            name, point = part.name, corners[0]
            normal = np.cross(corners[1] - point, corners[2] - point)
            normal /= np.linalg.norm(normal)
        steep = float(normal @ ray)
        eye = origin - scene.origin
        along = float(normal @ (point - eye)) / steep if steep else 0.0
        position = origin + along * ray if steep else point + scene.origin
        return PickedPoint(name, position, normal * (-1.0 if steep > 0 else 1.0))

    def _find_face(self, projection: CameraProjection, x: int, y: int) -> int:
        """Draw one pixel of a view, and read the number of its face."""
        cols, rows = projection.camera.size
        seen = projection.magnified((2 * x + 1) / cols - 1, 1 - (2 * y + 1) / rows, (cols, rows))
        with State(self._device, seen.clip) as state:
            self._pixel.begin(state, NOTHING)
            self._draw(state, seen, self._faces, _NEAREST, {"first": 0, "step": 1},
                       {"first": GROUND, "step": 0})  # fmt: skip
        return int(self._pixel.read()[0, 0])

    def lay(self, target: "ForeignTarget", projection: CameraProjection, picture: Target) -> None:
        """
        Draw a picture of this view into another framebuffer, by depth, where surfaces are.

        After: colour and depth hold this scene's nearest surface where it is before what was there.
        """
        with State(self._device, projection.clip) as state:
            target.use()
            picture.bind(0)
            given = {
                "picture": 0,
                "corner": np.array(target.viewport[:2], np.float32),
                "is_mirrored": projection.is_mirrored,
            }
            self._draw(state, projection, self._placed, _LAID, given, given)

    def _draw(
        self,
        state: State,
        projection: CameraProjection,
        programs: tuple[Program, Program],
        how: Pass,
        uniforms: dict[str, object],
        of_ground: dict[str, object],
    ) -> None:
        """Draw the faces, and the ground, by a program each."""
        surface, plane = programs
        state.use(how)
        self._geometry.bind(surface)
        surface.set(**projection.uniforms, **uniforms)
        self._indices.draw(surface, 0, 3 * int(self._starts[-1]))
        if self._ground is not None:
            draw_ground(state, plane, projection, self._ground, of_ground, how)

    def release(self) -> None:
        """Free the programs, indices and target."""
        release_all(self._pixel, *self._faces, *self._placed, self._indices)


def _find_ray(camera: Camera, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the origin, in the scene's own coordinates, and the direction of a pixel's ray."""
    cols, rows = camera.center
    right, up, forward = camera.pixel_axes
    height = camera.height or 2.0 * np.tan(np.radians(camera.fov) / 2.0)
    across = height / camera.size[1] * ((x - cols) * right + (rows - y) * up)
    if camera.is_perspective:
        return camera.eye, forward + across
    return camera.eye + across, forward
