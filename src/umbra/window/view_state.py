"""
Complete state of a view, as a frozen record independent of any window.

Its viewpoint orbits a point or walks; each move returns a new record.
"""

import datetime as dt
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.devices import DEVICES
from umbra.errors import InputError
from umbra.methods import MASK_FILTERS, MASK_SCALES, Softness
from umbra.methods import SOFT as METHODS_OF_SOFT
from umbra.scene import Camera, Light, Scene
from umbra.scene.exposure import expose_lights
from umbra.soft import SUN_RADIUS, AreaLight, ball_light
from umbra.sun import Site
from umbra.window.daylight import ProfilePeriod, Sun, Suns, find_daily_suns

__all__ = [
    "METHODS",
    "OVERLAYS",
    "SOFT",
    "SUN",
    "ViewState",
    "Viewpoint",
    "frame_bounds",
    "make_view",
]

STEEPEST = 89.9  # [degrees], so that "up" stays defined
_MARGIN = 1.06
_NEAR_MOST, _NEAR_SHARE = 0.1, 1e-3
_LEAST = 1e-6  # [m]; a smaller model is framed as if of this size

Point = tuple[float, float, float]
SUN = -1
"""Stands for the sun where lights are numbered."""

OVERLAYS = ("volumes", "cases", "edges", "counts", "components", "profile", "relief")
METHODS: dict[str, tuple[str, ...]] = {
    device.name: device.methods.hard
    for device in DEVICES.values()
    if set(METHODS_OF_SOFT) <= set(device.methods.soft)
}
"""By device that draws all that a view may ask, soft shadows too, in the order of their choice."""

SOFT = ("none", *METHODS_OF_SOFT)
"""What draws soft shadows."""

_LAMP = 0.01  # a lamp's radius, of the diagonal
_FROM_LEFT = 115.0  # [degrees] left of the heading: a light from the upper left


@dataclass(frozen=True)
class Viewpoint:
    """
    Position and direction of the view.

    Parameters
    ----------
    target : (float, float, float)
        Centre of the orbit, in the model's own coordinates [m].
    heading : float
        Direction of view, clockwise from +y [degrees].
    tilt : float
        Elevation of the direction of view [degrees].
    distance : float
        Distance from the eye to the target [m].
    fov : float
        Vertical field of view [degrees].
    near : float
        Distance of the near plane [m].
    walks : bool
        Whether turning rotates the target around the eye, rather than the eye around it.
    """

    target: Point
    heading: float = 20.0
    tilt: float = -28.0
    distance: float = 100.0
    fov: float = 45.0
    near: float = 0.1
    walks: bool = False

    def axes(self) -> NDArray[np.float64]:
        """Return the unit vectors right, up and forward, (3, 3) float64 by rows."""
        turn, lift = np.radians([self.heading, self.tilt])
        forward = np.array([np.sin(turn) * np.cos(lift), np.cos(turn) * np.cos(lift), np.sin(lift)])
        right = np.array([np.cos(turn), -np.sin(turn), 0.0])
        return np.stack([right, np.cross(right, forward), forward])

    @property
    def eye(self) -> NDArray[np.float64]:
        """Position of the eye, (3,) float64."""
        return np.array(self.target) - self.distance * self.axes()[2]

    def camera(self, size: tuple[int, int]) -> Camera:
        """Return the camera for a picture of columns and rows ``size``."""
        return Camera(self.eye, np.array(self.target), size=size, fov=self.fov, near=self.near)

    def turn(self, right: float, up: float) -> "Viewpoint":
        """Turn the view in a walk, else the eye around the target [degrees in the picture]."""
        eye = self.eye
        turned = replace(
            self,
            heading=(self.heading + right) % 360.0,
            tilt=float(np.clip(self.tilt + up, -STEEPEST, STEEPEST)),
        )
        return turned.put_eye(eye) if self.walks else turned

    def put_eye(self, eye: ArrayLike) -> "Viewpoint":
        """Move the eye to a point, in the same direction of view."""
        return replace(self, target=_point(np.asarray(eye, float) + self.distance * self.axes()[2]))

    def pan(self, cols: float, rows: float, height: int) -> "Viewpoint":
        """Pan so that points at the target's distance follow the mouse [pixels]."""
        right, up, _ = self.axes()
        pixel = 2 * self.distance * np.tan(np.radians(self.fov) / 2) / max(height, 1)
        return self.shift(pixel * (rows * up - cols * right))

    def dolly(self, steps: float) -> "Viewpoint":
        """Move toward the target by steps of a tenth of the distance; negative steps move away."""
        factor = 0.9**steps
        if self.walks:
            return self.shift(self.distance * (1 - factor) * self.axes()[2])
        return replace(self, distance=max(self.distance * factor, 2 * self.near))

    def walk(self, ahead: float, right: float, up: float) -> "Viewpoint":
        """Walk horizontally ahead and to the right, and move up [m]."""
        turn = np.radians(self.heading)
        level = np.array([np.sin(turn), np.cos(turn), 0.0])
        return self.shift(ahead * level + right * self.axes()[0] + np.array([0.0, 0.0, up]))

    def shift(self, way: NDArray[np.float64]) -> "Viewpoint":
        """Move the eye and the target together [m]."""
        return replace(self, target=_point(np.array(self.target) + way))


