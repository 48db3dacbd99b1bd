"""GeoPackage: all layers in one file, in the model's own CRS."""

import os
from collections.abc import Sequence

import numpy as np

from umbra.errors import UmbraError
from umbra.writers.vectors.places import find_crs
from umbra.writers.vectors.shapes import Layer

__all__ = ["write_geopackage"]

_NO_CRS = (
    'ENGCRS["undefined Cartesian",EDATUM["none"],CS[Cartesian,2],AXIS["x",east],'
    'AXIS["y",north],LENGTHUNIT["metre",1]]'
)


def write_geopackage(
    path: str | os.PathLike[str], layers: Sequence[Layer], crs: object = None
) -> None:
    """
    Write layers as tables of a GeoPackage.

    Parameters
    ----------
    path : path
        Replaced if it exists.
    layers : sequence of Layer
        In the model's own coordinates [m].
    crs : str, optional
        Theirs; without it they are Cartesian in metres, as the file then says.

    Raises
    ------
    OSError, UmbraError
        If the file cannot be written.
    """
    import pyogrio.errors  # noqa: PLC0415  (an extra)
    import pyogrio.raw  # noqa: PLC0415
    import shapely  # noqa: PLC0415

    system = find_crs(crs)
    try:
        for layer in layers:
            pyogrio.raw.write(
                os.fspath(path),
                shapely.to_wkb(np.array(layer.geometries, object)),
                [np.array(values) if not _is_text(values) else np.array(values, object)
                 for values in layer.values.values()],
                list(layer.values),
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
