"""
Shading of a picture, and antialiasing with several samples per pixel.

Each sample is a whole picture with its pixels offset from their centres (``Camera.offset``),
the same on every device. Visibility and counting are cheap; positions, textures and light
are found only for samples whose face or shadow differs from that at the pixel's centre.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.calls.lines import LineFinder
from umbra.calls.openness import find_openness, follow_openness
from umbra.calls.picture_options import RenderOptions
from umbra.calls.styles import STYLES, Backdrop, Style
from umbra.cpu.picture_layers import blend_layers, follow_lights, see_behind
from umbra.cpu.shade import find_colors
from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.scene import Camera, Light, Scene
from umbra.scene.camera import find_offsets
from umbra.scene.exposure import DAY, Sky
from umbra.soft import AreaLight

__all__ = ["Averages", "PictureLayer", "PictureLights", "SeenLights", "average_colors"]

_HALF = 0.5  # share of a light above which a point is lit
_STEP = 1 / 32  # difference of light shares between adjacent pixels that is an edge


@dataclass(frozen=True, eq=False)
class SeenLights:
    """
    Effect of each light in one view, (rows, cols) each.

    ``lit``: whether it reaches the surface; ``reached``: the same, or the share that arrives;
    ``visibility``: share that casters leave, for soft shadows; all without parts that are
    transparent or have holes. ``transmission``, (rows, cols, 3): share that those parts transmit;
    ``hidden``: number of their triangles that hide the light.
    """

    counts: Sequence[NDArray[np.integer]]
    lit: Sequence[NDArray[np.bool_]]
    reached: Sequence[NDArray]
    visibility: Sequence[NDArray[np.float32]] | None = None
    transmission: Sequence[NDArray[np.float32]] | None = None
    hidden: Sequence[NDArray[np.int32]] | None = None
    openness: NDArray[np.float32] | None = None


@dataclass(frozen=True, eq=False)
class Averages:
    """
    Means over the samples of each pixel, (rows, cols).

    ``colors`` in linear RGB (rows, cols, 3), ``coverage``, the share of samples that see something,
    and ``ink``, the strength of lines.
    """

    colors: NDArray[np.float64]
    coverage: NDArray[np.float32]
    ink: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class PictureLayer:
    """Layer of visible surfaces, with its lights and opacity."""

    view: DepthBuffer
    frame: VisibleSurface
    seen: SeenLights
    opacity: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PictureLights:
    """
    The lights of a picture, and the counting of their shadows.

    Parameters
    ----------
    counter : FrameCounts
    lights : sequence of Light
    sized : sequence of AreaLight
        The lights with their sizes, for soft shadows.
    options : RenderOptions
    style : Style
    backdrop : Backdrop, optional
        By default the sky runs from the top of the picture to its foot.
    lines : LineFinder, optional
        Of the style's lines.
    sky : Sky
    """

    counter: Any
    lights: Sequence[Light]
    sized: Sequence[AreaLight]
    options: RenderOptions
    style: Style = STYLES["plain"]
    backdrop: Backdrop | None = None
    lines: LineFinder | None = None
    sky: Sky = DAY

    @property
    def is_sharp(self) -> bool:
        """Whether shadows are hard, so that counts alone show their edges."""
        return not self.options.is_soft and self.options.mask_scale == 1

    def count(self, view: DepthBuffer, camera: Camera) -> list[NDArray]:
        """Count the shadows of each light."""
        return [
            self.counter.count(view, camera, light, self.options.method) for light in self.lights
        ]

    def find(
        self,
        view: DepthBuffer,
        frame: VisibleSurface,
        camera: Camera,
        counts: Sequence[NDArray] | None = None,
    ) -> SeenLights:
        """Find the lights' effect in a view; ``counts`` are its shadow counts, if known."""
        seen = self._find_whole(view, frame, camera, counts)
        if self.counter.transmitters is None:
            return seen
        lights = self.sized if self.options.is_soft else self.lights
        transmission, hidden = follow_lights(self.counter, view, camera, lights)
        return replace(seen, transmission=transmission, hidden=hidden)

    def find_layers(
        self,
        view: DepthBuffer,
        frame: VisibleSurface,
        camera: Camera,
        middle: Sequence[PictureLayer] = (),
    ) -> list[PictureLayer]:
        """
        Find the lights' effect in a view, and on surfaces seen through it.

        The sky's light is taken from the layers at the pixels' centres, ``middle``, if there are.
        """
        layers: list[PictureLayer] = []
        for seen, places, opacity in see_behind(self.counter, camera, view, frame):
            effect = self.find(seen, places, camera)
            if self.style.directions:
                if len(layers) < len(middle):
                    at = middle[len(layers)]
                    assert at.seen.openness is not None
                    openness = follow_openness(at.seen.openness, at.view, seen)
                else:
                    openness = find_openness(
                        self.counter, seen, places, camera, self.style.directions
                    )
                effect = replace(effect, openness=openness)
            layers.append(PictureLayer(seen, places, effect, opacity))
        return layers

    def color(
        self,
        scene: Scene,
        camera: Camera,
        view: DepthBuffer,
        frame: VisibleSurface,
        seen: SeenLights,
    ) -> NDArray[np.float64]:
        """Shade a view in linear RGB, (rows, cols, 3), before its backdrop."""
        shown = find_colors(
            scene, frame, self.lights, seen.reached, view, seen.counts, self.sized, camera,
            seen.transmission, seen.openness, self.sky,
        )  # fmt: skip
        return shown if self.backdrop is None else self.backdrop.color(shown, frame, camera)

    def find_lines(self, view: DepthBuffer, camera: Camera) -> NDArray[np.float32]:
        """Return the strength of lines in a view, (rows, cols)."""
        if self.lines is None:
            return np.zeros(view.face.shape, np.float32)
        return self.lines.find(view, camera)

    def find_colors(
        self, scene: Scene, camera: Camera, layers: Sequence[PictureLayer]
    ) -> NDArray[np.float64]:
        """Composite layers in linear RGB, (rows, cols, 3)."""
        return blend_layers(
            (self.color(scene, camera, layer.view, layer.frame, layer.seen), layer.opacity)
            for layer in layers
        )

    def _find_whole(
        self,
        view: DepthBuffer,
        frame: VisibleSurface,
        camera: Camera,
        counts: Sequence[NDArray] | None,
    ) -> SeenLights:
        """Find the lights' effect with opaque casters alone."""
        if self.options.mask_scale != 1:
            return self._find_by_mask(frame, camera)
        if counts is None:
            counts = self.count(view, camera)
        lit = [frame.lit(n, light) for n, light in zip(counts, self.lights, strict=True)]
        if not self.options.is_soft:
            return SeenLights(counts, lit, lit)
        shares = self.counter.find_visibility(
            view, camera, self.sized, self.options.soft, self.options.softness
        )
        return SeenLights(counts, lit, self._reach(frame, shares), shares)

    def _find_by_mask(self, frame: VisibleSurface, camera: Camera) -> SeenLights:
        """Count in a smaller picture; counts are 0 and 1."""
        from umbra.gl.masks.upsampling import find_shares  # noqa: PLC0415

        shares = find_shares(
            self.counter, frame, camera, self.lights, self.options.method,
            scale=self.options.mask_scale, kind=self.options.mask_filter,
        )  # fmt: skip
        seen = frame.part != NOTHING
        counts = [((share < _HALF) & seen).astype(np.int32) for share in shares]
        lit = [frame.lit(n, light) for n, light in zip(counts, self.lights, strict=True)]
        return SeenLights(counts, lit, self._reach(frame, shares))

    def _reach(self, frame: VisibleSurface, shares: Sequence[NDArray]) -> list[NDArray]:
        """Return the shares of light at surfaces that face it, within its range."""
        none = np.zeros(frame.part.shape, np.int32)
        pairs = zip(shares, self.lights, strict=True)
        return [share * frame.lit(none, light) for share, light in pairs]


