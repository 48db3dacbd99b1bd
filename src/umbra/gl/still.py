"""
What a still eye sees, kept from picture to picture while only the light moves.

The second picture of a view stores its surfaces, and the picture in shadow. From then on a picture
with one light costs its volumes and the light where it reaches, however many triangles are seen;
it may differ by 1 of 255 levels from one drawn anew. No cost while the camera moves.
"""

from collections.abc import Callable

from umbra.gl.context import release_all
from umbra.gl.masks import Counts
from umbra.gl.projection import CameraProjection
from umbra.gl.request import find_request_key
from umbra.gl.shading import Lamp, Scissor, Shading
from umbra.gl.state import ALL_BITS, Pass, State
from umbra.gl.target import PictureTargets, Target
from umbra.gl.volume_counter import COUNT_BITS, VolumeCounter
from umbra.gl.volume_plan import VolumePlan

__all__ = ["StillView"]


class StillView:
    """
    Tells whether a view is that of the last picture, and shows it in shadow.

    Attributes
    ----------
    is_stored : bool
        The surface target and the picture in shadow hold the view.
    is_marked : bool
        The stencil's highest bit still marks smooth surfaces.
    """

    def __init__(self, shading: Shading) -> None:
        self._shading = shading
        self._view: tuple | None = None
        self._dark: Target | None = None
        self.is_stored = self.is_marked = False

    def is_same(self, targets: PictureTargets, projection: CameraProjection) -> bool:
        """Return whether these targets were last asked for this view; remember it."""
        view = find_request_key((targets, projection, targets.device.sky))
        last, self._view = self._view, view
        if last == view:
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
        draw_surface: Callable[[State], None],
        is_smooth: bool,
    ) -> None:
        """
        Show the view in shadow, stored before if need be.

        After: ``targets.surface`` holds the surfaces, ``targets.drawn`` is in use and holds the
        view in shadow, and the stencil is 0; if it ``is_marked``, in `COUNT_BITS`, and if any
        surface ``is_smooth``, the bit beside these marks its pixels.
        """
        if self._dark is None or self._dark.depth_of is not targets.both:
            release_all(self._dark)
            self._dark = Target(targets.device, targets.size, ("rgba8",), depth_of=targets.both)
        if not self.is_stored:
            draw_surface(state)
            self._dark.use()
            self._shading.finish(state, targets.surface)
            if is_smooth:
                self._shading.mark_smooth(state, targets.surface)
            self.is_stored = self.is_marked = True
        state.use(Pass(color_write=True))
        targets.drawn.copy(self._dark)
        state.clear(stencil=0, bits=COUNT_BITS if self.is_marked else ALL_BITS)

    def count(
        self, state: State, target: Target, plan: VolumePlan, counter: Counts, *, keeps: bool
    ) -> None:
        """Count shadows as a counter does; if it ``keeps`` marks, only where both find room."""
        self.is_marked &= keeps and plan.statistics.deepest <= COUNT_BITS
        if self.is_marked:
            assert isinstance(counter, VolumeCounter)
            counter.count(state, target, plan, is_clear=True, bits=COUNT_BITS)
        else:
            counter.count(state, target, plan)

    def show_light(
        self,
        state: State,
        targets: PictureTargets,
        projection: CameraProjection,
        lamp: Lamp,
        scissor: Scissor | None,
        spares_turned: bool,
    ) -> None:
        """Draw what the only light reaches, as `Shading.show_light` does, by the last count."""
        targets.drawn.use()
        given = (state, targets.surface, projection, lamp, scissor)
        self._shading.show_light(*given, spares_turned=spares_turned, is_marked=self.is_marked)

    def release(self) -> None:
        """Free the picture."""
        release_all(self._dark)
        self._dark = None
        self.forget()
