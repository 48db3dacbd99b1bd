"""The options of ``umbra study`` that ask for more than its three files, and who writes them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from umbra.scene import Scene
    from umbra.study import Study
    from umbra.writers.painter import Painter
    from umbra.writers.plan import Plan

__all__ = ["Outputs", "output_options", "take_outputs"]

F = TypeVar("F", bound=Callable)

REPORT = "report.html"


def output_options(command: F) -> F:
    """Add the options to a command; ``take_outputs`` takes their values out again."""
    for option in reversed(
        (
            click.option(
                "--report",
                is_flag=True,
                help="Also write report.html: all in one page, with a slider through the day.",
            ),
        )
    ):
        command = option(command)
    return command


@dataclass(frozen=True)
class Outputs:
    """
    What is to be written besides ``study.nc`` and the pictures.

    Parameters
    ----------
    report : bool
    casters : tuple of str
        How casters were chosen, as typed.
    """

    report: bool
    casters: tuple[str, ...] = ()

    def write(
        self, folder: Path, study: "Study", scene: "Scene", plan: "Plan", painter: "Painter"
    ) -> list[str]:
        """
        Write into the unfinished results folder; the pictures are waited for if needed.

        Returns
        -------
        names : list of str
            Of the files, in the order in which they are told.
        """
        names: list[str] = []
        if self.report:
            from umbra.writers.report import write_report  # noqa: PLC0415

            painter.wait()
            sheets = [
                ("Hours in shadow", folder / "hours.png"),
                ("Shadows through the day", folder / "profile.png"),
            ]
            write_report(
                folder / REPORT, study, plan, sheets, casters=self.casters, notes=scene.notes
            )
            names.append(REPORT)
        return names


def take_outputs(options: dict[str, Any]) -> Outputs:
    """
    Take the values of these options out of a command's, and check them before any work.

    Parameters
    ----------
    options : dict
        Of the command; what is left is for the study.

    Returns
    -------
    outputs : Outputs
    """
    casters = [f"--cast {pattern}" for pattern in options.get("cast", ())]
    casters += [f"--no-cast {pattern}" for pattern in options.get("no_cast", ())]
    return Outputs(options.pop("report"), tuple(casters))
