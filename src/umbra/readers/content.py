"""Content of a file that was named: its first bytes, its digest, all of it or a stream."""

import io
import os
import stat
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import BinaryIO

from umbra.readers.checks import read_bounded

__all__ = ["FileContent"]

_HEAD = 16_000  # bytes that hold a file's kind; roots of CityGML declare dozens of namespaces
_BLOCK = 1 << 22


class FileContent:
    """
    Content of one file, read on demand.

    Parameters
    ----------
    path : Path
        A regular file, opened anew by `open`, or a pipe, which is read at once.
    data : bytes, optional
        Content already read.

    Attributes
    ----------
    head : bytes
        First bytes, which hold the kind of the file.
    size : int
        Of the whole file [byte].
    """

    def __init__(self, path: Path, data: bytes | None = None) -> None:
        self.path = path
        if data is None:
            with path.open("rb") as file:
                status = os.fstat(file.fileno())
                if stat.S_ISREG(status.st_mode):
                    self.head, self.size = file.read(_HEAD), status.st_size
                    return
                data = read_bounded(file)
        self.data = data  # replaces the cached property
        self.head, self.size = data[:_HEAD], len(data)

    @cached_property
    def data(self) -> bytes:
        """All bytes, of a file of bounded size."""
        with self.path.open("rb") as file:
            return read_bounded(file)

    @cached_property
    def digest(self) -> bytes:
        """SHA-256 of all bytes."""
        if "data" in self.__dict__:
            return sha256(self.data).digest()
        summed = sha256()
        with self.path.open("rb") as file:
            while block := file.read(_BLOCK):
                summed.update(block)
        return summed.digest()

    def open(self) -> BinaryIO:
        """Open a stream of all bytes."""
        if "data" in self.__dict__:
            return io.BytesIO(self.data)
        return self.path.open("rb")

    def forget(self) -> None:
        """Free the bytes of a regular file, which can be read again."""
        if self.path.is_file():
            _ = self.digest
            self.__dict__.pop("data", None)
