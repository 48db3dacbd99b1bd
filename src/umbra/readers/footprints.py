"""
Footprints with heights, made valid by shapely where it is installed, extruded to prisms.

A feature becomes one part, its polygons prisms from the base to base + height, with
their holes. Features without a height are left out and counted.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import write_install
from umbra.readers.checks import list_counts
from umbra.readers.footprint_table import (
    BASES,
    HEIGHTS,
    ColumnNumbers,
    FootprintTable,
    Rings,
    find_column,
    find_usual,
    name_features,
    parse_numbers,
)
from umbra.readers.model import FileModel, ReadChoices
from umbra.readers.triangulate import triangulate
from umbra.scene import Mesh, Part

__all__ = ["extrude_table", "from_shapes", "repair", "to_shapes"]

FEW, MANY = 50, 5000
"""Corners: polygons of few are always repaired quickly, those of many not even checked so."""
LABELS = ("name", "addr:street", "street", "use", "building", "type", "function")

# In OpenStreetMap a height counts from the ground, also where the building begins above it.
FROM_GROUND = {"min_height", "building:min_height"}


def repair(rings: Rings) -> tuple[Rings, list[str]]:
    """
    Make every polygon valid: its rings simple, its holes inside.

    Without shapely nothing is repaired; triangulation reports crossed polygons.
    """
    rings, notes = _drop_short(rings)
    try:
        import shapely  # noqa: PLC0415 - of the extra gis
    except ImportError:
        return rings, notes
    shapes = to_shapes(shapely, rings)
    corners = np.bincount(rings.polygon, rings.lengths, minlength=len(rings.feature))
    _, unchecked = _leave_tangled(rings, np.flatnonzero(corners > MANY), corners)
    is_checked = np.ones(len(shapes), np.bool_)
    is_checked[unchecked] = False
    wrong = np.flatnonzero(is_checked)
    wrong = wrong[~shapely.is_valid(shapes[wrong])]
    wrong, tangled = _leave_tangled(rings, wrong, corners)
    tangled = np.union1d(unchecked, tangled)
    if len(tangled):
        first = int(rings.feature[tangled[0]]) + 1
        notes.append(
            "footprints too tangled to repair, whose edges cross or pass each other too "
            f"often: {len(tangled)} (first: feature {first})"
        )
    if not len(wrong):
        return rings, notes
    reason = str(shapely.is_valid_reason(shapes[wrong[0]])).partition("[")[0].lower()
    # As GEOS's structure method: holes stay holes, overlaps count once.
    shapes[wrong] = shapely.make_valid(shapes[wrong], method="structure", keep_collapsed=False)
    first = int(rings.feature[wrong[0]]) + 1
    notes.append(f"footprints repaired: {len(wrong)} (first: feature {first}, {reason})")
    fixed, feature = shapely.get_parts(shapes, return_index=True)
    polygons = shapely.get_type_id(fixed) == 3
    filled = polygons & ~shapely.is_empty(fixed)
    return from_shapes(shapely, fixed[filled], rings.feature[feature[filled]]), notes


def _leave_tangled(
    rings: Rings, wrong: NDArray[np.int64], corners: NDArray[Any]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """
    Divide polygons into those to repair and those whose edges cross too often.

    A repair adds a corner at each crossing: 2,000 corners at random took 50 s and 4 GB. Only to
    check a star of 120,000 edges, which do not cross, took 36 s.
    """
    large = wrong[corners[wrong] > FEW]
    if not len(large):
        return wrong, large
    from umbra.readers.monotone import is_tangled  # noqa: PLC0415 - it compiles a kernel

    starts, following = rings.starts, rings.following
    first = np.searchsorted(rings.polygon, large)
    tangled = []
    for polygon, ring in zip(large.tolist(), first.tolist(), strict=True):
        begin = int(starts[ring])
        piece = slice(begin, begin + int(corners[polygon]))
        if is_tangled(rings.points[piece], following[piece] - begin):
            tangled.append(polygon)
    return np.setdiff1d(wrong, tangled), np.array(tangled, np.int64)


def from_shapes(shapely: Any, shapes: NDArray[Any], feature: NDArray[np.int64]) -> Rings:
    """Split shapely's non-empty polygons into flat arrays."""
    loops, polygon = shapely.get_rings(shapes, return_index=True)
    points, ring = shapely.get_coordinates(loops, return_index=True)
    lengths = np.bincount(ring, minlength=len(loops))
    # shapely closes every ring.
    last = np.cumsum(lengths) - 1
    return Rings(np.delete(points, last, axis=0), lengths - 1, polygon, feature)


