"""
Compilation of inner kernels, and kernels whose items are shared by threads.

A kernel with numba's ``parallel=True`` takes 2 to 4 times as long to compile as one for a single
thread. So the kernels of a first study run in a pool of Python's threads, without the GIL.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any, TypeVar, cast

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import config, event
from numba.core.options import DefaultOptions
from numba.core.registry import CPUDispatcher
from numba.core.types import unliteral
from numba.extending import intrinsic

from umbra.machine import count_cores, get_threads, tell_compiling

__all__ = [
    "borrowing", "copy_numbers", "copy_rows", "cross", "dot", "find_lowest", "inlined", "inner",
    "kernel", "run_shared", "take_next",
]  # fmt: skip

F = TypeVar("F", bound=Callable[..., Any])


class _Listener(event.Listener):
    """Hears of every kernel that numba compiles, and tells of umbra's."""

    def on_start(self, event: Any) -> None:
        if event.data["dispatcher"].py_func.__module__.startswith("umbra."):
            tell_compiling()

    def on_end(self, event: Any) -> None:
        """Do nothing: what is told is that it has begun."""


event.register("numba:compile", _Listener())

# No C calls them, whose wrapper would only take time to compile. That of Python stays: without
# it a slip would end the process, not in an error.
_INNER: dict[str, Any] = {"cache": True, "nogil": True, "no_cfunc_wrapper": True}
_BORROWING = _INNER | ({"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {})


def kernel(function: F, **options: Any) -> F:
    """
    Compile a kernel, once for each combination of its arguments' types, and keep it.

    Each costs time at the first run. What it is made of counts as well: loops over numbers are
    cheap, while array expressions (``a + b``), assignments to slices, ``np.cross`` and sorting
    take 0.15 to 4 s each. ``options`` are numba's.
    """
    return cast(F, _compile(function, _INNER | options))


def inner(function: F, **options: Any) -> F:
    """Compile a kernel that only kernels call. ``options`` are numba's."""
    return kernel(function, **options)


def borrowing(function: F, **options: Any) -> F:
    """
    Compile a kernel that makes no arrays, and whose arrays its caller holds.

    numba counts the references to every array, also to those in records, whenever a variable or
    an argument names it: an atomic addition each time, in which threads wait for each other. Here
    none are counted. Functions with ``inline="always"`` follow the kernel that contains them;
    others that it calls need this decorator, or ``inlined``, too. ``options`` are numba's.
    """
    return cast(F, _compile(function, _BORROWING | options))


class _Kernel(CPUDispatcher):
    """
    A kernel of which a call with a constant is one with any number.

    numba takes a constant for a type of its own, also as the first value of a variable (``n = 0``
    before a loop with ``n = add(n)``), and compiles what is called once more for it: 31 s in place
    of 27 of a first study of surfaces, 140 kernels in place of 130.
    """

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how a kernel's call is typed, and compile what it needs."""
        return super().get_call_template([unliteral(kind) for kind in args], kws)


def _compile(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Do what numba's ``njit`` does, for a kernel of the class above."""
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    is_kept = options.pop("cache")
    compiled = _Kernel(function, targetoptions={"nopython": True, "boundscheck": None, **options})
    if is_kept:
        compiled.enable_caching()
    return compiled


def inlined(function: F, **options: Any) -> F:
    """
    Compile a borrowing kernel into every place that calls it.

    A call copies all fields of all arrays, some 7 for each, which takes longer than a short kernel.
    Unlike ``inline="always"``, its types are found once and not in each place.
    """
    return borrowing(function, forceinline=True, **options)


@inlined
def dot(p, q):
    """Return the scalar product of two tuples of three."""
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


@inlined
def cross(p, q):
    """Return the vector product of two tuples of three."""
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


@inlined
def copy_numbers(source, target):
    """Copy the numbers of an array to the first of another."""
    for i in range(source.shape[0]):
        target[i] = source[i]


@inlined
def copy_rows(source, target):
    """
    Copy the rows of a matrix to the first rows of another.

    An assignment to a slice takes two seconds to compile, for the words of its error.
    """
    for i in range(source.shape[0]):
        for k in range(source.shape[1]):
            target[i, k] = source[i, k]


@intrinsic
def find_lowest(_: Any, _bits: Any) -> Any:  # numpydoc ignore=RT01
    """Find the lowest set bit of a nonzero int64."""

    def generate(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.IntType(1)(1))

    return types.int64(types.int64), generate


@intrinsic
def take_next(_: Any, taken: Any) -> Any:  # numpydoc ignore=RT01
    """Return the first number of an array of int64, and add one for the next thread."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.atomic_rmw("add", data, ir.IntType(64)(1), "monotonic")

    return types.int64(taken), generate


def run_shared(items: int, kernel: Callable[..., object], *arguments: Any) -> None:
    """
    Run a kernel in as many threads as ``use_threads`` allows this one, and has items for.

    The kernel's last argument, (2,) int64 of 0, is shared: by ``take_next(taken)`` it takes one
    item after another until there are no more, and ``take_next(taken[1:])`` numbers its threads.

    Parameters
    ----------
    items : int
    kernel : callable
        Compiled with ``nogil=True``.
    *arguments
        Its other arguments.
    """
    taken = np.zeros(2, np.int64)
    helpers = [
        _find_pool().submit(kernel, *arguments, taken) for _ in range(min(get_threads(), items) - 1)
    ]
    try:
        kernel(*arguments, taken)
    finally:
        for helper in helpers:
            if not helper.cancel():  # it has begun
                helper.result()


@cache
def _find_pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count_cores(), "umbra-kernels")


if hasattr(os, "register_at_fork"):  # a child has none of its parent's threads
    os.register_at_fork(after_in_child=_find_pool.cache_clear)
