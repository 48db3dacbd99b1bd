"""Printing: the only module that writes text to a terminal."""

import json
import os
import sys
from typing import Any

import click

from umbra.printable import make_printable, shorten

__all__ = ["echo", "echo_json", "echo_path"]


def echo(text: object = "", *, err: bool = False) -> None:
    """
    Print lines without what would command a terminal, each cut at 500 letters.

    Parameters
    ----------
    text : object
    err : bool
        Whether to print to the error stream.
    """
    lines = make_printable(str(text)).split("\n")
    click.echo("\n".join(map(shorten, lines)), err=err)


def echo_path(path: str | os.PathLike[str]) -> None:
    """Print the full path of a file that was written; for scripts byte by byte."""
    text = os.fspath(path)
    is_watched = sys.stdout is not None and sys.stdout.isatty()
    click.echo(make_printable(text) if is_watched else text)


def echo_json(result: dict[str, Any]) -> None:
    r"""Print a result as one JSON object; what would command a terminal is written ``\u001b``."""
    import orjson  # noqa: PLC0415

    options = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_INDENT_2
    try:
        text = orjson.dumps(result, option=options).decode()
    except orjson.JSONEncodeError:  # of a file's name that is no Unicode; json escapes it
        text = json.dumps(result, indent=2, default=lambda array: array.tolist())
    click.echo(make_printable(text, is_json=True))
