"""Assembly of surfaces: the pieces of all tiles in one store, a chunk at a time."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.study.measures import Quantity
from umbra.tiles.catalogue import Catalogue
from umbra.tiles.pieces import AXES, GEOMETRY, SurfacePieces
from umbra.tiles.store import CityStore

__all__ = ["assemble", "name_objects"]

CHUNK = 1 << 18
"""Rows of a chunk of the store."""


def assemble(
    store: CityStore,
    pieces: SurfacePieces,
    catalogue: Catalogue,
    facts: Mapping[str, object],
    quantities: Sequence[Quantity] = (),
) -> None:
    """
    Write the pieces of all tiles into a store.

    Parameters
    ----------
    store : CityStore
        Made anew.
    pieces : SurfacePieces
    catalogue : Catalogue
    facts : mapping
        Global attributes.
    quantities : sequence of Quantity
        Variables of the study's measures.
    """
    names = {name: dims for name, dims in pieces.names.items() if name not in GEOMETRY}
    template = {name: (dims, pieces.show(name)) for name, dims in names.items()}
    template["part"] = (("part",), np.array([""]))
    template["surface_part"] = (("surface",), np.zeros(1, np.int32))
    store.create(template, pieces.sizes, dict.fromkeys(AXES, CHUNK), facts, quantities)
    store.write({
        "part": name_objects(catalogue, pieces.objects),
        "surface_part": np.repeat(pieces.owner, pieces.keys[:, 4]).astype(np.int32),
    })  # fmt: skip
    for name, dims in names.items():
        at = pieces.find_axis(name)
        if at is None:
            continue
        size = pieces.sizes[dims[at]]
        for begin in range(0, size, CHUNK):
            stop = min(begin + CHUNK, size)
            where = *(slice(None),) * at, slice(begin, stop)
            store.write({name: pieces.read(name, begin, stop)}, where)


def name_objects(catalogue: Catalogue, objects: NDArray[np.int64]) -> NDArray:
    """Return the name of each object, (file, object), with its layer if there are several files."""
    names: list[str] = []
    for number in np.unique(objects[:, 0]).tolist():
        file = catalogue.files[number]
        known = file.names_of_objects
        lead = f"{file.layer}/" if file.layer else ""
        names += [lead + known[thing] for thing in objects[objects[:, 0] == number, 1].tolist()]
    return np.array(names)
