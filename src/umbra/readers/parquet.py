"""GeoParquet footprints, with Overture's columns; of a region only the row groups that meet it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.checks import Budget, find_reason
from umbra.readers.content import FileContent
from umbra.readers.footprint_files import find_polygons
from umbra.readers.footprint_table import FootprintTable, parse_numbers
from umbra.readers.footprints import extrude_table, from_shapes
from umbra.readers.georeference import name_crs
from umbra.readers.model import FileModel, ReadChoices
from umbra.readers.region import Region

__all__ = ["read_parquet"]

STOREY = 3.0
"""Height of a floor [m] where Overture gives only their number."""
_ROW, _BYTES = 64, 4  # memory of a row [byte], and of a byte of a column's own encoding
_GEOMETRY = ("geometry", "geom", "wkb_geometry")
_SIDES = ("xmin", "ymin", "xmax", "ymax")
_ARROW = {"polygon": 3, "multipolygon": 6}  # shapely's numbers


def read_parquet(content: FileContent, path: Path, choices: ReadChoices) -> FileModel:
    """Read footprints of GeoParquet 1.0 and 1.1, in WKB or GeoArrow's polygons."""
    parquet = need("pyarrow.parquet", "city", "GeoParquet")
    shapely = need("shapely", "gis", "GeoParquet")
    arrow = need("pyarrow", "city", "GeoParquet")
    try:
        with parquet.ParquetFile(path) as file:
            return _read_table(file, shapely, content, choices)
    except (arrow.ArrowException, OSError, shapely.errors.GEOSException) as error:
        if isinstance(error, MemoryError):
            raise
        reason = find_reason(error, 160)
        msg = f"cannot be read as GeoParquet ({reason}); export it again"
        raise InputError(msg) from error


def _read_table(file: Any, shapely: Any, content: FileContent, choices: ReadChoices) -> FileModel:
    column, facts = _find_geometry(file)
    crs, notes = _find_crs(facts)
    fields = _find_fields(file, column)
    groups, rows = _find_rows(file, facts, choices.region, crs)
    _check_size(file, groups, fields, Budget(content.size))
    shapes: list[NDArray[Any]] = []
    columns: dict[str, list[Any]] = {}
    outside = file.metadata.num_rows
    for group, kept in zip(groups, rows, strict=True):
        table = file.read_row_group(group, columns=fields).flatten()
        table = table if kept is None else table.filter(_mask(kept))
        outside -= table.num_rows
        shapes.append(_decode(shapely, table.column(column), facts.get("encoding", "WKB")))
        for name in table.column_names:
            if name != column:
                columns.setdefault(name, []).extend(table.column(name).to_pylist())
    if not sum(map(len, shapes)):
        if outside:
            return FileModel("GeoParquet", (), crs, tuple(notes), outside=outside)
        msg = "has no rows; give a file of building footprints"
        raise InputError(msg)
    found = np.concatenate(shapes)
    there = ~(shapely.is_missing(found) | shapely.is_empty(found))
    if not there.all():
        notes.append(f"features without a geometry left out: {int((~there).sum())}")
    there, base = _use_overture(columns, there, notes, choices)
    polygons, row = find_polygons(shapely, found, there, notes)
    table = FootprintTable(
        "GeoParquet",
        from_shapes(shapely, polygons, row),
        [None] * len(found),
        columns,
        crs,
        tuple(notes),
    )
    model = extrude_table(table, replace(choices, base_column=base))
    is_afloat = choices.base_column is None
    return replace(model, is_afloat=is_afloat, outside=outside)


def _find_geometry(file: Any) -> tuple[str, dict[str, Any]]:
    """Return the column of geometries and its facts."""
    told = (file.metadata.metadata or {}).get(b"geo")
    names = file.schema_arrow.names
    if told is None:
        column = next((name for name in _GEOMETRY if name in names), None)
        if column is None:
            msg = (
                "is Parquet without a geometry (it has neither GeoParquet's metadata nor a column "
                f"{_GEOMETRY[0]}); write it as GeoParquet (geopandas' to_parquet)"
            )
            raise InputError(msg)
        return column, {}
    facts = orjson.loads(told)
    column = facts["primary_column"]
    if column not in names:
        msg = f"has no column '{str(column)[:60]}', which its metadata names; export it again"
        raise InputError(msg)
    return column, facts["columns"][column]


def _find_crs(facts: dict[str, Any]) -> tuple[str | None, list[str]]:
    """Return the CRS, which is degrees if nothing is said, and a note without one."""
    if "crs" not in facts:
        return "OGC:CRS84", []
    told = facts["crs"]
    if told is None:
        return None, ["no CRS is named, so coordinates are taken as metres"]
    code = told.get("id")
    if isinstance(code, dict) and code.get("authority") in {"EPSG", "OGC"}:
        return name_crs(f"{code['authority']}:{code['code']}"), []
    from pyproj import CRS  # noqa: PLC0415 - 0.1 s, only with a CRS
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    try:
        return name_crs(CRS.from_json_dict(told).to_wkt()), []
    except CRSError as error:
        msg = "has a CRS that is no PROJJSON; export it again"
        raise InputError(msg) from error


