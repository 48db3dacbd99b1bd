"""Plans of all lights of a frame, for a scene that moves and bends."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body, make_bodies
from umbra.gl.casting_scene import CastingScene
from umbra.gl.context import Device
from umbra.gl.geometry import Geometry, Group
from umbra.gl.levels import DetailLevel, LevelTable, make_levels
from umbra.gl.light_plans import LightPlans
from umbra.gl.projection import CameraProjection, make_projection
from umbra.gl.request import FrameRequest, LightShape
from umbra.gl.resources import Indices
from umbra.gl.selection import VolumeOptions
from umbra.gl.volume_plan import VolumePlan
from umbra.methods import METHODS
from umbra.scene import Camera, Light, Part, Scene
from umbra.volume.box_tree import BoxTree

__all__ = ["Planner"]


@dataclass(eq=False)
class Planner:
    """
    Plans the shadow volumes of a scene.

    Parameters
    ----------
    device : Device
    scene : Scene
    geometry : Geometry
        Of the scene, not released by the planner; a `PointTable` where nothing is drawn.
    casters : sequence of int, optional
        Indices of the parts that cast; all by default. All casters must be in the depth
        buffer when counts are made.
    ground : float, optional
        z of a receiving plane, relative to the scene's origin [m].
    before : sequence of Body
        Bodies of the same parts in another pose.
    make_list : callable
        Makes the index list: on the device, or in memory (`IndexArray`).

    Attributes
    ----------
    bodies : list of Body
    casting : CastingScene
        The same as plans read them, without levels of detail.
    """

    device: Device
    scene: Scene
    geometry: Geometry
    casters: Sequence[int] | None = None
    ground: float | None = None
    before: Sequence[Body] = ()
    make_list: Callable[[Device, int], Indices] = Indices
    casting: CastingScene = field(init=False)
    _plans: LightPlans = field(init=False)
    _levels: list[list[DetailLevel]] | None = None
    _detailed: CastingScene | None = None
    _idle_boxes: dict[int, tuple[Part, NDArray[np.float64]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        chosen = range(len(self.scene.parts)) if self.casters is None else self.casters
        self._idle = sorted(set(range(len(self.scene.parts))) - set(chosen))
        self.bodies = make_bodies(self.scene, self.geometry, self.casters, self.before)
        self.before = ()
        self._plans = LightPlans(self.make_list(self.device, 2 * self.geometry.n_points))
        self.casting = self._measure()

    @property
    def indices(self) -> Indices:
        """The triangles of the last plans."""
        return self._plans.indices

    @property
    def detailed(self) -> CastingScene:
        """The casters with their levels of detail, made on first use."""
        if self._detailed is None:
            self._levels = self._levels or [make_levels(body) for body in self.bodies]
            coarse = [level.body for levels in self._levels for level in levels]
            self._detailed = self._measure([body for body in coarse if body is not None])
        return self._detailed

    def _measure(
        self, coarse: Sequence[Body] | None = None, tree: BoxTree | None = None
    ) -> CastingScene:
        """Return what plans read of the scene, with levels of detail if these are given."""
        bodies = (*self.bodies, *(coarse or ()))
        boxes = [body.world_bounds() for body in bodies]
        bounds = np.concatenate([np.zeros((0, 2, 3)), *boxes])
        tree = BoxTree(bounds) if tree is None else tree.fit(bounds)
        table = None if coarse is None else LevelTable.of(self.bodies, self._levels or ())
        return CastingScene(
            bodies, len(self.bodies), bounds, tree, self._bound_idle(), self.scene.origin,
            self.ground, self.geometry.n_points, self.device.reverses_depth, table,
        )  # fmt: skip

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
        if groups:
            self.geometry.bend(list(groups))
            posed = {group.parts: group for group in groups}
            for body in self.bodies:
                body.bend([posed[group.parts] for group in body.groups])
            self._levels = None
        for body in self.bodies:
            body.place(self.geometry.placed[[group.parts[0] for group in body.groups]])
        for body, levels in zip(self.bodies, self._levels or (), strict=False):
            for level in levels:
                if level.body is not None:
                    level.body.place(body.transforms)
        self.casting = self._measure(tree=None if groups else self.casting.tree)
        self._detailed = None

    def can_bend(self, groups: Sequence[Group]) -> bool:
        """Return whether all bodies keep their adjacency with the vertices of groups."""
        posed = {group.parts: group.vertices for group in groups}
        return all(
            posed[body.groups[0].parts] is body.caster.vertices
            or body.can_bend(posed[body.groups[0].parts])
            for body in self.bodies
        )

    def project(self, camera: Camera) -> CameraProjection:
        """Find the projection with the best depth for the scene and the receiving plane."""
        casting = self.casting
        bounds = np.concatenate([casting.bounds, casting.idle])
        bounds = bounds if len(bounds) else casting.whole[None]
        return make_projection(
            camera, self.scene.origin, bounds, self.ground,
            reverses_depth=self.device.reverses_depth,
        )  # fmt: skip

    def plan(
        self,
        projection: CameraProjection,
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
        casting = self.detailed if choices.detail > 0.0 else self.casting
        shapes = tuple(map(LightShape.of, lights))
        plans = self._plans.make(FrameRequest(casting, projection, shapes, method, choices))
        for plan in plans if method == "z-pass" else ():
            _warn(plan, warn)
        return plans

    def twin(self) -> "Planner":
        """Return another planner of the same casters, with its own lists and kept volumes."""
        other = copy(self)
        other._plans = LightPlans(self.make_list(self.device, 2 * self.geometry.n_points))
        return other

    def release(self) -> None:
        """Free the list of triangles."""
        self.indices.release()


def _warn(plan: VolumePlan, warn: Callable[[str], object]) -> None:
    """Warn where z-pass is wrong for a view."""
    count = int((plan.case > 1).sum())
    if count:
        warn(
            f"z-pass is wrong for this view: {count} casters stand "
            "between the near plane and the light, and the eye cannot see their volumes "
            "begin; use auto or z-fail"
        )
