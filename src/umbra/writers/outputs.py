"""Further files of a study by name: umbra's own formats, and outputs of packages beside it."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, ClassVar

from umbra.errors import InputError, UmbraError, show_value
from umbra.folders.atomic import is_full
from umbra.registry import Registry
from umbra.writers.output_formats import FORMATS, Format, Job, is_usual_name

if TYPE_CHECKING:
    from umbra.study import Study

__all__ = ["REGISTRY", "Output", "OutputError", "find_format", "write_formats"]


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


class OutputError(InputError):
    """An output of a package failed; all others are written."""


def _write_added(name: str, output: Output, job: Job) -> list[str]:
    """
    Write an output of a package into a folder of its own, and move its files beside the others.

    Raises
    ------
    OutputError
        If it fails, or names files that it did not write. Nothing of it is left then.
    """
    try:
        with TemporaryDirectory(prefix=".umbra-", dir=job.folder) as own:
            folder = Path(own) / "files"  # what lands in '..' is left behind
            folder.mkdir()
            written = output.write(job.study, folder)
            _check_written(written, folder, _find_taken(job))
            for path in folder.iterdir():
                path.replace(job.folder / path.name)
    except Exception as error:
        if isinstance(error, OSError) and is_full(error):
            raise
        reason = str(error) if isinstance(error, UmbraError) else f"{type(error).__name__}: {error}"
        msg = (
            f"write='{name}' failed ({reason}), and all else is written; update the package that "
            "brings it, or leave it out"
        )
        raise OutputError(msg, option="write", format=name) from error
    return list(written)


def _find_taken(job: Job) -> set[str]:
    """Return the names of files that are written, and of pictures that are still drawn."""
    drawn = [f"{one.name}{end}" for one in job.study.quantities for end in ("", "_lost")]
    pictures = {f"{name}.{kind}" for name in drawn for kind in ("png", "pdf", "svg")}
    return pictures | {path.name for path in job.folder.iterdir()}


def _check_written(names: object, folder: Path, taken: Collection[str]) -> None:
    """Refuse what is no list of names of files in the folder, and names that umbra writes."""
    advice = "write returns the names of the files in the folder that it is given"
    if not isinstance(names, (list, tuple)) or not all(isinstance(one, str) for one in names):
        msg = f"it returned {show_value(names)}; {advice}, as a list of str"
        raise InputError(msg)
    if strays := [path.name for path in folder.parent.iterdir() if path != folder]:
        msg = f"it wrote '{min(strays)}' outside its folder; {advice}"
        raise InputError(msg)
    for name in names:
        if Path(name).name != name or not (folder / name).is_file():
            msg = f"it named '{name}', which is no file in the folder; {advice}"
            raise InputError(msg)
    for path in folder.iterdir():
        if path.name not in names:
            msg = f"it wrote '{path.name}' and did not name it; {advice}"
            raise InputError(msg)
        if path.name in taken or is_usual_name(path.name):
            msg = f"it wrote '{path.name}', a name that umbra's own files have; choose another"
            raise InputError(msg)


def write_formats(job: Job, names: Sequence[str]) -> list[str]:
    """
    Write some of the formats; return the names of the files.

    An output of a package that fails keeps no other from being written: ``job.failures`` gets its
    error.
    """
    files: dict[str, None] = {}
    for name in names:
        try:
            files |= dict.fromkeys(find_format(name).write(job))
        except OutputError as error:
            job.failures.append(error)
    return list(files)