def frame_bounds(
    bounds: NDArray[np.float64],
    size: tuple[int, int],
    like: Viewpoint | None = None,
    fov: float | None = None,
) -> Viewpoint:
    """
    Find the viewpoint from which a box (2, 3) fills a picture of this size.

    It looks in the direction of ``like``, with its field of view unless ``fov`` is given.
    """
    middle = bounds.mean(0)
    diagonal = max(float(np.linalg.norm(np.ptp(bounds, axis=0))), _LEAST)
    near = min(_NEAR_SHARE * diagonal, _NEAR_MOST)
    start = like or Viewpoint(_point(middle))
    start = replace(start, target=_point(middle), near=near, fov=fov or start.fov)
    right, up, forward = start.axes()
    corners = np.stack(np.meshgrid(*bounds.T), -1).reshape(-1, 3) - middle
    across = np.tan(np.radians(start.fov) / 2) * np.array([size[0] / size[1], 1.0])
    needed = np.abs(corners @ np.stack([right, up]).T) / across - (corners @ forward)[:, None]
    # The model fits the picture, from no nearer than half its diagonal.
    return replace(start, distance=max(float(needed.max()) * _MARGIN, diagonal / 2))


def _point(values: NDArray[np.float64]) -> Point:
    x, y, z = values.tolist()
    return x, y, z


