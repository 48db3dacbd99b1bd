"""Readers that packages beside umbra bring: of files whose ending is their name."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from umbra.errors import InputError, UmbraError, show_value
from umbra.readers.model import FileModel, ReadChoices
from umbra.registry import Registry
from umbra.scene import Part

__all__ = ["REGISTRY", "Reader", "read_added"]


class Reader(ABC):
    """
    Base of readers of a file format.

    A reader is registered by the ending of its files, with or without the dot.

    Attributes
    ----------
    title : str
        The format's name for people.
    """

    title: ClassVar[str]

    @abstractmethod
    def read(self, data: bytes, path: Path) -> Sequence[Part]:
        """
        Read a file.

        Parameters
        ----------
        data : bytes
            The whole file; other files are not read.
        path : Path
            Its name, for messages and parts' names.

        Returns
        -------
        parts : sequence of Part
            Meshes in metres, x east, y north, z up.

        Raises
        ------
        InputError
            If the file is damaged: one line with what, where and the remedy.
        """


def _spell(name: str) -> str:
    """Return an ending as files are looked up by it: small letters, without the dot."""
    return name.removeprefix(".").lower()


REGISTRY: Registry[Reader] = Registry("reader", "files", {}, Reader, "Reader", ("title",), _spell)
"""Readers of packages, by the ending of their files."""


def read_added(name: str, data: bytes, path: Path, _choices: ReadChoices) -> FileModel:
    """Read a file with the reader of a package; name the package where it fails."""
    reader = REGISTRY.find(name)
    try:
        parts = tuple(reader.read(data, path))
        _check_parts(parts)
    except UmbraError:
        raise
    except Exception as error:
        msg = (
            f"the reader '{name}' of the package '{REGISTRY.name_package(name)}' failed "
            f"({type(error).__name__}: {error}); update the package, the file may be sound"
        )
        raise InputError(msg, reader=name) from error
    return FileModel(reader.title, parts)


def _check_parts(parts: Sequence[object]) -> None:
    """Refuse what is no part, which checks itself when it is made."""
    for number, part in enumerate(parts, 1):
        if not isinstance(part, Part):
            msg = f"part {number} is {show_value(part)}; return Part(name, kind, mesh)"
            raise TypeError(msg)
