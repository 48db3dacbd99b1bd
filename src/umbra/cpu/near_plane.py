"""Whether a camera's near plane cuts into what it looks at."""

from umbra.cpu.depth import NOTHING, see
from umbra.scene import Camera, Scene

__all__ = ["count_cut"]

_CLOSEST = 1e-6  # of the near plane's distance: what is nearer to the eye is not looked for


def count_cut(scene: Scene, camera: Camera, threads: int = 1) -> int:
    """
    Count the pixels through which one looks past the near plane into the model.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    threads : int

    Returns
    -------
    pixels : int
        Where something lies between the eye and the near plane, which is not drawn.
    """
    soup = scene.triangles()
    forward = camera.axes()[2]
    ahead = soup.vertices @ forward - (camera.eye - scene.origin) @ forward
    corners = ahead[soup.faces]
    close = (corners.min(1) < camera.near) & (corners.max(1) > 0)
    if not close.any():
        return 0
    if camera.is_perspective:
        limits = (1 / camera.near, 1 / (_CLOSEST * camera.near))
    else:
        limits = (-camera.near, 0.0)
    matrix = camera.matrix(scene.origin)
    view = see(soup.vertices, soup.faces[close], matrix, camera.size, limits, threads)
    return int((view.face != NOTHING).sum())
