"""
Scaled layers of the hard volume on OpenGL, after Weng, Daman and Rahim (2008).

As `umbra.soft.weng`, which defines layers: each is counted in the stencil from one shared
index list, with one uniform changed, and darkens the surfaces inside; the hard volume comes
last. Fragments of a layer are discarded where its own component is visible.

A layer's map keeps the light fixed, so that silhouettes and lit faces are those of the
caster itself, and its volumes are bounded by the caster and its widest layer. Layers are
not in the depth buffer: their light caps are tested like sides, also for z-pass.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body
from umbra.gl.context import release_all
from umbra.gl.flags import COARSE, CUT, DRAWS, LIGHT_CAPS, Z_FAILS, VolumeSelection
from umbra.gl.open_components import find_start
from umbra.gl.overlap import bound_boxes, find_most
from umbra.gl.planner import Planner
from umbra.gl.projection import CameraProjection, find_clip_range, find_light_source
from umbra.gl.request import find_request_key
from umbra.gl.resources import Indices
from umbra.gl.selection import FoundLights, VolumeOptions, select_lights
from umbra.gl.soft.growth import GrownPoints, Instance, Shown, part_bodies
from umbra.gl.soft.visibility import Visibility
from umbra.gl.state import State
from umbra.gl.target import Target
from umbra.gl.volume_counter import Stack, VolumeCounter
from umbra.gl.volume_plan import Draw, VolumePlan
from umbra.gl.volumes import BodyVolumes, IndexList, make_volumes
from umbra.methods import Softness
from umbra.rays.eye_count import FaceBlocks
from umbra.scene import Light
from umbra.soft import AreaLight
from umbra.soft.weng import GAP, LENGTH, find_growth, find_layer_opacities
from umbra.volume.adjacency import make_planes
from umbra.volume.box_tree import BoxTree

__all__ = ["LightLayers", "ScaledLayers", "find_caster_growth", "list_layers", "plan_layers"]

_SINKS = 1e-4
"""Of a component's radius, away from the light: a cap that grows in the plane of other
surfaces must not lie before them, within what the depth buffer tells apart."""


@dataclass(frozen=True, eq=False)
class LightLayers:
    """
    All layers of one light.

    Parameters
    ----------
    source : (4,) float64
        The light, relative to the scene's origin, a direction of length 1.
    instances : sequence of Instance
    growth : (n_rows, 2, 4) float64
        As in ``GrownPoints.write``.
    volumes : list of BodyVolumes
        Volumes of the bodies of ``part_bodies``.
    bounds : (n_shells, 2, 3) float64
        Bounds of all components in all layers, relative to the scene's origin [m].
    deepest : int
        Upper bound of a layer's count.
    """

    source: NDArray[np.float64]
    instances: Sequence[Instance]
    growth: NDArray[np.float64]
    volumes: list[BodyVolumes]
    bounds: NDArray[np.float64]
    deepest: int

    def is_of(self, source: NDArray[np.float64], hard: Sequence[BodyVolumes]) -> bool:
        """Return whether these layers belong to a light's current hard volumes."""
        return np.array_equal(self.source, source) and all(
            np.array_equal(first.opened, second.opened)
            for first, second in zip(self.volumes, hard, strict=True)
        )


def find_caster_growth(
    bodies: Sequence[Body],
    instances: Sequence[Instance],
    source: NDArray[np.float64],
    hard: Sequence[BodyVolumes],
    most: float,
) -> LightLayers:
    """
    Find the growth of casters of ``part_bodies`` under a light, and the volumes of all layers.

    ``hard`` are the volumes of the original bodies under this light; ``most`` is the scale
    of the widest layer, less 1.
    """
    growth, bounds, volumes, weights = [], [np.zeros((0, 2, 3))], [], [np.zeros(0, np.int64)]
    for body, old in zip(bodies, hard, strict=True):
        volumes.append(make_volumes(body, source, old.opened))
        weights.append(find_most(body, old.opened))
    for instance in instances:
        light = volumes[bodies.index(instance.body)].lights[instance.number]
        centers, axes, radii = find_growth(instance.body.caster, light, instance.vertices, source)
        rows = np.zeros((len(centers), 2, 4))
        rows[:, 0, :3], rows[:, 0, 3], rows[:, 1, :3] = centers, _SINKS * radii, axes
        growth.append(rows)
        widest = enlarge(instance, rows, most)
        bounds.append(_bound(instance, [instance.vertices, widest]))
    boxes = np.concatenate(bounds)
    return LightLayers(
        source=source,
        instances=instances,
        growth=np.concatenate([np.zeros((0, 2, 4)), *growth]),
        volumes=volumes,
        bounds=boxes,
        deepest=bound_boxes(boxes, np.concatenate(weights), source) if len(boxes) else 0,
    )


