"""Vector comparison of depth keys with a side of a volume."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core.cgutils import global_constant
from numba.extending import intrinsic

__all__ = ["add_where_nearer"]

_LANE = ir.IntType(32)


@intrinsic(prefer_literal=True)
def add_where_nearer(
    _: Any, lanes: Any, keys: Any, counts: Any, at: Any, side: Any, slope: Any, rest: Any, m: Any
) -> Any:  # numpydoc ignore=RT01
    """
    Add to the counts of consecutive pixels whose surface is farther than a side.

    Written by hand: of a loop the compiler makes vectors of one length only, and tests for each
    row whether the arrays overlap.

    Parameters
    ----------
    lanes : int
        A literal number: all these pixels are read, compared and written.
    keys : (n,) float64
    counts : (n,) int
    at : int
        The first pixel.
    side, slope : float64
        Key of the side there, and its change from pixel to pixel.
    rest : int32
        Only so many of the pixels are counted, at least 0.
    m : int
        Is added, in the type of ``counts``.
    """
    if not isinstance(lanes, types.IntegerLiteral):
        return None  # numba asks again for the plain type, then says that there is none
    n = lanes.literal_value
    signature = types.void(
        lanes, keys, counts, types.uint64, types.float64, types.float64, types.int32, counts.dtype
    )

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _, keys, counts, at, side, slope, rest, m = arguments

        def find(array: Any, k: int, element: Any) -> Any:
            data = context.make_array(signature.args[k])(context, builder, array).data
            vector = ir.VectorType(element, n).as_pointer()
            return builder.bitcast(builder.gep(data, [at]), vector)

        def spread(value: Any) -> Any:
            vector = ir.VectorType(value.type, n)
            lanes = builder.insert_element(vector(ir.Undefined), value, _LANE(0))
            zeros = ir.Constant(ir.VectorType(_LANE, n), [0] * n)
            return builder.shuffle_vector(lanes, vector(ir.Undefined), zeros)

        # The first ``rest`` lanes are those of a window on ones that zeros follow.
        window = ir.Constant(ir.ArrayType(m.type, 2 * n), [-1] * n + [0] * n)
        window = global_constant(builder.module, f"lanes_{n}_{m.type.width}", window)
        rest = builder.select(builder.icmp_signed("<", rest, _LANE(n)), rest, _LANE(n))
        first = builder.gep(window, [_LANE(0), builder.sub(_LANE(n), rest)])
        lanes = ir.VectorType(m.type, n)
        first = builder.bitcast(first, lanes.as_pointer())
        is_inside = builder.load(first, align=m.type.width // 8)

        ahead = ir.Constant(ir.VectorType(side.type, n), [float(k) for k in range(n)])
        key = builder.load(find(keys, 1, side.type), align=8)
        near = builder.fadd(spread(side), builder.fmul(spread(slope), ahead))
        is_nearer = builder.sext(builder.fcmp_ordered("<", key, near), lanes)
        pointer = find(counts, 2, m.type)
        old = builder.load(pointer, align=m.type.width // 8)
        more = builder.and_(builder.and_(is_nearer, is_inside), spread(m))
        builder.store(builder.add(old, more), pointer, align=m.type.width // 8)
        return context.get_dummy_value()

    return signature, generate
