"""A small table with a heading: rows of a report, and of a CSV file."""

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Table"]


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
        What a click on a row shows in the picture: ``part``, ``surface``, ``point``.
    index : sequence of int
        Which one, of each row.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]
    note: str = ""
    kind: str = ""
    index: Sequence[int] = ()
