"""Casters and bounds of one pose of a scene: what plans read of it, as one record."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.isolated import IsolatedCasters
from umbra.gl.levels import LevelTable
from umbra.volume.box_tree import BoxTree

__all__ = ["CastingScene"]

_BELOW = 0.002  # distance from lowest receiver to floor, as a fraction of the scene's size


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
    def floor(self) -> float:
        """A z, relative to the origin, below every receiver: volumes may end there [m]."""
        low = float(self.whole[0, 2])
        return (low if self.ground is None else min(low, self.ground)) - self._slack

    @cached_property
    def isolated(self) -> IsolatedCasters:
        """What tells which of the casters are convex and isolated under a light."""
        below = self.idle[:, 1, 2].tolist()
        below += [] if self.ground is None else [self.ground]
        top = max(below, default=np.inf) + self._slack
        return IsolatedCasters.of(self.fine, self.bounds[: self.n_shells], top)
