"""
Walls and roofs of a city, counted tile by tile.

A tile holds the objects whose centre lies in its square. An object is sampled and wound as if it
stood alone, so its samples do not depend on its tile. Samples are written in a folder of the tile;
when all tiles are done, ``surface_pieces.py`` puts them in the order of files and parts.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.errors import InputError
from umbra.receivers.kind import DIMS, Request
from umbra.receivers.points import SurfaceSamples
from umbra.receivers.samples import sample_surfaces
from umbra.receivers.surface_samples import Samples
from umbra.study.compare import NeighbourSums
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.city_proposal import split_neighbours
from umbra.tiles.job import WorkerContext
from umbra.tiles.neighbourhood import Neighbourhood, PartScene, Selection, make_tile_casters
from umbra.tiles.receive import Tiles, count_receivers
from umbra.volume.adjacency import make_caster

__all__ = ["PartResults", "count_surfaces", "find_objects", "turn_outward"]

_SAMPLES = 1_500_000
"""Most samples that are counted at a time, unless one object has more."""
_LEAST_SAMPLES = 10_000
_BASE, _SAMPLE = 3e8, 600.0  # memory of a process and of a sample with its results [byte]


@dataclass(frozen=True)
class PartResults:
    """
    Results of some parts.

    Parameters
    ----------
    keys : (n, 6) int64
        Of each part: number of its file, of the part in it and of its object, and its numbers of
        samples, surfaces and triangles.
    variables : dict
        Dimensions and values of each; indices of surfaces count from the part's first.
    """

    keys: NDArray[np.int64]
    variables: dict[str, tuple[tuple[str, ...], NDArray]]


def find_objects(context: WorkerContext, tile: CityTile) -> list[tuple[int, NDArray[np.intp]]]:
    """Find the objects whose centre lies in a tile's square: number of each file, and objects."""
    lattice = context.job.lattice
    assert lattice is not None
    grid = lattice.grid
    row, col = tile.rows[0], tile.cols[0]
    objects = []
    for number, box in enumerate(context.boxes):
        if not _meets(box, grid, row, col):
            continue
        geometry = context.catalogue.files[number].geometry
        count = context.catalogue.files[number].counts["objects"]
        low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
        np.minimum.at(low, geometry.objects, geometry.boxes[:, 0, :2])
        np.maximum.at(high, geometry.objects, geometry.boxes[:, 1, :2])
        centre = (low + high) / 2 + context.shifts[number, :2]
        cell = np.rint((centre - (grid.x0, grid.y0)) / (grid.dx, grid.dy))
        cell = np.clip(cell, 0, (grid.cols - 1, grid.rows - 1))
        own = np.flatnonzero((cell == (col, row)).all(1))
        if len(own):
            objects.append((number, own))
    return objects


def _meets(box: NDArray[np.float64], grid: Any, row: int, col: int) -> bool:
    """Return whether a file's bounds meet a square of the lattice, or lie beside its last ones."""
    first = np.rint((box[0, :2] - (grid.x0, grid.y0)) / (grid.dx, grid.dy))
    last = np.rint((box[1, :2] - (grid.x0, grid.y0)) / (grid.dx, grid.dy))
    ends = (grid.cols - 1, grid.rows - 1)
    first, last = np.clip(first, 0, ends), np.clip(last, 0, ends)
    return bool((first <= (col, row)).all() and (last >= (col, row)).all())


def count_surfaces(
    context: WorkerContext, tile: CityTile
) -> tuple[list[PartResults], list[NeighbourSums], int]:
    """
    Count the surfaces of the objects in a tile.

    Returns
    -------
    pieces : list of PartResults
    neighbours : list of NeighbourSums
        Those that lose sun to a proposal; none without one.
    triangles : int
        Casting triangles that were read, added up over its batches.
    """
    near = Neighbourhood(context)
    pieces, neighbours, triangles = [], list[NeighbourSums](), 0
    for batch in _make_batches(context, near, find_objects(context, tile)):
        counted = _count_batch(context, near, batch)
        if counted is not None:
            pieces.append(counted[0])
            neighbours += counted[1]
            triangles += counted[2]
    return pieces, neighbours, triangles


