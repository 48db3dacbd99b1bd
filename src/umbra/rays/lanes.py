"""Vector tests of eight boxes against a ray, or eight rectangles against one."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

__all__ = ["LANES", "meet_boxes", "meet_cone", "meet_rectangles"]

LANES = 8
_LONG, _SHORT = ir.IntType(64), ir.IntType(32)
_VECTOR = ir.VectorType(ir.FloatType(), LANES)
_SLACK = 1.00001
"""Factor on distances along the ray, above float32's rounding."""


@intrinsic
def meet_boxes(
    _: Any, boxes: Any, node: Any, sides: Any, start: Any, end: Any, inverse: Any
) -> Any:  # numpydoc ignore=RT01
    """
    Return a bit mask of the node's boxes that a ray may meet; bit 0 is the first box.

    Parameters
    ----------
    boxes : (n_nodes, 6, LANES) float32
        Lowest x, y, z and highest x, y, z of each box.
    node : int64
    sides : (3,) int64
        The rows of ``boxes`` where the ray enters: 0 or 3, 1 or 4, 2 or 5.
    start, end : (3,) float32
        Start of the ray, for entry and exit sides.
    inverse : (3,) float32
        1 / direction, finite.
    """
    three = types.UniTuple(types.float32, 3)
    signature = types.int64(boxes, types.int64, types.UniTuple(types.int64, 3), three, three, three)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, node, sides, start, end, inverse = arguments
        data = context.make_array(signature.args[0])(context, builder, array).data
        first = builder.gep(data, [builder.mul(node, _LONG(6 * LANES))])

        def meet(row: Any, origin: Any, k: int) -> Any:
            """Find the ray parameter of each box's side."""
            side = _load(builder, builder.gep(first, [builder.mul(row, _LONG(LANES))]))
            origin, scale = _spread(builder, origin, k), _spread(builder, inverse, k)
            return builder.fmul(builder.fsub(side, origin), scale)

        def choose(how: str, a: Any, b: Any) -> Any:
            return builder.select(builder.fcmp_ordered(how, a, b), a, b)

        near = ir.Constant(_VECTOR, [0.0] * LANES)
        far = ir.Constant(_VECTOR, [float("inf")] * LANES)
        for k in range(3):
            row = builder.extract_value(sides, k)
            near = choose(">", meet(row, start, k), near)
            far = choose("<", meet(builder.sub(_LONG(3 + 2 * k), row), end, k), far)
        far = builder.fmul(far, ir.Constant(_VECTOR, [_SLACK] * LANES))
        return _pack(builder, builder.fcmp_ordered("<=", near, far))

    return signature, generate


@intrinsic
def meet_cone(
    _: Any, boxes: Any, node: Any, places: Any, inverses: Any, exits: Any
) -> Any:  # numpydoc ignore=RT01
    """
    Return a bit mask of the node's boxes that a cone may meet; bit 0 is the first box.

    Parameters
    ----------
    boxes : (n_nodes, 6, LANES) float32
        Lowest x, y, z and highest x, y, z of each box.
    node : int64
    places : (6,) float32
        The cone's apex, for each row of ``boxes``.
    inverses : (6,) float32
        1 / its slope along the axis toward each row, finite.
    exits : (6,) bool
        Whether the cone leaves the box's range at this row, else it enters.
    """
    six = types.UniTuple(types.float32, 6)
    signature = types.int64(boxes, types.int64, six, six, types.UniTuple(types.boolean, 6))

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, node, places, inverses, exits = arguments
        data = context.make_array(signature.args[0])(context, builder, array).data
        first = builder.gep(data, [builder.mul(node, _LONG(6 * LANES))])
        near = ir.Constant(_VECTOR, [0.0] * LANES)
        far = ir.Constant(_VECTOR, [float("inf")] * LANES)
        for k in range(6):
            side = _load(builder, builder.gep(first, [_LONG(k * LANES)]))
            away = builder.fsub(side, _spread(builder, places, k))
            met = builder.fmul(away, _spread(builder, inverses, k))
            is_exit = builder.extract_value(exits, k)
            if is_exit.type != ir.IntType(1):
                is_exit = builder.trunc(is_exit, ir.IntType(1))
            later = builder.select(builder.fcmp_ordered(">", met, near), met, near)
            sooner = builder.select(builder.fcmp_ordered("<", met, far), met, far)
            near = builder.select(is_exit, near, later)
            far = builder.select(is_exit, sooner, far)
        far = builder.fmul(far, ir.Constant(_VECTOR, [_SLACK] * LANES))
        return _pack(builder, builder.fcmp_ordered("<=", near, far))

    return signature, generate


@intrinsic
def meet_rectangles(
    _: Any, table: Any, at: Any, limits: Any, slopes: Any
) -> Any:  # numpydoc ignore=RT01
    """
    Return a bit mask of the rectangles that may meet a frustum and are near enough the light.

    Parameters
    ----------
    table : (n, 5) float32, in Fortran's order
        Lowest and highest x, lowest and highest y, and greatest coordinate toward the light.
    at : int64
        First rectangle; seven more must follow.
    limits : (5,) float32
        Highest and lowest x, highest and lowest y, at coordinate 0, and least coordinate.
    slopes : (4,) float32
        What is added to the first four, for each unit of the coordinate toward the light.
    """
    signature = types.int64(
        table, types.int64, types.UniTuple(types.float32, 5), types.UniTuple(types.float32, 4)
    )

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        length = builder.extract_value(array.shape, 0)
        first = builder.gep(array.data, [arguments[1]])
        columns = [
            _load(builder, builder.gep(first, [builder.mul(length, _LONG(k))])) for k in range(5)
        ]
        near = columns[4]
        met = builder.fcmp_ordered(">=", near, _spread(builder, arguments[2], 4))
        for k, how in enumerate(("<=", ">=", "<=", ">=")):
            moved = builder.fmul(near, _spread(builder, arguments[3], k))
            limit = builder.fadd(moved, _spread(builder, arguments[2], k))
            met = builder.and_(met, builder.fcmp_ordered(how, columns[k], limit))
        return _pack(builder, met)

    return signature, generate


def _load(builder: Any, at: Any) -> Any:
    """Load LANES numbers."""
    return builder.load(builder.bitcast(at, _VECTOR.as_pointer()), align=4)


def _spread(builder: Any, values: Any, k: int) -> Any:
    """Broadcast the k-th value to all lanes."""
    vector = builder.insert_element(
        _VECTOR(ir.Undefined), builder.extract_value(values, k), _SHORT(0)
    )
    zeros = ir.Constant(ir.VectorType(_SHORT, LANES), [0] * LANES)
    return builder.shuffle_vector(vector, _VECTOR(ir.Undefined), zeros)


def _pack(builder: Any, lanes: Any) -> Any:
    """Pack booleans into a bit mask, one bit per lane."""
    return builder.zext(builder.bitcast(lanes, ir.IntType(LANES)), _LONG)
