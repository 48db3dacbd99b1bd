"""Values that options take: points, sizes, extents, lengths."""

import math
import re
from pathlib import Path
from typing import Any

import click

__all__ = ["LENGTH", "SIZE", "Length", "NewPath", "Numbers", "Size"]

_UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "km": 1e3, "ft": 0.3048}
_LENGTH = re.compile(r"(.*?)\s*(mm|cm|m|km|ft)?", re.IGNORECASE | re.DOTALL)


class Numbers(click.ParamType):
    """
    Finite numbers joined by commas.

    Parameters
    ----------
    name : str
        As shown in the help: ``X,Y,Z``.
    *counts : int
        How many there may be.
    remedy : str
        What to say of anything else.
    """

    def __init__(self, name: str, *counts: int, remedy: str = "numbers joined by commas") -> None:
        self.name, self.counts, self.remedy = name, counts, remedy

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[float, ...]:
        """Parse text; return a tuple unchanged."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(word) for word in str(value).split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in self.counts or not all(map(math.isfinite, numbers)):
            self.fail(f"'{value}' is not {self.name} ({self.remedy})", param, ctx)
        return numbers

    def get_metavar(self, *_: Any, **__: Any) -> str:
        """Return the name."""
        return self.name


class NewPath(click.Path):
    """A file or folder to write; an empty name, as from an unset variable, is refused."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Parse text; refuse an empty name."""
        if value == "":
            self.fail("the name is empty; name what is to be written", param, ctx)
        return super().convert(value, param, ctx)


class Size(click.ParamType):
    """Columns and rows: ``1024x768``."""

    name = "COLSxROWS"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[int, int]:
        """Parse text; return a tuple unchanged."""
        if isinstance(value, tuple):
            return value
        cols, _, rows = str(value).lower().partition("x")
        if not (cols.isdigit() and rows.isdigit() and int(cols) and int(rows)):
            self.fail(f"'{value}' is not COLSxROWS, such as 1024x768", param, ctx)
        return int(cols), int(rows)

    def get_metavar(self, *_: Any, **__: Any) -> str:
        """Return the name."""
        return self.name


class Length(click.ParamType):
    """A length in metres, or in the unit given: ``0.5``, ``50cm``."""

    name = "M"

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        """Parse text or a number."""
        number, unit = _LENGTH.fullmatch(str(value)).groups()  # type: ignore[union-attr]
        try:
            return float(number) * _UNITS[(unit or "m").lower()]
        except ValueError:
            units = ", ".join(_UNITS)
            self.fail(f"'{value}' is no length; give metres, or one in {units}: 50cm", param, ctx)


LENGTH = Length()
SIZE = Size()
