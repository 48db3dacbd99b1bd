"""
Assembly of surfaces: the pieces of all tiles in one store, in the order of files and parts.

The order, and so every byte, is the same for any tiles. Pieces stay on disk and are read a chunk at
a time.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.tiles.catalogue import Catalogue
from umbra.tiles.store import CityStore
from umbra.tiles.surfaces import PartResults

__all__ = ["assemble", "write_pieces"]

CHUNK = 1 << 18
"""Rows of a chunk of the store."""
_AXES = ("sample", "surface", "part")
_NAMES = "variables.json"
_FROM_KEYS = {"part", "surface_part"}


def write_pieces(folder: Path, pieces: Sequence[PartResults]) -> None:
    """
    Write the pieces of a tile into a folder, whole or not at all.

    Parameters
    ----------
    folder : Path
    pieces : sequence of PartResults
    """
    shutil.rmtree(folder, ignore_errors=True)
    if not pieces:
        return
    unfinished = folder.with_name(f".{folder.name}")
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    names: dict[str, tuple[str, ...]] = {}
    for name, (dims, _) in pieces[0].variables.items():
        if name in _FROM_KEYS:
            continue
        values = [piece.variables[name][1] for piece in pieces]
        axis = next((k for k, dim in enumerate(dims) if dim in _AXES), None)
        whole = values[0] if axis is None else np.concatenate(values, axis)
        np.save(unfinished / f"{name}.npy", whole)
        names[name] = dims
    np.save(unfinished / "keys.npy", np.concatenate([piece.keys for piece in pieces]))
    (unfinished / _NAMES).write_bytes(orjson.dumps(names))
    unfinished.rename(folder)


@dataclass(frozen=True)
class _Rows:
    """
    Where the rows of one axis come from.

    Parameters
    ----------
    tile, first, count : (n,) int64
        PartResults, first row in it, and number of rows of each run, in the final order.
    """

    tile: NDArray[np.int64]
    first: NDArray[np.int64]
    count: NDArray[np.int64]

    def __len__(self) -> int:
        return int(self.count.sum())

    def find(self, start: int, stop: int) -> list[tuple[int, NDArray[np.int64], NDArray[np.int64]]]:
        """Return for each piece its rows that lie in a range, and their places in the range."""
        ends = np.cumsum(self.count)
        some = slice(*np.searchsorted(ends, [start, stop - 1], "right") + (0, 1))
        low = np.maximum(ends[some] - self.count[some], start)
        high = np.minimum(ends[some], stop)
        length = high - low
        offset = np.arange(int(length.sum())) - np.repeat(np.cumsum(length) - length, length)
        skipped = low - (ends[some] - self.count[some])
        source = np.repeat(self.first[some] + skipped, length) + offset
        target = np.repeat(low - start, length) + offset
        tile = np.repeat(self.tile[some], length)
        return [(int(t), source[tile == t], target[tile == t]) for t in np.unique(tile)]


def assemble(
    store: CityStore, folders: Sequence[Path], catalogue: Catalogue, facts: Mapping[str, object]
) -> None:
    """
    Write the pieces of all tiles into a store.

    Parameters
    ----------
    store : CityStore
        Made anew.
    folders : sequence of Path
        As ``write_pieces`` wrote them.
    catalogue : Catalogue
    facts : mapping
        Global attributes.

    Raises
    ------
    InputError
        If there is no sample at all.
    """
    folders = [folder for folder in folders if folder.exists()]
    if not folders:
        msg = "nothing is left to sample: all surfaces face straight down; choose others with on="
        raise InputError(msg)
    each = [np.load(folder / "keys.npy") for folder in folders]
    tile = np.repeat(np.arange(len(each)), [len(keys) for keys in each])
    starts = [np.cumsum(keys[:, 3:], axis=0) - keys[:, 3:] for keys in each]
    keys, start = np.concatenate(each), np.concatenate(starts)
    order = np.lexsort((keys[:, 1], keys[:, 0]))
    keys, start, tile = keys[order], start[order], tile[order]
    rows = {
        "sample": _Rows(tile, start[:, 0], keys[:, 3]),
        "surface": _Rows(tile, start[:, 1], keys[:, 4]),
        "part": _sort_objects(each),
    }
    sizes = {axis: len(rows[axis]) for axis in _AXES}
    names = {
        name: tuple(dims) for name, dims in orjson.loads((folders[0] / _NAMES).read_bytes()).items()
    }
    template = {
        name: (dims, np.load(folders[0] / f"{name}.npy", mmap_mode="r")[_find_head(dims)])
        for name, dims in names.items()
    }
    objects, owner = np.unique(keys[:, [0, 2]], axis=0, return_inverse=True)
    template["part"] = (("part",), np.array([""]))
    template["surface_part"] = (("surface",), np.zeros(1, np.int32))
    store.create(template, sizes, dict.fromkeys(_AXES, CHUNK), facts)
    store.write_whole("part", _name_objects(catalogue, objects))
    store.write_whole("surface_part", np.repeat(owner.ravel(), keys[:, 4]).astype(np.int32))
    first_surface = np.cumsum(keys[:, 4]) - keys[:, 4]
    for name, dims in names.items():
        axis = next((dim for dim in dims if dim in _AXES), None)
        if axis is None:
            continue
        arrays = [np.load(folder / f"{name}.npy", mmap_mode="r") for folder in folders]
        at = dims.index(axis)
        for begin in range(0, sizes[axis], CHUNK):
            stop = min(begin + CHUNK, sizes[axis])
            values = _gather(arrays, rows[axis], at, begin, stop)
            if name == "surface_of_sample":
                owners = np.searchsorted(np.cumsum(keys[:, 3]), np.arange(begin, stop), "right")
                values = (values + first_surface[owners]).astype(np.int32)
            store.write_rows(name, values, at, slice(begin, stop))


def _find_head(dims: tuple[str, ...]) -> tuple[slice, ...]:
    """Return an index of the first row of an array."""
    return tuple(slice(0, 1) if dim in _AXES else slice(None) for dim in dims)


def _gather(arrays: Sequence[NDArray], rows: _Rows, axis: int, begin: int, stop: int) -> NDArray:
    """Gather a range of rows from pieces."""
    widest = max((array.dtype for array in arrays), key=lambda dtype: dtype.itemsize)
    shape = list(arrays[0].shape)
    shape[axis] = stop - begin
    values = np.zeros(shape, widest)
    lead: tuple[Any, ...] = (slice(None),) * axis
    for tile, source, target in rows.find(begin, stop):
        values[(*lead, target)] = arrays[tile][(*lead, source)]
    return values


def _sort_objects(each: Sequence[NDArray[np.int64]]) -> _Rows:
    """Return the rows of objects, which each piece holds in the order of files and objects."""
    labels = [np.unique(keys[:, [0, 2]], axis=0) for keys in each]
    label = np.concatenate(labels)
    order = np.lexsort((label[:, 1], label[:, 0]))
    tile = np.repeat(np.arange(len(each)), [len(one) for one in labels])[order]
    first = np.concatenate([np.arange(len(one)) for one in labels])[order]
    return _Rows(tile, first, np.ones(len(order), np.int64))


def _name_objects(catalogue: Catalogue, objects: NDArray[np.int64]) -> NDArray:
    """Return the name of each object, (file, object), with its layer if there are several files."""
    names: list[str] = []
    for number in np.unique(objects[:, 0]).tolist():
        file = catalogue.files[number]
        known = file.names_of_objects
        lead = f"{file.layer}/" if file.layer else ""
        names += [lead + known[thing] for thing in objects[objects[:, 0] == number, 1].tolist()]
    return np.array(names)
