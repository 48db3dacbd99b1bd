"""The files of surfaces and points that can be asked for, by name."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from umbra.study import PointStudy, split_dates, tell_dates
from umbra.writers.tables import find_columns

__all__ = ["OF_POINTS", "OF_SURFACES", "make_point_layer", "write_point_formats"]

OF_SURFACES = ("csv", "glb")
OF_POINTS = ("csv", "geojson", "gpkg")


def write_point_formats(folder: Path, study: PointStudy, names: Sequence[str]) -> list[str]:
    """
    Write some of the formats.

    Parameters
    ----------
    folder : Path
    study : PointStudy
    names : sequence of str
        Of ``OF_SURFACES`` or ``OF_POINTS``, whichever the study is of.

    Returns
    -------
    files : list of str
    """
    files: list[str] = []
    crs = study.facts.get("crs")
    for name in names:
        if name == "csv":
            from umbra.writers.tables import write_samples  # noqa: PLC0415

            files += write_samples(folder, study)
        elif name == "glb":
            from umbra.writers.surfaces_glb import write_surfaces_glb  # noqa: PLC0415

            dates = split_dates(study)
            most = max(one.up_hours for one in dates)
            for one in dates:
                file = f"hours_{tell_dates(one)}.glb" if len(dates) > 1 else "hours.glb"
                write_surfaces_glb(folder / file, one, most)
                files.append(file)
        elif name == "geojson":
            from umbra.writers.vectors.gis_files import write_geojson  # noqa: PLC0415

            write_geojson(folder / "points.geojson", make_point_layer(study), crs)
            files.append("points.geojson")
        elif name == "gpkg":
            from umbra.writers.vectors.gis_files import write_geopackage  # noqa: PLC0415

            write_geopackage(folder / "study.gpkg", [make_point_layer(study)], crs)
            files.append("study.gpkg")
    return files


def make_point_layer(study: PointStudy) -> Any:
    """
    Make a layer of points, each with its results; instants are UTC as text.

    Parameters
    ----------
    study : PointStudy

    Returns
    -------
    layer : Layer
    """
    import shapely  # noqa: PLC0415  (an extra)

    from umbra.writers.vectors.layers import Layer  # noqa: PLC0415

    values: dict[str, list] = {}
    for name, found in find_columns(study, ("sample",)).items():
        if found.dtype.kind == "M":
            texts = np.datetime_as_string(found.astype("datetime64[s]"), timezone="UTC")
            values[name] = ["" if text == "NaT" else str(text) for text in texts]
        elif found.dtype.kind == "f":
            values[name] = np.round(found.astype(np.float64), 4).tolist()
        else:
            values[name] = found.tolist()
    if "name" in values:
        values = {"name": values.pop("name"), **values}
    geometries = shapely.points(study.places.points[:, :2]).tolist()
    return Layer("points", "Point", geometries, values)
