"""Write a study as NetCDF-4 by the CF conventions."""

import os
import warnings
from collections.abc import Mapping
from typing import Any

import h5netcdf
import numpy as np
from numpy.typing import NDArray

from umbra.errors import UmbraError

__all__ = ["Variables", "write_netcdf"]

Variables = Mapping[str, tuple[tuple[str, ...], NDArray]]
"""Arrays by name, each with the names of its dimensions. One that bears a dimension's
name is that dimension's coordinate."""

CF_ATTRIBUTES: dict[str, dict[str, str]] = {
    "x": {"long_name": "x of cell centres", "units": "m", "axis": "X"},
    "y": {"long_name": "y of cell centres", "units": "m", "axis": "Y"},
    "time": {"long_name": "sample instant, UTC", "standard_name": "time", "axis": "T"},
    "shadow_hours": {"long_name": "hours in shadow", "units": "h"},
    "sun_hours": {"long_name": "hours in sun", "units": "h"},
    "receiver_z": {"long_name": "z of the receiver", "units": "m"},
    "sun_altitude": {
        "long_name": "altitude of the sun",
        "standard_name": "solar_elevation_angle",
        "units": "degree",
    },
    "sun_azimuth": {
        "long_name": "azimuth of the sun, clockwise from true north",
        "standard_name": "solar_azimuth_angle",
        "units": "degree",
    },
    "sun_direction": {"long_name": "unit vector toward the sun in the model's axes", "units": "1"},
    "in_shadow": {"long_name": "whether the cell is in shadow", "units": "1"},
    "day": {"long_name": "local date"},
    "up_hours_by_day": {"long_name": "hours with the sun up on the day", "units": "h"},
    "first_sun": {"long_name": "when the first spell of sun begins, UTC", "standard_name": "time"},
    "last_sun": {"long_name": "when the last spell of sun ends, UTC", "standard_name": "time"},
    "sun_spells": {"long_name": "number of spells of sun", "units": "1"},
    "longest_sun_hours": {"long_name": "longest unbroken spell of sun", "units": "h"},
    "sun_hours_in_spells": {
        "long_name": "hours in spells of sun of at least min_spell_minutes",
        "units": "h",
    },
    "along": {"long_name": "distance along the view, to its right", "units": "m"},
    "z": {"long_name": "z of cell centres", "units": "m", "axis": "Z", "positive": "up"},
    "row": {"long_name": "row of the picture, upward", "units": "1"},
    "col": {"long_name": "column of the picture", "units": "1"},
    "position": {"long_name": "where the receiver lies, in the model's axes", "units": "m"},
    "normal": {"long_name": "unit normal of the receiver's side that is seen", "units": "1"},
    "part": {"long_name": "part: its name, or its index; -2: the ground, -1: nothing is seen"},
    "up": {"long_name": "distance upward in the view", "units": "m"},
    "name": {"long_name": "name of the point"},
    "area": {"long_name": "area that the sample stands for", "units": "m2"},
    "surface_of_sample": {"long_name": "index of the sample's surface"},
    "surface_part": {"long_name": "index of the surface's part"},
    "surface_kind": {"long_name": "kind of the surface"},
    "surface_area": {"long_name": "area of the surface", "units": "m2"},
    "surface_azimuth": {
        "long_name": "azimuth that the surface faces, clockwise from true north",
        "units": "degree",
    },
    "surface_tilt": {"long_name": "tilt of the surface, 0 level, 90 upright", "units": "degree"},
    "surface_mean_sun_hours": {"long_name": "hours in sun, mean of the surface", "units": "h"},
    "surface_least_sun_hours": {"long_name": "least hours in sun on the surface", "units": "h"},
    "surface_most_sun_hours": {"long_name": "most hours in sun on the surface", "units": "h"},
    "part_area": {"long_name": "area of the part's surfaces", "units": "m2"},
    "part_mean_sun_hours": {"long_name": "hours in sun, mean of the part", "units": "h"},
    "part_least_sun_hours": {"long_name": "least hours in sun on the part", "units": "h"},
    "part_most_sun_hours": {"long_name": "most hours in sun on the part", "units": "h"},
    "caster": {"long_name": "chosen casters"},
    "cast_hours": {"long_name": "hours in the shadow of the caster alone", "units": "h"},
    "sole_hours": {"long_name": "hours that would be sun without the caster", "units": "h"},
    "hours_lost": {"long_name": "hours of sun lost to the proposal", "units": "h"},
    "newly_under": {
        "long_name": "whether under_hours of sun were reached before and no longer are",
        "units": "1",
    },
    "neighbour": {"long_name": "parts that lose sun to the proposal, most first"},
    "neighbour_area": {"long_name": "area of the neighbour's receivers", "units": "m2"},
    "neighbour_area_touched": {"long_name": "area that loses sun", "units": "m2"},
    "neighbour_area_newly_under": {
        "long_name": "area newly under under_hours of sun",
        "units": "m2",
    },
    "neighbour_most_hours_lost": {"long_name": "most hours of sun lost anywhere", "units": "h"},
    "neighbour_mean_hours_lost": {"long_name": "hours of sun lost, mean of the area", "units": "h"},
    "shaded_share": {"long_name": "share of the time with the sun up in shadow", "units": "1"},
}
_BY_DAY = "_by_day"
GRID_MAPPING = "spatial_ref"
_MISSING = np.iinfo(np.int64).min  # NaT as a number


