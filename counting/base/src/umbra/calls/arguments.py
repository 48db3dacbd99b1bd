"""Checks of the scenes and cameras passed to calls."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ParamSpec, Protocol

from umbra.calls.camera_options import CameraOptions
from umbra.errors import InputError, check_type
from umbra.machine import find_memory, name_memory
from umbra.scene import Camera, Scene
from umbra.signatures import takes

__all__ = ["check_picture_memory", "make_camera", "tell_moved_parts"]

P = ParamSpec("P")
_BYTES, _LIGHT_BYTES = 330, 16  # memory per pixel, and per pixel and light


class CameraCall(Protocol[P]):
    """The signature of ``umbra.make_camera``."""

    def __call__(self, scene: Scene, *_: P.args, **options: P.kwargs) -> Camera: ...


def _take(record: Callable[P, CameraOptions]) -> Callable[[Any], CameraCall[P]]:
    return takes(record, "a camera")


@_take(CameraOptions)
def make_camera(scene: Scene, *, options: CameraOptions) -> Camera:
    """
    Make a camera for a scene; by default of the whole model.

    Parameters
    ----------
    scene : Scene
    options : CameraOptions
        Each by its name.

    Returns
    -------
    camera : Camera

    Raises
    ------
    InputError
        If one of eye and target is missing, or the view is degenerate.
    """
    check_type("scene", scene, Scene)
    return options.make(scene)


def check_picture_memory(size: tuple[int, int], lights: int) -> None:
    """
    Refuse a picture that does not fit in memory.

    Parameters
    ----------
    size : (int, int)
        Columns and rows.
    lights : int
        Number of lights.

    Raises
    ------
    InputError
        If it does not fit; names a size that would.
    """
    cols, rows = size
    needed, held = cols * rows * (_BYTES + _LIGHT_BYTES * lights), find_memory()
    if needed <= held:
        return
    scale = math.sqrt(held / needed)
    msg = (
        f"a picture of {cols}x{rows} pixels needs {needed / 1e9:.1f} GB and "
        f"{name_memory(held)}; a size=({max(int(cols * scale), 1)}, {max(int(rows * scale), 1)}) "
        "would fit"
    )
    raise InputError(msg, option="size", bytes=needed)


def tell_moved_parts(tell: Callable[[str], object], moved: float, detail: float) -> None:
    """Tell how far shadows may be off, if they are cast from coarser meshes."""
    if detail and not moved:
        tell(f"note: all shadows are exact: no coarser mesh is within {detail:g} pixels")
    elif detail:
        tell(
            f"note: distant casters are coarser meshes, which are off by up to {moved:.3g} m, and "
            f"their shadows by up to {detail:g} pixels across the light; detail=0 is exact"
        )