def to_shapes(shapely: Any, rings: Rings) -> NDArray[Any]:
    """Return the polygons as shapely's, (n_polygons,)."""
    order = np.insert(np.arange(len(rings.points)), np.cumsum(rings.lengths), rings.starts)
    index = np.repeat(np.arange(len(rings.lengths)), rings.lengths + 1)
    loops = shapely.linearrings(rings.points[order], indices=index)
    return shapely.polygons(loops, indices=rings.polygon)


def _drop_short(rings: Rings) -> tuple[Rings, list[str]]:
    """Drop rings of fewer than three corners, and polygons whose outside is one."""
    short = rings.lengths < 3
    if not short.any():
        return rings, []
    gone = np.zeros(len(rings.feature), np.bool_)
    gone[rings.polygon[short & rings.is_outer]] = True
    notes = [f"rings with fewer than three corners left out: {int(short.sum())}"]
    return rings.select(~gone, ~short), notes


@dataclass(frozen=True, eq=False)
class _Extent:
    """Return the base and top of each feature [m]; NaN if not stated."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]


def extrude_table(table: FootprintTable, choices: ReadChoices) -> FileModel:
    """Extrude footprints by the columns of height and base; base 0 without one."""
    if not len(table.rings.feature):
        left = f" ({'; '.join(table.notes)})" if table.notes else ""
        msg = f"has no polygons{left}; give a file of building footprints"
        raise InputError(msg)
    names, remarks = name_features(table, choices.name_column)
    _check_corners(table, names)
    notes = [*table.notes, *remarks]
    extent, base = _find_extent(table, choices, names, notes)
    usable = extent.high > extent.low
    if not usable.any():
        msg = f"no footprint has a height ({'; '.join(notes)}); name another height_column="
        raise InputError(msg, option="height_column")
    rings, remarks = repair(table.rings.select(usable[table.rings.feature]))
    notes += remarks
    vertices, faces, feature, losses = make_prisms(rings, extent.low, extent.high)
    notes += losses

    labels = [table.columns[key] for key in _present(table.columns, LABELS)]
    order = np.argsort(feature, kind="stable")
    faces = faces[order]
    ends = np.cumsum(np.bincount(feature, minlength=len(names))).tolist()
    parts = [
        Part(names[row], "Building", Mesh(vertices, faces[start:end]), tags=_tags(labels, row))
        for row, (start, end) in enumerate(zip([0, *ends], ends))
        if end > start
    ]
    return FileModel(
        table.format,
        tuple(parts),
        table.crs,
        tuple(notes),
        is_afloat=base is None,
        is_high_in_metres=True,
    )


def _check_corners(table: FootprintTable, names: list[str]) -> None:
    rings = table.rings
    wrong = np.flatnonzero(~np.isfinite(rings.points).all(1))
    if not len(wrong):
        return
    ring = int(np.searchsorted(np.cumsum(rings.lengths), wrong[0], "right"))
    feature = int(rings.feature[rings.polygon[ring]])
    msg = (
        f"{len(wrong)} corners of footprints are not finite (first: of '{names[feature]}'); "
        "remove or repair them"
    )
    raise InputError(msg, count=len(wrong), feature=feature)


def _find_base(
    columns: dict[str, list[Any]], heights: NDArray[np.float64], notes: list[str]
) -> str | None:
    """Find a column of bases by its name, if every footprint with a height has a number in it."""
    column = find_usual(columns, BASES)
    if column is None:
        return None
    known = parse_numbers(columns[column], column).values[heights > 0]
    if not known.any():  # of a base at 0 everywhere nothing follows
        return None
    if np.isnan(known).any():
        notes.append(f"bases are 0, as the column '{column}' has not all of them (base_column=)")
        return None
    notes.append(f"bases come from the column '{column}' (base_column=)")
    return column


def _find_extent(
    table: FootprintTable, choices: ReadChoices, names: list[str], notes: list[str]
) -> tuple[_Extent, str | None]:
    columns = table.columns
    column = find_column(columns, choices.height_column, HEIGHTS)
    if choices.height_column is None:
        notes.append(f"heights come from the column '{column}' (height_column=)")
    heights = parse_numbers(columns[column], column)
    _note_text(heights, column, names, notes)
    low = np.zeros(len(heights.values))
    high = heights.values.copy()
    base = choices.base_column
    if base is None:
        base = _find_base(columns, heights.values, notes)
    if base is not None:
        base = find_column(columns, base, ())
        bases = parse_numbers(columns[base], base)
        _note_text(bases, base, names, notes)
        low = bases.values
        if base.casefold() not in FROM_GROUND:
            high = low + heights.values
        else:
            # Few features in OpenStreetMap state a base; the others stand on the ground.
            low = np.nan_to_num(low)
        _note_rows(np.isnan(low), f"without a number in '{base}'", table, names, notes)
    flat = heights.values <= 0
    _note_rows(np.isnan(heights.values), f"without a height in '{column}'", table, names, notes)
    _note_rows(flat, f"whose height is not above 0 in '{column}'", table, names, notes)
    _note_rows(~flat & (high <= low), "that end below their base", table, names, notes)
    high[flat] = np.nan
    return _Extent(low, high), base


def _note_text(numbers: ColumnNumbers, column: str, names: list[str], notes: list[str]) -> None:
    if numbers.odd:
        row, text = numbers.odd[0]
        notes.append(
            f"values of '{column}' that are not numbers of metres: {len(numbers.odd)} "
            f"(first: {text[:30]!r} of '{names[row]}')"
        )
    if numbers.in_feet:
        notes.append(f"heights of '{column}' in feet, converted to metres: {numbers.in_feet}")
    if numbers.from_text:
        notes.append(f"numbers in '{column}' that are written as text: {numbers.from_text}")


def _note_rows(
    wrong: NDArray[np.bool_], what: str, table: FootprintTable, names: list[str], notes: list[str]
) -> None:
    has_shape = np.zeros(len(wrong), np.bool_)
    has_shape[table.rings.feature] = True
    rows = np.flatnonzero(wrong & has_shape)
    if len(rows):
        notes.append(f"footprints {what} left out: {len(rows)} (first: '{names[rows[0]]}')")


def _present(columns: dict[str, list[Any]], wanted: tuple[str, ...]) -> list[str]:
    lower = {name.casefold(): name for name in reversed(columns)}
    return [lower[name] for name in wanted if name in lower]


def _tags(labels: list[list[Any]], row: int) -> tuple[str, ...]:
    words = (values[row] for values in labels)
    return tuple(dict.fromkeys(word for word in words if isinstance(word, str) and word))


def make_prisms(
    rings: Rings, low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int64], tuple[str, ...]]:
    """
    Extrude polygons of any winding from ``low`` to ``high``, (n_features,) [m].

    Returned are the floors' corners and then the roofs', the faces, counter-clockwise seen from
    outside, the feature of each face, and notes.
    """
    rings = _wind(rings)
    n = len(rings.points)
    ring = np.repeat(np.arange(len(rings.lengths)), rings.lengths)
    feature = rings.feature[rings.polygon[ring]]
    floor = np.column_stack([rings.points, low[feature]])
    roof = np.column_stack([rings.points, high[feature]])
    vertices = np.concatenate([floor, roof])

    cut = triangulate(
        roof, np.arange(n), rings.lengths, np.bincount(rings.polygon, minlength=len(rings.feature))
    )
    # A wall for each edge of the plan, from a corner to the next of its ring.
    here, there = np.arange(n), rings.following
    # Polygons without roof triangles get no walls either: prisms are complete.
    covered = np.zeros(len(rings.feature), np.bool_)
    covered[cut.polygon] = True
    walled = covered[rings.polygon[ring]]
    here, there = here[walled], there[walled]
    faces = np.concatenate(
        [
            cut.faces + n,
            cut.faces[:, ::-1],
            np.column_stack([here, there, there + n]),
            np.column_stack([here, there + n, here + n]),
        ]
    ).astype(np.int32)
    roofs = rings.feature[cut.polygon]
    walls = feature[walled]
    short = "footprints with fewer than three distinct corners left out"
    crossed = (
        "footprints whose rings cross themselves, so that triangles overlap "
        f"({write_install('gis')} repairs them)"
    )
    notes = list_counts({short: cut.degenerate, crossed: cut.crossed})
    return vertices, faces, np.concatenate([roofs, roofs, walls, walls]), notes


def _wind(rings: Rings) -> Rings:
    """Wind outer rings counter-clockwise and holes clockwise."""
    starts = rings.starts
    ring = np.repeat(np.arange(len(starts)), rings.lengths)
    position = np.arange(len(rings.points)) - starts[ring]
    # Relative to each ring's first corner, to keep digits far from the origin.
    a = rings.points - rings.points[starts[ring]]
    b = rings.points[rings.following] - rings.points[starts[ring]]
    area = np.bincount(ring, a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], minlength=len(starts))
    turn = (area < 0) == rings.is_outer
    order = np.where(
        turn[ring], starts[ring] + rings.lengths[ring] - 1 - position, starts[ring] + position
    )
    return Rings(rings.points[order], rings.lengths, rings.polygon, rings.feature)