def average_colors(
    scene: Scene,
    camera: Camera,
    lights: PictureLights,
    layers: Sequence[PictureLayer],
    advance: Callable[[int, int], object] = lambda _done, _of: None,
) -> Averages:
    """
    Average what the samples of each pixel show.

    Parameters
    ----------
    scene : Scene
    camera : Camera
        Of the pixels' centres.
    lights : PictureLights
    layers : sequence of PictureLayer
        Surfaces at the pixels' centres, the first ones first.
    advance : callable
        Called with the number of samples done, and of all.

    Returns
    -------
    averages : Averages
    """
    middle, samples = layers[0], lights.options.samples
    view, frame, seen = middle.view, middle.frame, middle.seen
    if samples == 1:
        colors = lights.find_colors(scene, camera, layers)
        coverage = (frame.part != NOTHING).astype(np.float32)
        return Averages(colors, coverage, lights.find_lines(view, camera))
    if lights.counter.transmitters is not None:
        return _average_layers(scene, camera, lights, layers, advance)
    colors = lights.color(scene, camera, view, frame, seen)
    edges = _find_textured(scene, frame)
    if not lights.is_sharp:
        edges |= _find_steps(seen.reached)
    more, (coverage, ink) = np.zeros_like(colors), np.zeros((2, *view.face.shape), np.float32)
    for done, (across, down) in enumerate(find_offsets(samples).tolist()):
        advance(done, samples)
        other = replace(camera, offset=(across, down))
        looked = lights.counter.look(other)
        differs = edges | (looked.face != view.face)
        counts = None
        if lights.is_sharp:
            counts = lights.count(looked, other)
            for first, second in zip(counts, seen.counts, strict=True):
                differs |= (first != 0) != (second != 0)
        changed = DepthBuffer(looked.key, np.where(differs, looked.face, NOTHING))
        frame = lights.counter.locate(changed, other)
        effect = lights.find(changed, frame, other, counts)
        if seen.openness is not None:
            effect = replace(effect, openness=follow_openness(seen.openness, view, looked))
        shown = lights.color(scene, other, changed, frame, effect)
        more[differs] += shown[differs] - colors[differs]
        coverage += looked.face != NOTHING
        ink += lights.find_lines(looked, other)
    n = np.float32(samples)
    return Averages(colors + more / samples, coverage / n, ink / n)


