"""Values that options take: points, sizes, extents."""

import math
from typing import Any

import click

__all__ = ["SIZE", "Numbers", "Size"]


class Numbers(click.ParamType):
    """
    Finite numbers joined by commas.

    Parameters
    ----------
    name : str
        As shown in the help: ``X,Y,Z``.
    *counts : int
        How many there may be.
    """

    def __init__(self, name: str, *counts: int) -> None:
        self.name, self.counts = name, counts

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[float, ...]:
        """Parse; a tuple passes as it is."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(word) for word in str(value).split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in self.counts or not all(map(math.isfinite, numbers)):
            self.fail(f"'{value}' is not {self.name} (numbers joined by commas)", param, ctx)
        return numbers

    def get_metavar(self, *_: Any, **__: Any) -> str:
        """Show the name as it is."""
        return self.name


class Size(click.ParamType):
    """Columns and rows: ``1024x768``."""

    name = "COLSxROWS"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[int, int]:
        """Parse; a tuple passes as it is."""
        if isinstance(value, tuple):
            return value
        cols, _, rows = str(value).lower().partition("x")
        if not (cols.isdigit() and rows.isdigit() and int(cols) and int(rows)):
            self.fail(f"'{value}' is not COLSxROWS, such as 1024x768", param, ctx)
        return int(cols), int(rows)

    def get_metavar(self, *_: Any, **__: Any) -> str:
        """Show the name as it is."""
        return self.name


SIZE = Size()
