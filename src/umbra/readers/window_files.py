"""Tables of windows: a line for each, with the middle of its pane, azimuth, width and height."""

import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from umbra.errors import InputError
from umbra.readers.csv_rows import read_rows
from umbra.scene.named_places import Window

__all__ = ["COLUMNS", "WindowRow", "read_windows"]

COLUMNS = ("name", "x", "y", "z", "azimuth", "width", "height")
"""Columns that a table of windows needs."""
_MORE = ("tilt", "sill", "reveal", "flat", "room", "storey")
_LARGEST = 50_000_000  # [byte]; hundreds of thousands of windows
_LIMITS = {
    "azimuth": (0.0, 360.0), "tilt": (0.0, 180.0), "width": (1e-3, 1e3), "height": (1e-3, 1e3),
    "sill": (0.0, 1e3), "reveal": (0.0, 10.0), "x": (-1e10, 1e10), "y": (-1e10, 1e10),
    "z": (-1e5, 1e5),
}  # fmt: skip
_UNITS = {"azimuth": "degrees, clockwise from true north", "tilt": "degrees: 90 is upright"}


@dataclass(frozen=True)
class WindowRow:
    """A line of a table; ``azimuth`` is clockwise from true north, ``tilt`` 90 upright."""

    name: str
    x: float
    y: float
    z: float
    azimuth: float
    width: float
    height: float
    tilt: float = 90.0
    sill: float | None = None
    reveal: float | None = None
    flat: str = ""
    room: str = ""
    storey: str = ""

    def place(self, true_north: float) -> Window:
        """Return the window in a model whose true north lies at an azimuth [degrees]."""
        turn, tilt = math.radians(self.azimuth + true_north), math.radians(self.tilt)
        level = math.sin(tilt)
        normal = np.array([level * math.sin(turn), level * math.cos(turn), math.cos(tilt)])
        return Window(
            self.name, np.array([self.x, self.y, self.z]), normal, self.width, self.height,
            self.sill, self.reveal, self.storey, self.flat, self.room,
        )  # fmt: skip


def read_windows(path: str | Path) -> tuple[WindowRow, ...]:
    """
    Read a table of windows.

    Parameters
    ----------
    path : path
        CSV with a heading: the columns ``COLUMNS``, and any of tilt, sill, reveal, flat, room,
        storey, in any order; separated by commas or semicolons.

    Returns
    -------
    rows : tuple of WindowRow

    Raises
    ------
    InputError
        If it cannot be read, a column is missing, a value is no number or out of its range, or two
        windows have one name.
    """
    lines = _read_lines(Path(path))
    head = [word.strip().lower() for word in lines[0][1]]
    missing = [name for name in COLUMNS if name not in head]
    if missing:
        msg = (
            f"{path}: lacks the column{'s' * (len(missing) > 1)} {', '.join(missing)}; its columns "
            f"are {', '.join(head)[:200]}; windows need {','.join(COLUMNS)}[,{','.join(_MORE)}]"
        )
        raise InputError(msg, option="windows", columns=missing)
    column = {name: head.index(name) for name in (*COLUMNS, *_MORE) if name in head}
    rows = tuple(_read_row(path, n, row, column, k) for k, (n, row) in enumerate(lines[1:], 1))
    if not rows:
        msg = f"{path}: holds no window; give a line for each"
        raise InputError(msg, option="windows")
    name, count = Counter(row.name for row in rows).most_common(1)[0]
    if count > 1:
        msg = f"{path}: {count} windows are called '{name}'; give each a name of its own"
        raise InputError(msg, option="windows", window=name, count=count)
    return rows


def _read_lines(path: Path) -> list[tuple[int, list[str]]]:
    """Read the lines of a table that are not empty, with their numbers."""
    lines = read_rows(path, "windows", ",".join(COLUMNS), _LARGEST, option="windows")
    if not lines:
        msg = f"{path}: is empty; give a heading {','.join(COLUMNS)} and a line for each window"
        raise InputError(msg, option="windows")
    return lines


def _read_row(
    path: str | Path, line: int, row: list[str], column: dict[str, int], number: int
) -> WindowRow:
    """Read a line; the number of its window names it if it has no name."""
    values: dict[str, object] = {}
    for name, index in column.items():
        word = row[index].strip().replace("\0", "\ufffd") if index < len(row) else ""
        if name not in _LIMITS:
            values[name] = word
            continue
        if not word and name in _MORE:
            continue
        values[name] = _read_number(path, line, name, word)
    values["name"] = values["name"] or f"window {number}"
    return WindowRow(**values)  # type: ignore[arg-type]


def _read_number(path: str | Path, line: int, name: str, word: str) -> float:
    low, high = _LIMITS[name]
    try:
        value = float(word.replace(",", ".") if word.count(",") == 1 else word)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        span = f"{low:g} to {high:g} {_UNITS.get(name, 'm')}"
        msg = f"{path}: line {line}: {name} is a number from {span}; got '{word[:40]}'"
        raise InputError(msg, option="windows", line=line, column=name)
    return value
