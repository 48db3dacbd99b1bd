"""Checks of the scenes and cameras passed to calls."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

from numpy.typing import ArrayLike

from umbra.calls.camera_options import CameraOptions
from umbra.errors import InputError, check_type
from umbra.machine import find_memory, name_memory
from umbra.scene import Camera, Scene

__all__ = ["check_picture_memory", "make_camera", "tell_moved_parts"]

_BYTES, _LIGHT_BYTES = 330, 16  # memory per pixel, and per pixel and light


def make_camera(
    scene: Scene,
    *,
    eye: ArrayLike | None = None,
    target: ArrayLike | None = None,
    view: Literal["isometric", "plan", "street", "bird"] | None = None,
    up: ArrayLike = (0.0, 0.0, 1.0),
    size: tuple[int, int] = (1024, 768),
    fov: float | None = None,
    height: float | None = None,
    near: float | None = None,
) -> Camera:
    """
    Make a camera for a scene; by default of the whole model.

    Parameters
    ----------
    scene : Scene
    eye, target : (3,) float, optional
        Both or none [m]; by default the whole model from above.
    view : {'isometric', 'plan', 'street', 'bird'}, optional
        The whole model in a named view, in place of eye and target: isometric and plan are
        orthographic; a street is seen from 1.7 m above the lowest point, with upright verticals.
    up : (3,) float
        Upward in the picture.
    size : (int, int)
        Columns and rows of pixels.
    fov : float, optional
        Vertical field of view [degrees], 50 by default, 28 of a named view.
    height : float, optional
        Height of the picture [m], for an orthographic view instead.
    near : float, optional
        Near plane [m]; by default 0.1, or a thousandth of a model smaller than 100 m.

    Returns
    -------
    camera : Camera

    Raises
    ------
    InputError
        If one of eye and target is missing, or the view is degenerate.
    """
    check_type("scene", scene, Scene)
    options = CameraOptions(
        eye=eye,  # type: ignore[arg-type]
        target=target,  # type: ignore[arg-type]
        view=view,
        up=up,  # type: ignore[arg-type]
        fov=fov,
        height=height,
        size=size,
        near=near,
    )
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
    raise InputError(msg, bytes=needed)


def tell_moved_parts(tell: Callable[[str], object], moved: float, detail: float) -> None:
    """Tell how far shadows may be off, if they are cast from coarser meshes."""
    if detail and not moved:
        tell(f"note: all shadows are exact: no coarser mesh is within {detail:g} pixels")
    elif detail:
        tell(
            f"note: distant casters are coarser meshes, which are off by up to {moved:.3g} m, and "
            f"their shadows by up to {detail:g} pixels across the light; detail=0 is exact"
        )
