"""Options of a study in tiles, besides those of any study."""

from __future__ import annotations

import math
import re
from functools import partial
from typing import Any

from umbra.errors import InputError, show_count, show_value
from umbra.machine import count_cores, find_memory, name_memory
from umbra.option_fields import (
    Given,
    Options,
    check_types,
    list_options,
    option,
    read_text,
    record,
)

__all__ = ["CityOptions", "TileOptions"]

_tiles = partial(option, heading="Tiles")
_LENGTH = re.compile(r"\s*([0-9.]+(?:e[0-9]+)?)\s*(m|km|ft)?\s*", re.IGNORECASE)
_UNITS = {"m": 1.0, "km": 1e3, "ft": 0.3048}
_SIZE = re.compile(r"\s*([0-9.]+)\s*(kb|mb|gb|tb|kib|mib|gib|tib)?\s*", re.IGNORECASE)
_BYTES = {"k": 10, "m": 20, "g": 30, "t": 40}
_LEAST = 1e9
"""Least memory that a process needs, half of it for Python and the kernels [byte]."""
_WORKERS_PER_CORE = 2
"""So that one counts while another waits for the disk."""


@record
class TileOptions(Options):
    """
    Options of whatever is counted in tiles, checked and normalised.

    Raises
    ------
    InputError
        If a value is wrong.
    """

    tiles: Given[str | float | None, Any] = _tiles(
        "any",
        "Count a city of any size in tiles of this side, such as 1km; FILE may be folders and "
        "patterns.",
        metavar="LENGTH",
    )  # fmt: skip
    memory: Given[str | float | None, Any] = _tiles(
        "any", "With tiles=: most memory of the run, such as 4GB; default: half the machine's.",
        metavar="SIZE", is_kept=False,
    )  # fmt: skip

    def __post_init__(self) -> None:
        check_types(self)
        if self.tiles is not None:
            object.__setattr__(self, "tiles", _read_length(self.tiles))
        if self.memory is not None:
            object.__setattr__(self, "memory", _read_memory(self.memory))
        own = (name for name, *_ in list_options(self) if name != "tiles")
        name = next((option for option in own if getattr(self, option) is not None), None)
        if self.tiles is None and name is not None:
            msg = f"{name}= is for a study in tiles; give their side, such as tiles='1km'"
            raise InputError(msg, option=name)

    @property
    def bytes(self) -> float:
        """Most memory of the run [byte]."""
        return find_memory() / 2 if self.memory is None else self.memory


@record
class CityOptions(TileOptions):
    """
    Options of a study in tiles, checked and normalised; see ``umbra.city_study``.

    Raises
    ------
    InputError
        If a value is wrong.
    """

    min_altitude: float | None = _tiles(
        "number",
        "With tiles=: leave out times when the sun is lower than this [degrees]; default: none.",
        unit="degree", metavar="DEG",
    )  # fmt: skip
    workers: int | None = _tiles(
        "whole",
        "With tiles=: count in this many processes of this machine, each on one thread.",
        least=1, metavar="N", is_kept=False,
    )  # fmt: skip
    scheduler: str | None = _tiles(
        "text",
        "With tiles=: count on a running Dask cluster: its scheduler's address, or the file "
        "scheduler.json. The scheduler can run code as you: name only one that you trust. All "
        "workers must see the files and the output folder.",
        metavar="ADDRESS", is_kept=False,
    )  # fmt: skip

    def __post_init__(self) -> None:
        TileOptions.__post_init__(self)
        read_text("scheduler", self.scheduler)
        if self.workers is not None and self.scheduler is not None:
            msg = "workers= starts a cluster and scheduler= takes a running one; give one of them"
            raise InputError(msg, option="workers")
        if self.min_altitude is not None and not 0 <= self.min_altitude < 90:
            msg = f"min_altitude is an angle of 0 to 90 degrees; got {self.min_altitude:g}"
            raise InputError(msg, option="min_altitude")
        if self.workers is not None:
            _check_workers(self.workers, self.bytes)


def _check_workers(workers: int, memory: float) -> None:
    """Refuse more processes than the machine's cores and the run's memory can serve."""
    cores = count_cores()
    most = min(_WORKERS_PER_CORE * cores, int(memory / _LEAST))
    if workers > most:
        msg = (
            f"workers={workers} is too many: {show_count(cores, 'core')} can be used, "
            f"and each process needs {_LEAST / 2**30:.2g} GB of the {memory / 2**30:.1f} GB that "
            f"the run may hold; {f'give at most {most}' if most else 'leave it out'}"
        )
        raise InputError(msg, option="workers")


def _read_length(given: Any) -> float:
    """Read the side of a tile [m]."""
    match = _LENGTH.fullmatch(str(given))
    try:
        length = float(match[1]) * _UNITS[(match[2] or "m").lower()] if match else 0.0
    except ValueError:
        length = 0.0
    if not 0 < length < math.inf:
        msg = f"tiles= is a length, such as '1km' or '500m'; got {show_value(given)}"
        raise InputError(msg, option="tiles")
    return length


def _read_memory(given: Any) -> float:
    """Read an amount of memory [byte]; GB and GiB are both 2^30."""
    match = _SIZE.fullmatch(str(given))
    try:
        size = float(match[1]) if match else 0.0
    except ValueError:
        size = 0.0
    if match and match[2]:
        size *= 2.0 ** _BYTES[match[2][0].lower()]
    if not size > 0:
        msg = f"memory= is a size, such as '4GB' or '800MB'; got {show_value(given)}"
        raise InputError(msg, option="memory")
    if size < _LEAST:
        msg = f"memory='{given}' is too little; a process needs {_LEAST / 2**30:.2g} GB at least"
        raise InputError(msg, option="memory")
    if size > find_memory():
        msg = f"memory='{given}' is more than there is: {name_memory(find_memory())}"
        raise InputError(msg, option="memory")
    return size
