"""Surfaces as GeoParquet: a row for each, with its triangles in their place on the earth."""

import os
from collections.abc import Callable, Iterable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.study import Study
from umbra.writers.vectors.gis_files import find_crs

__all__ = [
    "ROWS", "find_surface_columns", "find_surface_figures", "list_figures", "pack_triangles",
    "write_surface_table",
]  # fmt: skip

ROWS = 50_000
"""Rows of a row group, which is held in memory."""
_POLYGON, _MULTIPOLYGON = 1003, 1006  # with z, in ISO's well-known binary
_TRIANGLE = np.dtype(
    [("order", "u1"), ("type", "<u4"), ("rings", "<u4"), ("count", "<u4"), ("ring", "<f8", (4, 3))]
)


def write_surface_table(
    path: str | os.PathLike[str],
    groups: Iterable[tuple[Mapping[str, Any], list[bytes]]],
    crs: object = None,
    facts: Mapping[str, object] | None = None,
) -> None:
    """
    Write rows of surfaces, a group at a time.

    Parameters
    ----------
    path : path
    groups : iterable of (mapping, list of bytes)
        Columns of some surfaces, the same of each group, and geometries in well-known binary.
    crs : str, optional
        Coordinate reference system of the geometries.
    facts : mapping, optional
        Kept as metadata of the file.
    """
    import pyarrow as pa  # noqa: PLC0415  (an extra)
    import pyarrow.parquet as pq  # noqa: PLC0415

    system = find_crs(crs)
    column = {
        "encoding": "WKB",
        "geometry_types": ["MultiPolygon Z"],
        "crs": None if system is None else system.to_json_dict(),
    }
    geo = {"version": "1.1.0", "primary_column": "geometry", "columns": {"geometry": column}}
    metadata = {"geo": orjson.dumps(geo), "umbra": orjson.dumps(dict(facts or {}), default=str)}
    writer = None
    try:
        for columns, geometries in groups:
            arrays = {name: pa.array(values) for name, values in columns.items()}
            table = pa.table({**arrays, "geometry": pa.array(geometries, pa.binary())})
            if writer is None:
                schema = table.schema.with_metadata(metadata)
                writer = pq.ParquetWriter(os.fspath(path), schema, compression="zstd")
            writer.write_table(table.cast(schema), row_group_size=ROWS)
    finally:
        if writer is not None:
            writer.close()


def find_surface_columns(study: Study) -> Iterable[tuple[dict[str, Any], list[bytes]]]:
    """
    Yield the rows of a study of surfaces, some at a time.

    Each has the part, kind, azimuth and tilt [degrees], area [m2] and hours in the sun [h]: mean,
    least and most of its samples; if results by date are kept, also the mean of each month.

    Parameters
    ----------
    study : Study
    """
    samples = study.samples
    names = np.asarray(study.more["part"][1])[study.more["surface_part"][1]]
    kinds = np.asarray(study.more["surface_kind"][1])
    columns = {"part": names.astype(object), "kind": kinds.astype(object)}
    columns |= find_surface_figures(study)
    corners = samples.corners + study.model.scene.origin
    starts = np.searchsorted(samples.owner, np.arange(len(samples.part) + 1))
    for first in range(0, len(samples.part), ROWS):
        span = slice(first, first + ROWS)
        edges = starts[first : first + ROWS + 1]
        packed = pack_triangles(corners[edges[0] : edges[-1]], edges - edges[0])
        yield {name: values[span] for name, values in columns.items()}, packed


def find_surface_figures(study: Study) -> dict[str, NDArray]:
    """Return the figures of each surface of a study, as ``list_figures`` does."""
    more = study.more
    by_day = "surface_mean_sun_hours_by_day" in more
    days = np.array(study.period.days if by_day else (), "datetime64[D]")
    return list_figures(lambda name: np.asarray(more[name][1]), days, study.facts)


def list_figures(
    get: Callable[[str], NDArray], days: NDArray[np.datetime64], facts: Mapping[str, object]
) -> dict[str, NDArray]:
    """
    Return the figures of some surfaces: azimuth, tilt, area and hours in the sun.

    Hours of several dates are sums, and named so: ``mean_sun_hours_sum``.

    Parameters
    ----------
    get : callable
        Returns a variable of these surfaces by its name, such as ``surface_tilt``.
    days : (k,) datetime64
        Dates by which results are kept, if they are: means of each month are added.
    facts : mapping
        Of the study; ``days`` is the number of its dates, if it has several.
    """
    columns = {name: get(f"surface_{name}") for name in ("azimuth", "tilt", "area")}
    ending = "_sum" if facts.get("days", 1) != 1 else ""
    for name in ("mean", "least", "most"):
        columns[f"{name}_sun_hours{ending}"] = get(f"surface_{name}_sun_hours")
    months = days.astype("datetime64[M]")
    if len(months):
        by_day = get("surface_mean_sun_hours_by_day")
        for month in np.unique(months):
            added = by_day[months == month].sum(0, dtype=np.float64)
            columns[f"mean_sun_hours_{month}"] = added.astype("f4")
    return columns


def pack_triangles(corners: NDArray[np.float64], starts: NDArray[np.integer]) -> list[bytes]:
    """
    Pack triangles into multipolygons in well-known binary.

    Parameters
    ----------
    corners : (n, 3, 3) float64
    starts : (m + 1,) int
        First triangle of each multipolygon, and the end.
    """
    records = np.zeros(len(corners), _TRIANGLE)
    records["order"], records["type"], records["rings"], records["count"] = 1, _POLYGON, 1, 4
    records["ring"] = corners[:, [0, 1, 2, 0]]
    data, size = records.tobytes(), _TRIANGLE.itemsize
    head = b"\x01" + _MULTIPOLYGON.to_bytes(4, "little")
    ends = starts.tolist()
    return [
        head + (end - first).to_bytes(4, "little") + data[first * size : end * size]
        for first, end in pairwise(ends)
    ]
