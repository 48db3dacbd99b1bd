"""Write a study as NetCDF-4 by the CF conventions."""

import os
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from umbra.errors import UmbraError

if TYPE_CHECKING:
    import xarray

__all__ = ["write_netcdf"]

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
}
GRID_MAPPING = "spatial_ref"


def write_netcdf(path: str | os.PathLike[str], dataset: "xarray.Dataset") -> None:
    """
    Write a dataset as NetCDF-4 (HDF5), compressed, with CF attributes.

    Attributes that the dataset has are kept; missing ones are filled in by the
    variable's name. Where the global attribute ``crs`` names a coordinate reference
    system, a CF grid mapping goes in too, so that a GIS puts the raster in its place.

    Parameters
    ----------
    path : path
    dataset : xarray.Dataset
        As ``umbra.shadow_study`` gives it; not changed.

    Raises
    ------
    UmbraError
        If the file cannot be written.
    """
    dataset = _with_cf_attributes(dataset)
    try:
        dataset.to_netcdf(path, engine="h5netcdf", encoding=_find_encoding(dataset))
    except OSError as error:
        msg = f"could not write '{os.fspath(path)}' ({error}); free some space or choose another"
        raise UmbraError(msg, path=path) from error


def _with_cf_attributes(dataset: "xarray.Dataset") -> "xarray.Dataset":
    """Copy a dataset (its arrays are shared) and fill in what CF asks for."""
    dataset = dataset.copy(deep=False)
    for name, variable in dataset.variables.items():
        variable.attrs = {**CF_ATTRIBUTES.get(str(name), {}), **variable.attrs}
        if variable.attrs.get("units") in {"hour", "hours"}:
            variable.attrs["units"] = "h"  # xarray reads "hours" back as timedelta64
    # NetCDF has no None; a fact that is not known is left out.
    known = {name: value for name, value in dataset.attrs.items() if value is not None}
    dataset.attrs = {"Conventions": "CF-1.11", **known}

    grid_mapping = _find_grid_mapping(known.get("crs"))
    if grid_mapping and {"x", "y"} <= set(dataset.dims):
        for axis in "xy":
            dataset[axis].attrs.setdefault("standard_name", f"projection_{axis}_coordinate")
        for raster in dataset.data_vars.values():
            if {"x", "y"} <= set(raster.dims):
                raster.attrs.setdefault("grid_mapping", GRID_MAPPING)
        dataset = dataset.assign_coords({GRID_MAPPING: np.int32(0)})
        dataset[GRID_MAPPING].attrs = grid_mapping
    return dataset


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


def _find_encoding(dataset: "xarray.Dataset") -> dict[str, dict[str, Any]]:
    """Choose how each variable is stored."""
    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        if name in dataset.coords:
            # CF allows no missing values in coordinates.
            encoding[str(name)] = {"_FillValue": None}
        elif variable.ndim >= 2 and variable.size > 1024:
            # Level 1 is within a few percent of level 4's size at a fraction of its time.
            # Chunks of one raster let a viewer step through time without reading it all.
            encoding[str(name)] = {
                "zlib": True,
                "complevel": 1,
                "shuffle": variable.dtype.itemsize > 1,
                "chunksizes": (1,) * (variable.ndim - 2) + variable.shape[-2:],
            }
    return encoding
