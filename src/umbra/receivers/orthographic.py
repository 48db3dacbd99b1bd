"""Orthographic views as receivers: elevations from any azimuth, and views from above."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.ground.choice import find_ground
from umbra.ground.level import has_terrain
from umbra.receivers.kind import ReceiverKind, Request
from umbra.receivers.layout import Skyline, lay_out
from umbra.receivers.seen import SeenRaster, ViewModel, ViewTile
from umbra.receivers.surface_samples import Samples
from umbra.scene import Camera, Scene
from umbra.scene.grid import Grid

__all__ = [
    "COMPASS",
    "Elevation",
    "ElevationView",
    "SurfacesFromAbove",
    "ViewFromAbove",
    "find_direction",
]

_TURNS = 1e4  # largest azimuth that is accepted [degrees]
_MARGIN = 0.02  # of the model's length
_AROUND = 0.08  # of it, if the ground around is visible
PIXEL_BYTES = 200
"""Memory of a pixel: its position, normal, depth and counts [byte]."""
COMPASS = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}


def find_direction(receivers: str, names: Sequence[str] = ()) -> tuple[float, float]:
    """
    Read the direction of a view.

    Parameters
    ----------
    receivers : str
        North, east, south, west, or degrees clockwise from true north; after a slash the
        tilt downward: ``215/35``.
    names : sequence of str
        Other receivers that a message names.

    Returns
    -------
    azimuth, tilt : float
        [degrees]

    Raises
    ------
    InputError
        If it is none of these, or the view does not look level or down.
    """
    name, slash, down = receivers.partition("/")
    try:
        azimuth = COMPASS[name] if name in COMPASS else float(name)
        tilt = float(down) if slash else 0.0
    except ValueError:
        azimuth = tilt = np.nan
    if np.isfinite(azimuth) and not 0 <= azimuth <= 360:
        msg = (
            f"an elevation's azimuth lies between 0 and 360 degrees; got receivers '{receivers}'"
            + (f" (the same as {azimuth % 360:g}?)" if abs(azimuth) < _TURNS else "")
        )
        raise InputError(msg, receivers=receivers)
    if not (np.isfinite(azimuth) and 0 <= tilt < 90):
        msg = (
            f"unknown receivers '{receivers}'; choose {', '.join(names)}, an elevation from north, "
            "east, south, west or an azimuth in degrees, or a view from above such as 215/35"
        )
        raise InputError(msg, receivers=receivers)
    return azimuth % 360, tilt


@dataclass(frozen=True)
class Elevation:
    """
    The frame of an orthographic view, level or from above.

    Parameters
    ----------
    right, up, forward : (float, float, float)
        Unit vectors in the model's axes: to the right, upward in the view, and away.
    """

    right: tuple[float, float, float]
    up: tuple[float, float, float]
    forward: tuple[float, float, float]

    @classmethod
    def of(cls, azimuth: float, true_north: float, tilt: float = 0.0) -> "Elevation":
        """
        Make the frame of a view from an azimuth.

        Parameters
        ----------
        azimuth : float
            Azimuth of the viewer, clockwise from true north [degrees].
        true_north : float
            Azimuth of true north in the plan [degrees].
        tilt : float
            Tilt of the view downward [degrees].
        """
        quarters, rest = divmod(azimuth + true_north, 90.0)
        sine, cosine = np.sin(np.radians(rest)), np.cos(np.radians(rest))
        for _ in range(int(quarters) % 4):  # exact for north, east, south and west
            sine, cosine = cosine, -sine
        level, down = (np.cos(np.radians(tilt)), np.sin(np.radians(tilt))) if tilt else (1.0, 0.0)
        return cls(
            (-cosine, sine, 0.0),
            (-sine * down, -cosine * down, level),
            (-sine * level, -cosine * level, -down),
        )

    @property
    def is_level(self) -> bool:
        """Whether upward is along z."""
        return self.forward[2] == 0

    def find_extent(self, scene: Scene, parts: list[int] | None = None) -> NDArray[np.float64]:
        """Return the bounds of parts along the view's right and up axes, (2, 2) [m]."""
        soup = scene.triangles(scene.list_own() if parts is None else parts)
        used = soup.find_corners() + scene.origin
        across = used @ np.array([self.right, self.up]).T
        return np.stack([across.min(0), across.max(0)])

    def make_camera(self, grid: Grid, bounds: NDArray[np.float64]) -> Camera:
        """
        Make the camera of a raster of square cells along the view's right and up axes.

        Parameters
        ----------
        grid : Grid
            Along right and up, in the model's own coordinates [m].
        bounds : (2, 3) float64
            Of the model.
        """
        right, up, forward = (np.array(v) for v in (self.right, self.up, self.forward))
        corners = np.array(
            [[x, y, z] for x in bounds[:, 0] for y in bounds[:, 1] for z in bounds[:, 2]]
        )
        depth = corners @ forward
        room = 1.0 + np.ptp(depth)
        along = grid.x0 + grid.dx * (grid.cols - 1) / 2
        upward = grid.y0 + grid.dy * (grid.rows - 1) / 2
        eye = along * right + upward * up + (depth.min() - room) * forward
        return Camera(
            eye, eye + forward, size=(grid.cols, grid.rows), height=grid.dy * grid.rows,
            near=room / 2,
        )  # fmt: skip


