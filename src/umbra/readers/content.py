"""Content of a file that was named: its first bytes, its digest, all of it or a stream."""

import io
import os
import stat
import zipfile
import zlib
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, BinaryIO

from umbra.errors import InputError
from umbra.readers.checks import read_bounded

__all__ = ["GZIP", "ZIP", "BoundedStream", "FileContent"]

GZIP, ZIP = b"\x1f\x8b", b"PK\x03\x04"
EXPANSION = 200
"""Most growth of a compressed file; more is taken for an attack."""


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


class BoundedStream(io.RawIOBase):
    """
    An unpacked stream that may be at most `EXPANSION` times as long as its file.

    Parameters
    ----------
    stream : binary stream
        That unpacks.
    size : int
        Of the packed file [byte].
    """

    def __init__(self, stream: Any, size: int) -> None:
        self._stream = stream
        self._left = self._most = EXPANSION * size

    def read(self, size: int = -1) -> bytes:
        """Read a block; at the limit raise an error."""
        try:
            block: bytes = self._stream.read(size if size >= 0 else 1 << 20)
        except (EOFError, OSError, zipfile.BadZipFile, zlib.error) as error:
            msg = f"is damaged where it was compressed ({error}); fetch it again"
            raise InputError(msg) from error
        self._left -= len(block)
        if self._left < 0:
            msg = f"unpacks to more than {self._most / 1e6:.0f} MB; unpack it first"
            raise InputError(msg, bytes=self._most)
        return block

    def close(self) -> None:
        """Close the stream below."""
        self._stream.close()
        super().close()
