"""Compilation of inner kernels."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit
from numba.core.options import DefaultOptions
from numba.core.types import unliteral

__all__ = ["borrowing", "inlined"]

F = TypeVar("F", bound=Callable[..., Any])

# Only kernels call them: wrappers for Python and C would take as long to compile as they do.
_INNER: dict[str, Any] = {
    "cache": True, "nogil": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True,
}  # fmt: skip
if hasattr(DefaultOptions, "_nrt"):
    _INNER["_nrt"] = False


def borrowing(kernel: F, **options: Any) -> F:
    """
    Compile a kernel that makes no arrays, and whose arrays its caller holds.

    numba counts the references to every array, also to those in records, whenever a variable or
    an argument names it: an atomic addition each time, in which threads wait for each other. Here
    none are counted. Functions with ``inline="always"`` follow the kernel that contains them;
    others that it calls need this decorator, or ``inlined``, too. Python cannot call it.
    ``options`` are numba's.
    """
    compiled: Any = njit(**{**_INNER, **options})(kernel)
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
