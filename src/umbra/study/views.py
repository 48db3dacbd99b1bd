"""
Studies of what a camera sees: elevations from any azimuth, and any other view.

An elevation is seen from infinitely far, level. No point there is in shadow while the
sun is up: a shadow that runs to infinity runs downward. So z-pass counts are right, and
the same holds for every view that looks level or down from infinity; from an eye at
hand counting starts at the eye's own count.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.frame import FrameCounter
from umbra.errors import InputError
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import find_hidden
from umbra.rays.visible import VisibleSurface
from umbra.scene import Camera, Scene, directional_light
from umbra.scene.grid import Grid
from umbra.study.model import Casting
from umbra.study.receivers import Places
from umbra.volume.adjacency import Caster

__all__ = ["Elevation", "ViewModel", "ViewTile", "find_direction"]

COMPASS = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}
_FAR = 1e9  # where nothing is seen a point stands this high, out of every shadow [m]


def find_direction(receivers: str) -> tuple[float, float]:
    """
    Read from where a view is seen.

    Parameters
    ----------
    receivers : str
        North, east, south, west, or degrees clockwise from true north; after a slash
        how far the view looks down: ``215/35``.

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
            + (f" (the same as {azimuth % 360:g}?)" if abs(azimuth) < 1e4 else "")
        )
        raise InputError(msg, receivers=receivers)
    if not (np.isfinite(azimuth) and 0 <= tilt < 90):
        msg = (
            f"unknown receivers '{receivers}'; choose ground or top, an elevation from north, "
            "east, south, west or an azimuth in degrees, a view from above such as 215/35, "
            "camera, surfaces or points"
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
        Look at what faces an azimuth.

        Parameters
        ----------
        azimuth : float
            From where it is seen, clockwise from true north [degrees].
        true_north : float
            Azimuth of true north in the plan [degrees].
        tilt : float
            How far it looks down [degrees].
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
        """Whether up is z."""
        return self.forward[2] == 0

    def find_extent(self, scene: Scene, parts: list[int] | None = None) -> NDArray[np.float64]:
        """Give the bounds of parts along the view and upward in it, (2, 2) [m]."""
        soup = scene.triangles(parts)
        used = soup.find_corners() + scene.origin
        across = used @ np.array([self.right, self.up]).T
        return np.stack([across.min(0), across.max(0)])

    def make_camera(self, grid: Grid, bounds: NDArray[np.float64]) -> Camera:
        """
        Look at a raster of square cells, its axes along the view and upward in it.

        Parameters
        ----------
        grid : Grid
            Of distances along the view and upward, in the model's own coordinates [m].
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


@dataclass(frozen=True, eq=False)
class ViewModel(Casting):
    """
    Casters, and receivers that a camera sees.

    Parameters
    ----------
    scene, soup, caster, threads
        As in ``Casting``.
    casters : list of int
        Parts that cast.
    make_camera : callable
        Gives the camera of a grid of the view.
    ground : float, optional
        z of a ground that is seen, in the model's own coordinates [m].
    shown : list of int, optional
        Parts that are seen, as if no others stood before them; all by default.
    """

    casters: list[int]
    make_camera: Callable[[Grid], Camera]
    ground: float | None = None
    shown: list[int] | None = None

    def with_casters(self, parts: Sequence[int]) -> "ViewModel":
        """Give the same receivers with other parts casting, which need not be seen."""
        shown = range(len(self.scene.parts)) if self.shown is None else self.shown
        return replace(super().with_casters(parts), shown=list(shown))

    @cached_property
    def counter(self) -> FrameCounter:
        """What counts frames of the scene, or shows the chosen parts."""
        if self.shown is None:
            return FrameCounter(self.scene, self.casters, self.ground, self.threads)
        alone = replace(self.scene, parts=tuple(self.scene.parts[k] for k in self.shown))
        return FrameCounter(alone, None, self.ground, self.threads)

    def make_tile(self, grid: Grid) -> "ViewTile":
        """Look at the scene."""
        camera = self.make_camera(grid)
        return ViewTile(self, camera, *self.look(camera))

    def look(self, camera: Camera) -> tuple[DepthBuffer, VisibleSurface]:
        """See what is shown; parts are those of the scene."""
        view, frame = self.counter.see(camera)
        if self.shown is not None:
            part = np.where(frame.part < 0, frame.part, np.array(self.shown)[frame.part])
            frame = replace(frame, part=part.astype(np.int32))
        return view, frame


@dataclass(frozen=True, eq=False)
class ViewTile:
    """
    Pixels of a view as receivers; row 0 is the lowest.

    Parameters
    ----------
    model : ViewModel
    camera : Camera
    view : DepthBuffer
    frame : VisibleSurface
    """

    model: ViewModel
    camera: Camera
    view: DepthBuffer
    frame: VisibleSurface

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""
        return self.view.face.shape

    @property
    def is_seen(self) -> NDArray[np.bool_]:
        """Where anything is seen, (rows, cols) bool."""
        return self.frame.part[::-1] != NOTHING

    @property
    def tree(self) -> FaceTree:
        """What casts, for ways that start anywhere."""
        return self.model.tree

    @property
    def nothing(self) -> NDArray[np.bool_]:
        """Where nothing is seen, (rows, cols) bool."""
        return ~self.is_seen

    @property
    def axes(self) -> NDArray[np.float64]:
        """The directions of columns and rows, (2, 3) float64."""
        return self.camera.axes()[:2]

    @property
    def relief(self) -> NDArray[np.float64]:
        """1 where anything is seen, so that outlines are drawn, (rows, cols) float64."""
        return self.is_seen.astype(np.float64)

    @cached_property
    def places(self) -> Places:
        """The pixels' centres on the surface; far above everything where there is none."""
        origin = self.model.scene.origin
        position = (self.frame.position[::-1] - origin).reshape(-1, 3)
        normal = self.frame.normal[::-1].reshape(-1, 3).copy()
        nothing = ~self.is_seen.ravel()
        position[nothing] = (0.0, 0.0, _FAR)
        normal[nothing] = (0.0, 0.0, 1.0)
        return Places(position, normal)

    def make_counter(self) -> "ViewTile":
        """Give what counts these receivers: this."""
        return self

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Tell for each sun which pixels are in shadow, cast or attached."""
        if self.model.shown is not None:  # z-pass needs all that casts to be drawn
            tree, where = self.model.tree, self.places
            found = find_hidden(tree, where.points, where.normals, suns, self.model.threads)
            return found.reshape(-1, *self.shape)
        masks = np.zeros((len(suns), *self.shape), np.uint8)
        counter, normal = self.model.counter, np.nan_to_num(self.frame.normal)
        is_seen = self.view.face != NOTHING
        for mask, sun in zip(masks, suns, strict=True):
            counts = counter.count(self.view, self.camera, directional_light(sun))
            dark = ((counts != 0) | (normal @ sun <= 0)) & is_seen
            mask[...] = dark[::-1]
        return masks

    def add_steps(
        self,
        suns: NDArray[np.float64],
        steps: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Count for each pixel how many suns leave it in shadow."""
        for sun in suns:
            steps += self.masks(sun[None])[0]
            progress(1)

    def find_cast(self, caster: Caster, suns: NDArray[np.float64]) -> tuple[Any, NDArray[np.uint8]]:
        """Find the shadows of one caster alone: where they can be, and the masks there."""
        which, masks = self.model.find_cast(self.places, caster, suns)
        return np.unravel_index(which, self.shape), masks

    def with_casters(self, parts: Sequence[int] | None = None) -> "ViewTile":
        """Give the same receivers with other parts casting; all but canopies by default."""
        model = self.model.solid if parts is None else self.model.with_casters(parts)
        return replace(self, model=model)

    def find_canopies(self) -> NDArray[np.bool_]:
        """Tell which pixels have canopies before what they show, (rows, cols)."""
        model = self.model
        if model.canopy is None:
            return np.zeros(self.shape, np.bool_)
        seen = range(len(model.scene.parts)) if model.shown is None else model.shown
        whole = replace(model, shown=sorted({*seen, *model.canopy.parts}))
        crowned = replace(self, frame=whole.look(self.camera)[1])
        return np.isin(crowned.find_parts(), model.canopy.parts)

    def find_parts(self) -> NDArray[np.intp]:
        """Give each pixel's part; -1 for the ground and where there is none."""
        part = self.frame.part[::-1]
        return np.where(part < 0, -1, part)
