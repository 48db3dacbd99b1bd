"""Rows of tables as text: of points, of windows."""

import csv
import io
from pathlib import Path
from typing import Any

from umbra.errors import InputError

__all__ = ["read_rows"]


def read_rows(
    path: Path, /, what: str, columns: str, largest: int, **data: Any
) -> list[tuple[int, list[str]]]:
    """
    Read the rows of a table that are not empty, with the numbers of their lines.

    Parameters
    ----------
    path : Path
    what, columns : str
        What the table holds, and its columns, for errors.
    largest : int
        Most bytes that are read.
    **data
        Of errors.

    Raises
    ------
    InputError
        If the file cannot be read, or is no text in UTF-8.
    """
    try:
        with path.open("rb") as file:
            held = file.read(largest + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with a null byte
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        msg = f"{path}: {reason}; name a table of {what}"
        raise InputError(msg, **data) from None
    if len(held) > largest:
        msg = f"{path}: is larger than {largest / 1e6:,.0f} MB; cut it into several tables"
        raise InputError(msg, **data)
    try:
        text = held.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = held.count(b"\n", 0, error.start) + 1
        msg = (
            f"{path}, line {line}: has a byte {held[error.start]:#04x} that is not UTF-8; save the "
            "table as CSV in UTF-8"
        )
        raise InputError(msg, **data) from None
    first = text.partition("\n")[0]
    mark = ";" if ";" in first and "," not in first else ","
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=mark)
    try:
        return [(n, row) for n, row in enumerate(reader, 1) if any(map(str.strip, row))]
    except csv.Error as error:
        msg = f"{path}: cannot be read as a table ({error}); give {columns}"
        raise InputError(msg, **data) from None
