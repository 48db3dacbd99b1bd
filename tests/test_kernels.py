"""Inner kernels count no references to arrays; threads share the items of others."""

import os
import threading
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit, types
from numpy.typing import NDArray

from umbra import machine
from umbra.kernels import borrowing, inlined, run_shared, take_next


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


@njit(nogil=True)
def take_all(times, by, taken):
    thread = take_next(taken[1:])
    while True:
        item = take_next(taken)
        if item >= times.size:
            return
        times[item] += 1
        by[item] = thread
        work = 0.0
        for k in range(20_000):
            work += np.sin(k)
        times[item] += 0 * np.int64(work)


@pytest.mark.parametrize("threads", [1, 4])
def test_threads_take_each_item_once(threads, monkeypatch):
    monkeypatch.setattr(machine, "count_cores", lambda: 4)
    machine.use_threads(threads)
    try:
        times, by = np.zeros(300, np.int64), np.full(300, -1)
        run_shared(300, take_all, times, by)
    finally:
        machine.use_threads(machine.count_cores())
    assert (times == 1).all()
    assert set(by) <= set(range(threads))


@pytest.mark.parametrize("threads", [1, 2])
def test_as_many_threads_run_as_are_allowed(threads, monkeypatch):
    """All of them meet; one too many would wait alone."""
    monkeypatch.setattr(machine, "count_cores", lambda: 4)
    machine.use_threads(threads)
    met, came = threading.Barrier(threads), []

    def meet(taken):
        came.append(threading.get_ident())
        met.wait(30)

    try:
        run_shared(300, meet)
    finally:
        machine.use_threads(machine.count_cores())
    assert len(set(came)) == threads


def test_threads_that_have_begun_are_waited_for(monkeypatch):
    monkeypatch.setattr(machine, "count_cores", lambda: 4)
    machine.use_threads(2)
    has_begun, done = threading.Event(), []

    def work(taken):
        if threading.current_thread() is threading.main_thread():
            assert has_begun.wait(30)
        else:
            has_begun.set()
            time.sleep(0.3)
            done.append("helper")

    try:
        run_shared(2, work)
    finally:
        machine.use_threads(machine.count_cores())
    assert done == ["helper"]


def test_an_error_in_a_thread_is_raised():
    def fail(taken):
        msg = "in a thread"
        raise ValueError(msg)

    with pytest.raises(ValueError, match="in a thread"):
        run_shared(2, fail)


def test_a_fork_has_threads_of_its_own():
    if not hasattr(os, "fork"):
        pytest.skip("this system has no fork")
    times, by = np.zeros(300, np.int64), np.zeros(300, np.int64)
    run_shared(300, take_all, times, by)
    child = os.fork()
    if child == 0:
        run_shared(300, take_all, times, by)
        os._exit(0 if (times == 2).all() else 1)
    assert os.waitpid(child, 0)[1] == 0


def test_no_kernel_has_parallel_loops_of_numba():
    """They take 2 to 4 times as long to compile; ``run_shared`` does without."""
    names = ("prange", "parallel=True")
    for path in Path(machine.HOME).rglob("*.py"):
        text = path.read_text("utf-8")
        assert path.name == "kernels.py" or not any(name in text for name in names), path
