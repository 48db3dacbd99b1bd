"""Styles of pictures: what is added to the exact shadows so that a picture reads well."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, Light, Scene
from umbra.scene.exposure import DAY, GROUND_COLOR, NIGHT, Sky, choose_sky
from umbra.scene.mesh import ADDED_GROUND
from umbra.scene.pale import PALENESS, PAPER, STUDIO, expose_suns, has_looks

__all__ = [
    "STYLES",
    "Backdrop",
    "Style",
    "choose_style",
    "expose_by_style",
    "find_sky",
]

_NEAR, _FAR = 0.8, 3.0  # from the model's centre, where the ground begins and ends to fade [radii]
_SHADOW = 2.0  # length of a shadow that does not fade, of the model's height
_HIGH = 0.5  # sine of the altitude at which the sky has its full colour


@dataclass(frozen=True)
class Style:
    """
    What a picture shows besides surfaces and shadows.

    ``directions``: of the sky, whose shadows darken corners; 0 for an even light everywhere.
    ``has_lines``: outlines and creases. ``has_ground``: under a model that has none.
    ``paleness``: share of plaster in the colours of surfaces.
    """

    directions: int = 0
    has_lines: bool = False
    has_ground: bool = False
    paleness: float = 0.0

    @property
    def is_plain(self) -> bool:
        """Whether nothing is added but a ground."""
        return replace(self, has_ground=False) == Style()

    @property
    def has_backdrop(self) -> bool:
        """Whether the ground is of paper and fades into a sky with a horizon."""
        return self.has_ground or not self.is_plain


STYLES = {
    "plain": Style(),
    "material": Style(directions=48, has_ground=True),
    "architectural": Style(directions=48, has_lines=True, has_ground=True, paleness=PALENESS),
}
"""By the names that ``style=`` takes."""


def choose_style(name: str, scene: Scene, *, is_bare: bool, is_filed: bool = False) -> Style:
    """
    Return a style by its name; ``'auto'`` is chosen by the model.

    A bare picture, whose arrays are asked for, is plain by default, and gets no ground of its own:
    it shows what the arrays hold. A plain picture has a ground only if it is written to a file.
    """
    if name == "auto":
        name = "plain" if is_bare else "material" if has_looks(scene) else "architectural"
    style = STYLES[name]
    return replace(style, has_ground=(style.has_ground or is_filed) and not is_bare)


def find_sky(lights: Sequence[Light], style: Style, tell: Callable[[str], object]) -> Sky:
    """Return the sky of a picture; plain ones always have a day's."""
    sky = DAY if style.is_plain else choose_sky(lights)
    if sky is DAY and style.paleness:
        return STUDIO
    if sky is NIGHT:
        tell(
            "note: lamps shine alone, so sky and ambient light are a night's; date= and at= add "
            "the sun"
        )
    return sky


def expose_by_style(lights: Sequence[Light], style: Style) -> list[Light]:
    """Return the lights with low suns as bright as a photograph shows them, in pale pictures."""
    return expose_suns(lights) if style.paleness else list(lights)


@dataclass(frozen=True, eq=False)
class Backdrop:
    """Sky above a horizon, into which the ground fades with distance; none if transparent."""

    scene: Scene
    is_transparent: bool = False
    sky: Sky = DAY

    @cached_property
    def _circle(self) -> tuple[NDArray[np.float64], float]:
        """Return the model's centre in plan and its radius, or that of a tall one's shadow [m]."""
        low, high = self.scene.model_bounds()
        middle, (*plan, height) = (low + high) / 2, high - low
        return middle[:2], max(float(np.linalg.norm(plan)) / 2, _SHADOW * float(height), 1e-9)

    def color(
        self, linear: NDArray[np.float64], frame: VisibleSurface, camera: Camera
    ) -> NDArray[np.float64]:
        """Put it behind a picture in linear RGB (rows, cols, 3)."""
        empty = frame.part == NOTHING
        is_added = np.array([part.kind in ADDED_GROUND for part in self.scene.parts])
        ground = np.append(is_added, [True, False])[frame.part]  # GROUND and NOTHING are last
        if self.is_transparent:
            linear[empty] = 0.0
            return linear
        sky = self._find_sky(camera)
        linear[empty] = sky[empty]
        linear[ground] *= np.array(PAPER) / GROUND_COLOR
        middle, radius = self._circle
        away = np.linalg.norm(frame.position[ground][:, :2] - middle, axis=1) / radius
        faded = np.clip((away - _NEAR) / (_FAR - _NEAR), 0.0, 1.0)
        faded = (faded * faded * (3.0 - 2.0 * faded))[:, None]
        linear[ground] += faded * (np.array(self.sky.horizon) - linear[ground])
        return linear

    def _find_sky(self, camera: Camera) -> NDArray[np.float64]:
        """Return the colour of the sky in each pixel; below the horizon there is its own."""
        cols, rows = camera.size
        _, up, forward = camera.axes()
        if camera.is_perspective:
            right = camera.axes()[0]
            scale = np.tan(np.radians(camera.fov) / 2) / (rows / 2)
            middle = camera.center
            across = (np.arange(cols) - middle[0]) * scale
            down = (np.arange(rows) - middle[1])[:, None] * scale
            rise = forward[2] + across * right[2] - down * up[2]
            rise = rise / np.sqrt(1.0 + across**2 + down**2)
        else:
            rise = np.full((rows, cols), forward[2])
        share = np.clip(rise / _HIGH, 0.0, 1.0)[..., None]
        horizon = np.array(self.sky.horizon)
        return horizon + share * (np.array(self.sky.zenith) - horizon)
