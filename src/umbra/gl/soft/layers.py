"""
What to draw of the scaled layers of a light's volumes: one list of triangles for all of them.

A layer's map leaves the light where it is, so that silhouettes and lit faces are those of
the caster itself, and its volumes are bounded by the caster and its widest layer. Layers
are in no depth buffer: their light caps are tested like sides, also where counts are
made before the visible surface.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.open_components import find_start
from umbra.gl.overlap import bound_boxes, find_most
from umbra.gl.plan import Z_FAIL, Z_PASS, Draw, Selection, VolumeOptions, VolumePlan, select
from umbra.gl.projection import Projection, find_clip_range
from umbra.gl.soft.growth import Instance
from umbra.gl.volumes import BodyVolumes, gather, make_volumes
from umbra.rays.eye_count import FaceBlocks
from umbra.scene import Light
from umbra.soft.weng import find_growth
from umbra.volume.adjacency import make_planes

__all__ = ["LightLayers", "grow", "list_layers", "plan_layers"]

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
        Of the parted bodies.
    bounds : (n_shells, 2, 3) float64
        Of all bodies' components and all their layers, relative to the scene's origin [m].
    deepest : int
        No count of a layer can be larger.
    """

    source: NDArray[np.float64]
    instances: Sequence[Instance]
    growth: NDArray[np.float64]
    volumes: list[BodyVolumes]
    bounds: NDArray[np.float64]
    deepest: int

    def is_of(self, source: NDArray[np.float64], hard: Sequence[BodyVolumes]) -> bool:
        """Tell whether these are still the layers of a light's hard volumes."""
        return np.array_equal(self.source, source) and all(
            np.array_equal(one.opened, two.opened)
            for one, two in zip(self.volumes, hard, strict=True)
        )


def grow(
    bodies: Sequence[Body],
    instances: Sequence[Instance],
    source: NDArray[np.float64],
    hard: Sequence[BodyVolumes],
    most: float,
) -> LightLayers:
    """
    Find how casters of ``part_bodies`` grow under a light, and the volumes of all layers.

    ``hard`` are the volumes of the bodies as they were, under this light; ``most`` is by how
    much more than 1 the widest layer is enlarged.
    """
    growth, bounds, volumes, weights = [], [np.zeros((0, 2, 3))], [], [np.zeros(0, np.int64)]
    for body, old in zip(bodies, hard, strict=True):
        volumes.append(make_volumes(body, source, old.opened))
        weights.append(find_most(body, old.opened))
    for each in instances:
        light = volumes[bodies.index(each.body)].lights[each.number]
        centers, axes, radii = find_growth(each.body.caster, light, each.vertices, source)
        rows = np.zeros((len(centers), 2, 4))
        rows[:, 0, :3], rows[:, 0, 3], rows[:, 1, :3] = centers, _SINKS * radii, axes
        growth.append(rows)
        widest = enlarge(each, rows, most)
        bounds.append(_bound(each, [each.vertices, widest]))
    boxes = np.concatenate(bounds)
    return LightLayers(
        source=source,
        instances=instances,
        growth=np.concatenate([np.zeros((0, 2, 4)), *growth]),
        volumes=volumes,
        bounds=boxes,
        deepest=bound_boxes(boxes, np.concatenate(weights), source) if len(boxes) else 0,
    )


def enlarge(each: Instance, rows: NDArray[np.float64], growing: float) -> NDArray[np.float64]:
    """Give an instance's vertices in a layer, in the scene's frame: ``grow.glsl`` in float64."""
    centers, axes = rows[each.component, 0], rows[each.component, 1, :3]
    apart = each.vertices - centers[:, :3]
    apart -= np.einsum("ij,ij->i", apart, axes)[:, None] * axes
    grows = (axes != 0).any(1, keepdims=True)
    return each.vertices + np.where(grows, growing * apart - centers[:, 3:] * axes, 0.0)