def _make_batches(
    context: WorkerContext, near: Neighbourhood, objects: list[tuple[int, NDArray[np.intp]]]
) -> Iterator[Selection]:
    """Yield the units of objects, as many as make enough samples."""
    spacing = context.job.options.spacing
    room = (context.job.memory - _BASE) / 2 / _SAMPLE  # the other half is for casters
    most = min(_SAMPLES, max(room, _LEAST_SAMPLES))
    waiting: list[tuple[int, NDArray[np.intp]]] = []
    expected = 0.0
    for number, own in objects:
        geometry = context.catalogue.files[number].geometry
        units = np.flatnonzero(np.isin(geometry.objects, own))
        scene = near.read(Selection(((number, units),)), "receives")
        soup = scene.soup
        a, b, c = (soup.vertices[soup.faces[:, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
        owner = geometry.object_of[scene.number[:, 1]][soup.part]
        counts = np.bincount(owner, area, int(own.max()) + 1)[own] / spacing**2
        first = 0
        for k, samples in enumerate(counts):
            if expected and expected + samples > most:
                if k > first:
                    waiting.append((number, _pick(geometry, own[first:k])))
                yield Selection(tuple(waiting))
                waiting, expected, first = [], 0.0, k
            expected += samples
        waiting.append((number, _pick(geometry, own[first:])))
    if waiting:
        yield Selection(tuple(waiting))


def _pick(geometry: Any, objects: NDArray[np.intp]) -> NDArray[np.intp]:
    return np.flatnonzero(np.isin(geometry.objects, objects))


def _count_batch(
    context: WorkerContext, near: Neighbourhood, batch: Selection
) -> tuple[PartResults, list[NeighbourSums], int] | None:
    """Count the surfaces of some objects; return them, neighbours, and the number of casters."""
    box, groups = near.find_bounds(batch), context.groups

    def lay_out(units: Selection) -> SurfaceSamples | None:
        scene = near.read(units, "any").with_words(context.catalogue)
        samples = _sample(scene, _find_parts(context, scene, batch), context.job.options.spacing)
        if samples is None:
            return None
        caster, canopy, soup = make_tile_casters(context, scene)
        casting = Casting(scene, soup, caster, context.job.threads, canopy=canopy)
        return SurfaceSamples.of(context.kind, casting, samples)

    def cut(laid: SurfaceSamples | None) -> Tiles:
        assert laid is not None
        casting = laid.casting
        return laid.make_tiles(Request(
            casting.scene, context.job.options, [], casting.threads, casting.canopy,
            lights=len(context.lights), has_groups=groups is not None,
        ))  # fmt: skip

    units = batch | near.find_casting(box, context.lights.vectors)
    laid = lay_out(units)
    if laid is None:
        return None
    is_due = groups is not None and groups.are_among(units)
    study, neighbours = count_receivers(
        context, laid, cut(laid),
        lambda lights: cut(lay_out(batch | near.find_casting(box, lights))), is_due=is_due,
    )  # fmt: skip
    variables = split_neighbours({**study.variables(), **laid.sum_up(study)})
    pieces = _cut_to_parts(laid.casting.scene, laid.samples, variables)  # type: ignore[arg-type]
    return pieces, neighbours, len(laid.casting.caster.faces)


def _find_parts(context: WorkerContext, scene: PartScene, batch: Selection) -> NDArray[np.intp]:
    """Return the parts of a scene that are sampled: those of the batch's objects that receive."""
    units = dict(batch.units)

    def find(number: int) -> NDArray[np.bool_]:
        geometry = context.catalogue.files[number].geometry
        is_chosen = np.isin(geometry.object_of, geometry.objects[units.get(number, [])])
        return is_chosen & context.roles.find_receiving(number)

    return np.flatnonzero(scene.spread(find))


def _sample(scene: PartScene, parts: NDArray[np.intp], spacing: float) -> Samples | None:
    """Sample parts as if each object stood alone; None if all surfaces face down."""
    if not len(parts):
        return None
    soup = scene.triangles(parts.tolist())
    faces = turn_outward(soup.vertices, soup.faces, scene.group[soup.part])
    try:
        return sample_surfaces(scene, spacing, (), parts.tolist(), faces)
    except InputError as error:
        if "nothing is left to sample" in str(error):
            return None
        raise


def turn_outward(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], group: NDArray[np.int32]
) -> NDArray[np.int32]:
    """
    Return faces (n, 3), those of closed components wound inward reversed.

    Parameters
    ----------
    vertices : (n_vertices, 3) float64
    faces : (n, 3) int32
    group : (n,) int32
        Object of each face: objects are welded and judged each alone.
    """
    rows = np.concatenate(
        [np.repeat(group, 3)[:, None].astype(np.float64), vertices[faces.ravel()] + 0.0], axis=1
    )
    _, first, own = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    points = rows[first, 1:]
    caster = make_caster(points, own.reshape(-1, 3).astype(np.int32), group, is_welded=True)
    # In the order of the faces given, about a corner of its own: so the sum of a component has the
    # same bits whatever else there is.
    order = np.argsort(caster.source)
    component, own_faces = caster.component[order], caster.faces[order]
    start = np.full(len(caster.is_closed), len(order))
    np.minimum.at(start, component, np.arange(len(order)))
    base = points[own_faces[start[component], 0]]
    a, b, c = (points[own_faces[:, k]] - base for k in range(3))
    volume = np.bincount(component, np.einsum("ij,ij->i", a, np.cross(b, c)), len(caster.is_closed))
    inward = caster.source[order][(caster.is_closed & (volume < 0))[component]]
    turned = faces.copy()
    turned[inward] = turned[inward][:, ::-1]
    return turned


def _cut_to_parts(
    scene: PartScene, samples: Samples, variables: dict[str, tuple[tuple[str, ...], Any]]
) -> PartResults:
    """Return results with the parts that they are of; indices count from each part's first."""
    own, first, surfaces = np.unique(samples.part, return_index=True, return_counts=True)
    count = np.bincount(samples.part[samples.surface], minlength=len(scene.group))[own]
    owner = samples.part[samples.owner]
    triangles = np.bincount(owner, minlength=len(scene.group))[own]
    keys = np.column_stack([scene.number[own], scene.thing[own], count, surfaces, triangles])
    start = np.zeros(len(scene.group), np.int64)
    start[own] = first
    results = {name: (dims, np.asarray(array)) for name, (dims, array) in variables.items()}
    index = samples.surface - start[samples.part[samples.surface]]
    results["surface_of_sample"] = (DIMS, index.astype(np.int32))
    # What files of shapes need besides.
    own_surface = (samples.owner - start[owner]).astype(np.int32)
    results |= {
        "triangle_corners": (("triangle", "corner", "xyz"), samples.corners),
        "surface_of_triangle": (("triangle",), own_surface),
        "surface_axes": (("surface", "axis", "xyz"), samples.axes),
        "surface_start": (("surface", "axis"), samples.start),
        "surface_cells": (("surface", "axis"), samples.cells),
    }
    return PartResults(keys.astype(np.int64), results)
