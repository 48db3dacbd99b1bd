"""A proposal among a city's files: its triangles, and what its place may not be meant for."""

import numpy as np

from umbra.scene import Triangles
from umbra.study.remarks import tell_outside, tell_overlap
from umbra.tiles.job import Workplace
from umbra.tiles.neighbourhood import Neighbourhood
from umbra.tiles.replaced import find_matching, tell_city_replaced

__all__ = ["find_proposal", "tell_proposal"]

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


def tell_proposal(place: Workplace) -> list[str]:
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
