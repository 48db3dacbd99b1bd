"""Compilation of inner kernels."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit
from numba.core.options import DefaultOptions

__all__ = ["borrowing"]

F = TypeVar("F", bound=Callable[..., Any])

_UNCOUNTED: dict[str, Any] = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}


def borrowing(kernel: F) -> F:
    """
    Compile a kernel that makes no arrays, and whose arrays its caller holds.

    numba counts the references to every array, also to those in records, whenever a variable or
    an argument names it: an atomic addition each time, in which threads wait for each other. Here
    none are counted. Functions with ``inline="always"`` follow the kernel that contains them;
    others that it calls need this decorator too.
    """
    return njit(cache=True, nogil=True, **_UNCOUNTED)(kernel)