def _average_layers(
    scene: Scene,
    camera: Camera,
    lights: PictureLights,
    middle: Sequence[PictureLayer],
    advance: Callable[[int, int], object],
) -> Averages:
    """Average all samples of every pixel in all layers: each may see another leaf."""
    samples, shape = lights.options.samples, (camera.size[1], camera.size[0])
    colors, (coverage, ink) = np.zeros((*shape, 3)), np.zeros((2, *shape), np.float32)
    for done, (across, down) in enumerate(find_offsets(samples).tolist()):
        advance(done, samples)
        other = replace(camera, offset=(across, down))
        view, frame = lights.counter.see(other)
        layers = lights.find_layers(view, frame, other, middle)
        colors += lights.find_colors(scene, other, layers)
        coverage += view.face != NOTHING
        ink += lights.find_lines(view, other)
    n = np.float32(samples)
    return Averages(colors / samples, coverage / n, ink / n)


def _find_textured(scene: Scene, frame: VisibleSurface) -> NDArray[np.bool_]:
    """Find pixels of textured parts, (rows, cols): texels may be finer than pixels."""
    has = np.array([bool(part.material.images) for part in scene.parts] + [False, False])
    return np.asarray(has[frame.part])  # ground and empty pixels are negative


def _find_steps(shares: Sequence[NDArray]) -> NDArray[np.bool_]:
    """Find the pixels on both sides of a step in the share of light, (rows, cols)."""
    is_step = np.zeros(shares[0].shape, np.bool_)
    for share in shares:
        level = share.astype(np.float32)
        across, down = (np.abs(np.diff(level, axis=axis)) > _STEP for axis in (1, 0))
        is_step[:, 1:] |= across
        is_step[:, :-1] |= across
        is_step[1:] |= down
        is_step[:-1] |= down
    return is_step
