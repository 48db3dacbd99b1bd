"""
Casters and bounds of one pose of a scene: what plans read of it, as one record.

Isolated convex casters: their shadow meets no other caster but falls on what lies below them all.

Such a volume is empty down to there, and all it counts above are its caster's own faces turned
from the light, which get none anyway. So it may begin just above, closed by a fan: that of a ball
over the ground then fills a fraction of the pixels. A caster that another's shadow meets is not
isolated either: where its smooth normals lean to the light, a count of 1 says that no other shades
it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body
from umbra.gl.flags import CUT, LOW, SIDES, VolumeSelection
from umbra.gl.levels import LevelTable
from umbra.gl.projection import CameraProjection
from umbra.kernels import dot, kernel
from umbra.volume.box_tree import BoxTree

__all__ = ["CastingScene", "IsolatedCasters"]

_MOST = 512
"""More shells than take a millisecond to compare with each other are not compared."""


@dataclass(frozen=True, eq=False)
class IsolatedCasters:
    """
    What tells which shells are isolated under a light, while they stand still.

    Parameters
    ----------
    balls : (n_shells, 4) float64
        Middle, relative to the scene's origin, and radius of a ball around each shell [m].
    can_be : (n_shells,) bool
        Convex shells that end above ``top``.
    top : float
        z above every receiver that does not cast, relative to the origin [m].
    """

    balls: NDArray[np.float64]
    can_be: NDArray[np.bool_]
    top: float

    @classmethod
    def of(
        cls, bodies: Sequence[Body], bounds: NDArray[np.float64], top: float
    ) -> "IsolatedCasters":
        """Measure the shells of bodies, whose boxes ``bounds`` (n_shells, 2, 3) are."""
        convex: list[NDArray[np.bool_]] = [np.zeros(0, np.bool_)]
        reach: list[NDArray[np.float64]] = [np.zeros(0)]
        if len(bounds) > _MOST:
            return cls(np.zeros((0, 4)), np.zeros(len(bounds), np.bool_), top)
        for body in bodies:
            count = np.bincount(body.component_shell, minlength=body.n_shells)
            dented = np.bincount(body.component_shell, ~body.is_convex, body.n_shells)
            is_convex = (count == 1) & (dented == 0)
            convex.append(np.tile(is_convex, len(body.transforms)))
            reach.append(np.full(len(convex[-1]), np.inf))
            if is_convex.any():
                axes = body.transforms[:, :3, :3]
                stretch = np.sqrt(np.abs(axes.transpose(0, 2, 1) @ axes).sum(2).max(1))  # or less
                reach[-1] = np.outer(stretch, body.radii).ravel()
        middle, half = bounds.mean(1), (bounds[:, 1] - bounds[:, 0]) / 2
        radius = np.minimum(np.linalg.norm(half, axis=1), np.concatenate(reach))
        can_be = np.concatenate(convex) & (bounds[:, 0, 2] > top)
        return cls(np.column_stack([middle, radius]), can_be, top)

    def shorten(self, selection: VolumeSelection, light: NDArray[np.float64]) -> VolumeSelection:
        """Return a light's selection in which the volumes of isolated casters are ``LOW``."""
        is_cut = (selection.flags & (SIDES | CUT)) == (SIDES | CUT)
        wanted = is_cut & (selection.case == 1) & self.can_be
        if not wanted.any():
            return selection
        isolated = _find_isolated(self.balls, light, wanted)
        flags = selection.flags | np.where(isolated, LOW, np.uint8(0))
        return replace(selection, flags=flags, top=self.top)


@kernel
def _find_isolated(balls, light, wanted):
    """Find the wanted balls whose shadow under a light meets no ball, and which none shades."""
    n, is_point = balls.shape[0], light[3] != 0.0
    holds = np.zeros(n, np.bool_)
    ways, sines, cosines = np.zeros((n, 3)), np.zeros(n), np.zeros(n)
    for i in range(n):
        way = ways[i]
        for axis in range(3):
            way[axis] = balls[i, axis] - light[axis] if is_point else balls[i, axis]
        if is_point:
            distance = max(np.sqrt(dot(way, way)), 1e-300)
            holds[i] = distance <= balls[i, 3]
            way[0], way[1], way[2] = way[0] / distance, way[1] / distance, way[2] / distance
            sines[i] = min(balls[i, 3] / distance, 1.0)
            cosines[i] = np.sqrt(1.0 - sines[i] ** 2)
        else:
            along = dot(way, light)
            for axis in range(3):
                way[axis] -= along * light[axis]
    isolated = wanted.copy()
    for i in range(n):
        if not wanted[i]:
            continue
        for j in range(n):
            if j == i:
                continue
            if is_point:
                cosine = ways[i, 0] * ways[j, 0] + ways[i, 1] * ways[j, 1] + ways[i, 2] * ways[j, 2]
                # A caster whose ball holds the lamp may stand in any direction.
                meets = holds[i] or holds[j]
                meets |= cosine >= cosines[i] * cosines[j] - sines[i] * sines[j]
            else:
                x, y, z = ways[i, 0] - ways[j, 0], ways[i, 1] - ways[j, 1], ways[i, 2] - ways[j, 2]
                meets = x * x + y * y + z * z <= (balls[i, 3] + balls[j, 3]) ** 2
            if meets:
                isolated[i] = False
                break
    return isolated


