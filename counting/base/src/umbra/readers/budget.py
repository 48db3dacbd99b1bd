"""What one reading may take, of one file or of many: memory, and bytes that pass by."""

from umbra.errors import InputError
from umbra.machine import find_memory
from umbra.readers.child import ChildLimits
from umbra.scene.numbers import read_number

__all__ = ["GIGABYTE", "Budget", "TooLargeError", "make_budget"]

LEAST = 512e6  # [byte] of memory that any files may take
FACTOR = 128  # memory per byte of the files
SHARE = 0.5  # of the memory
LEAST_UNPACKED = 64e6  # [byte] that any archive may unpack to, where they are not kept
EXPANSION = 36  # most growth of archives; city models in XML shrink to a tenth or a thirtieth
ITEM = 5000
"""Memory of an object in a scene without its mesh [byte]: names, matrix, material, levels."""
FILE = 50_000
"""What looking for a file that a model names is charged [byte], for the time it takes."""
SECONDS, FOR_A_BYTE = 6.0, 1e-6  # processor time of a child [s], and more of it for a byte
GIGABYTE = 1e9


class TooLargeError(InputError):
    """Files ask for more than they may take."""


class Budget:
    """
    Accounts of one call of `umbra.read`: every reader charges what it keeps and unpacks.

    Limits grow with the files' sizes, each file counted once, however often it is named.

    Parameters
    ----------
    most : float, optional
        Memory that the caller allows instead [byte].
    """

    def __init__(self, most: float | None = None) -> None:
        self._most = most
        self._sizes: dict[str, int] = {}
        self._spent = self._unpacked = 0.0
        self._held = SHARE * find_memory()
        self._set_limits()

    def grow(self, name: object, size: int) -> None:
        """Add the size of a file [byte], once."""
        self._sizes[str(name)] = size
        self._set_limits()

    def _set_limits(self) -> None:
        self.size = sum(self._sizes.values())
        """Of all files together [byte]."""
        usual = min(max(LEAST, FACTOR * self.size), self._held)
        self.limit = usual if self._most is None else self._most
        """Memory that may be spent in all [byte]."""
        self._most_unpacked = max(EXPANSION * self.size, LEAST_UNPACKED, self._most or 0.0)

    def spend(self, size: float, what: str) -> None:
        """Reserve memory [byte]; refuse more than the files' size justifies."""
        self.check(size, what)
        self._spent += size

    def check(self, size: float, what: str) -> None:
        """Refuse memory that is needed for a while [byte], beside what is spent."""
        if self._spent + size > self.limit:
            raise self._refuse(what, "memory", self._spent + size, self.limit)

    def count(self, what: str, number: float = 1) -> None:
        """Reserve the memory of objects, tiles, members or links."""
        self.spend(ITEM * number, what)

    def find_file(self) -> None:
        """Charge a file that a model names, before it is looked for."""
        self.spend(FILE, "files that it names")

    def unpack(self, size: float, what: str) -> None:
        """Account for bytes that are unpacked and not kept."""
        self.check_unpacked(size, what)
        self._unpacked += size

    def check_unpacked(self, size: float, what: str) -> None:
        """Refuse bytes that are to be unpacked and not kept, beside those that were."""
        if self._unpacked + size > self._most_unpacked:
            raise self._refuse(what, "unpacked data", self._unpacked + size, self._most_unpacked)

    def limit_child(
        self, seconds: float | None = None, for_a_byte: float = FOR_A_BYTE
    ) -> "ChildLimits":
        """
        Return what a child may take that reads one of the files.

        ``seconds`` until each piece [s]; by default all that it may take, which grows with the
        files' size.
        """
        whole = SECONDS + for_a_byte * self.size
        memory = max(self.limit - self._spent, LEAST / 2)
        return ChildLimits(whole if seconds is None else min(seconds, whole), whole, memory)

    def _refuse(self, what: str, kind: str, needed: float, limit: float) -> TooLargeError:
        msg = (
            f"{what}: {needed / GIGABYTE:,.2f} GB of {kind} in all are more than files of "
            f"{self.size / 1e6:,.1f} MB may take ({limit / GIGABYTE:,.2f} GB); if the model is "
            "that large, say how much it may take (max_memory=)"
        )
        return TooLargeError(msg, option="max_memory", needed=needed, limit=limit)


def make_budget(most: float | None) -> Budget:
    """Return the budget of a call whose caller may allow so much memory [GB]."""
    if most is None:
        return Budget(None)
    number = read_number("max_memory=", most)
    if not number > 0:
        msg = f"max_memory= is a number of gigabytes above 0; got {most!r}"
        raise InputError(msg, option="max_memory")
    return Budget(number * GIGABYTE)
