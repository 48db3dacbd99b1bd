"""
Plans of all lights of a frame, with one upload for all of them.

Volumes are kept between frames and rebuilt only where a body moved relative to a
light. While nothing moves, the last plan is reused.
"""

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body, make_bodies
from umbra.gl.context import Device
from umbra.gl.flags import CUT, DRAWS, Z_FAILS, VolumeSelection
from umbra.gl.geometry import Geometry, Group
from umbra.gl.kept_light import FineVolumes, KeptLight
from umbra.gl.level import find_level_points, is_level, split_level
from umbra.gl.levels import DetailLevel, LevelTable, make_levels
from umbra.gl.lone import LoneCasters
from umbra.gl.nearby import Nearby
from umbra.gl.open_components import find_near, find_start
from umbra.gl.plan import Draw, Statistics, VolumePlan
from umbra.gl.projection import (
    Projection,
    Rectangle,
    find_clip_ranges,
    find_pixel,
    find_source,
    make_projection,
    turn_scissor,
)
from umbra.gl.resources import Indices
from umbra.gl.selection import FoundLights, VolumeOptions, select_lights
from umbra.gl.volumes import IndexList, find_together
from umbra.machine import count_cores, use_threads
from umbra.methods import METHODS
from umbra.scene import Camera, Light, Part, Scene
from umbra.volume.box_tree import BoxTree

__all__ = ["Planner"]

_BELOW = 0.002  # distance from lowest receiver to floor, as a fraction of the scene's size
_BEHIND = 4.0  # of its largest error a level of detail's volume begins behind its caster
_FEW_FACES = 300_000  # below this, one thread is faster than starting more


