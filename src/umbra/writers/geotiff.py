"""GeoTIFF: hours as a cloud-optimised raster in its place on the earth."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import UmbraError

__all__ = ["write_geotiff"]


def write_geotiff(
    path: str | os.PathLike[str],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    bands: Sequence[tuple[str, str, NDArray[np.float32]]],
    *,
    cell: tuple[float, float],
    crs: object = None,
    facts: dict[str, object] | None = None,
) -> None:
    """
    Write rasters as bands of one GeoTIFF, with overviews, in compressed tiles (COG).

    Parameters
    ----------
    path : path
    x : (cols,) float64
    y : (rows,) float64
        Cell centres, ascending [m]. The file's first row is the northernmost.
    bands : sequence of (name, unit, (rows, cols) float32)
        NaN is nodata.
    cell : (float, float)
        Width and height of a cell [m].
    crs : str, optional
        Without it the file has coordinates, but no system.
    facts : dict, optional
        Kept as tags.

    Raises
    ------
    OSError, UmbraError
        If the file cannot be written.
    """
    import rasterio  # noqa: PLC0415  (an extra)
    import rasterio.errors  # noqa: PLC0415
    from rasterio.io import MemoryFile  # noqa: PLC0415
    from rasterio.shutil import copy  # noqa: PLC0415

    from umbra.writers.vectors.places import find_crs  # noqa: PLC0415

    system = find_crs(crs)
    dx, dy = cell
    profile = {
        "driver": "GTiff",
        "width": len(x),
        "height": len(y),
        "count": len(bands),
        "dtype": "float32",
        "nodata": float("nan"),
        "crs": None if system is None else rasterio.crs.CRS.from_wkt(system.to_wkt()),
        "transform": rasterio.transform.from_origin(x[0] - dx / 2, y[-1] + dy / 2, dx, dy),
    }
    try:
        with MemoryFile() as memory, MemoryFile() as packed:
            with memory.open(**profile) as raster:
                for k, (name, unit, values) in enumerate(bands, 1):
                    raster.write(np.ascontiguousarray(values[::-1], np.float32), k)
                    raster.set_band_description(k, name)
                    raster.set_band_unit(k, unit)
                raster.update_tags(**{name: str(v) for name, v in (facts or {}).items()})
            copy(
                memory.name, packed.name, driver="COG", compress="DEFLATE", predictor="YES",
                overview_resampling="AVERAGE", blocksize=256,
            )  # fmt: skip
            # GDAL says nothing of a disk that is full; Python does.
            Path(path).write_bytes(packed.getbuffer())
    except (rasterio.errors.RasterioError, rasterio.errors.RasterioIOError) as error:
        msg = f"could not write '{os.fspath(path)}' ({error}); free some space or choose another"
        raise UmbraError(msg, path=path) from error
