"""The volumes of one light, made on demand, and what a planner keeps of them between frames."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.casting_scene import CastingScene
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
    casting : CastingScene
        The bodies.
    source : (4,) float64
        The light, relative to the scene's origin.
    near : mapping
        Number of a body -> instances and shells (n, 2) near the light; see ``find_near``.
    camera : Camera
        The view, on which open components depend.
    """

    casting: CastingScene
    source: NDArray[np.float64]
    near: Mapping[int, NDArray[np.intp]]
    camera: Camera
    _made: dict[int, BodyVolumes] = field(default_factory=dict)
    _old: dict[int, BodyVolumes] = field(default_factory=dict)
    _bounded: KnownBound | None = None
    _step: float = 0.0

    def __len__(self) -> int:
        return len(self.casting.bodies)

    def __getitem__(self, index: int) -> BodyVolumes:  # type: ignore[override]
        if index not in self._made:
            self._made[index] = self._make(self.casting.bodies[index], index)
        return self._made[index]

    def is_of(self, casting: CastingScene, source: NDArray[np.float64], camera: Camera) -> bool:
        """Return whether these are the volumes of a light (4,) in a view of a scene."""
        return (
            self.casting is casting
            and self.source.tobytes() == source.tobytes()
            and (self.camera is camera or not self.is_special)
        )

    def _make(self, body: Body, index: int) -> BodyVolumes:
        """Make a body's volumes, or reuse the old ones where nothing moved."""
        lights, origin = body.lights(self.source), self.casting.origin
        near = self.near.get(index, _NO_SHELLS)
        held, opened = near[:0], body.none_opened
        if len(near) or body.any_inward:
            held = find_held(body, origin, lights, near)
            opened = find_opened(body, self.camera, origin, lights, held, near)
        last = self._old.pop(index, None)
        if last is not None and last.is_of(body, lights, opened, held):
            return last
        made = BodyVolumes(body, lights, opened, held)
        if last is not None and last.body is body and len(lights) > 1:
            made.inherit(last)
        return made

    def follow(self, old: "KeptLight") -> None:
        """Reuse the previous frame's volumes and bounds where casters and light are the same."""
        self._old = old._made
        if old.casting is self.casting:
            self._bounded = old._bounded
            self._step = float(np.abs(self.source - old.source).sum())
            if not self._step:
                self._old = {**old._old, **old._made}
                if "nearby" in old.__dict__:  # which the view does not change
                    self.__dict__["nearby"] = old.nearby

    @cached_property
    def nearby(self) -> Nearby | None:
        """The points near the light, of all shells near it, drawn or not."""
        if not self.near:
            return None
        return find_nearby([(self[index], mine) for index, mine in self.near.items()], self.source)

    @cached_property
    def is_special(self) -> bool:
        """Whether components of any body may be open, which depends on the view."""
        return bool(self.near) or any(body.any_inward for body in self.casting.bodies)

    def bound(self, selection: VolumeSelection) -> int:
        """Bound the count of the drawn shells."""
        most, starts = self.casting.most, self.casting.starts
        # What is wound inward is open elsewhere, too, but not convex: it adds as many either way.
        for index in self.near:
            opened = self[index].opened
            if opened.any():
                most = most.copy()
                mine = slice(starts[index], starts[index + 1])
                most[mine] = find_most(self.casting.bodies[index], opened)
        self._bounded, bound = bound_nearby(
            self, self.casting.bounds, most, self.source, selection.sides, self._bounded,
            _STEPS * self._step,
        )  # fmt: skip
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
