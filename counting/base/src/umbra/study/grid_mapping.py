"""CF grid mapping of rasters, by which a GIS places them on the earth."""

import warnings
from typing import Any

__all__ = ["GRID_MAPPING", "find_grid_mapping", "find_map_attributes"]

GRID_MAPPING = "spatial_ref"
"""Name of the variable that holds it."""


def find_map_attributes(name: str, dimensions: tuple[str, ...]) -> dict[str, str]:
    """Return the grid-mapping attributes of a raster or its axis; none of other variables."""
    if name in ("x", "y"):
        return {"standard_name": f"projection_{name}_coordinate"}
    if not {"x", "y"} <= set(dimensions):
        return {}
    # As a coordinate, too: so xarray keeps it beside a raster that is picked alone.
    return {"grid_mapping": GRID_MAPPING, "coordinates": GRID_MAPPING}


def find_grid_mapping(crs: object) -> dict[str, Any]:
    """Return CF's attributes of a coordinate reference system; none if it is not known."""
    if not crs:
        return {}
    from pyproj import CRS  # noqa: PLC0415  (a tenth of a second, and most models have no CRS)
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    with warnings.catch_warnings():
        # crs_wkt also covers CRSs that CF's own parameters cannot express.
        warnings.simplefilter("ignore", UserWarning)
        try:
            return CRS.from_user_input(crs).to_cf()
        except CRSError:
            return {}
