"""The volumes of one light, made on demand, and what a planner keeps of them between frames."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.nearby import Nearby, find_nearby
from umbra.gl.open_components import find_held, find_opened
from umbra.gl.overlap import KnownBound, bound_nearby, find_most
from umbra.gl.selection import VolumeSelection
from umbra.gl.volumes import BodyVolumes
from umbra.scene import Camera

__all__ = ["FineVolumes", "KeptLight"]

_STEPS = 8  # of a lamp's motion that a bound covers
_NO_SHELLS = np.zeros((0, 2), np.intp)


@dataclass(eq=False)
class KeptLight(Sequence[BodyVolumes]):
    """
    Volumes of every body under one light, each made when it is first looked up.

    Parameters
    ----------
    bodies : sequence of Body
    starts : (n_bodies + 1,) int
        Body k owns the shells from ``starts[k]`` to ``starts[k + 1]``.
    source : (4,) float64
        The light, relative to the scene's origin.
    near : mapping
        Number of a body -> instances and shells (n, 2) near the light; see ``find_near``.
    camera : Camera
        The view, on which open components depend.
    origin : (3,) float64
        Origin of the scene.
    moves : int
        Number of poses of the scene so far.
    """

    bodies: Sequence[Body]
    starts: NDArray[np.intp]
    source: NDArray[np.float64]
    near: Mapping[int, NDArray[np.intp]]
    camera: Camera
    origin: NDArray[np.float64]
    moves: int
    _made: dict[int, BodyVolumes] = field(default_factory=dict)
    _old: dict[int, BodyVolumes] = field(default_factory=dict)
    _nearby: Nearby | None = None
    _touched: NDArray[np.bool_] | None = None
    _bounded: KnownBound | None = None
    _step: float = 0.0

    def __len__(self) -> int:
        return len(self.bodies)

    def __getitem__(self, index: int) -> BodyVolumes:  # type: ignore[override]
        if index not in self._made:
            self._made[index] = self._make(self.bodies[index], index)
        return self._made[index]

    def _make(self, body: Body, index: int) -> BodyVolumes:
        """Make a body's volumes, or reuse the old ones where nothing moved."""
        lights = body.lights(self.source)
        near = self.near.get(index, _NO_SHELLS)
        held, opened = near[:0], body.none_opened
        if len(near) or body.any_inward:
            held = find_held(body, self.origin, lights, near)
            opened = find_opened(body, self.camera, self.origin, lights, held, near)
        last = self._old.pop(index, None)
        if last is not None and last.is_of(lights, opened):
            return last
        made = BodyVolumes(body, lights, opened, held)
        if last is not None and len(lights) > 1:
            made.inherit(last)
        return made

    def follow(self, old: "KeptLight") -> None:
        """Take over from the last frame what still holds; its volumes are reused on demand."""
        self._old = old._made
        if old.moves == self.moves:
            self._bounded = old._bounded
            self._step = float(np.abs(self.source - old.source).sum())
            if not self._step:
                self._nearby, self._touched = old._nearby, old._touched
                self._old = {**old._old, **old._made}

    def touch(self, selection: VolumeSelection) -> Nearby | None:
        """Find the points near the light of the shells drawn now or before."""
        if not self.near:
            return None
        drawn = selection.sides
        if self._touched is None or (drawn & ~self._touched).any():
            self._touched = drawn if self._touched is None else drawn | self._touched
            wanted = []
            for index, near in self.near.items():
                body = self.bodies[index]
                mine = near[self._touched[self.starts[index] + near @ (body.n_shells, 1)]]
                if len(mine):
                    wanted.append((self[index], mine))
            self._nearby = find_nearby(wanted, self.source)
        return self._nearby

    @cached_property
    def is_special(self) -> bool:
        """Whether components of any body may be open, which depends on the view."""
        return bool(self.near) or any(body.any_inward for body in self.bodies)

    def bound(self, selection: VolumeSelection, bounds: NDArray, most: NDArray[np.int64]) -> int:
        """
        Bound the count of the drawn shells.

        ``bounds`` (n_shells, 2, 3) are the boxes of all shells, ``most`` (n_shells,) the largest
        count that each adds while no component is open.
        """
        # What is wound inward is open elsewhere, too, but not convex: it adds as many either way.
        for index in self.near:
            opened = self[index].opened
            if opened.any():
                most = most.copy()
                mine = slice(self.starts[index], self.starts[index + 1])
                most[mine] = find_most(self.bodies[index], opened)
        self._bounded, bound = bound_nearby(
            self, bounds, most, self.source, selection.sides, self._bounded, _STEPS * self._step
        )
        return bound


@dataclass(frozen=True, eq=False)
class FineVolumes(Sequence[BodyVolumes]):
    """The volumes of the first n bodies of a light: those that are no level of detail."""

    kept: KeptLight
    n: int

    def __len__(self) -> int:
        return self.n

    def __getitem__(self, index: int) -> BodyVolumes:  # type: ignore[override]
        return self.kept[range(self.n)[index]]
