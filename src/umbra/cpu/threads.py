"""How many threads kernels use, and who runs them."""

import ctypes
import os
import sys
from contextlib import suppress
from pathlib import Path

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
    # Work is handed out piece by piece: halves decided beforehand are seldom equal.
    numba.set_parallel_chunksize(1)


def _load_tbb() -> None:
    """
    Load oneTBB where pip put it, so that numba finds it among its threading layers.

    numba asks the system's loader, which does not look into virtual environments, and
    falls back to OpenMP: that one spins while it waits, which on a busy machine makes
    two threads several times slower than one.
    """
    library = Path(sys.prefix) / "lib" / "libtbb.so.12"
    if library.exists():
        with suppress(OSError):
            ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)


_load_tbb()
