from numba import types
from numba.extending import intrinsic
from llvmlite import ir
@intrinsic
def tick(_):
    def gen(context, builder, sig, args):
        fn = builder.module.declare_intrinsic('llvm.readcyclecounter', (), ir.FunctionType(ir.IntType(64), []))
        return builder.call(fn, [])
    return types.int64(), gen
