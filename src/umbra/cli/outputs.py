"""The options of ``umbra study`` that ask for more than its three files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from umbra.writers.folder.outputs import NAMES, Outputs

__all__ = ["output_options", "take_outputs"]

F = TypeVar("F", bound=Callable)


def output_options(command: F) -> F:
    """Add the options to a command; ``take_outputs`` takes their values out again."""
    report = click.option(
        "--report",
        is_flag=True,
        help="Also write report.html: all in one page, with a slider through the day.",
    )
    write = click.option(
        "--write",
        multiple=True,
        metavar="FORMAT,...",
        help=f"Also write {', '.join(NAMES)}; several by commas, or repeat. pdf and svg: every "
        "picture, with its type as type.",
    )
    rules = click.option(
        "--rules",
        type=click.Path(path_type=Path),
        metavar="FILE.yaml",
        help="Judge the result by a rule file; writes verdicts.csv.",
    )
    sheet = click.option(
        "--sheet",
        is_flag=True,
        help="Also write sheet.png: plan and four elevations in one scale, on A3.",
    )
    return report(sheet(write(rules(command))))


def take_outputs(options: dict[str, Any]) -> Outputs:
    """
    Take the values of these options out of a command's, and check them before any work.

    Parameters
    ----------
    options : dict
        Of the command; what is left is for the study and its pictures.
    """
    return Outputs.of(
        options.pop("write"),
        receivers=options["receivers"],
        report=options.pop("report"),
        sheet=options.pop("sheet"),
        rules=options.pop("rules"),
        show=options["show"],
        at=options["at"],
    )