def _bound(each: Instance, places: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Box the shells of an instance wherever its vertices come to be, (n_shells, 2, 3)."""
    bounds = np.zeros((each.body.n_shells, 2, 3))
    bounds[:, 0], bounds[:, 1] = np.inf, -np.inf
    shell = each.body.component_shell[each.component]
    for vertices in places:
        np.minimum.at(bounds[:, 0], shell, vertices)
        np.maximum.at(bounds[:, 1], shell, vertices)
    return bounds


def list_layers(
    layers: LightLayers,
    projection: Projection,
    light: Light,
    origin: NDArray[np.float64],
    floor: float,
    choices: VolumeOptions,
    place: int,
) -> tuple[Selection, list[Draw], list[NDArray[np.uint32]]]:
    """
    Select what is drawn of a light's layers, the same for each, and list its triangles.

    ``floor`` is a z, relative to the origin of the scene, below every receiver [m]; the
    triangles will begin at ``place`` in the index list.
    """
    reach = light.range if choices.narrow else np.inf
    corners = None
    if choices.narrow:
        corners, _ = find_clip_range(projection.camera, origin, layers.source, light)
    selection = select(
        layers.volumes, layers.bounds, projection, origin, layers.source, method="auto",
        choices=replace(choices, ask_triangles=False), floor=floor, reach=reach, scissor=corners,
    )  # fmt: skip
    draws, lists = [], []
    for z_fail in (False, True):
        for is_cut in (False, True):
            chosen = selection.sides & (selection.z_fail == z_fail) & (selection.is_cut == is_cut)
            is_quad = is_cut or layers.source[3] > 0
            found = [
                gather(layers.volumes, "sides", chosen, is_quad=is_quad),
                gather(layers.volumes, "light_cap", chosen),
                gather(
                    layers.volumes, "dark_cap", chosen & selection.dark_cap,
                    is_fan=selection.is_fan,
                ),
            ]  # fmt: skip
            count = sum(map(len, found))
            if count:
                draws.append(Draw(Z_FAIL if z_fail else Z_PASS, is_cut, place, count))
                lists += found
                place += count
    return selection, draws, lists


def plan_layers(
    layers: LightLayers,
    hard: VolumePlan,
    projection: Projection,
    selection: Selection,
    draws: Sequence[Draw],
    steps: Sequence[float],
) -> list[VolumePlan]:
    """
    Give a plan for each layer of a light, by how much more than 1 each is enlarged.

    ``hard`` is the plan of the light, ``projection`` that of the picture, without a tilt;
    selection and draws are those of ``list_layers``.
    """
    statistics = replace(hard.statistics, deepest=layers.deepest)
    whole = replace(
        hard, projection=projection, draws=tuple(draws), start=0, case=selection.case,
        statistics=statistics, selection=selection, volumes=tuple(layers.volumes),
    )  # fmt: skip
    uncut = selection.sides & selection.z_fail & ~selection.is_cut
    if projection.camera.is_perspective or not uncut.any():
        return [whole] * len(steps)
    plans = []
    for growing in steps:
        scaled = _scale(layers, growing)
        start, tilt = find_start(scaled, projection.camera, layers.source, uncut)
        plans.append(replace(whole, start=start, projection=projection.tilted(tilt)))
    return plans


def _scale(layers: LightLayers, growing: float) -> list[BodyVolumes]:
    """Give volumes of enlarged bodies without their sides, each instance by itself."""
    scaled = []
    opened = {id(each.body): each.opened for each in layers.volumes}
    for each in layers.instances:
        caster, number = each.body.caster, each.number
        rows = layers.growth[each.first_row : each.first_row + len(caster.is_closed)]
        vertices = enlarge(each, rows, growing)
        # Mirrored, what is lit is called unlit; far away there are as many of either.
        planes = make_planes(vertices, caster.faces)
        body = copy(each.body)
        body.caster = replace(caster, vertices=vertices, planes=planes)
        body.blocks = FaceBlocks.of(body.caster)
        body.groups = [body.groups[number]]
        body.place([None])
        open_here = opened[id(each.body)][[number]]
        scaled.append(BodyVolumes(body, layers.source[None], open_here))
    return scaled