_BELOW = 0.002  # distance from lowest receiver to floor, as a fraction of the scene's size
_ROUNDED = 1e-5  # the same where only float32 is in the way, as a fraction of how far volumes reach


@dataclass(frozen=True, eq=False)
class CastingScene:
    """
    One pose of a scene, made anew when anything moves.

    Parameters
    ----------
    bodies : tuple of Body
        The casters, and behind them their levels of detail, if these are asked for.
    n_fine : int
        Number of casters among the bodies.
    bounds : (n_shells, 2, 3) float64
        Bounds of all bodies' shells, relative to the scene's origin [m].
    tree : BoxTree
        Tree of these boxes.
    idle : (n, 2, 3) float64
        Bounds of the parts that do not cast, relative to the origin [m].
    origin : (3,) float64
        Origin of the scene.
    ground : float, optional
        z of a receiving plane, relative to the origin [m].
    n_points : int
        Number of points of the geometry.
    reverses_depth : bool
        As in ``Device``.
    table : LevelTable, optional
        Of the levels of detail.
    """

    bodies: tuple[Body, ...]
    n_fine: int
    bounds: NDArray[np.float64]
    tree: BoxTree
    idle: NDArray[np.float64]
    origin: NDArray[np.float64]
    ground: float | None
    n_points: int
    reverses_depth: bool
    table: LevelTable | None = None

    @property
    def fine(self) -> Sequence[Body]:
        """The casters, without levels of detail."""
        return self.bodies[: self.n_fine]

    @cached_property
    def starts(self) -> NDArray[np.intp]:
        """Body k owns the shells from ``starts[k]`` to ``starts[k + 1]``."""
        counts = [body.n_shells * len(body.groups) for body in self.bodies]
        return np.append(0, np.cumsum(counts)).astype(np.intp)

    @property
    def n_shells(self) -> int:
        """Number of the casters' shells, which come first."""
        return int(self.starts[self.n_fine])

    @cached_property
    def n_faces(self) -> int:
        """Number of the casters' faces, of all instances."""
        return sum(len(body.caster.faces) * len(body.groups) for body in self.fine)

    @cached_property
    def most(self) -> NDArray[np.int64]:
        """Largest count that each shell adds, (n_shells,), while no component is open."""
        most = [np.tile(body.most, len(body.groups)) for body in self.bodies]
        return np.concatenate([np.zeros(0, np.int64), *most])

    @cached_property
    def whole(self) -> NDArray[np.float64]:
        """Bounds of all parts, (2, 3), relative to the origin [m]; 0 if there is none."""
        # Of boxes, not of vertices: a scene that has moved is as large as one made there.
        boxes = np.concatenate([self.bounds[: self.n_shells], self.idle])
        if not len(boxes):
            return np.zeros((2, 3))
        return np.stack([boxes[:, 0].min(0), boxes[:, 1].max(0)])

    @cached_property
    def _slack(self) -> float:
        return _BELOW * max(float(np.ptp(self.whole, axis=0).max()), 0.1)

    @cached_property
    def _lowest(self) -> float:
        low = float(self.whole[0, 2])
        return low if self.ground is None else min(low, self.ground)

    @cached_property
    def floor(self) -> float:
        """A z, relative to the origin, below every receiver: volumes may end there [m]."""
        return self._lowest - self._slack

    def find_end(self, light: NDArray[np.float64], projection: CameraProjection) -> float:
        """
        Find how low volumes reach that are counted before the visible surface.

        Their sides have no cap below. So they may end as near to the lowest receiver as float32
        can tell a place at the far end of a shadow from another: what a side lacks there could only
        be crossed nearer than that to a shadow's edge.

        Parameters
        ----------
        light : (4,) float64
            Relative to the origin.
        projection : CameraProjection

        Returns
        -------
        end : float
            z relative to the origin, not below ``floor`` [m].
        """
        low, high = self.whole
        size, top = float(np.linalg.norm(high - low)), float(high[2])
        # How steep the flattest rays are that pass over the scene.
        steep = light[2] / np.linalg.norm(light[:3])
        if light[3]:
            steep = (light[2] - top) / (light[2] - self.floor) if light[2] > top else 0.0
        if steep <= 0.0:
            return self.floor
        away = float(np.linalg.norm(projection.eye - (low + high) / 2))
        end = self._lowest - min(_ROUNDED * (away + size + size / float(steep)), self._slack)
        return end if projection.lowest > end else self.floor

    @cached_property
    def isolated(self) -> IsolatedCasters:
        """What tells which of the casters are convex and isolated under a light."""
        below = self.idle[:, 1, 2].tolist()
        below += [] if self.ground is None else [self.ground]
        top = max(below, default=np.inf) + self._slack
        return IsolatedCasters.of(self.fine, self.bounds[: self.n_shells], top)
