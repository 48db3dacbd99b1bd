"""How much memory there is, so that work that cannot fit is refused before it starts."""

import os
from contextlib import suppress
from pathlib import Path

__all__ = ["find_memory"]

_CGROUPS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def find_memory() -> float:
    """Give the memory that this process may use [byte]; 8 GB where no one tells."""
    try:
        held = float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 8e9
    for limit in _CGROUPS:  # a container's share of the machine
        with suppress(OSError, ValueError):  # it may say "max"
            held = min(held, float(Path(limit).read_text(encoding="ascii")))
    return held
