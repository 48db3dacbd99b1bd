"""
GeoParquet footprints, with Overture's columns; of a region only the row groups that meet it.

They are read in a child process: a page may say less than it unpacks to.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need, require
from umbra.readers.budget import Budget
from umbra.readers.checks import find_reason
from umbra.readers.child import ReadingChild
from umbra.readers.content import FileContent
from umbra.readers.footprint_table import FootprintTable, Rings, parse_numbers
from umbra.readers.footprints import extrude_table, from_shapes
from umbra.readers.georeference import name_crs
from umbra.readers.model import NO_CRS, FileModel, ReadChoices
from umbra.readers.region import Region
from umbra.readers.vector_tables import find_polygons

__all__ = ["read_parquet"]

STOREY = 3.0
"""Height of a floor [m] where Overture gives only their number."""
_ROW = 64  # memory of a row [byte]
_COPIES = 2  # of a column's decoded bytes: Arrow's and Python's
_BATCH = 1 << 16  # rows decoded at once
_GEOMETRY = ("geometry", "geom", "wkb_geometry")
_SIDES = ("xmin", "ymin", "xmax", "ymax")
_ARROW = {"polygon": 3, "multipolygon": 6}  # shapely's numbers


@dataclass(frozen=True)
class ParquetWork:
    """Request to read a file."""

    path: str
    height_column: str | None
    base_column: str | None
    region: Region | None
    memory: float  # that decoded columns may take [byte]


@dataclass(frozen=True, eq=False)
class ParquetRows:
    """The rows of a file, or those in a region."""

    table: FootprintTable | None  # none if no row is in the region
    crs: str | None
    notes: tuple[str, ...]
    outside: int  # rows that were left out
    base: str | None  # column of the base


def read_parquet(_: FileContent, path: Path, choices: ReadChoices) -> FileModel:
    """Read footprints of GeoParquet 1.0 and 1.1, in WKB or GeoArrow's polygons, in a child."""
    require(["pyarrow"], "city", "GeoParquet")
    require(["shapely"], "gis", "GeoParquet")
    limits = choices.budget.limit_child()
    work = ParquetWork(
        str(path.absolute()), choices.height_column, choices.base_column, choices.region,
        limits.memory,
    )  # fmt: skip
    child = ReadingChild("umbra.readers.parquet:read_rows", work, limits)
    pieces = list(child)
    if not child.is_done or not pieces:
        error = child.make_error("GeoParquet", "export it again")
        raise error
    rows: ParquetRows = pieces[0]
    if rows.table is None:
        return FileModel("GeoParquet", (), rows.crs, rows.notes, outside=rows.outside)
    model = extrude_table(rows.table, replace(choices, base_column=rows.base))
    return replace(model, is_afloat=choices.base_column is None, outside=rows.outside)


def read_rows(work: ParquetWork) -> Iterator[ParquetRows]:
    """Read a file's rows in a child process: yield them at once."""
    parquet = need("pyarrow.parquet", "city", "GeoParquet")
    shapely = need("shapely", "gis", "GeoParquet")
    arrow = need("pyarrow", "city", "GeoParquet")
    arrow.set_cpu_count(1)  # further threads reserve memory of their own
    try:
        with parquet.ParquetFile(work.path) as file:
            fields = _find_fields(file, _find_geometry(file)[0])
            plain = [name for name in fields if _is_text(file.schema_arrow, name)]
        # Texts and shapes stay in dictionaries until what they decode to is accounted for.
        with parquet.ParquetFile(work.path, read_dictionary=plain) as file:
            yield _read_table(file, fields, shapely, work)
    except (arrow.ArrowException, OSError, shapely.errors.GEOSException) as error:
        if isinstance(error, MemoryError):
            raise
        reason = find_reason(error, 160)
        msg = f"cannot be read as GeoParquet ({reason}); export it again"
        raise InputError(msg) from error


def _read_table(file: Any, fields: list[str], shapely: Any, work: ParquetWork) -> ParquetRows:
    column, facts = _find_geometry(file)
    crs, notes = _find_crs(facts)
    groups, rows = _find_rows(file, facts, work.region, crs)
    budget = Budget(work.memory)
    _check_size(file, groups, fields, budget)
    shapes: list[NDArray[Any]] = []
    columns: dict[str, list[Any]] = {}
    outside = file.metadata.num_rows
    for group, mask in zip(groups, rows, strict=True):
        start = 0
        for batch in file.iter_batches(_BATCH, row_groups=[group], columns=fields):
            table = _flatten(batch)
            table = table if mask is None else table.filter(_mask(mask[start : start + len(batch)]))
            start += len(batch)
            outside -= table.num_rows
            table = _unfold(table, budget)
            shapes.append(_decode(shapely, table.column(column), facts.get("encoding", "WKB")))
            for name in table.column_names:
                if name != column:
                    columns.setdefault(name, []).extend(table.column(name).to_pylist())
    if not sum(map(len, shapes)):
        if outside:
            return ParquetRows(None, crs, tuple(notes), outside, None)
        msg = "has no rows; give a file of building footprints"
        raise InputError(msg)
    geometries = np.concatenate(shapes)
    there = ~(shapely.is_missing(geometries) | shapely.is_empty(geometries))
    if not there.all():
        notes.append(f"features without a geometry left out: {int((~there).sum())}")
    there, base = _use_overture(columns, there, notes, work)
    polygons, row = find_polygons(shapely, geometries, there, notes)
    rings: Rings = from_shapes(shapely, polygons, row)
    table = FootprintTable(
        "GeoParquet", rings, [None] * len(geometries), columns, crs, tuple(notes)
    )
    return ParquetRows(table, crs, (), outside, base)


