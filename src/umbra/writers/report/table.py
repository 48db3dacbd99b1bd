"""A small table with a heading: rows of a report, and of a CSV file."""

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Pin", "Table"]


@dataclass(frozen=True)
class Pin:
    """
    A place that is marked on a plan.

    Parameters
    ----------
    name : str
    x, y : float
        In the model's own coordinates [m].
    passes : bool
    standing : str
        What it lies in, under or on, if anything.
    """

    name: str
    x: float
    y: float
    passes: bool
    standing: str = ""


@dataclass(frozen=True)
class Table:
    """
    Rows under named columns.

    Parameters
    ----------
    title : str
    columns : sequence of str
        With their units: ``"sun [h]"``.
    rows : sequence of sequences
        Numbers or text; None where there is no value. A cell that begins with ``pass`` or
        ``fail`` is marked.
    note : str
        What a reader must know besides.
    kind : str
        What a click on a row shows in the picture: ``part``, ``surface``, ``point``, or the
        ``place`` of a pin.
    index : sequence of int
        Which one, of each row; None where a row shows nothing.
    link : int
        The column that says so.
    pins : sequence of Pin
        What is marked on a plan.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]
    note: str = ""
    kind: str = ""
    index: Sequence[int | None] = ()
    link: int = 0
    pins: Sequence[Pin] = ()
