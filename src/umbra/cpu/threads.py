"""How many threads kernels use."""

import os

import numba

__all__ = ["count_cores", "use_threads"]


def count_cores() -> int:
    """Give the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def use_threads(threads: int) -> None:
    """
    Let kernels called from here use so many threads, as far as there are any.

    Results never depend on it.
    """
    most = numba.config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]
    numba.set_num_threads(max(1, min(threads, most)))
