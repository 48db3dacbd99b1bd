"""Casters of a neighbourhood: adjacency, canopies, and what is seen."""

import numpy as np

from umbra.casters import Canopy
from umbra.scene import Triangles
from umbra.tiles.job import Workplace
from umbra.tiles.neighbourhood import PartScene
from umbra.volume.adjacency import Caster, make_caster

__all__ = ["make_tile_casters"]

_ABYSS = -1e7  # z of the face that stands for no caster [m]


def make_tile_casters(
    place: Workplace, scene: PartScene
) -> tuple[Caster, Canopy | None, Triangles]:
    """
    Prepare the casters of a neighbourhood.

    Parameters
    ----------
    place : Workplace
    scene : PartScene
        As ``Neighbourhood.read`` returns it.

    Returns
    -------
    caster : Caster
        Canopies as if they were opaque.
    canopy : Canopy or None
        If the study has canopies.
    seen : Triangles
        All but canopies.
    """
    roles = place.roles
    casts = scene.spread(roles.find_casting)
    soup = scene.pick(casts)
    vertices, faces, group = soup.vertices, soup.faces, scene.group[soup.part]
    if not len(faces):  # a face below every receiver casts nothing
        vertices = np.array([[0.0, 0.0, _ABYSS], [1.0, 0.0, _ABYSS], [0.0, 1.0, _ABYSS]])
        faces, group = np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32)
    caster = make_caster(vertices, faces, group)
    gone = scene.spread(roles.find_replaced)
    if roles.season is None:
        return caster, None, scene.pick(~gone)
    crowns = scene.spread(roles.find_canopies)
    every, casting, solid, former = (
        tuple(np.flatnonzero(which).tolist())
        for which in (crowns & ~gone, crowns & casts, casts & ~crowns, crowns & gone)
    )
    return caster, Canopy(every, casting, solid, roles.season, former), scene.pick(~crowns & ~gone)
