"""Vectors written by hand, for loops too short for the compiler to make vectors of them."""

from functools import partial
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

__all__ = ["FEW_LANES", "add_below", "write_crossings"]

FEW_LANES = 8
"""Cells, or columns, that are computed at once."""


def _make_vector(kind: Any) -> Any:
    return ir.VectorType(kind, FEW_LANES)


def _spread(builder: Any, value: Any) -> Any:
    """Return a vector of equal numbers."""
    number = ir.IntType(32)
    vector = ir.Constant(_make_vector(value.type), ir.Undefined)
    vector = builder.insert_element(vector, value, number(0))
    return builder.shuffle_vector(
        vector, vector, ir.Constant(_make_vector(number), [0] * FEW_LANES)
    )


def _find_lanes(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    """Return a pointer to a vector in an array, from a place on."""
    data = context.make_array(kind)(context, builder, array).data
    start = builder.gep(data, [index])
    return builder.bitcast(start, _make_vector(data.type.pointee).as_pointer())


@intrinsic
def add_below(
    _typing: Any, tops: Any, held: Any, index: Any, at: Any, slope: Any, x: Any, rest: Any, m: Any
) -> Any:
    """
    Add ``m`` to the first ``rest`` of eight cells from ``index`` on, where they are below a side.

    ``tops`` (n,) float64 are the cells' heights and ``held`` (n,) their counts; the side is
    ``at + slope * x`` high in the first cell, and x grows by 1 from cell to cell. ``index`` is
    unsigned, ``rest`` and ``m`` int64, the others float64.
    """

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        tops, held, index, at, slope, x, rest, m = values
        spread = partial(_spread, builder)
        steps = ir.Constant(_make_vector(x.type), [float(t) for t in range(FEW_LANES)])
        numbers = ir.Constant(_make_vector(rest.type), list(range(FEW_LANES)))
        tops = _find_lanes(context, builder, signature.args[0], tops, index)
        heights = builder.load(tops, align=8)
        lanes = _find_lanes(context, builder, signature.args[1], held, index)
        size = signature.args[1].dtype.bitwidth // 8
        before = builder.load(lanes, align=size)
        side = builder.fmul(spread(slope), builder.fadd(spread(x), steps))
        is_below = builder.fcmp_ordered("<", heights, builder.fadd(spread(at), side))
        is_inside = builder.icmp_signed("<", numbers, spread(rest))
        more = spread(builder.trunc(m, before.type.element))
        more = builder.select(
            builder.and_(is_below, is_inside), more, ir.Constant(before.type, None)
        )
        builder.store(builder.add(before, more), lanes, align=size)
        return context.get_dummy_value()

    return types.void(tops, held, index, at, slope, x, rest, m), generate


@intrinsic
def write_crossings(
    _typing: Any, places: Any, adds: Any, to: Any, line: Any, rows: Any, cols: Any, origin: Any,
    m: Any,
) -> Any:  # fmt: skip
    """
    Write where a line crosses eight columns, and ``m``, to two lists from ``to`` on.

    The ``line`` is a column, and x, y and rise: it is ``y + (column - x) * rise`` high in the
    column, where it crosses the next row from there on, of the least and the greatest of ``rows``.
    ``places`` (n,) int32 are ``row * cols + column - origin``, ``adds`` (n,) int8; ``to`` is
    unsigned, ``m`` int64, all others are float64.
    """

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        places, adds, to, line, rows, cols, origin, m = values
        column, x, y, rise = (_spread(builder, builder.extract_value(line, k)) for k in range(4))
        low, top = (_spread(builder, builder.extract_value(rows, k)) for k in range(2))
        kind = column.type
        ceil = f"llvm.ceil.v{FEW_LANES}f64"
        ceil = get_or_insert_function(builder.module, ir.FunctionType(kind, [kind]), ceil)
        column = builder.fadd(column, ir.Constant(kind, [float(t) for t in range(FEW_LANES)]))
        row = builder.fadd(y, builder.fmul(builder.fsub(column, x), rise))
        row = builder.select(builder.fcmp_ordered(">", row, low), row, low)
        row = builder.select(builder.fcmp_ordered("<", row, top), row, top)
        row = builder.call(ceil, [row])
        columns = builder.fmul(row, _spread(builder, cols))
        columns = builder.fadd(columns, builder.fsub(column, _spread(builder, origin)))
        columns = builder.fptosi(columns, _make_vector(ir.IntType(32)))
        more = _spread(builder, builder.trunc(m, ir.IntType(8)))
        for k, array, vector in (0, places, columns), (1, adds, more):
            start = _find_lanes(context, builder, signature.args[k], array, to)
            builder.store(vector, start, align=vector.type.element.width // 8)
        return context.get_dummy_value()

    return types.void(places, adds, to, line, rows, cols, origin, m), generate
