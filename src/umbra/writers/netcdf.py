"""Write a study as NetCDF-4 by the CF conventions."""

import io
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import h5netcdf
import numpy as np
from numpy.typing import NDArray

from umbra.errors import UmbraError
from umbra.receivers.on_demand import OnDemand
from umbra.study.attributes import find_attributes
from umbra.study.grid_mapping import GRID_MAPPING, find_grid_mapping, find_map_attributes
from umbra.study.measures import Quantity

__all__ = ["DeferredFile", "Variables", "write_netcdf"]


class DeferredFile(io.FileIO):
    """
    A new file that stores the first error of writing instead of raising it.

    After an error nothing more is written, and unwritten bytes read as zeros; call `check` after
    each step.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__(os.fspath(path), "w+")
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the stored error, if any."""
        if self._error is not None:
            raise self._error

    def write(self, data: object) -> int:
        """Write all of the data, or pretend to after an error."""
        view = memoryview(data).cast("B")  # type: ignore[arg-type]
        done = 0
        while self._error is None and done < len(view):
            try:
                done += super().write(view[done:]) or 0
            except OSError as error:
                self._error = error
        if done < len(view):
            self.seek(len(view) - done, os.SEEK_CUR)
        return len(view)

    def readinto(self, buffer: object) -> int:
        """Read; zeros beyond the end."""
        view = memoryview(buffer).cast("B")  # type: ignore[arg-type]
        done = super().readinto(view) or 0
        if self._error is not None and done < len(view):
            view[done:] = bytes(len(view) - done)
            done = len(view)
        return done

    def truncate(self, size: int | None = None) -> int:
        """Cut or lengthen the file."""
        try:
            return super().truncate(size)
        except OSError as error:
            self._error = self._error or error
            return self.tell() if size is None else size


Variables = Mapping[str, tuple[tuple[str, ...], NDArray]]
"""Arrays by name, each with the names of its dimensions. An array named like a dimension is
its coordinate."""

_CHUNK = 1024  # most rows and columns of a chunk
_AT_ONCE = 4 * _CHUNK**2  # values written at a time
_MISSING = np.iinfo(np.int64).min  # NaT as a number


def write_netcdf(
    path: str | os.PathLike[str],
    variables: Variables,
    facts: Mapping[str, object],
    quantities: Sequence[Quantity] = (),
) -> None:
    """
    Write arrays as NetCDF-4 (HDF5), compressed, with CF attributes by their names.

    Written without xarray, whose import takes longer than most studies. If the fact ``crs`` names
    a coordinate reference system, a CF grid mapping is added, so that a GIS can georeference the
    raster.

    Variables are (dimensions, array) by name: numbers, ``datetime64`` in UTC, or str. A value that
    is no ``ndarray`` but has a shape and a dtype is written one item of its first dimension at a
    time. Facts become global attributes, those that are None are left out. ``quantities`` are the
    variables of the study's measures, with their words. An `UmbraError` says
    that the file cannot be written.
    """
    known = {name: value for name, value in facts.items() if value is not None}
    grid_mapping = find_grid_mapping(known.get("crs"))
    dates = int(str(known.get("days", 1)))
    try:
        with DeferredFile(path) as target, h5netcdf.File(target, "w") as file:
            file.attrs.update({"Conventions": "CF-1.11", **known})
            file.dimensions = {
                name: size
                for dimensions, array in variables.values()
                for name, size in zip(dimensions, array.shape, strict=True)
            }
            for name, (dimensions, array) in variables.items():
                attributes = find_attributes(name, dates, quantities)
                written = _write_variable(file, target, name, dimensions, array, attributes)
                if grid_mapping:
                    written.attrs.update(find_map_attributes(name, dimensions))
            if grid_mapping:
                mapping = file.create_variable(GRID_MAPPING, (), np.int32, data=np.int32(0))
                mapping.attrs.update(grid_mapping)
            file.flush()
            target.check()
        target.check()
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        name = os.path.basename(os.fspath(path))  # noqa: PTH119 - its folder may be temporary
        msg = f"could not write '{name}' ({reason}); free some space or choose another folder"
        raise UmbraError(msg, path=path) from error


def _write_variable(
    file: h5netcdf.File,
    target: DeferredFile,
    name: str,
    dimensions: tuple[str, ...],
    array: NDArray,
    attributes: dict[str, str],
) -> h5netcdf.Variable:
    """Store one array with its attributes and suitable compression."""
    if isinstance(array, OnDemand):
        array = np.asarray(array)
    how: dict[str, Any] = {}
    if array.dtype.kind == "M":
        array, units = _encode_instants(array)
        attributes |= {"units": units, "calendar": "proleptic_gregorian"}
        if name not in dimensions:
            how["fillvalue"] = np.int64(_MISSING)
    elif array.dtype.kind == "U":
        array = array.astype(h5netcdf.core.h5py.string_dtype())
    elif array.dtype.kind == "f" and name not in dimensions:
        how["fillvalue"] = array.dtype.type(np.nan)  # coordinates have no missing values
    if array.ndim >= 2 and array.size > 1024:
        # Level 1 is within a few percent of level 4's size at a fraction of its time. Chunks of
        # one raster let a viewer step through time without reading it all; they are bounded, as
        # the library holds each three times while it packs it.
        how |= {
            "compression": "gzip",
            "compression_opts": 1,
            "shuffle": array.dtype.itemsize > 1,
            "chunks": (1,) * (array.ndim - 2) + tuple(min(n, _CHUNK) for n in array.shape[-2:]),
        }
    if isinstance(array, np.ndarray) and array.size <= _AT_ONCE:
        written = file.create_variable(name, dimensions, array.dtype, data=array, **how)
    else:
        written = file.create_variable(name, dimensions, array.dtype, **how)
        for where, values in _cut(array):
            written[where] = values
            target.check()
    written.attrs.update(attributes)
    target.check()
    return written


def _cut(array: NDArray) -> Iterator[tuple[Any, NDArray]]:
    """Cut an array, which may be packed, into bands of chunks: index and values of each."""
    if array.ndim == 1:
        yield ..., np.asarray(array)
        return
    for index in np.ndindex(array.shape[:-2]):
        raster = array[index[0] if len(index) == 1 else index] if index else array
        for first in range(0, array.shape[-2], _CHUNK):
            rows = slice(first, first + _CHUNK)
            yield (*index, rows), raster[rows]


def _encode_instants(instants: NDArray[np.datetime64]) -> tuple[NDArray[np.int64], str]:
    """Return CF numbers of instants and their unit: seconds, or finer if they need it."""
    units = {"s": "seconds", "ms": "milliseconds", "us": "microseconds"}
    known = instants[~np.isnat(instants)]
    exact = (unit for unit in units if (known.astype(f"datetime64[{unit}]") == known).all())
    unit = next(exact, "us")
    numbers = instants.astype(f"datetime64[{unit}]").astype(np.int64)  # NaT is _MISSING
    return numbers, f"{units[unit]} since 1970-01-01 00:00:00"
