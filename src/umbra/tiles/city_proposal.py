"""
A proposal among a city's files: its triangles, and what its place may not be meant for.

Sun that a city's neighbours lose to a proposal: figures of each tile, put together.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from umbra.receivers.kind import Receivers, Variables
from umbra.scene import Triangles
from umbra.study.accumulators.attribution import Attribution
from umbra.study.compare import GROUND, NeighbourSums
from umbra.study.remarks import tell_outside, tell_overlap
from umbra.study.setup import Result
from umbra.tiles.city_catalogue import Catalogue
from umbra.tiles.job import WorkerContext
from umbra.tiles.matched_parts import find_matching, tell_city_replaced
from umbra.tiles.neighbourhood import Neighbourhood

__all__ = [
    "find_neighbours",
    "find_proposal",
    "join_neighbours",
    "split_neighbours",
    "tell_tiled_proposal",
    "write_neighbours",
]

_MOST_FACES = 4_000_000
"""Faces around a proposal that are searched for what it overlaps: 0.5 GB."""


def find_proposal(context: WorkerContext) -> Triangles:
    """Return the triangles of the proposal, in the run's local frame; parts are not numbered."""
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int32)], 0
    for file in context.catalogue.files:
        new, geometry = find_matching(file, context.job.options.proposed), file.geometry
        if not new.any():
            continue
        corners = geometry.faces[new[geometry.part]]
        used = np.unique(corners)
        vertices.append(geometry.vertices[used] + context.shifts[file.number])
        faces.append((np.searchsorted(used, corners) + count).astype(np.int32))
        count += len(used)
    every = np.concatenate(faces)
    return Triangles(np.concatenate(vertices), every, np.zeros(len(every), np.int32))


def tell_tiled_proposal(context: WorkerContext) -> list[str]:
    """Report a proposal that lies wholly outside the plan, or within what stands there."""
    options = context.job.options
    soup = find_proposal(context) if options.proposed else None
    notes = tell_city_replaced(context.catalogue, options)
    if soup is None or not len(soup.faces):
        return notes
    box = np.stack([soup.vertices.min(0), soup.vertices.max(0)])
    if options.extent is not None and context.kind.is_plan:
        notes += tell_outside(box + context.origin, options.extent)
    near = Neighbourhood(context)
    around = near.find_seen(box[0, :2], box[1, :2])
    if near.count_faces(around) > _MOST_FACES:
        return notes
    scene, files = near.read(around, "casts"), context.catalogue.files
    is_new = scene.spread(lambda file: find_matching(files[file], options.proposed))

    def name(group: int) -> str:
        part = int(np.flatnonzero(scene.group == group)[0])
        return files[int(scene.number[part, 0])].names_of_objects[int(scene.thing[part])]

    return notes + tell_overlap(soup, scene.pick(~is_new), scene.group, name)


_FIELDS = ("names", "area", "sums", "most")


def find_neighbours(result: Result, laid: Receivers) -> list[NeighbourSums]:
    """Return the figures of the neighbours on some receivers, one or, without a proposal, none."""
    tables = [
        accumulator.find_losses(laid)
        for accumulator in result.accumulators
        if isinstance(accumulator, Attribution)
    ]
    return [losses.sum_up() for losses in tables if losses is not None]


def split_neighbours(variables: Variables) -> Variables:
    """Return the variables without those of neighbours, which the whole city has."""
    return {
        name: variable for name, variable in variables.items() if "neighbour" not in variable[0]
    }


def write_neighbours(folder: Path, sums: Sequence[NeighbourSums]) -> None:
    """Write the figures of a tile's windows into its folder."""
    if sums:
        folder.mkdir(parents=True, exist_ok=True)
        whole = sums[0].join(sums[1:])
        for name in _FIELDS:
            np.save(folder / f"neighbour_{name}.npy", getattr(whole, name))


def join_neighbours(folders: Iterable[Path], catalogue: Catalogue) -> Variables:
    """Return the variables of all neighbours that lose sun; none without a proposal."""
    there = [folder for folder in folders if (folder / "neighbour_names.npy").exists()]
    if not there:
        return {}
    sums = [
        NeighbourSums(*(np.load(folder / f"neighbour_{name}.npy") for name in _FIELDS))
        for folder in there
    ]
    whole = sums[0].join(sums[1:])
    labels = {}
    for file in {int(name.split("/")[0]) for name in whole.names.tolist() if name != GROUND}:
        known = catalogue.files[file]
        of_part = catalogue.label_parts(known)
        for part, index in enumerate(known.geometry.object_of.tolist()):
            labels[f"{file:08}/{index:010}"] = of_part[part]
    return whole.rename(np.array([labels.get(n, GROUND) for n in whole.names.tolist()])).variables()