class OrthographicKind(ReceiverKind):
    """Base of elevations and views from above."""

    samples: Samples | None = None
    rows: ClassVar[str]

    def lay_out(self, request: Request) -> SeenRaster:
        """Find the surfaces visible from an azimuth."""
        scene = request.scene
        known = find_ground(scene, request.options.ground)
        level, assumed = known.level, known.assumed
        azimuth, tilt = find_direction(request.options.receivers)
        shown, requested = self.find_drawn(request)
        bounds = scene.bounds()
        frame = Elevation.of(azimuth, request.true_north, tilt)
        drawn = shown if shown is None or request.options.on else [*shown, *request.find_proposed()]
        low, high = frame.find_extent(scene, requested or drawn)
        margin = _MARGIN * (high[0] - low[0]) + 1e-3
        room = min(margin, 0.1 * (high[1] - low[1]) + 1e-3)  # long rows of houses are low
        ground = None
        if not frame.is_level and not has_terrain(scene):
            ground, margin = level, _AROUND * (high[0] - low[0])  # room for shadows on the ground
            room = margin * -frame.forward[2]
        bottom = level if frame.is_level else low[1] - room
        default = (low[0] - margin, bottom, high[0] + margin, max(high[1], bottom) + room)
        raster = request.find_room()
        extent, size, cell = raster["extent"] or default, raster["size"], raster["cell"]
        if size is None and cell is None:
            cell = _choose_cell(extent)
        # Visible parts in the view's axes, like the extent.
        grid, _, _ = lay_out(
            Skyline.of(np.array([(*low, level), (*high, level)]), level),
            np.zeros((0, 3)),
            **{
                **raster,
                "extent": extent,
                "cell": cell,
                "bytes_kept": raster["bytes_kept"] + PIXEL_BYTES,
            },
        )
        if size is not None:
            grid = _make_square(grid)
        casting = request.prepare()
        model = ViewModel(
            scene, casting.soup, casting.caster, request.threads, request.casters,
            lambda part: frame.make_camera(part, bounds), ground, shown, canopy=request.canopy,
            lights=request.lights, proposed=request.find_proposed(), asked=requested,
            samples=self.samples,
        )  # fmt: skip
        tile = model.make_tile(grid)
        facts = {"ground_z": level, "view_azimuth_deg": azimuth, **self.describe_tilt(tilt)}
        if assumed is not None and not has_terrain(scene):
            facts |= assumed.describe(level)
        facts |= known.describe()
        return SeenRaster(
            self, model, tile.shape, (self.rows, "along"),
            grid.dx * grid.dy / _find_facing(tile), facts, x=grid.x, y=grid.y, ground=level,
            grid=grid, tile=tile,
        )  # fmt: skip

    def find_drawn(self, request: Request) -> tuple[list[int] | None, list[int] | None]:
        """Return the visible parts, and those of them that receive; None: all."""
        return request.find_shown(), None

    def describe_tilt(self, tilt: float) -> dict[str, object]:
        """Return the view's tilt downward as an attribute [degrees]."""
        return {}

    def describe_receivers(self, study: Any) -> str:
        """Describe the view."""
        facts = study.facts
        azimuth, tilt = facts["view_azimuth_deg"], facts.get("view_tilt_deg")
        words = f"what is seen from azimuth {azimuth:g}°, clockwise from true north"
        words += f", looking down {tilt:g}°" if tilt else ", level and orthographic"
        return words + (", through the proposed parts" if study.model.proposed else "")


