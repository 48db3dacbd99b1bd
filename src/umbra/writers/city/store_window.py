"""The store of a study in tiles, read a window at a time."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.tiles.store import FORMAT

__all__ = [
    "CityResult",
    "Months",
    "StoredTile",
    "is_of_plan",
    "list_neighbours",
    "make_damage",
    "open_store",
    "read_months",
    "read_stored_array",
]  # fmt: skip

_STORE, _MARKS = "study.zarr", "tiles"
_CELLS = ("y", "x")
_PLACE = {"receiver_z", "area"}
_BROKEN = (ValueError, TypeError, LookupError, RuntimeError, OSError)
"""What Zarr and its codecs raise of damaged files."""


@dataclass(frozen=True)
class StoredTile:
    """
    A tile of the store.

    Parameters
    ----------
    number : int
    rows, cols : slice
    """

    number: int
    rows: slice
    cols: slice

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"tile_{self.number:06}"


def open_store(folder: Path) -> Any:
    """
    Open the store of a study in tiles, to be read.

    Raises
    ------
    InputError
        If the folder holds none, or it is damaged.
    """
    import zarr  # noqa: PLC0415  (an extra)
    import zarr.errors  # noqa: PLC0415

    try:
        group: Any = zarr.open_group(str(folder / _STORE), mode="r", zarr_format=FORMAT)
        name_counted(group)
    except (zarr.errors.GroupNotFoundError, FileNotFoundError, KeyError) as error:
        msg = (
            f"'{folder}' holds no study in tiles (no {_STORE} of Zarr {FORMAT}, which of surfaces "
            "is made when all tiles are done); name the folder of one"
        )
        raise InputError(msg, path=folder) from error
    except (zarr.errors.BaseZarrError, *_BROKEN) as error:
        raise make_damage(folder / _STORE) from error
    return group


def name_counted(group: Any) -> str:
    """
    Return the name of a variable that has a value for each receiver: hours, or a measure.

    Raises
    ------
    KeyError
        If there is none.
    """
    for name, array in sorted(group.arrays(), key=lambda entry: entry[0] != "shadow_hours"):
        dims = array.metadata.dimension_names
        if dims in {_CELLS, ("sample",)} and array.dtype.kind == "f" and name not in _PLACE:
            return str(name)
    raise KeyError(_STORE)


def read_stored_array(group: Any, name: str, where: Any = ...) -> NDArray:
    """
    Read a part of a store's variable, all of it by default.

    Raises
    ------
    InputError
        If it is damaged.
    """
    try:
        return np.asarray(group[name][where])
    except _BROKEN as error:
        raise make_damage(Path(str(group.store.root)) / name) from error


class Months(NamedTuple):
    """Months of the year, the number of dates in each, and its hours a day with the sun up."""

    month: NDArray[np.int32]
    dates: NDArray[np.int32]
    up_hours: NDArray[np.float64]


def read_months(group: Any) -> Months | None:
    """Return the months of which a store keeps hours; None if it keeps none."""
    if "shadow_hours_by_month" not in group:
        return None
    names = ("month", "dates_by_month", "up_hours_by_month")
    return Months(*(read_stored_array(group, name) for name in names))


def make_damage(path: Path) -> InputError:
    """Return the error of a damaged file of a run."""
    msg = f"'{path}' is damaged; run the same study again: what is damaged is made anew"
    return InputError(msg, path=path)


def is_of_plan(folder: Path) -> bool:
    """Return whether a study in tiles is of a plan's cells."""
    group = open_store(folder)
    return len(group[name_counted(group)].shape) == len(_CELLS)


def list_neighbours(folder: Path) -> list[dict[str, Any]]:
    """Return a row for each neighbour that loses sun to a proposal, most first; none without."""
    group = open_store(folder)
    arrays = {
        name.removeprefix("neighbour_").replace("neighbour", "name"): read_stored_array(
            group, name
        ).tolist()
        for name, array in sorted(group.arrays())
        if name.startswith("neighbour") and len(array.shape) == 1
    }
    return [dict(zip(arrays, row, strict=True)) for row in zip(*arrays.values(), strict=True)]


