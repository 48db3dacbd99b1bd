"""Pictures of a changing scene: parts move, are added and removed between two pictures."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, show_value
from umbra.gl import scene_renderer as engine
from umbra.gl.context import on_device, release_all
from umbra.gl.geometry import Geometry
from umbra.gl.matrices import read_projection
from umbra.gl.projection import CameraProjection
from umbra.gl.target import Target
from umbra.gl.visible_faces import PickedPoint, VisibleFaces
from umbra.realtime.scene_user import SceneUser, read_target
from umbra.scene import Camera, Light, Scene
from umbra.soft import AreaLight

__all__ = ["Renderer"]

SomeLight = Light | AreaLight


class Renderer(SceneUser):
    """
    Draw a scene with the shadows of any lights, hard or soft.

    Parameters
    ----------
    scene : Scene
    context : moderngl.Context, optional
        The caller's own, which is current now; one is made if None. Its state is as before after
        every call.
    ground : float, optional
        z of an endless plane that is drawn and receives shadows, in the scene's coordinates [m].

    Raises
    ------
    InputError
        If a texture cannot be decoded.
    UmbraError
        If OpenGL is missing or insufficient.

    Examples
    --------
    >>> renderer = Renderer(scene, ground=0.0)  # doctest: +SKIP
    >>> texture = renderer.draw(Camera((20, -25, 14), (0, 0, 3)), [sun])  # doctest: +SKIP
    >>> rgba = renderer.read()  # doctest: +SKIP
    """

    def __init__(self, scene: Scene, context: Any = None, ground: float | None = None) -> None:
        super().__init__(scene, context)
        with self.device.current():
            self._engine = engine.SceneRenderer(scene, ground, device=self.device)
        self._faces: tuple[Geometry, VisibleFaces] | None = None
        self._shown: tuple[int, Any] = 0, None
        self._seen: CameraProjection | None = None
        self._is_hdr = False

    @on_device
    def draw(
        self,
        camera: Camera,
        lights: SomeLight | Sequence[SomeLight],
        samples: int = 1,
        *,
        hdr: bool = False,
    ) -> Any:
        """
        Draw a picture of the camera's size.

        Parameters
        ----------
        camera : Camera
        lights : Light, AreaLight or a sequence of them
            The latter have soft shadows.
        samples : int
            Least number a pixel, for smooth edges.
        hdr : bool
            Return the light itself, for tone mapping of your own: of opaque surfaces, one sample a
            pixel, alpha 0 where there are none. A white surface that faces one light of intensity 1
            has 0.8, of n lights 0.8 / sqrt(n) from each, besides ambient light.

        Returns
        -------
        texture : moderngl.Texture
            Of the picture, RGBA in display colours (sRGB, 8 bits), or, with ``hdr``, of linear
            radiance (16-bit floats); row 0 at the bottom as everywhere in OpenGL. It is the
            renderer's: the next picture is drawn into it.
        """
        if hdr and samples != 1:
            msg = f"with hdr= a pixel has one sample; got samples={show_value(samples)}"
            raise InputError(msg, option="samples")
        self._draw(camera, lights, samples, hdr=hdr)
        self._seen = self._engine.planner.project(camera)
        picture = self._find_picture()
        number = picture.textures[0]
        if self._shown[0] != number or self._shown[1].size != picture.size:
            kind = "f2" if hdr else "f1"
            texture = self.device.context.external_texture(number, picture.size, 4, 0, kind)
            self._shown = number, texture
        return self._shown[1]

    @on_device
    def draw_into(
        self,
        framebuffer: Any,
        view: ArrayLike,
        projection: ArrayLike,
        lights: SomeLight | Sequence[SomeLight],
        viewport: Sequence[int] | None = None,
        *,
        depth: str = "minus-one-to-one",
        samples: int = 1,
    ) -> None:
        """
        Add the scene to a picture of the caller, by depth.

        Colours are written as they are shown (sRGB), with the scene's nearest depth, where the
        scene is before what the framebuffer holds; the sky is left out.

        Parameters
        ----------
        framebuffer : moderngl.Framebuffer
            With depth, if the caller's own surfaces are to hide the scene's.
        view, projection : (4, 4) float
            For column vectors; world coordinates are the scene's.
        lights : Light, AreaLight or a sequence of them
        viewport : (int, int, int, int), optional
            Left, bottom, columns, rows [pixels]; the framebuffer's own by default.
        depth : {'minus-one-to-one', 'zero-to-one', 'reversed'}
            How the projection's depth runs from the near to the far plane.
        samples : int
            As in ``draw``.

        Raises
        ------
        InputError
            If the matrices are no view.
        """
        target, _ = read_target(self.device, framebuffer, viewport)
        seen = read_projection(self.device, view, projection, target.size, self.scene.origin, depth)
        self._draw(seen.camera, lights, samples)
        self._seen = seen
        assert self._engine.targets is not None
        self._find_faces().lay(target, seen, self._engine.targets.picture)

    @on_device
    def read(self) -> NDArray[np.uint8] | NDArray[np.float32]:
        """
        Read the last picture; row 0 is the top.

        Returns
        -------
        rgba : (rows, cols, 4) uint8 or float32
            In sRGB, or linear radiance if it was drawn with ``hdr``.
        """
        if self._engine.targets is None:
            return np.zeros((0, 0, 4), np.uint8)
        picture = self._find_picture().read()
        is_mirrored = self._seen is not None and self._seen.is_mirrored
        return np.ascontiguousarray(picture[:, ::-1] if is_mirrored else picture)

    @on_device
    def pick(self, x: int, y: int) -> PickedPoint | None:
        """
        Find what the last picture's view shows at a pixel now, after edits, too.

        Parameters
        ----------
        x, y : int
            Column and row; row 0 is the top.

        Returns
        -------
        point : PickedPoint or None
            ``name`` of the part, or ``ground``; ``position`` [m] and ``normal``. None: nothing.

        Raises
        ------
        InputError
            If nothing was drawn yet, or the pixel is outside the picture.
        """
        if self._seen is None:
            msg = "nothing was drawn yet; draw a picture, then pick one of its pixels"
            raise InputError(msg)
        cols, rows = self._seen.camera.size
        if not (0 <= x < cols and 0 <= y < rows):
            msg = f"the pixel {x},{y} is outside the picture of {cols}x{rows} pixels"
            raise InputError(msg, x=x, y=y)
        column = cols - 1 - int(x) if self._seen.is_mirrored else int(x)
        return self._find_faces().pick(self.scene, self._seen, column, int(y))

    def _find_picture(self) -> Target:
        """Return what the last picture is in: its colours as they are shown, or its light."""
        assert self._engine.targets is not None
        return self._engine.targets.surface if self._is_hdr else self._engine.targets.picture

    def _draw(
        self,
        camera: Camera,
        lights: SomeLight | Sequence[SomeLight],
        samples: int,
        *,
        hdr: bool = False,
    ) -> None:
        if not isinstance(camera, Camera):
            msg = f"camera= is an umbra.Camera; got {show_value(camera)}"
            raise InputError(msg, option="camera")
        if isinstance(samples, bool) or not isinstance(samples, int) or samples < 1:
            msg = f"samples= is a whole number of at least 1; got {show_value(samples)}"
            raise InputError(msg, option="samples")
        some = [lights] if isinstance(lights, SomeLight) else list(lights)
        other = next((light for light in some if not isinstance(light, SomeLight)), None)
        if other is not None:
            msg = f"lights= are umbra's lights (umbra.point_light, ...); got {show_value(other)}"
            raise InputError(msg, option="lights")
        self._engine.draw(camera, some, samples=samples, keeps_light=hdr)
        self._is_hdr = hdr

    def _find_faces(self) -> VisibleFaces:
        """Return what draws all faces, made anew when the geometry was."""
        geometry = self._engine.geometry
        if self._faces is None or self._faces[0] is not geometry:
            release_all(self._faces and self._faces[1])
            self._faces = None
            faces = VisibleFaces(self.device, self.scene, geometry, self._engine.ground)
            self._faces = geometry, faces
        return self._faces[1]

    def _show(self, before: Scene, scene: Scene) -> None:
        self._engine.move(scene)

    def _list_held(self) -> Iterable[Any]:
        yield from (self._faces and self._faces[1], self._engine)