def enlarge(instance: Instance, rows: NDArray[np.float64], growing: float) -> NDArray[np.float64]:
    """Return an instance's vertices in a layer, in the scene's frame: ``grow.glsl`` in float64."""
    centers, axes = rows[instance.component, 0], rows[instance.component, 1, :3]
    apart = instance.vertices - centers[:, :3]
    apart -= np.einsum("ij,ij->i", apart, axes)[:, None] * axes
    grows = (axes != 0).any(1, keepdims=True)
    return instance.vertices + np.where(grows, growing * apart - centers[:, 3:] * axes, 0.0)


def _bound(instance: Instance, places: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Bound the shells of an instance over all ``places`` of its vertices, (n_shells, 2, 3)."""
    bounds = np.zeros((instance.body.n_shells, 2, 3))
    bounds[:, 0], bounds[:, 1] = np.inf, -np.inf
    shell = instance.body.component_shell[instance.component]
    for vertices in places:
        np.minimum.at(bounds[:, 0], shell, vertices)
        np.maximum.at(bounds[:, 1], shell, vertices)
    return bounds


def list_layers(
    layers: LightLayers,
    projection: CameraProjection,
    light: Light,
    origin: NDArray[np.float64],
    floor: float,
    choices: VolumeOptions,
    numbers: IndexList,
) -> tuple[VolumeSelection, list[Draw]]:
    """
    Select the faces to draw of a light's layers, equal for each, and add them to ``numbers``.

    ``floor`` is a z, relative to the origin of the scene, below every receiver [m]. As levels of
    detail, layers are in no depth buffer.
    """
    reach = light.range if choices.narrow else np.inf
    corners = None
    if choices.narrow:
        corners, _ = find_clip_range(projection.camera, origin, layers.source, light)
    (selection,) = select_lights(
        [layers.volumes], BoxTree(layers.bounds), projection, origin,
        FoundLights.of_one(layers.source, reach, corners), method="auto",
        choices=replace(choices, ask_triangles=False), floor=floor,
    )  # fmt: skip
    flags = np.where(selection.sides, selection.flags | COARSE | LIGHT_CAPS, selection.flags)
    selection = replace(selection, flags=flags)
    begin = numbers.end
    starts = np.append(0, np.cumsum([len(body_volumes.shells) for body_volumes in layers.volumes]))
    counts = numbers.append_light(layers.volumes, selection, starts, layers.source[3] > 0)
    draws = []
    for name, count in zip(DRAWS, counts.tolist(), strict=True):
        if count:
            draws.append(Draw.of(*name, begin, count))
            begin += count
    return selection, draws


def plan_layers(
    layers: LightLayers,
    hard: VolumePlan,
    projection: CameraProjection,
    selection: VolumeSelection,
    draws: Sequence[Draw],
    steps: Sequence[float],
) -> list[VolumePlan]:
    """
    Return a plan for each layer of a light; ``steps`` are the layers' scales, less 1.

    ``hard`` is the plan of the light, ``projection`` that of the picture, without a tilt;
    selection and draws are from ``list_layers``.
    """
    statistics = replace(hard.statistics, deepest=layers.deepest)
    whole = replace(
        hard, projection=projection, draws=tuple(draws), start=0, end=None, case=selection.case,
        statistics=statistics, selection=selection, volumes=tuple(layers.volumes),
    )  # fmt: skip
    uncut = (selection.flags & (Z_FAILS | CUT)) == Z_FAILS
    if projection.camera.is_perspective or not uncut.any():
        return [whole] * len(steps)
    plans = []
    for growing in steps:
        scaled = _scale(layers, growing)
        start, tilt = find_start(scaled, projection.camera, layers.source, uncut)
        plans.append(replace(whole, start=start, projection=projection.tilted(tilt)))
    return plans


def _scale(layers: LightLayers, growing: float) -> list[BodyVolumes]:
    """Return volumes of enlarged bodies without sides, one body per instance."""
    scaled = []
    opened = {id(body_volumes.body): body_volumes.opened for body_volumes in layers.volumes}
    for instance in layers.instances:
        caster, number = instance.body.caster, instance.number
        rows = layers.growth[instance.first_row : instance.first_row + len(caster.is_closed)]
        vertices = enlarge(instance, rows, growing)
        # Mirroring swaps lit and unlit; at infinity there are as many of either.
        planes = make_planes(vertices, caster.faces)
        body = copy(instance.body)
        body.caster = replace(caster, vertices=vertices, planes=planes)
        body.blocks = FaceBlocks.of(body.caster)
        body.groups = [body.groups[number]]
        body.place(np.eye(4)[None])
        open_here = opened[id(instance.body)][[number]]
        scaled.append(BodyVolumes(body, layers.source[None], open_here))
    return scaled


class ScaledLayers(Visibility):
    """
    Stacks the shadows of enlarged casters.

    Parameters
    ----------
    planner : Planner
        Planner of the casters.
    counter : VolumeCounter
        Counter of its plans.
    length, gap : float
        As in ``Softness``; `InputError` for no layer or more than 1,000.
    choices : VolumeOptions, optional
    """

    def __init__(
        self,
        planner: Planner,
        counter: VolumeCounter,
        *,
        length: float = LENGTH,
        gap: float = GAP,
        choices: VolumeOptions | None = None,
    ) -> None:
        layers = Softness(length=length, gap=gap).layers
        self._opacities = find_layer_opacities(layers)
        self._steps = [m * gap / 10 for m in range(1, layers + 1)]
        self._planner, self._hard = planner, counter
        self._choices = choices or VolumeOptions()
        device, scene = planner.device, planner.scene
        self._bodies, self._instances = part_bodies(planner.bodies)
        self._points = GrownPoints(device, self._instances)
        self._shown = Shown(device, scene, planner.geometry, self._instances, planner.casters)
        self._indices = Indices(device, 2 * self._points.n_points)
        self._counter = VolumeCounter(device, self._points, self._indices, grows=True)
        self._numbers, self._stack = IndexList(), Stack(device)
        self._layers: list[LightLayers] = []
        self._key: tuple | None = None
        self._plans: list[list[VolumePlan]] = []
        self._middles: list[VolumePlan] = []
        self._projection: CameraProjection | None = None
        self._is_shown = False

    def begin(
        self, projection: CameraProjection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Prepare a picture; see `Visibility`."""
        self._projection, self._middles, self._is_shown = projection, list(plans), False
        self._grow(lights, plans)
        key = find_request_key((projection, *self._layers, *plans))
        if key == self._key:
            return
        self._key = key
        origin, floor = self._planner.scene.origin, self._planner.casting.floor
        self._plans = []
        self._numbers.begin(self._indices.dtype)
        for layers, area, plan in zip(self._layers, lights, plans, strict=True):
            selection, draws = list_layers(
                layers, projection, area.light, origin, floor, self._choices, self._numbers
            )
            self._plans.append(plan_layers(layers, plan, projection, selection, draws, self._steps))
        self._indices.write(self._numbers.numbers)

    def draw(self, state: State, target: Target, number: int) -> Target:
        """Draw a light's visibility; see `Visibility`."""
        if not self._is_shown:
            assert self._projection is not None
            self._points.shown = self._shown.draw(state, target, self._projection)
            self._is_shown = True
        shares = self._stack.begin(state, target, 1.0)
        points, scissor = self._points, self._middles[number].scissor
        points.light = number
        steps = zip(self._steps, self._plans[number], self._opacities[1:], strict=True)
        for growing, plan, opacity in reversed(list(steps)):
            points.growing = growing
            self._counter.count(state, shares, plan)
            self._stack.add_shadow(state, 1.0 - float(opacity), scissor)
        self._hard.count(state, shares, self._middles[number])
        self._stack.add_shadow(state, 1.0 - float(self._opacities[0]), scissor)
        return shares

    def _grow(self, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]) -> None:
        """Find the layers of moved lights."""
        layers = []
        for number, (area, plan) in enumerate(zip(lights, plans, strict=True)):
            source = find_light_source(area.light, self._planner.scene.origin)
            old = self._layers[number] if number < len(self._layers) else None
            if old is not None and old.is_of(source, plan.volumes):
                layers.append(old)
            else:
                layers.append(
                    find_caster_growth(
                        self._bodies, self._instances, source, plan.volumes, self._steps[-1]
                    )
                )
        same = len(layers) == len(self._layers) and all(
            first is second for first, second in zip(layers, self._layers, strict=True)
        )
        self._layers = layers
        if not same:
            growth = np.stack([layer.growth for layer in layers]) if layers else np.zeros(0)
            self._points.write(growth.astype(np.float32))

    def release(self) -> None:
        """Free the device objects."""
        release_all(self._stack, self._counter, self._indices, self._shown, self._points)