def write_netcdf(
    path: str | os.PathLike[str], variables: Variables, facts: Mapping[str, object]
) -> None:
    """
    Write arrays as NetCDF-4 (HDF5), compressed, with CF attributes by their names.

    It goes to the file without xarray, whose import costs more than most studies count.
    Where the fact ``crs`` names a coordinate reference system, a CF grid mapping goes in
    too, so that a GIS puts the raster in its place.

    Parameters
    ----------
    path : path
    variables : mapping of str to (dimensions, array)
        Numbers, ``datetime64`` in UTC, or str. What is no ``ndarray`` but has a shape and
        a dtype is written one item of its first dimension at a time.
    facts : mapping
        Global attributes; None is left out.

    Raises
    ------
    UmbraError
        If the file cannot be written.
    """
    known = {name: value for name, value in facts.items() if value is not None}
    grid_mapping = _find_grid_mapping(known.get("crs"))
    try:
        with h5netcdf.File(path, "w") as file:
            file.attrs.update({"Conventions": "CF-1.11", **known})
            file.dimensions = {
                name: size
                for dimensions, array in variables.values()
                for name, size in zip(dimensions, array.shape, strict=True)
            }
            for name, (dimensions, array) in variables.items():
                written = _write_variable(file, name, dimensions, array)
                if grid_mapping:
                    written.attrs.update(_find_map_attributes(name, dimensions))
            if grid_mapping:
                mapping = file.create_variable(GRID_MAPPING, (), np.int32, data=np.int32(0))
                mapping.attrs.update(grid_mapping)
    except OSError as error:
        msg = f"could not write '{os.fspath(path)}' ({error}); free some space or choose another"
        raise UmbraError(msg, path=path) from error


def _write_variable(
    file: h5netcdf.File, name: str, dimensions: tuple[str, ...], array: NDArray
) -> h5netcdf.Variable:
    """Store one array as suits its size and kind."""
    attributes = dict(CF_ATTRIBUTES.get(name, {}))
    if not attributes and name.endswith(_BY_DAY):
        attributes = dict(CF_ATTRIBUTES.get(name.removesuffix(_BY_DAY), {}))
        if attributes:
            attributes["long_name"] += ", on the day"
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
        # Level 1 is within a few percent of level 4's size at a fraction of its time.
        # Chunks of one raster let a viewer step through time without reading it all.
        how |= {
            "compression": "gzip",
            "compression_opts": 1,
            "shuffle": array.dtype.itemsize > 1,
            "chunks": (1,) * (array.ndim - 2) + array.shape[-2:],
        }
    if isinstance(array, np.ndarray):
        written = file.create_variable(name, dimensions, array.dtype, data=array, **how)
    else:  # packed: one instant at a time is unpacked
        written = file.create_variable(name, dimensions, array.dtype, **how)
        for i, slab in enumerate(array):
            written[i] = slab
    written.attrs.update(attributes)
    return written


def _encode_instants(instants: NDArray[np.datetime64]) -> tuple[NDArray[np.int64], str]:
    """Give CF numbers of instants and their unit: seconds, or what they need."""
    units = {"s": "seconds", "ms": "milliseconds", "us": "microseconds"}
    known = instants[~np.isnat(instants)]
    exact = (unit for unit in units if (known.astype(f"datetime64[{unit}]") == known).all())
    unit = next(exact, "us")
    numbers = instants.astype(f"datetime64[{unit}]").astype(np.int64)  # NaT is _MISSING
    return numbers, f"{units[unit]} since 1970-01-01 00:00:00"


def _find_map_attributes(name: str, dimensions: tuple[str, ...]) -> dict[str, str]:
    """Say where on the earth a raster or its axis lies."""
    if name in ("x", "y"):
        return {"standard_name": f"projection_{name}_coordinate"}
    if not {"x", "y"} <= set(dimensions):
        return {}
    # As a coordinate, too: so xarray keeps it beside a raster that is picked alone.
    return {"grid_mapping": GRID_MAPPING, "coordinates": GRID_MAPPING}


def _find_grid_mapping(crs: object) -> dict[str, Any]:
    """Give CF's attributes of a coordinate reference system; none if it is not known."""
    if not crs:
        return {}
    from pyproj import CRS  # noqa: PLC0415  (a tenth of a second, and most models have no CRS)
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    with warnings.catch_warnings():
        # Of the CRSs that CF's own parameters cannot say in full, crs_wkt still says all.
        warnings.simplefilter("ignore", UserWarning)
        try:
            return CRS.from_user_input(crs).to_cf()
        except CRSError:
            return {}