def _find_fields(file: Any, column: str) -> list[str]:
    """Return the columns to read: the geometry, plain columns, and the main name."""
    import pyarrow.types as kinds  # noqa: PLC0415 - an extra

    fields = [column]
    for field in file.schema_arrow:
        is_text = kinds.is_string(field.type) or kinds.is_large_string(field.type)
        is_number = kinds.is_integer(field.type) or kinds.is_floating(field.type)
        if field.name != column and (is_text or is_number or kinds.is_boolean(field.type)):
            fields.append(field.name)
        elif field.name == "names" and kinds.is_struct(field.type):
            fields += ["names.primary"] * (field.type.get_field_index("primary") >= 0)
    return fields


def _find_rows(
    file: Any, facts: dict[str, Any], region: Region | None, crs: str | None
) -> tuple[list[int], list[NDArray[np.bool_] | None]]:
    """Return the row groups that meet a region, and which of their rows do, if it can be told."""
    every = list(range(file.metadata.num_row_groups))
    paths = _find_cover(file, facts)
    if region is None or paths is None:
        return every, [None] * len(every)
    region = region.settle(crs)
    west, south, east, north = region.find_box(crs)
    index = {file.metadata.schema.column(k).path: k for k in range(file.metadata.num_columns)}
    groups: list[int] = []
    rows: list[NDArray[np.bool_] | None] = []
    for group in every:
        chunks = [file.metadata.row_group(group).column(index[path]) for path in paths]
        told = [chunk.statistics for chunk in chunks]
        if all(one is not None and one.has_min_max for one in told):
            low, high = [one.min for one in told], [one.max for one in told]
            if low[0] > east or high[2] < west or low[1] > north or high[3] < south:
                continue
        table = file.read_row_group(group, columns=paths).flatten()
        boxes = np.column_stack([table.column(path).to_numpy() for path in paths])
        # Sides are rounded outward at best to the next float32.
        met = region.meets(boxes.astype(np.float64), crs) | ~np.isfinite(boxes).all(1)
        if met.any():
            groups.append(group)
            rows.append(met)
    return groups, rows


def _find_cover(file: Any, facts: dict[str, Any]) -> list[str] | None:
    """Return the columns of each row's box: xmin, ymin, xmax, ymax; None without them."""
    told = facts.get("covering", {}).get("bbox", {})
    paths = [".".join(told.get(side, ("bbox", side))) for side in _SIDES]
    schema = file.metadata.schema
    known = {schema.column(k).path: schema.column(k) for k in range(file.metadata.num_columns)}
    plain = {"FLOAT", "DOUBLE"}
    is_there = all(path in known and known[path].physical_type in plain for path in paths)
    return paths if is_there else None


def _check_size(file: Any, groups: list[int], fields: list[str], budget: Budget) -> None:
    """Refuse a file whose columns would take far more memory than the file."""
    wanted = set(fields)
    for group in groups:
        one = file.metadata.row_group(group)
        budget.spend(_ROW * max(one.num_rows, 0), "rows")
        for chunk in (one.column(k) for k in range(one.num_columns)):
            if chunk.path_in_schema.partition(".")[0] in wanted:
                budget.spend(_BYTES * max(chunk.total_uncompressed_size, 0), "columns")


def _mask(rows: NDArray[np.bool_]) -> Any:
    import pyarrow as pa  # noqa: PLC0415 - an extra

    return pa.array(rows)


def _decode(shapely: Any, column: Any, encoding: str) -> NDArray[Any]:
    """Return the shapes (n,) of a column; None for null."""
    if encoding.upper() == "WKB":
        return shapely.from_wkb(np.array(column.to_pylist(), object))
    if encoding not in _ARROW:
        msg = f"has geometries encoded as {encoding[:40]}, not as polygons; export it with WKB"
        raise InputError(msg)
    array = column.combine_chunks()
    shapes = np.full(len(array), None, object)
    rows = np.flatnonzero(array.is_valid().to_numpy(zero_copy_only=False))
    array, offsets = array.drop_null(), []
    while hasattr(array, "offsets"):
        begin = array.offsets.to_numpy()
        offsets.append(begin - begin[0])
        array = array.flatten()
    if hasattr(array, "field"):  # separate x and y
        points = np.column_stack([array.field(k).to_numpy() for k in (0, 1)])
    else:
        points = array.flatten().to_numpy().reshape(len(array), -1)[:, :2]
    shapes[rows] = shapely.from_ragged_array(_ARROW[encoding], points, tuple(offsets[::-1]))
    return shapes


def _use_overture(
    columns: dict[str, list[Any]], there: NDArray[np.bool_], notes: list[str], choices: ReadChoices
) -> tuple[NDArray[np.bool_], str | None]:
    """Leave out what is underground, take heights from floors; return the column of the base."""
    if "names.primary" in columns:
        columns.setdefault("name", columns.pop("names.primary"))
    hidden = np.array([bool(one) for one in columns.get("is_underground", ())], np.bool_)
    if hidden.any():
        notes.append(f"footprints underground left out: {int((hidden & there).sum())}")
        there = there & ~hidden
    if choices.height_column is None and "num_floors" in columns:
        heights = parse_numbers(columns.get("height", [None] * len(there))).values
        floors = parse_numbers(columns["num_floors"]).values
        filled = np.isnan(heights) & (floors > 0)
        if filled.any():
            notes.append(
                f"heights taken from num_floors, {STOREY:g} m each: {int((filled & there).sum())}"
            )
        columns["height"] = [
            None if np.isnan(one) else one
            for one in np.where(filled, STOREY * floors, heights).tolist()
        ]
    base = choices.base_column
    if base is None and "is_underground" in columns and "min_height" in columns:
        return there, "min_height"
    return there, base
