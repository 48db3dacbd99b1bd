"""
The surfaces that the tiles of a city found, on disk, in the order of files and parts.

The order, and so every byte, is the same for any tiles. A range of rows is read from the files of
those pieces that hold it.

Assembly of surfaces: the pieces of all tiles in one store, a chunk at a time.
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
from umbra.study.measures import Quantity
from umbra.tiles.city_catalogue import Catalogue
from umbra.tiles.store import CityStore
from umbra.tiles.surface_results import PartResults

__all__ = ["AXES", "GEOMETRY", "SurfacePieces", "assemble", "name_objects", "write_pieces"]

AXES = ("sample", "surface", "part", "triangle")
"""Dimensions along which results of several pieces are put together."""
GEOMETRY = (
    "triangle_corners", "surface_of_triangle", "surface_axes", "surface_start", "surface_cells",
)  # fmt: skip
"""Variables that only files of shapes need; they are not results."""
_NAMES = "variables.json"
_FROM_KEYS = {"part", "surface_part"}
_COUNTS = {"sample": 3, "surface": 4, "triangle": 5}  # columns of the keys
_INDICES = ("surface_of_sample", "surface_of_triangle")


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
        axis = next((k for k, dim in enumerate(dims) if dim in AXES), None)
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
        Piece, first row in it, and number of rows of each run, in the final order.
    """

    tile: NDArray[np.int64]
    first: NDArray[np.int64]
    count: NDArray[np.int64]

    def __len__(self) -> int:
        return int(self.count.sum())

    def find(self, start: int, stop: int) -> list[tuple[int, NDArray[np.int64], NDArray[np.int64]]]:
        """Return for each piece its rows that lie in a range, and their places in the range."""
        ends = np.cumsum(self.count)
        rows = slice(*np.searchsorted(ends, [start, stop - 1], "right") + (0, 1))
        low = np.maximum(ends[rows] - self.count[rows], start)
        high = np.minimum(ends[rows], stop)
        length = high - low
        offset = np.arange(int(length.sum())) - np.repeat(np.cumsum(length) - length, length)
        skipped = low - (ends[rows] - self.count[rows])
        source = np.repeat(self.first[rows] + skipped, length) + offset
        target = np.repeat(low - start, length) + offset
        tile = np.repeat(self.tile[rows], length)
        return [(int(t), source[tile == t], target[tile == t]) for t in np.unique(tile)]


class SurfacePieces:
    """
    The pieces of all tiles, read a range of rows at a time.

    Parameters
    ----------
    folders : sequence of Path
        As ``write_pieces`` wrote them; those of tiles without surfaces do not exist.

    Attributes
    ----------
    keys : (n, 6) int64
        Of each part, in order: number of its file, of the part in it and of its object, and its
        numbers of samples, surfaces and triangles.
    objects : (n_objects, 2) int64
        File and number in it of each object.
    owner : (n,) int64
        Object of each part, in ``objects``.
    names : dict
        Dimensions of each variable.
    sizes : dict of str to int
        Number of rows along each axis.

    Raises
    ------
    InputError
        If there is no sample at all.
    """

    def __init__(self, folders: Sequence[Path]) -> None:
        self._folders = [folder for folder in folders if folder.exists()]
        if not self._folders:
            msg = (
                "nothing is left to sample: all surfaces face straight down; choose others with on="
            )
            raise InputError(msg, option="on")
        keys_by_tile = [np.load(folder / "keys.npy") for folder in self._folders]
        tile = np.repeat(np.arange(len(keys_by_tile)), [len(keys) for keys in keys_by_tile])
        start = np.concatenate([np.cumsum(keys, axis=0) - keys for keys in keys_by_tile])
        keys = np.concatenate(keys_by_tile)
        order = np.lexsort((keys[:, 1], keys[:, 0]))
        self.keys, start, tile = keys[order], start[order], tile[order]
        self._rows = {
            axis: _Rows(tile, start[:, column], self.keys[:, column])
            for axis, column in _COUNTS.items()
        }
        self._rows["part"] = _sort_objects(keys_by_tile)
        self.sizes = {axis: len(rows) for axis, rows in self._rows.items()}
        self.objects, owner = np.unique(self.keys[:, [0, 2]], axis=0, return_inverse=True)
        self.owner = owner.ravel()
        known = orjson.loads((self._folders[0] / _NAMES).read_bytes())
        self.names: dict[str, tuple[str, ...]] = {n: tuple(dims) for n, dims in known.items()}

    def show(self, name: str) -> NDArray:
        """Return the first row of a variable, or all of it if it has no rows."""
        return np.array(self._open(0, name)[tuple(
            slice(0, 1) if dim in AXES else slice(None) for dim in self.names[name]
        )])  # fmt: skip

    def find_axis(self, name: str) -> int | None:
        """Return the axis of a variable's rows; None if it has none."""
        return next((k for k, dim in enumerate(self.names[name]) if dim in AXES), None)

    def read(self, name: str, begin: int, stop: int) -> NDArray:
        """Return a range of a variable's rows; indices count from the first of all."""
        at = self.find_axis(name)
        assert at is not None
        axis = self.names[name][at]
        lead: tuple[Any, ...] = (slice(None),) * at
        pieces = []
        # One file is open at a time: there may be more pieces than a process may open.
        for piece, source, target in self._rows[axis].find(begin, stop):
            pieces.append((self._open(piece, name)[(*lead, source)], target))
        widest = max((rows.dtype for rows, _ in pieces), key=lambda dtype: dtype.itemsize)
        shape = list(pieces[0][0].shape)
        shape[at] = stop - begin
        values = np.zeros(shape, widest)
        for rows, target in pieces:
            values[(*lead, target)] = rows
        if name in _INDICES:
            values = (values + self._find_first_surfaces(axis, begin, stop)).astype(np.int32)
        return values

    def _open(self, piece: int, name: str) -> NDArray:
        return np.load(self._folders[piece] / f"{name}.npy", mmap_mode="r")

    def _find_first_surfaces(self, axis: str, begin: int, stop: int) -> NDArray[np.int64]:
        """Return the first surface of the part of each row."""
        ends = np.cumsum(self.keys[:, _COUNTS[axis]])
        first = np.cumsum(self.keys[:, 4]) - self.keys[:, 4]
        return first[np.searchsorted(ends, np.arange(begin, stop), "right")]


def _sort_objects(piece_keys: Sequence[NDArray[np.int64]]) -> _Rows:
    """Return the rows of objects, which each piece holds in the order of files and objects."""
    labels = [np.unique(keys[:, [0, 2]], axis=0) for keys in piece_keys]
    label = np.concatenate(labels)
    order = np.lexsort((label[:, 1], label[:, 0]))
    tile = np.repeat(np.arange(len(piece_keys)), [len(objects) for objects in labels])[order]
    first = np.concatenate([np.arange(len(objects)) for objects in labels])[order]
    return _Rows(tile, first, np.ones(len(order), np.int64))


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
        names += [lead + known[index] for index in objects[objects[:, 0] == number, 1].tolist()]
    return np.array(names)
