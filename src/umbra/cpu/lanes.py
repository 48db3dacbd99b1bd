"""A few cells of a height field compared with a side at once, as vectors written by hand."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

__all__ = ["FEW_LANES", "add_below"]

FEW_LANES = 8
"""Cells that ``add_below`` compares: numba makes no vectors of loops as short as this."""


@intrinsic
def add_below(
    _typing: Any, tops: Any, held: Any, place: Any, at: Any, slope: Any, x: Any, rest: Any, m: Any
) -> Any:
    """
    Add ``m`` to the first ``rest`` of eight cells from ``place`` on, where they are below a side.

    ``tops`` (n,) float64 are the cells' heights and ``held`` (n,) their counts; the side is
    ``at + slope * x`` high in the first cell, and x grows by 1 from cell to cell. ``place`` is
    unsigned, ``rest`` and ``m`` int64, the others float64.
    """

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        def vector(kind: Any) -> Any:
            return ir.VectorType(kind, FEW_LANES)

        def spread(value: Any) -> Any:
            number = ir.IntType(32)
            one = ir.Constant(vector(value.type), ir.Undefined)
            one = builder.insert_element(one, value, number(0))
            return builder.shuffle_vector(one, one, ir.Constant(vector(number), [0] * FEW_LANES))

        def find_lanes(kind: Any, array: Any) -> Any:
            data = context.make_array(kind)(context, builder, array).data
            start = builder.gep(data, [place])
            return builder.bitcast(start, vector(data.type.pointee).as_pointer())

        tops, held, place, at, slope, x, rest, m = values
        steps = ir.Constant(vector(x.type), [float(t) for t in range(FEW_LANES)])
        numbers = ir.Constant(vector(rest.type), list(range(FEW_LANES)))
        heights = builder.load(find_lanes(signature.args[0], tops), align=8)
        lanes = find_lanes(signature.args[1], held)
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

    return types.void(tops, held, place, at, slope, x, rest, m), generate
