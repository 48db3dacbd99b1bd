"""What every reader returns: parts in the file's own coordinates, and what it says of them."""

from dataclasses import dataclass

from umbra.scene import Light, Part, Source

__all__ = ["Model"]


@dataclass(frozen=True, eq=False)
class Model:
    """
    One file, read.

    Parameters
    ----------
    format : str
        For people: ``CityJSON 2.0``, ``OBJ``.
    parts : tuple of Part
        In the file's own coordinates; z is up.
    crs : str, optional
        As ``EPSG:7415`` where the file names a code, else its own words.
    notes : tuple of str
        What was left out, one line each.
    companions : tuple of Source
        Further files that hold a piece of it (glTF buffers).
    lights : tuple of Light
        In the file's own coordinates.
    """

    format: str
    parts: tuple[Part, ...]
    crs: str | None = None
    notes: tuple[str, ...] = ()
    companions: tuple[Source, ...] = ()
    lights: tuple[Light, ...] = ()
