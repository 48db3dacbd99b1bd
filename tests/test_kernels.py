"""Inner kernels count no references to arrays."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.kernels import borrowing


class Pair(NamedTuple):
    """Two arrays."""

    one: NDArray[np.float64]
    two: NDArray[np.float64]


def add_up(pair, n):
    total = 0.0
    now = pair.one
    for i in range(n):
        total += now[i]
        now = pair.two if now[i] > 0.0 else pair.one
    return total


def test_a_borrowing_kernel_counts_no_references():
    pair = Pair(np.array([1.0, -1.0, 2.0]), np.array([3.0, -5.0, 7.0]))
    borrowed, counted = borrowing(add_up), njit(add_up)
    assert borrowed(pair, 3) == counted(pair, 3) == 1.0 - 5.0 + 2.0
    if not hasattr(borrowed, "inspect_llvm"):  # without the compiler
        return
    assert "@NRT_incref" in find_body(counted)
    assert "@NRT_incref" not in find_body(borrowed)


def find_body(kernel):
    """Return the code of the kernel itself, without its wrappers for Python and C."""
    functions = next(iter(kernel.inspect_llvm().values())).split("define ")[1:]
    names = [one.split("(")[0] for one in functions]
    return functions[
        next(k for k, name in enumerate(names) if "cpython" not in name and "cfunc" not in name)
    ]
