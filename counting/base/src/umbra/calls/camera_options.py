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
_FOV = 50.0  # [degrees]
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
        "numbers", "Position of the camera [m]; default: the whole model, seen from above.",
        unit="m", count=3, metavar="X,Y,Z",
    )  # fmt: skip
    target: Given[ArrayLike | None, Sequence[float] | None] = _camera(
        "numbers", "Point that the camera looks at [m].", unit="m", count=3, metavar="X,Y,Z"
    )
    view: Literal["isometric", "plan", "street", "bird"] | None = _camera(
        "choice", "The whole model in a named view, in place of eye= and target=: isometric and "
        "plan are orthographic, street stands 1.7 m above the lowest point.",
        choices=("isometric", "plan", "street", "bird"),
    )  # fmt: skip
    up: Given[ArrayLike, Sequence[float]] = _camera(
        "numbers", "Direction that points up in the picture; default: 0,0,1.",
        default=(0.0, 0.0, 1.0), count=3, metavar="X,Y,Z",
        remedy="numbers joined by commas; the file's own axis is --axis-up",
    )  # fmt: skip
    fov: float | None = _camera(
        "number",
        "Vertical field of view [degrees]; default: 50, of a named view 28.",
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
        return _FOV if self.fov is None else self.fov

    def make(self, scene: Scene) -> Camera:
        """Make the camera; by default the model fills the picture but for a margin."""
        from umbra.scene import Camera  # noqa: PLC0415
        from umbra.scene.camera import fit_camera  # noqa: PLC0415
        from umbra.scene.named_views import FOV, make_named_view  # noqa: PLC0415
        from umbra.window.view_state import frame_bounds  # noqa: PLC0415

        framed = frame_bounds(scene.model_bounds(), self.size, fov=self._angle).camera(self.size)
        near = framed.near if self.near is None else self.near
        points = scene.triangles().vertices + scene.origin if self.eye is None else None
        if self.view is not None and points is not None:
            return make_named_view(self.view, points, self.size, self.fov or FOV, near)
        camera = Camera(
            framed.eye if self.eye is None else self.eye,  # type: ignore[arg-type]
            framed.target if self.target is None else self.target,  # type: ignore[arg-type]
            self.up,  # type: ignore[arg-type]
            size=self.size,
            fov=self._angle,
            height=self.height,
            near=near,
        )
        return camera if points is None else fit_camera(camera, points)
