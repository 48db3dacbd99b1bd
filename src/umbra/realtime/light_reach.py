"""What a light can reach in a view, as plain numbers for the caller's own light pass."""

from umbra.errors import InputError, show_value
from umbra.gl.projection import CameraProjection, find_clip_range, find_light_source, turn_scissor
from umbra.scene import Light, Scene

__all__ = ["check_light", "find_reach"]

Viewport = tuple[int, int, int, int]


def check_light(light: object) -> None:
    """Raise `InputError` unless this is a light without size."""
    if not isinstance(light, Light):
        msg = f"light= is one of umbra's lights without size; got {show_value(light)}"
        raise InputError(msg, option="light")


def find_reach(
    seen: CameraProjection, scene: Scene, light: Light, viewport: Viewport
) -> tuple[Viewport, tuple[float, float]]:
    """Find the scissor of a light's range and cone in a framebuffer, and its depth bounds."""
    source = find_light_source(light, scene.origin)
    corners, depths = find_clip_range(seen.camera, scene.origin, source, light)
    left, bottom, cols, rows = viewport
    if corners is not None:
        x, y, width, height = turn_scissor(corners, seen.camera)
        x = cols - x - width if seen.is_mirrored else x
        left, bottom, cols, rows = left + x, bottom + y, width, height
    low, high = depths or (0.0, 1.0)
    bounds = (1.0 - high, 1.0 - low) if seen.reverses_depth else (low, high)
    return (left, bottom, cols, rows), bounds