class CityResult:
    """
    Results of a study in tiles, of a plan.

    Parameters
    ----------
    folder : Path
        With the store and the marks of the tiles that are done.

    Raises
    ------
    InputError
        If it holds no study in tiles.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._group: Any = open_store(folder)
        self.counted = name_counted(self._group)
        counted = self._group[self.counted]
        self._shape, self._sides = counted.shape, counted.chunks

    @cached_property
    def facts(self) -> dict[str, Any]:
        """Attributes of the study."""
        return dict(self._group.attrs)

    @cached_property
    def x(self) -> NDArray[np.float64]:
        """Centres of the columns, ascending [m]."""
        return read_stored_array(self._group, "x").astype(np.float64)

    @cached_property
    def y(self) -> NDArray[np.float64]:
        """Centres of the rows, ascending [m]."""
        return read_stored_array(self._group, "y").astype(np.float64)

    @cached_property
    def times(self) -> NDArray[np.datetime64]:
        """Instants in UTC."""
        return read_stored_array(self._group, "time").astype("datetime64[us]")

    @property
    def cell(self) -> tuple[float, float]:
        """Width and height of a cell [m]."""
        sides = (float(np.ptp(v)) / max(len(v) - 1, 1) for v in (self.x, self.y))
        wide, high = sides
        return wide or high or 1.0, high or wide or 1.0

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Outer edges: xmin, ymin, xmax, ymax [m]."""
        (dx, dy), x, y = self.cell, self.x, self.y
        ends = x[0] - dx / 2, y[0] - dy / 2, x[-1] + dx / 2, y[-1] + dy / 2
        return ends[0].item(), ends[1].item(), ends[2].item(), ends[3].item()

    @cached_property
    def tiles(self) -> list[StoredTile]:
        """All tiles, by rows from the south: the chunks of the arrays."""
        sides = self._sides
        counts = [math.ceil(n / side) for n, side in zip(self._shape, sides, strict=True)]

        def cut(k: int, axis: int) -> slice:
            return slice(k * sides[axis], min((k + 1) * sides[axis], self._shape[axis]))

        return [
            StoredTile(i * counts[1] + j, cut(i, 0), cut(j, 1))
            for i in range(counts[0])
            for j in range(counts[1])
        ]

    @cached_property
    def marks(self) -> dict[int, Path]:
        """Marks of the tiles that are done, by number."""
        paths = (self.folder / _MARKS).glob("[0-9]*.json")
        return {int(path.stem): path for path in paths}

    @property
    def missing(self) -> list[StoredTile]:
        """Tiles that are not done."""
        return [tile for tile in self.tiles if tile.number not in self.marks]

    @cached_property
    def bands(self) -> dict[str, str]:
        """Names and units of the numbers of each cell."""
        bands = {}
        for name, array in sorted(self._group.arrays()):
            units = str(array.attrs.get("units", "1"))
            is_time = " since " in units
            if array.metadata.dimension_names == _CELLS and not is_time and name != "receiver_z":
                bands[name] = units
        return bands

    @property
    def has_hours(self) -> bool:
        """Whether hours of sun were asked for."""
        return "shadow_hours" in self._group

    @cached_property
    def months(self) -> Months | None:
        """Months of which hours are kept; None if none are."""
        return read_months(self._group)

    @property
    def has_heights(self) -> bool:
        """Whether each cell has a height of its own."""
        return "receiver_z" in self._group

    def read(self, name: str, tile: StoredTile) -> NDArray:
        """Return a variable on a tile, (..., rows, cols)."""
        return read_stored_array(self._group, name, (..., tile.rows, tile.cols))

    def holds(self, name: str) -> bool:
        """Return whether there is such a variable."""
        return name in self._group

    def find_shape(self, name: str) -> tuple[int, ...]:
        """Return the shape of a variable."""
        return tuple(self._group[name].shape)

    def find_sides(self) -> Iterator[NDArray[np.float32]]:
        """Yield the hours in shadow along the four sides of the plan, one after the other."""
        for at in (0, self._shape[0] - 1):
            yield read_stored_array(self._group, "shadow_hours", (at, slice(None)))
        for at in (0, self._shape[1] - 1):
            yield read_stored_array(self._group, "shadow_hours", (slice(None), at))

    def find_done(self) -> Iterator[StoredTile]:
        """Yield the tiles that are done."""
        return (tile for tile in self.tiles if tile.number in self.marks)

    @cached_property
    def up_hours(self) -> float:
        """Time with the sun up in the whole period [h]; 0 if no tile tells."""
        if not self.has_hours:
            return 0.0
        for tile in self.find_done():
            hours = self.read("shadow_hours", tile) + self.read("sun_hours", tile)
            is_there = np.isfinite(hours)
            if is_there.any():
                return float(hours[is_there][0])
        return 0.0
