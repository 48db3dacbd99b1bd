"""A view: all that can be looked at and chosen, as one frozen record that knows no window."""

import datetime as dt
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from umbra.devices import DEVICES
from umbra.errors import InputError
from umbra.methods import SOFT as METHODS_OF_SOFT
from umbra.scene import Light, Scene
from umbra.scene.palette import expose_lights
from umbra.soft.area import SUN_RADIUS, AreaLight, ball_light
from umbra.sun import Site
from umbra.window.daylight import Sun
from umbra.window.viewpoint import Viewpoint, frame_bounds

__all__ = [
    "METHODS",
    "OVERLAYS",
    "SOFT",
    "SUN",
    "ViewState",
    "find_ground",
    "make_view",
]

SUN = -1
"""Stands for the sun where lights are numbered."""

OVERLAYS = ("volumes", "cases", "edges", "counts")
METHODS: dict[str, tuple[str, ...]] = {
    device.name: device.methods.hard for device in DEVICES.values()
}
"""By device, in the order in which they are chosen."""

SOFT = ("none", *METHODS_OF_SOFT)
"""What draws soft shadows."""

_CLEAR = 2e-4  # of the diagonal, so that no floor of the model lies in the ground
_LAMP = 0.01  # a lamp's radius, of the diagonal
_FROM_LEFT = 115.0  # [degrees] left of where one looks: a light from the upper left


@dataclass(frozen=True)
class ViewState:
    """
    What a window shows.

    Parameters
    ----------
    viewpoint : Viewpoint
    sun : Sun
    lights : tuple of Light
        Besides the sun.
    chosen : int
        The light whose volumes are shown: a place in ``lights``, or ``SUN``.
    method : str
        Of ``METHODS``.
    device : {'gl', 'cpu'}
    overlays : frozenset of str
        Of ``OVERLAYS``.
    soft : str
        Of ``SOFT``; ``none`` are hard shadows.
    sun_radius : float
        From the middle of the sun, or of another direction, to its rim [degrees].
    lamp_radius : float
        Of lights at a place [m].
    """

    viewpoint: Viewpoint
    sun: Sun = field(default_factory=Sun)
    lights: tuple[Light, ...] = ()
    chosen: int = SUN
    method: str = "auto"
    device: str = "gl"
    overlays: frozenset[str] = frozenset()
    soft: str = "none"
    sun_radius: float = SUN_RADIUS
    lamp_radius: float = 0.5

    def __post_init__(self) -> None:
        if self.device not in METHODS:
            msg = f"a view has no device '{self.device}'; it has {', '.join(DEVICES)}"
            raise InputError(msg, device=self.device)
        if self.method not in METHODS["gl"]:
            msg = f"a view has no method '{self.method}'; it has {', '.join(METHODS['gl'])}"
            raise InputError(msg, method=self.method)
        if self.soft not in SOFT:
            msg = f"a view has no soft shadows '{self.soft}'; it has {', '.join(SOFT)}"
            raise InputError(msg, soft=self.soft)
        if not (0 < self.sun_radius < 45 and 0 < self.lamp_radius < np.inf):
            msg = (
                f"lights of {self.sun_radius:g} degrees and {self.lamp_radius:g} m are none; give "
                "sun_radius above 0 and below 45, and lamp_radius above 0"
            )
            raise InputError(msg)
        unknown = sorted(self.overlays.difference(OVERLAYS))
        if unknown:
            msg = f"a view has no overlay '{unknown[0]}'; it has {', '.join(OVERLAYS)}"
            raise InputError(msg, overlay=unknown[0])
        if self.method not in METHODS[self.device]:
            object.__setattr__(self, "method", "auto")
        if not SUN <= self.chosen < len(self.lights):
            object.__setattr__(self, "chosen", len(self.lights) - 1)

    def shining(self) -> dict[int, Light]:
        """Give the lights that shine now, by number; the sun first."""
        found = dict(enumerate(self.lights))
        sun = self.sun.light()
        return found if sun is None else {SUN: sun, **found}

    def size_lights(self) -> list[AreaLight]:
        """Give the lights that shine with the sizes that soft shadows take."""
        return [
            ball_light(light, self.lamp_radius if light.is_point else self.sun_radius)
            for light in self.shining().values()
        ]

    def toggle(self, overlay: str) -> "ViewState":
        """Show an overlay, or no longer."""
        return replace(self, overlays=self.overlays ^ {overlay})

    def choose_method(self, method: str) -> "ViewState":
        """Count by a method."""
        return replace(self, method=method)

    def next_method(self) -> "ViewState":
        """Count by the device's next method."""
        methods = METHODS[self.device]
        return replace(self, method=methods[(methods.index(self.method) + 1) % len(methods)])

    def next_soft(self) -> "ViewState":
        """Draw soft shadows by the next method, or hard ones."""
        return replace(self, soft=SOFT[(SOFT.index(self.soft) + 1) % len(SOFT)])

    def choose_device(self, device: str) -> "ViewState":
        """Count on a device; a method that it does not have becomes ``auto``."""
        return replace(self, device=device)

    def add_light(self, light: Light) -> "ViewState":
        """Add a light and choose it."""
        return replace(self, lights=(*self.lights, light), chosen=len(self.lights))

    def change_light(self, number: int, light: Light) -> "ViewState":
        """Put another light in a light's place."""
        return replace(self, lights=(*self.lights[:number], light, *self.lights[number + 1 :]))

    def move_light(self, number: int, position: NDArray[np.float64]) -> "ViewState":
        """Move a light that has a place to (3,) [m]."""
        light = self.lights[number]
        return self.change_light(number, replace(light, position=np.append(position, 1.0)))

    def remove_light(self, number: int) -> "ViewState":
        """Remove a light; the sun is switched off."""
        if number == SUN:
            return replace(self, sun=replace(self.sun, shines=False))
        left = (*self.lights[:number], *self.lights[number + 1 :])
        return replace(self, lights=left, chosen=min(self.chosen, len(left) - 1))


def find_ground(bounds: NDArray[np.float64]) -> float:
    """Give the height of a ground [m] just below a model in a box (2, 3), clear of its base."""
    return float(bounds[0, 2] - _CLEAR * np.linalg.norm(bounds[1] - bounds[0]))


def make_view(
    scene: Scene,
    size: tuple[int, int],
    *,
    site: Site | None = None,
    date: dt.date | None = None,
    minutes: float | None = None,
) -> ViewState:
    """
    Make the view to begin with: the whole model under its own lights, the sun or one light.

    Without a site a light comes from the upper left. The date is 21 March of this year by
    default; ``minutes`` are on the clock since midnight, 15:00 by default.
    """
    viewpoint = frame_bounds(scene.bounds(), size)
    lights = expose_lights(scene)
    asked = date is not None or minutes is not None
    sun = Sun(
        shines=asked or not lights,
        site=site,
        date=date or dt.date(dt.datetime.now(dt.UTC).year, 3, 21),
        minutes=15 * 60.0 if minutes is None else minutes,
        azimuth=(viewpoint.heading - _FROM_LEFT) % 360.0,
        altitude=42.0,
        by_clock=site is not None,
    )
    radius = float(f"{_LAMP * np.linalg.norm(np.ptp(scene.bounds(), axis=0)):.1g}") or 0.5
    return ViewState(viewpoint, sun, lights, chosen=SUN if sun.shines else 0, lamp_radius=radius)
