"""Readers that packages beside umbra bring: of files whose ending is their name."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from umbra.errors import InputError, UmbraError
from umbra.readers.model import FileModel, ReadChoices
from umbra.registry import Registry
from umbra.scene import Part

__all__ = ["REGISTRY", "Reader", "read_added"]


class Reader(ABC):
    """
    Base of readers of a file format.

    A reader is registered by the ending of its files, without the dot.

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


REGISTRY: Registry[Reader] = Registry("reader", "files", {}, Reader, "Reader", ("title",))
"""Readers of packages, by the ending of their files."""


def read_added(name: str, data: bytes, path: Path, _choices: ReadChoices) -> FileModel:
    """Read a file with the reader of a package; name the package where it fails."""
    reader = REGISTRY.find(name)
    try:
        parts = tuple(reader.read(data, path))
    except UmbraError:
        raise
    except Exception as error:
        msg = f"reader '{name}' failed ({type(error).__name__}: {error}); update its package"
        raise InputError(msg) from error
    return FileModel(reader.title, parts)
