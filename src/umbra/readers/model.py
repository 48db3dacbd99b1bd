"""What every reader returns: parts in the file's own coordinates, and what it says of them."""

from dataclasses import dataclass

from umbra.scene import Light, Part, Source

__all__ = ["Choices", "Model", "Place"]


@dataclass(frozen=True)
class Choices:
    """
    What a caller chooses that a file does not say.

    Parameters
    ----------
    up : {'x', 'y', 'z'}, optional
        The axis that points up.
    height_column, base_column : str, optional
        Of footprints: which column holds the height above the base, and which the
        base's own height.
    """

    up: str | None = None
    height_column: str | None = None
    base_column: str | None = None


@dataclass(frozen=True)
class Place:
    """
    Where a file says that it stands, beside or instead of a CRS.

    Parameters
    ----------
    latitude, longitude : float, optional
        [degrees]
    elevation : float, optional
        Above the sea [m].
    true_north : float, optional
        Azimuth of true north in the file's plan, clockwise from +y [degrees].
    ground : float, optional
        Height of the level ground in the file's own coordinates [m].
    """

    latitude: float | None = None
    longitude: float | None = None
    elevation: float | None = None
    true_north: float | None = None
    ground: float | None = None


NOWHERE = Place()


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
    place : Place
        What it says of its site, beside the CRS.
    is_afloat : bool
        Whether the file does not say how high its parts stand: they stand on 0, or
        on a terrain if another file brings one.
    is_terrain : bool
        Whether parts without a height may be stood on it.
    """

    format: str
    parts: tuple[Part, ...]
    crs: str | None = None
    notes: tuple[str, ...] = ()
    companions: tuple[Source, ...] = ()
    lights: tuple[Light, ...] = ()
    place: Place = NOWHERE
    is_afloat: bool = False
    is_terrain: bool = False
