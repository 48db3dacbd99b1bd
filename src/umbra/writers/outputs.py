"""Further files of a study by name: umbra's own formats, and outputs of packages beside it."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from umbra.errors import InputError, UmbraError
from umbra.registry import Registry
from umbra.writers.formats import FORMATS, Format, Job

if TYPE_CHECKING:
    from umbra.study import Study

__all__ = ["REGISTRY", "Output", "find_format", "write_formats"]


class Output(ABC):
    """
    Base of further files of a study that packages beside umbra write.

    Attributes
    ----------
    needs_hours : bool
        Whether it is made of hours of sun; else of any measure.
    """

    needs_hours: ClassVar[bool] = False

    @abstractmethod
    def write(self, study: "Study", folder: Path) -> list[str]:
        """
        Write files of a study.

        Parameters
        ----------
        study : Study
            ``study.to_dataset()`` is what ``study.nc`` holds; ``study.quantities`` name its
            measures with their units and words.
        folder : Path
            Where the files go.

        Returns
        -------
        names : list of str
            Of the files in the folder.
        """


REGISTRY: Registry[Output] = Registry("output", "write", {}, Output, "Output", ())
"""Outputs that packages beside umbra bring."""


def find_format(name: str) -> Format:
    """
    Return a format by its name, umbra's own or one of a package.

    Raises
    ------
    InputError
        If the package that brings it cannot be used.
    """
    if name in FORMATS:
        return FORMATS[name]
    output = REGISTRY.find(name)
    return Format(partial(_write_added, name, output), needs_hours=output.needs_hours)


def _write_added(name: str, output: Output, job: Job) -> list[str]:
    """Write an output of a package; name it where it fails, or writes elsewhere."""
    try:
        written = [str(one) for one in output.write(job.study, job.folder)]
    except UmbraError:
        raise
    except Exception as error:
        msg = (
            f"write='{name}' failed ({type(error).__name__}: {error}); update the package that "
            "brings it, or leave it out"
        )
        raise InputError(msg, option="write") from error
    lacking = [one for one in written if Path(one).name != one or not (job.folder / one).exists()]
    if lacking:
        msg = f"write='{name}' named a file that it did not write into the folder: '{lacking[0]}'"
        raise InputError(msg, option="write")
    return written


def write_formats(job: Job, names: Sequence[str]) -> list[str]:
    """Write some of the formats; return the names of the files."""
    return list(dict.fromkeys(file for name in names for file in find_format(name).write(job)))
