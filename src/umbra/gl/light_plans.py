"""
Makes the plans of all lights of a frame, with one upload for all of them.

Nothing is known here but a `FrameRequest`, and the volumes of the last frame: they are kept, and
rebuilt only where a body moved relative to a light. While a request is equal to the last, so are
its plans.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.gl.flags import CUT, DRAWS, Z_FAILS, VolumeSelection
from umbra.gl.kept_light import FineVolumes, KeptLight
from umbra.gl.level import find_level_points, is_level, split_level
from umbra.gl.nearby import Nearby
from umbra.gl.open_components import find_near_shells, find_start
from umbra.gl.plan import Draw, Statistics, VolumePlan
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
from umbra.gl.volumes import IndexList, find_sides_together
from umbra.machine import count_cores, use_threads

__all__ = ["LightPlans"]

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
        touched = [kept.nearby for kept in self._kept]
        points = [near.points for near in touched if near is not None]
        # Points near a light are numbered beyond all others, which may take wider numbers.
        self._list.begin(self.indices.widen(sum(len(some) for some in points)))
        plans, first = [], casting.n_points
        places = sources.copy()  # relative to the eye
        places[:, :3] -= sources[:, 3:] * projection.eye
        for each in zip(self._kept, selections, touched, ranges, places, strict=True):
            plans.append(self._plan(request, *each, first, slack))
            first += 0 if each[2] is None else len(each[2].points)
        self.indices.write(self._list.numbers, nearby=np.concatenate(points) if points else None)
        return plans

    def _keep(self, request: FrameRequest, sources: NDArray[np.float64]) -> None:
        """Keep each light's volumes, those of the last frame where nothing moved."""
        casting, camera = request.casting, request.projection.asked
        near = find_near_shells(casting.bodies, casting.starts, casting.tree, sources)
        found = []
        for number, (source, mine) in enumerate(zip(sources, near, strict=True)):
            old = self._kept[number] if number < len(self._kept) else None
            if old is not None and old.is_of(casting, source, camera):
                found.append(old)
                continue
            kept = KeptLight(casting, source, mine, camera)
            if old is not None:
                kept.follow(old)
            found.append(kept)
        self._kept = found

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
            selection if kept.is_special else casting.isolated.shorten(selection, kept.source)
            for kept, selection in pairs
        ]

    def _plan(
        self,
        request: FrameRequest,
        kept: KeptLight,
        selection: VolumeSelection,
        touched: Nearby | None,
        clip_range: tuple[Rectangle | None, tuple[float, float] | None],
        lamp: NDArray[np.float64],
        first: int,
        slack: tuple[float, float],
    ) -> VolumePlan:
        """Plan one light, and list its triangles; its points near it are numbered from first on."""
        casting, projection = request.casting, request.projection
        source, (corners, depths) = kept.source, clip_range
        draws: list[Draw] = []
        drawn: dict[str, int] = {}
        start, deepest = 0, 0
        if len(selection.shells):
            for name, is_cut, place, count in self._list_draws(
                request, kept, selection, touched, first
            ):
                draws.append(Draw.of(name, is_cut, place, count))
                drawn[name] = drawn.get(name, 0) + count // 3
            if not projection.camera.is_perspective:
                uncut = (selection.flags & (Z_FAILS | CUT)) == Z_FAILS
                start, tilt = find_start(kept, projection.camera, source, uncut)
                projection = projection.tilted(tilt)
            start += selection.start
            deepest = kept.bound(selection)
        size = self.indices.dtype.itemsize
        statistics = Statistics.of(selection, casting.n_shells, drawn, size, deepest)
        return VolumePlan(
            projection=projection,
            light=lamp,
            bottom=float(casting.floor - projection.eye[2]),
            top=float(selection.top - projection.eye[2]),
            draws=tuple(draws),
            start=start,
            case=selection.case,
            statistics=statistics,
            scissor=None if corners is None else turn_scissor(corners, projection.camera),
            depth_bounds=depths,
            slack=slack,
            selection=selection,
            volumes=FineVolumes(kept, casting.n_fine),
        )

    def _list_draws(
        self,
        request: FrameRequest,
        kept: KeptLight,
        selection: VolumeSelection,
        touched: Nearby | None,
        first: int,
    ) -> Iterator[tuple[str, bool, int, int]]:
        """List a light's triangles; yield name, cut, place and length of each of its draws."""
        casting = request.casting
        place, is_point = self._list.end, bool(kept.source[3])
        level = None  # the points in the ground's plane, if the light lies in it too
        if is_level(kept.source, casting.ground):
            level = find_level_points(casting.fine, casting.ground, casting.n_points)
        counts = self._list.append_light(kept, selection, casting.starts, is_point).tolist()
        if touched is None and level is None:
            for (name, is_cut), count in zip(DRAWS, counts, strict=True):
                if count:
                    yield name, is_cut, place, count
                place += count
            return
        lists = np.split(self._list.numbers[place:].copy(), np.cumsum(counts[:-1]))
        self._list.end = place
        if level is not None:
            lists = split_level(lists, level)
        for (name, is_cut), numbers in zip(DRAWS, lists, strict=True):
            found = numbers if touched is None else touched.refine(numbers, first)
            if len(found):
                yield name, is_cut, self._list.end, len(found)
                self._list.append(found)
