"""The methods by which each device counts, by name: what commands offer and counters check."""

from dataclasses import dataclass
from typing import Literal

from umbra.errors import InputError

__all__ = ["METHODS", "SOFT", "DeviceName", "Methods"]

DeviceName = Literal["auto", "cpu", "gl"]
"""What callers may ask for, as signatures say it."""
SOFT = ("samples", "wedges", "weng")
"""Soft shadows: samples of the light (the reference), penumbra wedges, scaled layers."""


@dataclass(frozen=True)
class Methods:
    """
    What one device can count by.

    Parameters
    ----------
    title : str
        The device as refusals call it.
    volumes : tuple of str
        Hard shadows by counting volumes; the first is the default.
    masks : tuple of str
        Hard shadows by masks without a stencil.
    soft : tuple of str
    """

    title: str
    volumes: tuple[str, ...]
    masks: tuple[str, ...] = ()
    soft: tuple[str, ...] = SOFT

    @property
    def hard(self) -> tuple[str, ...]:
        """All methods of hard shadows."""
        return (*self.volumes, *self.masks)

    def check(self, method: str, *, masks: bool = True) -> None:
        """
        Refuse a method of hard shadows that the device does not have.

        Parameters
        ----------
        method : str
        masks : bool
            Whether it may be a mask.

        Raises
        ------
        InputError
            If it has none of this name; the error names those that it has.
        """
        names = self.hard if masks else self.volumes
        if method not in names:
            msg = f"the {self.title} has no method '{method}'; it has {', '.join(names)}"
            raise InputError(msg, method=method)

    def check_soft(self, method: str) -> None:
        """Refuse a method of soft shadows that the device does not have; raises as `check`."""
        if method not in self.soft:
            has = f"it has {', '.join(self.soft)}" if self.soft else "it has none"
            msg = f"the {self.title} has no soft shadows by '{method}'; {has}"
            raise InputError(msg, method=method)


METHODS = {
    "cpu": Methods("cpu", ("auto", "z-pass", "z-fail")),
    "gl": Methods(
        "gl device",
        ("auto", "z-pass", "z-fail", "lengyel", "mcguire"),
        ("alpha", "screen", "max", "half"),
    ),
}
"""By the device's name."""
