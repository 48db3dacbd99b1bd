"""Compilation of inner kernels."""

from collections.abc import Callable
from typing import Any, TypeVar

from llvmlite import ir
from numba import njit, types
from numba.core.options import DefaultOptions
from numba.core.types import unliteral
from numba.extending import intrinsic

__all__ = ["borrowing", "cross", "dot", "find_lowest", "inlined", "inner"]

F = TypeVar("F", bound=Callable[..., Any])

# No C calls them, whose wrapper would only take time to compile. That of Python stays: without
# it a slip would end the process, not in an error.
_INNER: dict[str, Any] = {"cache": True, "nogil": True, "no_cfunc_wrapper": True}
_BORROWING = _INNER | ({"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {})


def inner(kernel: F, **options: Any) -> F:
    """Compile a kernel that only kernels call. ``options`` are numba's."""
    compiled: F = njit(**{**_INNER, **options})(kernel)
    return compiled


def borrowing(kernel: F, **options: Any) -> F:
    """
    Compile a kernel that makes no arrays, and whose arrays its caller holds.

    numba counts the references to every array, also to those in records, whenever a variable or
    an argument names it: an atomic addition each time, in which threads wait for each other. Here
    none are counted. Functions with ``inline="always"`` follow the kernel that contains them;
    others that it calls need this decorator, or ``inlined``, too. ``options`` are numba's.
    """
    compiled: Any = njit(**{**_BORROWING, **options})(kernel)
    if hasattr(compiled, "get_call_template"):  # it has not without the compiler
        find = compiled.get_call_template
        # A constant argument is a number like any other: for each it would be compiled once more.
        compiled.get_call_template = lambda types, named: find([unliteral(t) for t in types], named)
    return compiled


def inlined(kernel: F, **options: Any) -> F:
    """
    Compile a borrowing kernel into every place that calls it.

    A call copies all fields of all arrays, some 7 for each, which takes longer than a short kernel.
    Unlike ``inline="always"``, its types are found once and not in each place.
    """
    return borrowing(kernel, forceinline=True, **options)


@inlined
def dot(p, q):
    """Return the scalar product of two tuples of three."""
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


@inlined
def cross(p, q):
    """Return the vector product of two tuples of three."""
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


@intrinsic
def find_lowest(_: Any, _bits: Any) -> Any:  # numpydoc ignore=RT01
    """Find the lowest set bit of a nonzero int64."""

    def generate(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.IntType(1)(1))

    return types.int64(types.int64), generate
