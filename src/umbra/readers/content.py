"""Content of a file that was named: its first bytes, its digest, all of it or a stream."""

import io
import os
import stat
import zipfile
import zlib
from collections.abc import Callable, Sequence
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, BinaryIO

from umbra.errors import InputError
from umbra.readers.budget import Budget
from umbra.readers.checks import read_bounded

__all__ = ["GZIP", "ZIP", "BoundedStream", "FileContent", "open_archive"]

GZIP, ZIP = b"\x1f\x8b", b"PK\x03\x04"

_HEAD = 16_000  # bytes that hold a file's kind; roots of CityGML declare dozens of namespaces
_BLOCK = 1 << 22
_TOO_MUCH = "it unpacks to too much"
_HEADER = 30  # [byte] before a member of an archive, without its name


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


def open_archive(
    file: BinaryIO, budget: Budget, choose: Callable[[zipfile.ZipFile], Sequence[str]]
) -> tuple[zipfile.ZipFile, Sequence[str]]:
    """
    Open a ZIP archive, and choose members to read.

    Members that share bytes, as in archives made to unpack to more, are refused, and so is what
    says to unpack to too much: no member unpacks to more than the directory says.

    Returns
    -------
    archive : ZipFile
    chosen : sequence of str

    Raises
    ------
    BadZipFile
        If it is none.
    InputError
    """
    archive = zipfile.ZipFile(file)
    members = sorted(archive.infolist(), key=lambda member: member.header_offset)
    budget.count("members of archives", len(members))
    ends = [member.header_offset for member in members[1:]] + [archive.start_dir]
    for member, end in zip(members, ends, strict=False):
        # A member's header in the directory may be longer than the one before its bytes.
        if member.header_offset + _HEADER + len(member.orig_filename) + member.compress_size > end:
            msg = f"has members that overlap (first: '{member.filename[:60]}'); pack it again"
            raise InputError(msg, member=member.filename)
    chosen = choose(archive)
    budget.check_unpacked(sum(archive.getinfo(name).file_size for name in chosen), _TOO_MUCH)
    return archive, chosen


class BoundedStream(io.RawIOBase):
    """
    A stream that unpacks, and accounts for what it unpacks.

    Parameters
    ----------
    stream : binary stream
    budget : Budget
    """

    def __init__(self, stream: Any, budget: Budget) -> None:
        self._stream, self._budget = stream, budget

    def read(self, size: int = -1) -> bytes:
        """Read a block; refuse more than an archive may unpack to."""
        try:
            block: bytes = self._stream.read(size if size >= 0 else 1 << 20)
        except (EOFError, OSError, zipfile.BadZipFile, zlib.error) as error:
            msg = f"is damaged where it was compressed ({error}); fetch it again"
            raise InputError(msg) from error
        self._budget.unpack(len(block), _TOO_MUCH)
        return block

    def close(self) -> None:
        """Close the stream below."""
        self._stream.close()
        super().close()
