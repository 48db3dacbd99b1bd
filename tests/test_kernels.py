"""Inner kernels count no references to arrays."""

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from umbra.kernels import borrowing, inlined


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


def multiply(numbers, n):
    product = 1.0
    for i in range(n):
        product *= numbers[i]
    return product


def multiply_too(numbers, n):
    product = 1.0
    for i in range(n):
        product *= numbers[i]
    return product


def test_a_borrowing_kernel_counts_no_references():
    pair = Pair(np.array([1.0, -1.0, 2.0]), np.array([3.0, -5.0, 7.0]))
    borrowed, counted = borrowing(add_up, cache=False), njit(add_up)

    @njit
    def call(pair, n):
        return borrowed(pair, n)

    assert call(pair, 3) == counted(pair, 3) == 1.0 - 5.0 + 2.0
    if not hasattr(borrowed, "inspect_llvm"):  # without the compiler
        return
    assert "@NRT_incref" in find_body(counted)
    assert "@NRT_incref" not in find_body(borrowed)


def test_an_inlined_kernel_is_part_of_its_caller():
    numbers = np.array([2.0, 3.0, 4.0])
    # A kernel that is loaded from the cache has no code to look into.
    called, contained = borrowing(multiply, cache=False), inlined(multiply_too, cache=False)

    @njit
    def call(numbers):
        return called(numbers, 3)

    @njit
    def contain(numbers):
        return contained(numbers, 3)

    assert call(numbers) == contain(numbers) == 24.0
    if not hasattr(contained, "inspect_llvm"):  # without the compiler
        return
    for kernel in (called, contained):  # not once for the number 3, and again for others
        assert [signature[1] for signature in kernel.signatures] == [types.int64]
    assert "alwaysinline" in next(iter(contained.inspect_llvm().values()))
    assert "alwaysinline" not in next(iter(called.inspect_llvm().values()))


def find_body(kernel):
    """Return the code of the kernel itself, without its wrappers for Python and C."""
    functions = next(iter(kernel.inspect_llvm().values())).split("define ")[1:]
    names = [one.split("(")[0] for one in functions]
    return functions[
        next(k for k, name in enumerate(names) if "cpython" not in name and "cfunc" not in name)
    ]
