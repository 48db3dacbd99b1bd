"""Options of a picture's camera: each with its type, default, unit, help, flag and heading."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Literal

from umbra.errors import InputError
from umbra.option_fields import Given, Options, check_types, option, record

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from umbra.scene import Camera, Scene

__all__ = ["CameraOptions"]

_camera = partial(option, heading="Camera")
_FOV, _UP = 50.0, (0.0, 0.0, 1.0)  # [degrees]
_SOMEWHERE = (0.0, 0.0, 0.0), (0.3, 0.8, -0.5)  # any valid view, for early checks


@record
class CameraOptions(Options):
    """
    A camera for a scene, checked; see ``umbra.make_camera``.

    Raises
    ------
    InputError
        If one of eye and target is missing, or the view is degenerate.
    """

    eye: Given[ArrayLike | None, Sequence[float] | None] = _camera(
        "numbers", "Position of the camera [m]; default: view='bird'.",
        unit="m", count=3, metavar="X,Y,Z",
    )  # fmt: skip
    target: Given[ArrayLike | None, Sequence[float] | None] = _camera(
        "numbers", "Point that the camera looks at [m].", unit="m", count=3, metavar="X,Y,Z"
    )
    view: Literal["isometric", "plan", "street", "bird"] | None = _camera(
        "choice", "The whole model in a named view, in place of eye= and target=: from the air "
        "(default), from the street, 1.7 m above the ground, or orthographic, isometric or plan.",
        choices=("isometric", "plan", "street", "bird"),
    )  # fmt: skip
    up: Given[ArrayLike, Sequence[float]] = _camera(
        "numbers", "Direction that points up in the picture; default: 0,0,1.",
        default=(0.0, 0.0, 1.0), count=3, metavar="X,Y,Z",
        remedy="numbers joined by commas; the file's own axis is --axis-up",
    )  # fmt: skip
    fov: float | None = _camera(
        "number",
        "Vertical field of view [degrees]; default: 28, with eye= 50.",
        unit="degree",
        metavar="DEG",
    )
    height: Given[float | str | None, float | None] = _camera(
        "length", "Orthographic view: the height that the picture shows [m].", unit="m",
        metavar="M",
    )  # fmt: skip
    size: tuple[int, int] = _camera(
        "size", "Size of the picture in pixels; default: 1024x768.", default=(1024, 768), count=2
    )
    near: Given[float | str | None, float | None] = _camera(
        "length",
        "Distance of the near plane [m]; default: 0.1, or a thousandth of the diagonal of a "
        "model smaller than 100 m.",
        unit="m", metavar="M",
    )  # fmt: skip

    def __post_init__(self) -> None:
        from umbra.scene import Camera  # noqa: PLC0415

        check_types(self)
        if (self.eye is None) != (self.target is None):
            missing = "target" if self.target is None else "eye"
            msg = (
                "a view needs both eye=(X, Y, Z) and target=(X, Y, Z); leave both out to see the "
                "whole model"
            )
            raise InputError(msg, option=missing)
        if self.view is not None and (self.eye is not None or self.height is not None):
            other = "eye" if self.eye is not None else "height"
            msg = f"view='{self.view}' places the camera; leave it or {other}= out"
            raise InputError(msg, option="view")
        if self.fov is not None and self.height is not None:
            msg = (
                "fov= is the angle of a perspective view, height= makes the view orthographic; "
                "leave one of them out"
            )
            raise InputError(msg, option="fov")
        # Report camera errors before reading any file.
        eye, target = (self.eye, self.target) if self.eye is not None else _SOMEWHERE
        near = 0.1 if self.near is None else self.near
        Camera(eye, target, self.up, self.size, self._angle, self.height, near)  # type: ignore[arg-type]

    @property
    def _angle(self) -> float:
        """The field of view, where it matters [degrees]."""
        from umbra.scene.named_views import FOV  # noqa: PLC0415

        return self.fov or (FOV if self.eye is None else _FOV)

    def make(self, scene: Scene) -> Camera:
        """Make the camera; by default the model fills the picture but for a margin."""
        from umbra.scene import Camera  # noqa: PLC0415
        from umbra.scene.camera import fit_camera  # noqa: PLC0415
        from umbra.scene.named_views import make_named_view  # noqa: PLC0415
        from umbra.window.view_state import frame_bounds  # noqa: PLC0415

        framed = frame_bounds(scene.model_bounds(), self.size, fov=self._angle).camera(self.size)
        near = framed.near if self.near is None else self.near
        if self.eye is not None and self.target is not None:
            return Camera(
                self.eye, self.target, self.up, self.size, self._angle, self.height, near  # type: ignore[arg-type]
            )  # fmt: skip
        points = scene.triangles().vertices + scene.origin
        if self.height is None and tuple(self.up) == _UP:
            view = self.view or "bird"
            return make_named_view(
                view, points, self.size, self._angle, near, partial(_find_height, scene)
            )
        camera = Camera(
            framed.eye, framed.target, self.up, self.size, self._angle, self.height, near  # type: ignore[arg-type]
        )  # fmt: skip
        return fit_camera(camera, points)


def _find_height(scene: Scene, x: float, y: float) -> float:
    """Return the height of the ground that a study would take at a place [m]."""
    import numpy as np  # noqa: PLC0415

    from umbra.ground.choice import find_ground  # noqa: PLC0415
    from umbra.ground.level import TERRAIN  # noqa: PLC0415
    from umbra.readers.terrain import find_terrain_height  # noqa: PLC0415

    try:
        ground = find_ground(scene)
    except InputError:  # nothing stands on it
        return float(scene.model_bounds()[0, 2])
    land = [part for part in ground.scene.parts if part.kind in TERRAIN and part.triangles]
    if ground.is_plane or not land:
        return ground.level
    plan = np.array([[x, y]]) - ground.scene.origin[:2]
    return float(find_terrain_height(land, plan)[0][0] + ground.scene.origin[2])
