"""
Makes the plans of all lights of a frame, with one upload for all of them.

Nothing is known here but a `FrameRequest`, and the volumes of the last frame: they are kept, and
rebuilt only where a body moved relative to a light. While a request is equal to the last, so are
its plans.

`KeptLight` holds the volumes of one light, made on demand, and what is kept of them between frames.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body
from umbra.gl.casting_scene import CastingScene
from umbra.gl.flags import CUT, DRAWS, Z_FAILS, VolumeSelection
from umbra.gl.lists import find_level_points, is_level, split_level
from umbra.gl.nearby import Nearby, find_nearby
from umbra.gl.open_components import find_faces_at_light, find_near_shells, find_opened, find_start
from umbra.gl.overlap import KnownBound, bound_nearby, find_most
from umbra.gl.projection import (
    Rectangle,
    find_clip_ranges,
    find_light_source,
    find_pixel,
    turn_scissor,
)
from umbra.gl.request import FrameRequest
from umbra.gl.resources import Indices
from umbra.gl.selection import FoundLights, select_lights
from umbra.gl.volume_plan import Draw, Statistics, VolumePlan
from umbra.gl.volumes import BodyVolumes, IndexList, find_sides_together
from umbra.machine import count_cores, use_threads
from umbra.scene import Camera

__all__ = ["FineVolumes", "KeptLight", "LightPlans"]

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
            held = find_faces_at_light(body, origin, lights, near)
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
        return find_nearby(
            [(self[index], shells) for index, shells in self.near.items()], self.source
        )

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
                span = slice(starts[index], starts[index + 1])
                most[span] = find_most(self.casting.bodies[index], opened)
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


_BEHIND = 4.0  # of its largest error a level of detail's volume begins behind its caster
_FEW_FACES = 300_000  # below this, one thread is faster than starting more


class LightPlans:
    """
    Plans of the last frame, and the volumes that the next one may reuse.

    Parameters
    ----------
    indices : Indices
        Where the triangles of the last plans are written.
    """

    def __init__(self, indices: Indices) -> None:
        self.indices = indices
        self._kept: list[KeptLight] = []
        self._last: tuple[tuple, list[VolumePlan]] | None = None
        self._list = IndexList()

    def make(self, request: FrameRequest) -> list[VolumePlan]:
        """Plan all lights of a frame; the last plans, if they are of an equal request."""
        if self._last is None or self._last[0] != request.key:
            self._last = None  # whatever is raised, the list is no longer theirs
            self._last = request.key, self._make(request)
        return self._last[1]

    def _make(self, request: FrameRequest) -> list[VolumePlan]:
        casting, projection, choices = request.casting, request.projection, request.choices
        use_threads(count_cores() if casting.n_faces > _FEW_FACES else 1)
        lights, origin = request.lights, casting.origin
        sources = np.array([find_light_source(light, origin) for light in lights]).reshape(-1, 4)
        ranges = find_clip_ranges(projection.camera, origin, sources, lights)
        if not choices.narrow:
            ranges = [(None, None)] * len(lights)
        self._keep(request, sources)
        selections = select_lights(
            self._kept, casting.tree, projection, origin,
            FoundLights.of(lights, sources, ranges, choices), method=request.method,
            choices=choices, floor=casting.floor, levels=casting.table, ground=casting.ground,
        )  # fmt: skip
        if choices.shorten and request.method == "auto":
            selections = self._shorten(request, selections)
        pixel, grows = find_pixel(projection.camera)
        slack = _BEHIND * choices.detail * pixel, _BEHIND * choices.detail * grows
        find_sides_together(self._kept, selections, casting.starts)
        touched = [light.nearby for light in self._kept]
        points = [near.points for near in touched if near is not None]
        # Points near a light are numbered beyond all others, which may take wider numbers.
        self._list.begin(self.indices.widen(sum(len(group) for group in points)))
        plans, first = [], casting.n_points
        places = sources.copy()  # relative to the eye
        places[:, :3] -= sources[:, 3:] * projection.eye
        for arguments in zip(self._kept, selections, touched, ranges, places, strict=True):
            plans.append(self._plan(request, *arguments, first, slack))
            first += 0 if arguments[2] is None else len(arguments[2].points)
        self.indices.write(self._list.numbers, nearby=np.concatenate(points) if points else None)
        return plans

    def _keep(self, request: FrameRequest, sources: NDArray[np.float64]) -> None:
        """Keep each light's volumes, those of the last frame where nothing moved."""
        casting, camera = request.casting, request.projection.asked
        near = find_near_shells(casting.bodies, casting.starts, casting.tree, sources)
        lights = []
        for number, (source, shells) in enumerate(zip(sources, near, strict=True)):
            old = self._kept[number] if number < len(self._kept) else None
            if old is not None and old.is_of(casting, source, camera):
                lights.append(old)
                continue
            light = KeptLight(casting, source, shells, camera)
            if old is not None:
                light.follow(old)
            lights.append(light)
        self._kept = lights

    def _shorten(
        self, request: FrameRequest, selections: Sequence[VolumeSelection]
    ) -> list[VolumeSelection]:
        """Let the volumes of isolated casters begin low; depths must tell them from the ground."""
        casting = request.casting
        is_possible = casting.table is None and casting.reverses_depth
        if not is_possible or not casting.isolated.can_be.any():
            return list(selections)
        pairs = zip(self._kept, selections, strict=True)
        return [
            selection if light.is_special else casting.isolated.shorten(selection, light.source)
            for light, selection in pairs
        ]

    def _plan(
        self,
        request: FrameRequest,
        light: KeptLight,
        selection: VolumeSelection,
        touched: Nearby | None,
        clip_range: tuple[Rectangle | None, tuple[float, float] | None],
        lamp: NDArray[np.float64],
        first: int,
        slack: tuple[float, float],
    ) -> VolumePlan:
        """Plan one light, and list its triangles; its points near it are numbered from first on."""
        casting, projection = request.casting, request.projection
        source, (corners, depths) = light.source, clip_range
        draws: list[Draw] = []
        drawn: dict[str, int] = {}
        start, deepest = 0, 0
        if len(selection.shells):
            for name, is_cut, begin, count in self._list_draws(
                request, light, selection, touched, first
            ):
                draws.append(Draw.of(name, is_cut, begin, count))
                drawn[name] = drawn.get(name, 0) + count // 3
            if not projection.camera.is_perspective:
                uncut = (selection.flags & (Z_FAILS | CUT)) == Z_FAILS
                start, tilt = find_start(light, projection.camera, source, uncut)
                projection = projection.tilted(tilt)
            start += selection.start
            deepest = light.bound(selection)
        size = self.indices.dtype.itemsize
        statistics = Statistics.of(selection, casting.n_shells, drawn, size, deepest)
        return VolumePlan(
            projection=projection,
            light=lamp,
            bottom=float(casting.floor - projection.eye[2]),
            end=float(casting.find_end(source, projection) - projection.eye[2]),
            top=float(selection.top - projection.eye[2]),
            draws=tuple(draws),
            start=start,
            case=selection.case,
            statistics=statistics,
            scissor=None if corners is None else turn_scissor(corners, projection.camera),
            depth_bounds=depths,
            slack=slack,
            selection=selection,
            volumes=FineVolumes(light, casting.n_fine),
        )

    def _list_draws(
        self,
        request: FrameRequest,
        light: KeptLight,
        selection: VolumeSelection,
        touched: Nearby | None,
        first: int,
    ) -> Iterator[tuple[str, bool, int, int]]:
        """List a light's triangles; yield name, cut, place and length of each of its draws."""
        casting = request.casting
        begin, is_point = self._list.end, bool(light.source[3])
        level = None  # the points in the ground's plane, if the light lies in it too
        if is_level(light.source, casting.ground):
            level = find_level_points(casting.fine, casting.ground, casting.n_points)
        counts = self._list.append_light(light, selection, casting.starts, is_point).tolist()
        if touched is None and level is None:
            for (name, is_cut), count in zip(DRAWS, counts, strict=True):
                if count:
                    yield name, is_cut, begin, count
                begin += count
            return
        lists = np.split(self._list.numbers[begin:].copy(), np.cumsum(counts[:-1]))
        self._list.end = begin
        if level is not None:
            lists = split_level(lists, level)
        for (name, is_cut), numbers in zip(DRAWS, lists, strict=True):
            refined = numbers if touched is None else touched.refine(numbers, first)
            if len(refined):
                yield name, is_cut, self._list.end, len(refined)
                self._list.append(refined)
