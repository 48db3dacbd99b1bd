"""
What a still eye sees, kept from picture to picture while only the light moves.

The second picture of a view stores its surfaces, and the picture in shadow. From then on a picture
with one light costs its volumes and the light where it reaches, however many triangles are seen.
An eye that moves pays nothing for it.
"""

from collections.abc import Callable

from umbra.gl.context import Device, release_all
from umbra.gl.projection import Projection
from umbra.gl.shading import Shading
from umbra.gl.state import Pass, State
from umbra.gl.target import PictureTargets, Target

__all__ = ["StillView"]


class StillView:
    """
    Tells whether a view is that of the last picture, and shows it in shadow.

    Attributes
    ----------
    is_stored : bool
        The surface target and the picture in shadow hold the view.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._view: tuple[PictureTargets, bytes] | None = None
        self._dark: Target | None = None
        self.is_stored = False

    def is_same(self, targets: PictureTargets, projection: Projection) -> bool:
        """Return whether these targets were last asked for this view; remember it."""
        name = projection.matrix.tobytes() + projection.eye.tobytes()
        last, self._view = self._view, (targets, name)
        if last is not None and last[0] is targets and last[1] == name:
            return True
        self.is_stored = False
        return False

    def forget(self) -> None:
        """Forget the view: surfaces, depth or what is stored of them have changed."""
        self._view, self.is_stored = None, False

    def show(
        self,
        state: State,
        targets: PictureTargets,
        shading: Shading,
        draw_surface: Callable[[State], None],
    ) -> None:
        """
        Show the view in shadow, stored before if need be.

        After: ``targets.surface`` holds the surfaces, ``targets.drawn`` is in use and holds the
        view in shadow, and the stencil is 0.
        """
        if self._dark is None or self._dark.depth_of is not targets.both:
            release_all(self._dark)
            self._dark = Target(self._device, targets.size, ("rgba8",), depth_of=targets.both)
        if not self.is_stored:
            draw_surface(state)
            self._dark.use()
            shading.finish(state, targets.surface)
            self.is_stored = True
        state.use(Pass(color_write=True))
        targets.drawn.copy(self._dark)
        state.clear(stencil=0)

    def release(self) -> None:
        """Free the picture."""
        release_all(self._dark)
        self._dark = None
        self.forget()