@dataclass(frozen=True)
class ViewState:
    """
    State of a view.

    Parameters
    ----------
    viewpoint : Viewpoint
    sun : Sun
    lights : tuple of Light
        Lights other than the sun.
    chosen : int
        The light whose volumes are shown: an index into ``lights``, or ``SUN``.
    method : str
        One of ``METHODS``.
    device : {'gl', 'cpu'}
    overlays : frozenset of str
        Any of ``OVERLAYS``.
    soft : str
        One of ``SOFT``; ``none`` for hard shadows.
    sun_radius : float
        Angular radius of the sun and other directional lights [degrees].
    lamp_radius : float
        Radius of lamps [m].
    layer_length, layer_gap : float
        Parameters of scaled layers, as in ``Softness``.
    mask_scale : {1, 2, 4}
        Factor by which hard shadows on gl are counted in fewer columns and rows.
    mask_filter : {'joint', 'bilinear', 'nearest'}
        Upsampling filter of the mask.
    detail : float
        By how many pixels hard shadows on gl may be off, cast from coarser meshes.
    animation : int or str, optional
        Animation of the scene: its number, its name or ``all``.
    time : float
        Time of the animation [s].
    no_cast : frozenset of int
        Indices of the parts that cast no shadow.
    period : ProfilePeriod
        Period of the shadow profile, on the sun's date.
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
    layer_length: float = Softness.length
    layer_gap: float = Softness.gap
    mask_scale: int = 1
    mask_filter: str = "joint"
    detail: float = 0.0
    animation: int | str | None = None
    time: float = 0.0
    no_cast: frozenset[int] = frozenset()
    period: ProfilePeriod = field(default_factory=ProfilePeriod)

    def __post_init__(self) -> None:
        if self.device not in METHODS:
            msg = f"a view has no device '{self.device}'; it has {', '.join(METHODS)}"
            raise InputError(msg, device=self.device)
        if self.method not in METHODS["gl"]:
            msg = f"a view has no method '{self.method}'; it has {', '.join(METHODS['gl'])}"
            raise InputError(msg, method=self.method)
        if self.soft not in SOFT:
            msg = f"a view has no soft shadows '{self.soft}'; it has {', '.join(SOFT)}"
            raise InputError(msg, soft=self.soft)
        if not (0 < self.sun_radius < 45 and 0 < self.lamp_radius < np.inf):
            msg = (
                f"lights of {self.sun_radius:g} degrees and {self.lamp_radius:g} m are impossible; "
                "give sun_radius above 0 and below 45, and lamp_radius above 0"
            )
            raise InputError(msg)
        if not 0 <= self.detail < np.inf:
            msg = f"a view's detail is a number of pixels, 0 or more; got {self.detail:g}"
            raise InputError(msg)
        Softness(length=self.layer_length, gap=self.layer_gap)
        for what, value, known in (
            ("mask_scale", self.mask_scale, MASK_SCALES),
            ("mask_filter", self.mask_filter, MASK_FILTERS),
        ):
            if value not in known:
                msg = f"a view has no {what}={value!r}; it has {', '.join(map(str, known))}"
                raise InputError(msg, option=what)
        unknown = sorted(self.overlays.difference(OVERLAYS))
        if unknown:
            msg = f"a view has no overlay '{unknown[0]}'; it has {', '.join(OVERLAYS)}"
            raise InputError(msg, overlay=unknown[0])
        if self.method not in METHODS[self.device]:
            object.__setattr__(self, "method", "auto")
        if not SUN <= self.chosen < len(self.lights):
            object.__setattr__(self, "chosen", len(self.lights) - 1)

    def shining(self) -> dict[int, Light]:
        """Return the active lights by number, the sun first."""
        shining = dict(enumerate(self.lights))
        sun = self.sun.light()
        return shining if sun is None else {SUN: sun, **shining}

    def profile_suns(self) -> Suns | None:
        """Return the suns of the shadow profile; None without a site or if none is up."""
        if self.sun.site is None:
            return None
        suns = find_daily_suns(self.sun.site, self.sun.date, self.period, self.sun.land)
        return suns if suns.total else None

    def size_lights(self) -> list[AreaLight]:
        """Return the active lights with their sizes, for soft shadows."""
        return [
            ball_light(light, self.lamp_radius if light.is_point else self.sun_radius)
            for light in self.shining().values()
        ]

    def soften(self, samples: int) -> Softness:
        """Return the resolution of soft shadows for a number of samples."""
        return Softness(samples=samples, length=self.layer_length, gap=self.layer_gap)

    def toggle(self, overlay: str) -> "ViewState":
        """Toggle an overlay."""
        return replace(self, overlays=self.overlays ^ {overlay})

    def choose_casters(self, casters: Iterable[int], parts: int) -> "ViewState":
        """Make only ``casters`` cast, out of ``parts`` parts."""
        return replace(self, no_cast=frozenset(range(parts)).difference(casters))

    def toggle_cast(self, part: int) -> "ViewState":
        """Toggle whether a part casts."""
        return replace(self, no_cast=self.no_cast ^ {part})

    def choose_method(self, method: str) -> "ViewState":
        """Choose the method of counting."""
        return replace(self, method=method)

    def next_method(self) -> "ViewState":
        """Choose the device's next method."""
        methods = METHODS[self.device]
        return replace(self, method=methods[(methods.index(self.method) + 1) % len(methods)])

    def next_soft(self) -> "ViewState":
        """Choose the next soft method, or hard shadows."""
        return replace(self, soft=SOFT[(SOFT.index(self.soft) + 1) % len(SOFT)])

    def next_scale(self) -> "ViewState":
        """Halve the mask's columns and rows, or restore full resolution."""
        scale = MASK_SCALES[(MASK_SCALES.index(self.mask_scale) + 1) % len(MASK_SCALES)]
        return replace(self, mask_scale=scale)

    def choose_device(self, device: str) -> "ViewState":
        """Choose a device; a method that it lacks becomes ``auto``."""
        return replace(self, device=device)

    def next_device(self) -> "ViewState":
        """Choose the next device."""
        names = [*METHODS]
        return self.choose_device(names[(names.index(self.device) + 1) % len(names)])

    def add_light(self, light: Light) -> "ViewState":
        """Add a light and choose it."""
        return replace(self, lights=(*self.lights, light), chosen=len(self.lights))

    def change_light(self, number: int, light: Light) -> "ViewState":
        """Replace a light."""
        return replace(self, lights=(*self.lights[:number], light, *self.lights[number + 1 :]))

    def move_light(self, number: int, position: NDArray[np.float64]) -> "ViewState":
        """Move a lamp to (3,) [m]."""
        light = self.lights[number]
        return self.change_light(number, replace(light, position=np.append(position, 1.0)))

    def remove_light(self, number: int) -> "ViewState":
        """Remove a light; the sun is switched off."""
        if number == SUN:
            return replace(self, sun=replace(self.sun, shines=False))
        left = (*self.lights[:number], *self.lights[number + 1 :])
        return replace(self, lights=left, chosen=min(self.chosen, len(left) - 1))


def make_view(
    scene: Scene,
    size: tuple[int, int],
    *,
    site: Site | None = None,
    date: dt.date | None = None,
    minutes: float | None = None,
) -> ViewState:
    """
    Make the initial view: the whole model under its own lights, the sun or one light.

    Without a site, the light comes from the upper left. The date is 21 March of this year by
    default; ``minutes`` is the clock time since midnight, 15:00 by default.
    """
    viewpoint = frame_bounds(scene.model_bounds(), size)
    lights = expose_lights(scene)
    is_given = date is not None or minutes is not None
    sun = Sun(
        shines=is_given or not lights,
        site=site,
        date=date or dt.date(dt.datetime.now(dt.UTC).year, 3, 21),
        minutes=15 * 60.0 if minutes is None else minutes,
        azimuth=(viewpoint.heading - _FROM_LEFT) % 360.0,
        altitude=42.0,
        by_clock=site is not None,
    )
    radius = float(f"{_LAMP * np.linalg.norm(np.ptp(scene.model_bounds(), axis=0)):.1g}") or 0.5
    return ViewState(viewpoint, sun, lights, chosen=SUN if sun.shines else 0, lamp_radius=radius)
