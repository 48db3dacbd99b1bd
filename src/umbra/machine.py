"""The machine: how much memory this process may use, how many cores, and who runs its threads."""

import ctypes
import math
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path, PurePosixPath

try:
    import resource
except ImportError:  # Windows has no such limits
    resource = None  # type: ignore[assignment]

__all__ = ["count_cores", "find_memory", "name_memory", "use_threads"]

_UNKNOWN = 8e9
_GROUPS = Path("/proc/self/cgroup")
_FOLDERS = Path("/sys/fs/cgroup")
_USE = Path("/proc/self/statm")


def find_memory() -> float:
    """
    Return the memory that this process may use [byte]; 8 GB where no one tells.

    It is the machine's, or less where a control group (a container, a job of a cluster, a
    systemd service) or the process's own limits (``ulimit -v``, ``-d``) allow less.
    """
    return min(_find_physical(), _find_group_limit(), *_find_own_limits())


def name_memory(held: float) -> str:
    """Say in words how much memory that is, for errors."""
    is_machine = held >= _find_physical()
    return f"{'this machine has' if is_machine else 'this process may use'} {held / 1e9:.1f} GB"


def _find_physical() -> float:
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return _UNKNOWN


@cache
def _find_group_limit() -> float:
    """Return the least that a control group above this process may use [byte]."""
    least = math.inf
    for path in _find_group_files():
        with suppress(OSError, ValueError):  # it may say "max"
            least = min(least, float(path.read_text(encoding="ascii")))
    return least


def _find_own_limits() -> Iterator[float]:
    if resource is None:
        return
    # These bound addresses, of which libraries and threads take more than they use.
    size, resident, data = _find_use()
    for name, taken in (("RLIMIT_AS", size), ("RLIMIT_DATA", data)):
        limit = resource.getrlimit(getattr(resource, name))[0]
        if limit != resource.RLIM_INFINITY:
            yield max(float(limit - max(taken - resident, 0)), 0.0)


def _find_group_files() -> Iterator[Path]:
    """
    Return the files that limit this process's control group and those that hold it.

    In a container the group's own path may not be there, and the root is the container's.
    """
    text = ""
    with suppress(OSError, ValueError):
        text = _GROUPS.read_text(encoding="utf-8")
    for line in [*text.splitlines(), "0::/", "1:memory:/"]:
        _, _, rest = line.partition(":")
        kinds, _, path = rest.partition(":")
        inside = PurePosixPath(path).relative_to("/") if path.startswith("/") else PurePosixPath()
        roots: tuple[Path, ...]
        if not kinds:  # version 2
            roots, name = (_FOLDERS, _FOLDERS / "unified"), "memory.max"
        elif "memory" in kinds.split(","):  # version 1
            roots, name = (_FOLDERS / "memory",), "memory.limit_in_bytes"
        else:
            continue
        for root in roots:
            for group in (inside, *inside.parents):
                yield root / group / name


def _find_use() -> tuple[int, int, int]:
    """Return the addresses of this process, what of them is in memory, and those of data [byte]."""
    with suppress(OSError, ValueError):
        pages = [int(word) for word in _USE.read_text(encoding="ascii").split()]
        size, resident, data = (pages[n] * os.sysconf("SC_PAGE_SIZE") for n in (0, 1, 5))
        return size, resident, data
    return 0, 0, 0


def count_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def use_threads(threads: int) -> None:
    """
    Let kernels called from here use so many threads, as far as there are any.

    Results never depend on it.
    """
    import numba  # noqa: PLC0415  (readers ask for memory alone)

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
