"""
Several samples a pixel: volumes are counted in each, each is shaded, and their mean is shown.

A multisampled target has a depth, a stencil and colours for every sample, so surfaces are
shaded once a pixel, and counts choose between light and shadow sample by sample. Passes over
the whole picture are drawn into one sample after the other, by OpenGL 3.3's sample mask.
Where a driver gives fewer samples than are asked for, and for what is counted in pictures
of one sample (soft shadows, masks), several pictures are drawn whose pixels look a little off
their centres, and averaged.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from umbra.gl.context import Device, release_all
from umbra.gl.programs import Programs
from umbra.gl.projection import Projection
from umbra.gl.state import Pass, State
from umbra.gl.target import PictureTargets
from umbra.scene import Camera
from umbra.scene.camera import find_offsets

if TYPE_CHECKING:
    from umbra.gl.planner import Planner

__all__ = ["Averaging", "draw_samples", "split_samples"]

_MAX_SAMPLES, _MAX_COLOR_SAMPLES = 0x8D57, 0x910E


def draw_samples(
    state: State,
    how: Pass,
    programs: Programs,
    needs: tuple[str, ...],
    samples: int,
    **uniforms: Any,
) -> None:
    """Draw a pass over the whole picture, into one sample after the other where it has several."""
    if samples > 1:
        needs = (*needs, "HAS_SAMPLES")
    program = programs.find(*needs)
    program.set(**uniforms)
    for which in range(samples):
        state.use(how if samples == 1 else replace(how, sample=which))
        program.set(which=which)
        program.draw(3)


def split_samples(
    device: Device, samples: int, *, in_one: bool
) -> tuple[int, list[tuple[float, float]]]:
    """
    Tell how many samples a picture has, and how far off their centres the pixels of each look.

    ``in_one`` tells whether a picture may have several.
    """
    each = 1
    if in_one:
        most = min(device.gl.integers(name)[0] for name in (_MAX_SAMPLES, _MAX_COLOR_SAMPLES))
        while 2 * each <= min(samples, most):
            each *= 2
    offsets = find_offsets(-(-samples // each)) / each**0.5
    return each, [(across, down) for across, down in offsets.tolist()]


class Averaging:
    """Adds up pictures and their samples in linear light, and shows the mean."""

    def __init__(self, device: Device) -> None:
        self._average, self._encode = (
            Programs(device, "picture.vert.glsl", f"{what}.frag.glsl")
            for what in ("average", "encode")
        )

    def take(
        self,
        state: State,
        targets: PictureTargets,
        camera: Camera,
        offsets: list[tuple[float, float]],
        planner: "Planner",
    ) -> Iterator[Projection]:
        """
        Return each projection to draw ``targets.drawn`` with; at the end the picture is there.

        Before: what is drawn has as many samples as ``split_samples`` says, with these offsets.
        After: ``targets.picture`` holds the mean in sRGB.
        """
        if len(offsets) == targets.drawn.samples == 1:
            yield planner.project(camera)
            return
        targets.sum.fill(state, 0.0)
        for offset in offsets:
            yield planner.project(replace(camera, offset=offset))
            self._add(state, targets, 1 / len(offsets))
        targets.picture.use()
        state.use(Pass(color_write=True))
        targets.sum.bind(0)
        program = self._encode.find()
        program.set(light=0)
        program.draw(3)

    def _add(self, state: State, targets: PictureTargets, share: float) -> None:
        """Add a share of what was drawn, the same of each of its samples."""
        drawn = targets.drawn
        targets.sum.use()
        state.use(Pass(color_write=True, blend="add"))
        drawn.bind(0)
        program = self._average.find(*(("HAS_SAMPLES",) if drawn.samples > 1 else ()))
        for which in range(drawn.samples):
            program.set(picture=0, share=share / drawn.samples, which=which)
            program.draw(3)

    def release(self) -> None:
        """Free the programs."""
        release_all(self._average, self._encode)
