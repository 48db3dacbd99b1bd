"""
Multisampling: volumes are counted and shaded per sample, and the mean is shown.

A multisampled target has depth, stencil and colours for every sample, so surfaces are
shaded once per pixel, and counts select light or shadow per sample. Passes over the whole
picture are drawn into each sample in turn, by OpenGL 3.3's sample mask. Where a driver
has fewer samples than requested, and for methods that need pictures of one sample (soft
shadows, masks), several pictures with subpixel offsets are drawn and averaged.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from umbra.gl.context import Device, release_all
from umbra.gl.programs import Programs
from umbra.gl.projection import CameraProjection
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
    vertices: int = 3,
    **uniforms: Any,
) -> None:
    """Draw a pass over the whole picture, or its rectangles, into each sample in turn."""
    if samples > 1:
        needs = (*needs, "HAS_SAMPLES")
    program = programs.find(*needs)
    program.set(**uniforms)
    for which in range(samples):
        state.use(how if samples == 1 else replace(how, sample=which))
        program.set(which=which)
        program.draw(vertices)


def split_samples(
    device: Device, samples: int, *, in_one: bool
) -> tuple[int, list[tuple[float, float]]]:
    """
    Return the samples per picture, and the subpixel offset of each picture to draw.

    ``in_one``: whether a picture may have several samples.
    """
    per_picture = 1
    if in_one:
        most = min(device.gl.integers(name)[0] for name in (_MAX_SAMPLES, _MAX_COLOR_SAMPLES))
        while 2 * per_picture <= min(samples, most):
            per_picture *= 2
    offsets = find_offsets(-(-samples // per_picture)) / per_picture**0.5
    return per_picture, [(across, down) for across, down in offsets.tolist()]


class Averaging:
    """Averages pictures and their samples in linear light."""

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
    ) -> Iterator[CameraProjection]:
        """
        Yield each projection to draw ``targets.drawn`` with, then write the mean.

        Before: the drawn target has the samples of ``split_samples``, which gave the offsets.
        After: ``targets.picture`` holds the mean in sRGB, summed in floats: samples that differ by
        one level of 255 give means that do.
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
        """Add a fraction of the drawn picture, equal for each of its samples."""
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
