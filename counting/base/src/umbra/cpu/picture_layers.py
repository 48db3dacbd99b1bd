"""
Layers of a picture: the visible surface, the surfaces seen through it, and their light.

Each layer is counted, traced to the lights and shaded as if it were the only one, by the counter of
any device.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.rays.transmission import POINTS
from umbra.scene import Camera, Light
from umbra.soft import AreaLight

if TYPE_CHECKING:
    from umbra.soft.frames import FrameCounts

__all__ = ["blend_layers", "follow_lights", "see_behind"]


def see_behind(
    counter: "FrameCounts", camera: Camera, view: DepthBuffer, frame: VisibleSurface
) -> Iterator[tuple[DepthBuffer, VisibleSurface, NDArray[np.float64]]]:
    """
    Yield a view, then the layers seen through it, nearest first, with their opacity.

    Parameters
    ----------
    counter : FrameCounts
    camera : Camera
    view : DepthBuffer
    frame : VisibleSurface
        Visible surface of the first layer.

    Yields
    ------
    view, frame
        A layer; empty where the previous one is opaque.
    opacity : (rows, cols) float64
        1 where nothing is seen.
    """
    while True:
        opacity = np.ones(view.face.shape)
        if counter.transmitters is not None:
            seen = view.face != NOTHING
            places = frame.position[seen] - counter.scene.origin
            opacity[seen] = counter.transmitters.find_opacity(view.face[seen], places)
        yield view, frame, opacity
        is_clear = opacity < 1
        if not is_clear.any():
            return
        before = DepthBuffer(view.key, np.where(is_clear, view.face, NOTHING))
        view = counter.look(camera, before)
        frame = counter.locate(view, camera)


def follow_lights(
    counter: "FrameCounts", view: DepthBuffer, camera: Camera, lights: Sequence[Light | AreaLight]
) -> tuple[list[NDArray[np.float32]], list[NDArray[np.int32]]]:
    """
    Find the light that transmitting parts leave at each visible point, and what hides it.

    For an area light the first is the average over sample points, the second that of its centre.
    See `Sight.transmit` for the arrays.
    """
    transmission, hidden = [], []
    for light in lights:
        middle = light.light if isinstance(light, AreaLight) else light
        left, behind = counter.transmit(view, camera, middle)
        if isinstance(light, AreaLight):
            points = light.points(POINTS)
            parts = [counter.transmit(view, camera, point)[0] for point in points]
            left = np.mean(parts, 0, dtype=np.float32)
        transmission.append(left)
        hidden.append(behind)
    return transmission, hidden


def blend_layers(
    layers: Iterable[tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> NDArray[np.float64]:
    """Blend colours (rows, cols, 3) with their opacity (rows, cols), nearest layer first."""
    colors, left = np.zeros(()), np.ones(())
    for shown, opacity in layers:
        colors = colors + (left * opacity)[..., None] * shown
        left = left * (1.0 - opacity)
    return colors
