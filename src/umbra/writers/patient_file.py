"""
A file that takes what no longer fits, and says so afterwards.

HDF5 cannot close a file on a full disk: it fails again for every object that it frees,
and may end the process. Here it never hears of it.
"""

import io
import os

__all__ = ["PatientFile"]


class PatientFile(io.FileIO):
    """
    A new file, which remembers the first error of writing instead of raising it.

    After an error nothing more is written, and what was not reads as zeros; so ask
    `check` after each piece of work.

    Parameters
    ----------
    path : path
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__(os.fspath(path), "w+")
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise what went wrong."""
        if self._error is not None:
            raise self._error

    def write(self, data: object) -> int:
        """Write all of the data, or seem to."""
        view = memoryview(data).cast("B")  # type: ignore[arg-type]
        done = 0
        while self._error is None and done < len(view):
            try:
                done += super().write(view[done:]) or 0
            except OSError as error:
                self._error = error
        if done < len(view):
            self.seek(len(view) - done, os.SEEK_CUR)
        return len(view)

    def readinto(self, buffer: object) -> int:
        """Read; zeros beyond the end."""
        view = memoryview(buffer).cast("B")  # type: ignore[arg-type]
        done = super().readinto(view) or 0
        if self._error is not None and done < len(view):
            view[done:] = bytes(len(view) - done)
            done = len(view)
        return done

    def truncate(self, size: int | None = None) -> int:
        """Cut or lengthen the file."""
        try:
            return super().truncate(size)
        except OSError as error:
            self._error = self._error or error
            return self.tell() if size is None else size