@dataclass(eq=False)
class Planner:
    """
    Plans the shadow volumes of a scene.

    Parameters
    ----------
    device : Device
    scene : Scene
    geometry : Geometry
        Geometry of the scene; not released by the planner.
    casters : sequence of int, optional
        Indices of the parts that cast; all by default. All casters must be in the depth
        buffer when counts are made.
    ground : float, optional
        z of a receiving plane, relative to the scene's origin [m].
    before : sequence of Body
        Bodies of the same parts in another pose.

    Attributes
    ----------
    bodies : list of Body
    casting : list of Body
        The same and, once they were asked for, their levels of detail.
    bounds : (n_shells, 2, 3) float64
        Bounds of all these bodies' shells, relative to the scene's origin [m].
    tree : BoxTree
        Tree of these boxes.
    indices : Indices
        The triangles of the last plans.
    floor : float
        z, relative to the scene's origin, below every receiver: volumes may end there [m].
    """

    device: Device
    scene: Scene
    geometry: Geometry
    casters: Sequence[int] | None = None
    ground: float | None = None
    before: Sequence[Body] = ()
    _kept: list[KeptLight] = field(default_factory=list)
    _last: tuple[bytes, list[VolumePlan]] | None = None
    _moves: int = 0
    _list: IndexList = field(default_factory=IndexList)
    _levels: list[list[DetailLevel]] = field(default_factory=list)
    table: LevelTable | None = None
    _lone: LoneCasters | None = None
    tree: BoxTree = field(init=False)
    _has_moved: bool = False
    _idle_boxes: dict[int, tuple[Part, NDArray[np.float64]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        chosen = range(len(self.scene.parts)) if self.casters is None else self.casters
        self._idle = sorted(set(range(len(self.scene.parts))) - set(chosen))
        self.bodies = make_bodies(self.scene, self.geometry, self.casters, self.before)
        self.before, self.casting = (), self.bodies
        self.indices = Indices(self.device, 2 * self.geometry.n_points)
        self._measure()

    def _make_levels(self) -> None:
        """Make the levels of detail of all bodies; their shells follow those of the bodies."""
        self._levels = [make_levels(body) for body in self.bodies]
        self.table = LevelTable.of(self.bodies, self._levels)
        self._kept = []
        coarse = [level.body for levels in self._levels for level in levels]
        self.casting = [*self.bodies, *(body for body in coarse if body is not None)]
        self._measure(renumbers=True)

    def _measure(self, *, renumbers: bool = False) -> None:
        boxes = [body.world_bounds() for body in self.casting]
        self.bounds = np.concatenate([np.zeros((0, 2, 3)), *boxes])
        self._starts = np.append(0, np.cumsum([len(box) for box in boxes])).astype(np.intp)
        self._n_shells = int(self._starts[len(self.bodies)])
        most = [np.tile(body.most, len(body.groups)) for body in self.casting]
        self._most = np.concatenate([np.zeros(0, np.int64), *most])
        if self._has_moved and not renumbers:
            self.tree.fit(self.bounds)
        else:
            self.tree = BoxTree(self.bounds)
        whole = self._whole = self._find_whole()
        low = min(whole[0, 2], np.inf if self.ground is None else self.ground)
        self._slack = _BELOW * max(float(np.ptp(whole, axis=0).max()), 0.1)
        self.floor = low - self._slack
        self._moves += 1
        self._last = self._lone = None

    def _find_whole(self) -> NDArray[np.float64]:
        """Bound all parts, (2, 3), relative to the origin; moving parts by their bodies' boxes."""
        if not self._has_moved:
            return self.scene.bounds() - self.scene.origin
        found = np.concatenate([self.bounds, self._bound_idle()])
        return np.stack([found[:, 0].min(0), found[:, 1].max(0)])

    def _bound_idle(self) -> NDArray[np.float64]:
        """Bound the parts that do not cast, (n, 2, 3), relative to the origin."""
        boxes = np.zeros((len(self._idle), 2, 3))
        for row, index in enumerate(self._idle):
            part, box = self._idle_boxes.get(index, (None, None))
            if part is not self.scene.parts[index] or box is None:
                part = self.scene.parts[index]
                box = part.bounds
                self._idle_boxes[index] = part, box
            boxes[row] = box
        return boxes

    def move(self, scene: Scene, groups: Sequence[Group] = ()) -> None:
        """
        Update the transforms from a scene of the same parts; none may be added.

        Only volumes of bodies that moved relative to a light are rebuilt. ``groups`` are from
        ``pose_groups`` where meshes bend, and every body ``can_bend``.
        """
        self.scene = scene
        self.geometry.move(scene)
        self._has_moved = True
        if groups:
            self.geometry.bend(list(groups))
            posed = {group.parts: group for group in groups}
            for body in self.bodies:
                body.bend([posed[group.parts] for group in body.groups])
            self._levels, self.table, self.casting = [], None, self.bodies
        for body in self.bodies:
            body.place(self.geometry.placed[[group.parts[0] for group in body.groups]])
        for body, levels in zip(self.bodies, self._levels, strict=False):
            for level in levels:
                if level.body is not None:
                    level.body.place(body.transforms)
        if self._levels:
            self.table = LevelTable.of(self.bodies, self._levels)
        self._measure(renumbers=bool(groups))

    def can_bend(self, groups: Sequence[Group]) -> bool:
        """Return whether all bodies keep their adjacency with the vertices of groups."""
        posed = {group.parts: group.vertices for group in groups}
        return all(
            posed[body.groups[0].parts] is body.caster.vertices
            or body.can_bend(posed[body.groups[0].parts])
            for body in self.bodies
        )

    def project(self, camera: Camera) -> Projection:
        """Find the projection with the best depth for the scene and the receiving plane."""
        origin = self.scene.origin
        bounds = self.bounds
        if not len(bounds) or self.casters is not None:
            bounds = np.concatenate([bounds, self._whole[None]])
        return make_projection(
            camera, origin, bounds, self.ground, reverses_depth=self.device.reverses_depth
        )

    def plan(
        self,
        projection: Projection,
        lights: Sequence[Light],
        method: str = "auto",
        *,
        choices: VolumeOptions | None = None,
        warn: Callable[[str], object] = lambda _: None,
    ) -> list[VolumePlan]:
        """
        Plan all lights of a frame, and upload their triangles together.

        Plans are valid until the next call. ``warn`` is called with one line where the method
        is wrong for this view; `InputError` if there is no such method.
        """
        METHODS["gl"].check(method, masks=False)
        choices = choices or VolumeOptions()
        key = projection.matrix.tobytes() + projection.eye.tobytes()
        key += b"".join(light.position.tobytes() for light in lights)
        key += b"".join(light.axis.tobytes() for light in lights if light.axis is not None)
        shapes = [(light.range, light.half_angle, light.axis is None) for light in lights]
        key += f"{method} {choices} {shapes}".encode()
        if self._last is None or self._last[0] != key or method == "z-pass":
            if choices.detail > 0.0 and self.table is None:
                self._make_levels()
            faces = sum(len(body.caster.faces) * len(body.groups) for body in self.bodies)
            use_threads(count_cores() if faces > _FEW_FACES else 1)
            origin = self.scene.origin
            sources = np.array([find_source(light, origin) for light in lights]).reshape(-1, 4)
            ranges = find_clip_ranges(projection.camera, origin, sources, lights)
            if not choices.narrow:
                ranges = [(None, None)] * len(lights)
            near = find_near(self.casting, self._starts, self.tree, sources)
            for number, (source, mine) in enumerate(zip(sources, near, strict=True)):
                self._keep(number, projection.asked, source, mine)
            del self._kept[len(lights) :]
            selections = select_lights(
                self._kept, self.tree, projection, origin,
                FoundLights.of(lights, sources, ranges, choices), method=method, choices=choices,
                floor=self.floor, levels=self.table, ground=self.ground,
            )  # fmt: skip
            if choices.shorten and method == "auto":
                selections = self._shorten(selections)
            near_slack, slack = (
                _BEHIND * choices.detail * s for s in find_pixel(projection.camera)
            )
            for selection in selections:
                self._warn(selection, method, warn)
            find_together(self._kept, selections, self._starts)
            touched = [
                kept.touch(selection)
                for kept, selection in zip(self._kept, selections, strict=True)
            ]
            points = [near.points for near in touched if near is not None]
            # Points near a light are numbered beyond all others, which may take wider numbers.
            self._list.begin(self.indices.widen(sum(len(some) for some in points)))
            plans, first = [], self.geometry.n_points
            places = sources.copy()  # relative to the eye
            places[:, :3] -= sources[:, 3:] * projection.eye
            for each in zip(self._kept, selections, touched, ranges, places, strict=True):
                plans.append(self._plan(projection, *each, first, (near_slack, slack)))
                first += 0 if each[2] is None else len(each[2].points)
            self.indices.write(
                self._list.numbers, nearby=np.concatenate(points) if points else None
            )
            self._last = key, plans
        return self._last[1]

    def _shorten(self, selections: Sequence[VolumeSelection]) -> list[VolumeSelection]:
        """Let the volumes of lone casters begin low; depths must tell them from the ground."""
        if self.table is not None or not self.device.reverses_depth:
            return list(selections)
        if self._lone is None:
            below = self._bound_idle()[:, 1, 2].tolist()
            below += [] if self.ground is None else [self.ground]
            top = max(below, default=np.inf) + self._slack
            self._lone = LoneCasters.of(self.bodies, self.bounds, top)
        if not self._lone.can_be.any():
            return list(selections)
        pairs = zip(self._kept, selections, strict=True)
        return [self._lone.shorten(selection, kept) for kept, selection in pairs]

    @staticmethod
    def _warn(selection: VolumeSelection, method: str, warn: Callable[[str], object]) -> None:
        """Warn where z-pass is wrong for a view."""
        if method == "z-pass" and (selection.case > 1).any():
            warn(
                f"z-pass is wrong for this view: {int((selection.case > 1).sum())} casters stand "
                "between the near plane and the light, and the eye cannot see their volumes "
                "begin; use auto or z-fail"
            )

    def _plan(
        self,
        projection: Projection,
        kept: KeptLight,
        selection: VolumeSelection,
        touched: Nearby | None,
        clip_range: tuple[Rectangle | None, tuple[float, float] | None],
        lamp: NDArray[np.float64],
        first: int,
        slack: tuple[float, float],
    ) -> VolumePlan:
        """Plan one light, and list its triangles; its points near it are numbered from first on."""
        source, (corners, depths) = kept.source, clip_range
        draws: list[Draw] = []
        drawn: dict[str, int] = {}
        start, deepest = 0, 0
        if len(selection.shells):
            for name, is_cut, place, count in self._list_draws(kept, selection, touched, first):
                draws.append(Draw.of(name, is_cut, place, count))
                drawn[name] = drawn.get(name, 0) + count // 3
            if not projection.camera.is_perspective:
                uncut = (selection.flags & (Z_FAILS | CUT)) == Z_FAILS
                start, tilt = find_start(kept, projection.camera, source, uncut)
                projection = projection.tilted(tilt)
            start += selection.start
            deepest = kept.bound(selection, self.bounds, self._most)
        size = self.indices.dtype.itemsize
        statistics = Statistics.of(selection, self._n_shells, drawn, size, deepest)
        return VolumePlan(
            projection=projection,
            light=lamp,
            bottom=float(self.floor - projection.eye[2]),
            top=float(selection.top - projection.eye[2]),
            draws=tuple(draws),
            start=start,
            case=selection.case,
            statistics=statistics,
            scissor=None if corners is None else turn_scissor(corners, projection.camera),
            depth_bounds=depths,
            slack=slack,
            selection=selection,
            volumes=FineVolumes(kept, len(self.bodies)),
        )

    def _list_draws(
        self, kept: KeptLight, selection: VolumeSelection, touched: Nearby | None, first: int
    ) -> Iterator[tuple[str, bool, int, int]]:
        """List a light's triangles; yield name, cut, place and length of each of its draws."""
        place, level = self._list.end, self._find_level(kept.source)
        is_point = bool(kept.source[3])
        counts = self._list.append_light(kept, selection, self._starts, is_point).tolist()
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

    def _find_level(self, source: NDArray[np.float64]) -> NDArray[np.bool_] | None:
        """Find the points in the ground's plane, if a light (4,) lies in it too."""
        if not is_level(source, self.ground):
            return None
        return find_level_points(self.bodies, self.ground, self.geometry.n_points)

    def _keep(
        self,
        number: int,
        camera: Camera,
        source: NDArray[np.float64],
        near: dict[int, NDArray[np.intp]],
    ) -> None:
        """Keep a light's volumes, those of the last frame where nothing moved."""
        old = self._kept[number] if number < len(self._kept) else None
        if (
            old is not None
            and old.moves == self._moves
            and old.source.tobytes() == source.tobytes()
            and (old.camera is camera or not old.is_special)
        ):
            return
        origin, moves = self.scene.origin, self._moves
        kept = KeptLight(self.casting, self._starts, source, near, camera, origin, moves)
        if old is not None:
            kept.follow(old)
        self._kept[number : number + 1] = [kept]

    def twin(self) -> "Planner":
        """Return another planner of the same casters, with its own lists and kept volumes."""
        other = copy(self)
        other.indices = Indices(self.device, 2 * self.geometry.n_points)
        other._kept, other._last, other._list = [], None, IndexList()
        return other

    def release(self) -> None:
        """Free the list of triangles."""
        self.indices.release()
