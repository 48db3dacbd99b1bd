"""Sun that a city's neighbours lose to a proposal: figures of each tile, put together."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from umbra.receivers.kind import Receivers, Variables
from umbra.study.accumulators.attribution import Attribution
from umbra.study.compare import GROUND, NeighbourSums
from umbra.study.setup import Result
from umbra.tiles.catalogue import Catalogue

__all__ = ["find_neighbours", "join_neighbours", "split_neighbours", "write_neighbours"]

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