class ElevationView(OrthographicKind):
    """Facades, seen level from an azimuth."""

    name = "elevation"
    rows = "z"
    is_upright = True

    def tell_view(self, facts: dict[str, Any], receivers: str) -> str:
        """Name the elevation."""
        side = receivers.partition("/")[0]
        name = f"the {side}" if side.isalpha() else f"azimuth {float(side):g}°"
        return f", elevation from {name}"

    def find_north(self, facts: dict[str, Any], true_north: float) -> tuple[float | None, float]:
        """Show no arrow: the ground is seen edge-on."""
        return None, 1.0


class ViewFromAbove(OrthographicKind):
    """View from an azimuth, looking down."""

    name = "view"
    rows = "up"

    def tell_view(self, facts: dict[str, Any], receivers: str) -> str:
        """Describe the view."""
        azimuth, tilt = facts["view_azimuth_deg"], facts["view_tilt_deg"]
        return f", seen from azimuth {azimuth:g}°, looking down {tilt:g}°"

    def find_north(self, facts: dict[str, Any], true_north: float) -> tuple[float | None, float]:
        """Find the direction of true north in the tilted view."""
        tilt = math.radians(float(facts["view_tilt_deg"]))
        return 180.0 - float(facts["view_azimuth_deg"]), math.sin(tilt)

    def describe_tilt(self, tilt: float) -> dict[str, object]:
        """Return the view's tilt downward as an attribute [degrees]."""
        return {"view_tilt_deg": tilt}


class SurfacesFromAbove(ViewFromAbove):
    """
    Picture of sampled surfaces: all parts, with hours only on those that ``on`` names.

    Parameters
    ----------
    samples : Samples
    """

    area_of = " of walls and roofs"
    counts_cells = False

    def __init__(self, samples: Samples) -> None:
        self.samples = samples

    def tell_cells(self, grid: Grid, facts: dict[str, Any]) -> str:
        """Describe where the hours were counted."""
        text = f"walls and roofs: samples {facts['spacing_m']:g} m apart"
        cell = facts.get("ground_cell_m")
        return text if cell is None else f"{text} · ground: cells of {cell:g} m"

    def find_drawn(self, request: Request) -> tuple[list[int] | None, list[int] | None]:
        """Return what is seen of all parts, and the parts asked for."""
        if not request.options.on:
            return request.find_shown(), None
        requested = request.find_shown() or []
        others = replace(request, options=replace(request.options, on=())).find_shown()
        return None if others is None else sorted({*others, *requested}), requested


def _find_facing(tile: ViewTile) -> NDArray[np.float64]:
    """Return the cosine between each normal and the view; 1 in empty pixels."""
    way = tile.camera.axes()[2]
    facing = -np.nan_to_num(tile.frame.normal[::-1]) @ way
    return np.where(tile.is_seen, np.maximum(facing, 1e-6), 1.0)


def _choose_cell(extent: Sequence[float]) -> float:
    """Choose 1, 2 or 5 times a power of ten for at most a million cells and 2048 a side."""
    wide, high = extent[2] - extent[0], extent[3] - extent[1]
    least = max(wide / 2048, high / 2048, math.sqrt(wide * high) / 1024, 1e-9)
    power = 10.0 ** math.floor(math.log10(least))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= least * 0.999)


def _make_square(grid: Grid) -> Grid:
    """Make the cells square, with the same centre and at least the same extent."""
    side = max(grid.dx, grid.dy)
    x = grid.x0 + grid.dx * (grid.cols - 1) / 2 - side * (grid.cols - 1) / 2
    y = grid.y0 + grid.dy * (grid.rows - 1) / 2 - side * (grid.rows - 1) / 2
    return Grid(x, y, side, side, grid.cols, grid.rows)
