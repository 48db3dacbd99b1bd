"""Files for GIS, in their place on the earth: GeoJSON, GeoPackage, GeoTIFF."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import UmbraError
from umbra.readers.model import UniqueNames
from umbra.writers.vectors import Layer

if TYPE_CHECKING:
    from pyproj import CRS

__all__ = [
    "find_crs",
    "make_to_wgs84",
    "name_gis_crs",
    "write_geojson",
    "write_geopackage",
    "write_geotiff",
]


def find_crs(crs: object) -> "CRS | None":
    """
    Return the horizontal coordinate reference system that a study's fact ``crs`` names.

    A compound one loses its heights. None where there is none, or none that is known.
    """
    if not crs:
        return None
    from pyproj import CRS  # noqa: PLC0415  (a tenth of a second)
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    try:
        return CRS.from_user_input(crs).to_2d()
    except CRSError:
        return None


def name_gis_crs(crs: "CRS | None") -> str:
    """Name a coordinate reference system: ``EPSG:31256 (MGI / Austria GK East)``."""
    if crs is None:
        return "the model's own coordinates in metres; no CRS is known"
    code = crs.to_epsg(min_confidence=70)
    return f"EPSG:{code} ({crs.name})" if code else crs.name


def make_to_wgs84(crs: "CRS") -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Return the function that turns (n, 2) coordinates into longitude and latitude on WGS 84."""
    from pyproj import Transformer  # noqa: PLC0415

    transformer = Transformer.from_crs(crs, 4326, always_xy=True)

    def to_wgs84(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.column_stack(transformer.transform(points[:, 0], points[:, 1]))

    return to_wgs84


_DEGREES, _METRES = 9, 6  # decimals: a tenth of a millimetre, and a thousandth


def write_geojson(
    path: str | os.PathLike[str], layer: Layer, crs: object = None, note: str = ""
) -> None:
    """
    Write a layer as a FeatureCollection.

    Without a CRS coordinates stay as they are, and the member ``coordinates_note`` says so, with
    ``note`` if it is given: the file is then no map, but programs can still place it.
    """
    import shapely  # noqa: PLC0415  (an extra)
    from shapely.geometry import mapping  # noqa: PLC0415

    system = find_crs(crs)
    to_wgs84 = None if system is None else make_to_wgs84(system)

    def place(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return (
            np.round(points, _METRES) if to_wgs84 is None else np.round(to_wgs84(points), _DEGREES)
        )

    collection: dict[str, Any] = {"type": "FeatureCollection", "name": layer.name}
    collection["coordinates_note"] = (
        f"longitude, latitude on WGS 84, reprojected from {name_gis_crs(system)}"
        if system is not None
        else f"{note or name_gis_crs(system)}: not longitude and latitude"
    )
    collection["features"] = [
        {
            "type": "Feature",
            "properties": {name: values[k] for name, values in layer.values.items()},
            "geometry": mapping(shapely.transform(geometry, place)),
        }
        for k, geometry in enumerate(layer.geometries)
    ]
    Path(path).write_bytes(orjson.dumps(collection, option=orjson.OPT_SERIALIZE_NUMPY) + b"\n")


_NO_CRS = (
    'ENGCRS["undefined Cartesian",EDATUM["none"],CS[Cartesian,2],AXIS["x",east],'
    'AXIS["y",north],LENGTHUNIT["metre",1]]'
)


_RESERVED = ("fid", "geom")
"""Columns that every table of a GeoPackage has."""


def write_geopackage(
    path: str | os.PathLike[str], layers: Sequence[Layer], crs: object = None
) -> None:
    """
    Write layers as tables of a GeoPackage, which is replaced if it exists.

    Without a CRS coordinates are Cartesian in metres, as the file then says. An `UmbraError` says
    that the file cannot be written.
    """
    import pyogrio.errors  # noqa: PLC0415  (an extra)
    import pyogrio.raw  # noqa: PLC0415
    import shapely  # noqa: PLC0415

    system = find_crs(crs)
    try:
        for layer in layers:
            names = UniqueNames(_RESERVED, ignores_case=True)
            pyogrio.raw.write(
                os.fspath(path),
                shapely.to_wkb(np.array(layer.geometries, object)),
                [np.array(values) if not _is_text(values) else np.array(values, object)
                 for values in layer.values.values()],
                [names.add(name) for name in layer.values],
                layer=layer.name,
                driver="GPKG",
                geometry_type=layer.kind,
                crs=system.to_wkt() if system is not None else _NO_CRS,
                append=layer is not layers[0],
            )  # fmt: skip
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError) as error:
        msg = f"could not write '{os.fspath(path)}' ({error}); free some space or choose another"
        raise UmbraError(msg, path=path) from error


def _is_text(values: list) -> bool:
    return bool(values) and isinstance(values[0], str)


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

    x (cols,) and y (rows,) are cell centres, ascending [m]; the file's first row is the
    northernmost. Bands are (name, unit, (rows, cols) float32), NaN is nodata; ``cell`` is the
    width and height of a cell [m]. Without a CRS the file has coordinates, but no system. Facts
    are kept as tags. Raises UmbraError if the file cannot be written.
    """
    import rasterio  # noqa: PLC0415  (an extra)
    import rasterio.errors  # noqa: PLC0415
    from rasterio.io import MemoryFile  # noqa: PLC0415
    from rasterio.shutil import copy  # noqa: PLC0415

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
