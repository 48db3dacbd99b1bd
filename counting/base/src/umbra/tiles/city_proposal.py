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
from umbra.tiles.job import Workplace
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
"""Faces around a proposal that are looked through for what it overlaps: 0.5 GB."""


def find_proposal(place: Workplace) -> Triangles:
    """Return the triangles of the proposal, in the run's local frame; parts are not numbered."""
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int32)], 0
    for file in place.catalogue.files:
        new, geometry = find_matching(file, place.job.options.proposed), file.geometry
        if not new.any():
            continue
        corners = geometry.faces[new[geometry.part]]
        used = np.unique(corners)
        vertices.append(geometry.vertices[used] + place.shifts[file.number])
        faces.append((np.searchsorted(used, corners) + count).astype(np.int32))
        count += len(used)
    every = np.concatenate(faces)
    return Triangles(np.concatenate(vertices), every, np.zeros(len(every), np.int32))


def tell_tiled_proposal(place: Workplace) -> list[str]:
    """Report a proposal that lies wholly outside the plan, or within what stands there."""
    options = place.job.options
    soup = find_proposal(place) if options.proposed else None
    notes = tell_city_replaced(place.catalogue, options)
    if soup is None or not len(soup.faces):
        return notes
    box = np.stack([soup.vertices.min(0), soup.vertices.max(0)])
    if options.extent is not None and place.kind.is_plan:
        notes += tell_outside(box + place.origin, options.extent)
    near = Neighbourhood(place)
    around = near.find_seen(box[0, :2], box[1, :2])
    if near.count_faces(around) > _MOST_FACES:
        return notes
    scene, files = near.read(around, "casts"), place.catalogue.files
    is_new = scene.spread(lambda file: find_matching(files[file], options.proposed))

    def name(thing: int) -> str:
        part = int(np.flatnonzero(scene.group == thing)[0])
        return files[int(scene.number[part, 0])].names_of_objects[int(scene.thing[part])]

    return notes + tell_overlap(soup, scene.pick(~is_new), scene.group, name)


_FIELDS = ("names", "area", "sums", "most")


def find_neighbours(result: Result, laid: Receivers) -> list[NeighbourSums]:
    """Return the figures of the neighbours on some receivers, one or, without a proposal, none."""
    found = [one.find_losses(laid) for one in result.accumulators if isinstance(one, Attribution)]
    return [losses.sum_up() for losses in found if losses is not None]


def split_neighbours(variables: Variables) -> Variables:
    """Return the variables without those of neighbours, which the whole city has."""
    return {name: one for name, one in variables.items() if "neighbour" not in one[0]}


def write_neighbours(folder: Path, each: Sequence[NeighbourSums]) -> None:
    """Write the figures of a tile's windows into its folder."""
    if each:
        folder.mkdir(parents=True, exist_ok=True)
        whole = each[0].join(each[1:])
        for name in _FIELDS:
            np.save(folder / f"neighbour_{name}.npy", getattr(whole, name))


def join_neighbours(folders: Iterable[Path], catalogue: Catalogue) -> Variables:
    """Return the variables of all neighbours that lose sun; none without a proposal."""
    there = [one for one in folders if (one / "neighbour_names.npy").exists()]
    if not there:
        return {}
    each = [
        NeighbourSums(*(np.load(one / f"neighbour_{name}.npy") for name in _FIELDS))
        for one in there
    ]
    whole = each[0].join(each[1:])
    labels = {}
    for file in {int(name.split("/")[0]) for name in whole.names.tolist() if name != GROUND}:
        known = catalogue.files[file]
        of_part = catalogue.label_parts(known)
        for part, thing in enumerate(known.geometry.object_of.tolist()):
            labels[f"{file:08}/{thing:010}"] = of_part[part]
    return whole.rename(np.array([labels.get(n, GROUND) for n in whole.names.tolist()])).variables()
