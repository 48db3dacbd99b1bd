"""
Shadow volumes as index lists, from silhouettes and casting faces.

An even vertex number is a point, the next odd one that point projected to the far end of
the volume (``place.glsl``). A side is two triangles of four such numbers; the first alone
is the whole side where both far corners are one point at infinity, under a directional
light.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body
from umbra.gl.flags import DARK_CAP, DRAWS, FAN, LIGHT_CAPS, SIDES, VolumeSelection
from umbra.gl.lists import count_draws, list_cap, write_draws
from umbra.gl.sides import ShellSides, make_shell_sides, make_sides_alike
from umbra.volume.adjacency import Caster

__all__ = ["FAR", "BodyVolumes", "IndexList", "find_sides_together", "list_drawn", "make_volumes"]

_LARGE = 200_000  # edges; larger meshes are searched light by light, in several threads

_NO_FACES, _NO_SHELLS = np.zeros((0, 3), np.uint32), np.zeros(0, np.intp)

FAR = np.uint32(1)
"""Added to a point's vertex number: its far end."""


@dataclass(eq=False)
class BodyVolumes:
    """
    The shadow volumes of a body's shells under one light.

    Parameters
    ----------
    body : Body
    lights : (n_instances, 4) float64
        In each instance's own frame.
    opened : (n_instances, n_components) bool
        Closed components that follow the open rule.
    held : (n, 2) int
        Instance and face: faces on which the light lies cast nothing.

    A shell's number is instance * n_shells + shell.
    """

    body: Body
    lights: NDArray[np.float64]
    opened: NDArray[np.bool_]
    held: NDArray[np.intp] = field(default_factory=lambda: np.zeros((0, 2), np.intp))
    _sides: ShellSides = field(init=False)
    _found: NDArray[np.bool_] = field(init=False)
    _pose: int = field(init=False)

    def __post_init__(self) -> None:
        self._pose = self.body.poses
        self._found = np.zeros(self.body.n_shells * len(self.lights), np.bool_)
        self._sides = ShellSides.none(len(self._found))

    def find(self, wanted: NDArray[np.bool_]) -> ShellSides:
        """Find the sides of the wanted shells; return all that are known."""
        missing = self.lacks(wanted)
        if missing.any():
            self.add(make_shell_sides(self, missing), missing)
        return self._sides

    def lacks(self, wanted: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the shells, of the wanted ones, whose sides are not found yet."""
        return wanted & ~self._found

    def add(self, sides: ShellSides, is_new: NDArray[np.bool_]) -> None:
        """Add the sides of newly found shells."""
        self._sides = self._sides.join(sides, is_new)
        self._found = self._found | is_new

    def list_sides(
        self, wanted: NDArray[np.bool_] | None = None
    ) -> tuple[NDArray[np.uint32], NDArray[np.intp]]:
        """
        List the sides of the wanted shells, or of all.

        Returns two triangles per side, wound outward, (n, 6) vertex numbers, and the shell of each,
        ascending.
        """
        wanted = np.ones_like(self._found) if wanted is None else wanted
        return self.find(wanted).list_points(self.body, wanted)

    def inherit(self, old: "BodyVolumes") -> None:
        """Reuse the sides of instances that have not moved relative to their light."""
        same = (self.lights == old.lights).all(1) & (self.opened == old.opened).all(1)
        same[self.held[:, 0]] = same[old.held[:, 0]] = False
        is_reused = old._found & np.repeat(same, self.body.n_shells)
        if self._pose == old._pose and is_reused.any():
            self._sides, self._found = old._sides.keep(is_reused), is_reused

    @cached_property
    def is_closed(self) -> NDArray[np.bool_]:
        """Whether only lit faces cast, (n_instances, n_components) bool."""
        return self.body.caster.is_closed & ~self.opened

    def caster_of(self, instance: int) -> Caster:
        """Return the casting faces of one instance: all but those on which the light lies."""
        if not len(self.held):
            return self.body.caster
        return self.body.caster.without(self.held[self.held[:, 0] == instance, 1])

    def list_arrays(self, instance: int) -> tuple[NDArray, ...]:
        """List the arrays of an instance's caster, as for ``ask_shell``."""
        caster = self.caster_of(instance)
        return (
            caster.vertices, caster.faces, caster.planes, caster.component, caster.edges,
            caster.edge_faces, caster.turn,
        )  # fmt: skip

    def is_of(
        self,
        body: Body,
        lights: NDArray[np.float64],
        opened: NDArray[np.bool_],
        held: NDArray[np.intp],
    ) -> bool:
        """Return whether these are the volumes of a body as it is, made of the same."""
        return (
            self.body is body
            and self._pose == body.poses
            and np.array_equal(self.lights, lights)
            and np.array_equal(self.opened, opened)
            and np.array_equal(self.held, held)
        )

    def find_cap(self, wanted: NDArray[np.bool_]) -> tuple[NDArray[np.uint32], NDArray[np.intp]]:
        """Return the casting faces (n, 3) of wanted shells, turned to the light, and shells."""
        return list_cap(self.body, self.lights, self.is_closed, self.held, wanted)

    @property
    def shells(self) -> range:
        """Numbers of all instances' shells: instance * n_shells + shell."""
        return range(self.body.n_shells * len(self.lights))


def make_volumes(
    body: Body,
    light: NDArray[np.float64],
    opened: NDArray[np.bool_],
    held: NDArray[np.intp] | None = None,
) -> BodyVolumes:
    """
    Make the shadow volumes of a body's instances; sides are found on demand.

    The light is relative to the scene's origin; closed components that are ``opened``
    follow the open rule, and ``held`` faces cast nothing.
    """
    held = np.zeros((0, 2), np.intp) if held is None else held
    return BodyVolumes(body, body.lights(light), opened, held)


def list_drawn(
    volumes: Sequence[BodyVolumes], drawn: NDArray[np.bool_]
) -> Iterator[tuple[BodyVolumes, int, NDArray[np.bool_]]]:
    """Yield the volumes, number and drawn shells (n_shells,) of each instance that has any."""
    first = 0
    for body_volumes in volumes:
        for instance in range(len(body_volumes.lights)):
            is_drawn = drawn[first : first + body_volumes.body.n_shells]
            first += body_volumes.body.n_shells
            if is_drawn.any():
                yield body_volumes, instance, is_drawn


def find_sides_together(
    volumes: Sequence[Sequence[BodyVolumes]],
    selections: Sequence[VolumeSelection],
    starts: NDArray[np.intp],
) -> None:
    """
    Find the sides of the selected shells for several lights, each mesh at once.

    ``volumes`` are of the same bodies under each light, body k with the shells from ``starts[k]``
    to ``starts[k + 1]``. Large meshes, open components and lights on a face are handled light by
    light.
    """
    touched: dict[int, list[tuple[BodyVolumes, NDArray[np.bool_]]]] = {}
    for light, selection in zip(volumes, selections, strict=True):
        for index in selection.find_bodies(starts):
            body_volumes = light[index]
            missing = body_volumes.lacks(selection.sides[starts[index] : starts[index + 1]])
            if missing.any():
                touched.setdefault(index, []).append((body_volumes, missing))
    for group in touched.values():
        is_plain = [
            not len(body_volumes.held) and not body_volumes.opened.any()
            for body_volumes, _ in group
        ]
        if sum(is_plain) < 2 or len(group[0][0].body.caster.edges) >= _LARGE:
            is_plain = [False] * len(group)
        alike = list(compress(group, is_plain))
        if alike:
            for (body_volumes, shells), sides in zip(alike, make_sides_alike(alike), strict=True):
                body_volumes.add(sides, shells)
        for (body_volumes, shells), is_done in zip(group, is_plain, strict=True):
            if not is_done:
                body_volumes.find(shells)


@dataclass(eq=False)
class IndexList:
    """
    One list of vertex numbers for all lights of a frame, whose room is used again.

    Attributes
    ----------
    end : int
        How many numbers are in use.
    """

    end: int = 0
    _room: NDArray = field(default_factory=lambda: np.zeros(0, np.uint32))

    def begin(self, dtype: np.dtype) -> None:
        """Empty the list, for numbers of a type."""
        self.end = 0
        if self._room.dtype != dtype:
            self._room = np.zeros(0, dtype)

    @property
    def numbers(self) -> NDArray:
        """The numbers in use, valid until the next call of any method."""
        return self._room[: self.end]

    def append(self, numbers: NDArray) -> None:
        """Add numbers (n,)."""
        self._reserve(len(numbers))[self.end : self.end + len(numbers)] = numbers
        self.end += len(numbers)

    def append_light(
        self,
        volumes: Sequence[BodyVolumes],
        selection: VolumeSelection,
        starts: NDArray[np.intp],
        is_point: bool,
    ) -> NDArray[np.int64]:
        """
        Add the selected triangles of a light, in the order of `DRAWS`.

        Returns how many numbers belong to each draw (n_draws,). Sides of volumes that end in one
        point, of a directional light at infinity, are single triangles.
        """
        bodies = [
            _list_body(volumes[index], selection.flags[starts[index] : starts[index + 1]])
            for index in selection.find_bodies(starts)
        ]
        counts = np.zeros(len(DRAWS), np.int64)
        for body in bodies:
            count_draws(*body, is_point, counts)  # type: ignore[call-arg]
        ends = self.end + np.cumsum(counts)
        room = self._reserve(int(ends[-1]) - self.end)
        places = ends - counts
        for body in bodies:
            write_draws(*body, is_point, places, room)  # type: ignore[call-arg]
        self.end = int(ends[-1])
        return counts

    def _reserve(self, more: int) -> NDArray:
        """Return the list's whole room, with some behind its end."""
        if self.end + more > len(self._room):
            room = np.zeros(2 * (self.end + more), self._room.dtype)
            room[: self.end] = self._room[: self.end]
            self._room = room
        return self._room


def _list_body(body_volumes: BodyVolumes, flags: NDArray[np.uint8]) -> tuple[tuple | NDArray, ...]:
    """Return what ``count_draws`` and ``write_draws`` need of a body's selected volumes."""
    shell_sides = body_volumes.find((flags & SIDES) != 0)
    body, cap = body_volumes.body, (_NO_FACES, _NO_SHELLS)
    if np.bitwise_or.reduce(flags) & (LIGHT_CAPS | DARK_CAP):
        cap = body_volumes.find_cap(
            (flags & LIGHT_CAPS != 0) | ((flags & (DARK_CAP | FAN)) == DARK_CAP)
        )
    sides = shell_sides.sides, shell_sides.starts, shell_sides.ends
    return sides, (body.caster.edges, body.first, body.mirrored), cap, flags
