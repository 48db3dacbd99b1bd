"""Asking for memory ahead of its use, from numba."""

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

__all__ = ["prefetch"]


@intrinsic
def prefetch(_typing, array, place):
    """
    Ask for the cache line of one entry of an array, and go on at once.

    Only a hint: where processors or arrays know nothing of it, nothing happens.

    Parameters
    ----------
    array : contiguous array
    place : int64
        In the array read as if it were flat.
    """

    def generate(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        byte = ir.IntType(8).as_pointer()
        number = ir.IntType(32)
        hint = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        call = cgutils.get_or_insert_function(builder.module, hint, "llvm.prefetch.p0i8")
        address = builder.bitcast(builder.gep(data, [arguments[1]]), byte)
        read, keep, is_data = (ir.Constant(number, value) for value in (0, 3, 1))
        builder.call(call, [address, read, keep, is_data])
        return context.get_dummy_value()

    return types.void(array, place), generate
