"""What the renderer and the shadow volumes share: a context, a scene, and edits of it."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from umbra.errors import InputError, show_value
from umbra.gl.context import Device, DeviceUser, on_device
from umbra.gl.foreign import ForeignTarget
from umbra.realtime.edited_scene import EditedScene
from umbra.scene import Part, Scene

__all__ = ["SceneUser", "read_target"]


class SceneUser(DeviceUser):
    """
    Base of what draws a scene in a context, its own or the caller's.

    Parameters
    ----------
    scene : Scene
    context : moderngl.Context, optional
        The caller's, current now; made if None, and then current until another is.
    """

    def __init__(self, scene: Scene, context: Any = None) -> None:
        self._edited, self._is_released = EditedScene(scene), False
        if context is not None and not hasattr(context, "version_code"):
            msg = f"context= is a moderngl.Context; got {show_value(context)}"
            raise InputError(msg, option="context")
        super().__init__(None if context is None else Device.of(context))
        if context is None and self.device.binding.is_alone:
            self.device.use()  # textures of moderngl are read in the current context

    def release(self) -> None:
        """Free all that is held, once; the caller's context stays, and everything else in it."""
        if not self._is_released:
            self._is_released = True
            super().release()
            self.device.release()

    @property
    def scene(self) -> Scene:
        """The scene as it is now."""
        return self._edited.scene

    @property
    def context(self) -> Any:
        """The moderngl context that is drawn in."""
        return self.device.handle

    @on_device
    def move(self, name: str, matrix: ArrayLike) -> None:
        """
        Place a part or an instance; only its own volumes are made anew.

        Parameters
        ----------
        name : str
            As in the scene; ``layer/name`` where several layers have it.
        matrix : (4, 4) float64
            From the part's own coordinates to the scene's; the own coordinates of a part that came
            without a transform are the scene's.

        Raises
        ------
        InputError
            If no part has the name, or several have it at different places.
        """
        self._edit("move", name, matrix)

    @on_device
    def add(self, part: Part) -> None:
        """Add a part, in the scene's own coordinates."""
        self._edit("add", part)

    @on_device
    def remove(self, name: str) -> None:
        """Remove the parts of a name; `InputError` if there are none, or no others."""
        self._edit("remove", name)

    @on_device
    def replace(self, name: str, part: Part) -> None:
        """Put a part, in the scene's own coordinates, in place of those of a name."""
        self._edit("replace", name, part)

    def _edit(self, edit: str, *given: Any) -> None:
        """Edit the scene, and draw that from now on; if it cannot be drawn, keep the last."""
        before = self._edited.scene
        try:
            self._show(before, getattr(self._edited, edit)(*given))
        except InputError:
            self._edited.scene = before
            raise

    @abstractmethod
    def _show(self, before: Scene, scene: Scene) -> None:
        """Update what is on the device to an edited scene."""


def read_target(
    device: Device, framebuffer: Any, viewport: Sequence[int] | None
) -> tuple[ForeignTarget, tuple[int, int]]:
    """
    Read a caller's framebuffer and viewport; return the target and the framebuffer's size.

    `InputError` if either is none.
    """
    if not all(hasattr(framebuffer, name) for name in ("glo", "size", "viewport")):
        msg = f"framebuffer= is a moderngl.Framebuffer; got {show_value(framebuffer)}"
        raise InputError(msg, option="framebuffer")
    box = tuple(framebuffer.viewport if viewport is None else viewport)
    if len(box) != 4 or not all(isinstance(n, (int, np.integer)) for n in box) or min(box[2:]) < 1:
        msg = (
            "viewport= is left, bottom, columns and rows, whole numbers of pixels of which the "
            f"last two are at least 1; got {show_value(viewport)}"
        )
        raise InputError(msg, option="viewport")
    left, bottom, cols, rows = map(int, box)
    return ForeignTarget(device, framebuffer.glo, (left, bottom, cols, rows)), framebuffer.size