def _flatten(batch: Any) -> Any:
    import pyarrow as pa  # noqa: PLC0415 - an extra

    return pa.Table.from_batches([batch]).flatten()


def _unfold(table: Any, budget: Budget) -> Any:
    """Decode the dictionaries of a batch, after what they decode to is charged."""
    import pyarrow as pa  # noqa: PLC0415 - an extra
    import pyarrow.compute as pc  # noqa: PLC0415

    for number, name in enumerate(table.column_names):
        column = table.column(number)
        if pa.types.is_dictionary(column.type):
            for chunk in column.chunks:
                lengths = pc.binary_length(chunk.dictionary).take(chunk.indices)
                budget.spend(_COPIES * (pc.sum(lengths).as_py() or 0), "columns")
            column = column.cast(column.type.value_type)
            table = table.set_column(number, name, column)
        else:
            budget.spend(_COPIES * column.nbytes, "columns")
    return table


def _find_geometry(file: Any) -> tuple[str, dict[str, Any]]:
    """Return the column of geometries and its facts."""
    metadata = (file.metadata.metadata or {}).get(b"geo")
    names = file.schema_arrow.names
    if metadata is None:
        column = next((name for name in _GEOMETRY if name in names), None)
        if column is None:
            msg = (
                "is Parquet without a geometry (it has neither GeoParquet's metadata nor a column "
                f"{_GEOMETRY[0]}); write it as GeoParquet (geopandas' to_parquet)"
            )
            raise InputError(msg)
        return column, {}
    facts = orjson.loads(metadata)
    column = facts["primary_column"]
    if column not in names:
        msg = f"has no column '{str(column)[:60]}', which its metadata names; export it again"
        raise InputError(msg)
    return column, facts["columns"][column]


def _find_crs(facts: dict[str, Any]) -> tuple[str | None, list[str]]:
    """Return the CRS, which is degrees if nothing is said, and a note without one."""
    if "crs" not in facts:
        return "OGC:CRS84", []
    document = facts["crs"]
    if document is None:
        return None, [NO_CRS]
    code = document.get("id")
    if isinstance(code, dict) and code.get("authority") in {"EPSG", "OGC"}:
        return name_crs(f"{code['authority']}:{code['code']}"), []
    from pyproj import CRS  # noqa: PLC0415 - 0.1 s, only with a CRS
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    try:
        return name_crs(CRS.from_json_dict(document).to_wkt()), []
    except CRSError as error:
        msg = "has a CRS that is not PROJJSON; export it again"
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


def _is_text(schema: Any, name: str) -> bool:
    """Return whether a column holds texts or bytes, of which a dictionary may repeat long ones."""
    import pyarrow.types as kinds  # noqa: PLC0415 - an extra

    front, _, inner = name.partition(".")
    kind = schema.field(front).type
    kind = kind.field(inner).type if inner else kind
    return kinds.is_string(kind) or kinds.is_binary(kind)


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
        statistics = [chunk.statistics for chunk in chunks]
        if all(column is not None and column.has_min_max for column in statistics):
            low, high = [column.min for column in statistics], [column.max for column in statistics]
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
    covering = facts.get("covering", {}).get("bbox", {})
    paths = [".".join(covering.get(side, ("bbox", side))) for side in _SIDES]
    schema = file.metadata.schema
    known = {schema.column(k).path: schema.column(k) for k in range(file.metadata.num_columns)}
    plain = {"FLOAT", "DOUBLE"}
    is_there = all(path in known and known[path].physical_type in plain for path in paths)
    return paths if is_there else None


def _check_size(file: Any, groups: list[int], fields: list[str], budget: Budget) -> None:
    """Refuse a file whose rows or encoded columns would take far more memory than the file."""
    wanted = set(fields)
    for group in groups:
        row_group = file.metadata.row_group(group)
        budget.spend(_ROW * max(row_group.num_rows, 0), "rows")
        chunks = (row_group.column(k) for k in range(row_group.num_columns))
        encoded = max(
            (
                max(chunk.total_uncompressed_size, 0)
                for chunk in chunks
                if chunk.path_in_schema.partition(".")[0] in wanted
            ),
            default=0,
        )
        budget.check(encoded, "an encoded column")


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
    columns: dict[str, list[Any]], there: NDArray[np.bool_], notes: list[str], work: ParquetWork
) -> tuple[NDArray[np.bool_], str | None]:
    """Leave out what is underground, take heights from floors; return the column of the base."""
    if "names.primary" in columns:
        columns.setdefault("name", columns.pop("names.primary"))
    hidden = np.array([bool(value) for value in columns.get("is_underground", ())], np.bool_)
    if hidden.any():
        notes.append(f"footprints underground left out: {int((hidden & there).sum())}")
        there = there & ~hidden
    if work.height_column is None and "num_floors" in columns:
        heights = parse_numbers(columns.get("height", [None] * len(there))).values
        floors = parse_numbers(columns["num_floors"]).values
        filled = np.isnan(heights) & (floors > 0)
        if filled.any():
            notes.append(
                f"heights taken from num_floors, {STOREY:g} m each: {int((filled & there).sum())}"
            )
        columns["height"] = [
            None if np.isnan(height) else height
            for height in np.where(filled, STOREY * floors, heights).tolist()
        ]
    base = work.base_column
    if base is None and "is_underground" in columns and "min_height" in columns:
        return there, "min_height"
    return there, base
