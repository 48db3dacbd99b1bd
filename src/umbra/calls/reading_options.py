"""
Options of every command that reads files: the site, the reading, canopy rasters.

They are those of ``umbra.read``, ``umbra.find_site`` and ``umbra.pose``, which check them.
"""

from __future__ import annotations

from functools import partial

from umbra.option_fields import Options, option, record

__all__ = ["CanopyOptions", "ReadingOptions", "SiteOptions"]

_site = partial(option, heading="Site")
_reading = partial(option, heading="Reading")
_canopy = partial(option, heading="Casters")


@record
class SiteOptions(Options):
    """The site, where the file does not say it; see ``umbra.find_site``."""

    latitude: float | None = _site(
        "number", "Latitude; default: the file's.", flag="--lat", unit="degree", metavar="DEG"
    )
    longitude: float | None = _site(
        "number", "Longitude, east positive; default: the file's.", flag="--lon", unit="degree",
        metavar="DEG",
    )  # fmt: skip
    zone: str | None = _site(
        "text", "Time zone, such as Europe/Vienna; default: the one at these coordinates.",
        flag="--tz", metavar="ZONE",
    )  # fmt: skip
    true_north: float | None = _site(
        "number",
        "Angle from the plan's y axis to true north, clockwise; default: the file's, or 0.",
        flag="--north", unit="degree", metavar="DEG",
    )  # fmt: skip


@record
class ReadingOptions(Options):
    """What a file does not state, and which of it is wanted; see ``umbra.read``."""

    up_axis: str | None = _reading(
        "choice",
        "The file's axis that points up, where the file does not say it.",
        flag="--up",
        choices=("x", "y", "z"),
    )
    height_column: str | None = _reading(
        "text", "Footprints: column of the height [m] above the base; default: found by its name.",
        metavar="NAME",
    )  # fmt: skip
    base_column: str | None = _reading(
        "text",
        "Footprints: column of the base's height [m]; default: found by its name, else 0, or the "
        "terrain of another file.",
        metavar="NAME",
    )
    name_column: str | None = _reading(
        "text", "Footprints: column of the names; default: the one with the most different names.",
        metavar="NAME",
    )  # fmt: skip
    time: float | None = _reading(
        "number", "Pose an animated file at this time [s]; default: not animated.", unit="s",
        metavar="S",
    )  # fmt: skip
    animation: str | None = _reading(
        "text",
        "The animation that time= poses, or that umbra view plays: its name, its number, or all; "
        "default: 0, the first.",
        metavar="NAME",
    )
    crs: str | None = _reading(
        "text",
        "Coordinate reference system of files that name none, such as EPSG:28992.",
        metavar="CRS",
    )
    bbox: str | None = _reading(
        "text",
        "Read only what lies at least partly in this rectangle; in degrees if all numbers can be, "
        "else in the coordinates of the first file.",
        metavar="XMIN,YMIN,XMAX,YMAX[,CRS]",
    )
    area: str | None = _reading(
        "text",
        "Read only what lies at least partly in this polygon: a GeoJSON file, or WKT.",
        metavar="FILE|WKT",
    )
    geometric_error: float | None = _reading(
        "number",
        "3D Tiles: largest geometric error of the tiles that are read [m]; default: the finest.",
        unit="m", metavar="M",
    )  # fmt: skip
    place: tuple[str, ...] = _reading(
        "texts",
        "Bring a layer's own origin to this place among the others: x, y in their coordinates, or "
        "latitude, longitude; its y axis AZIMUTH degrees clockwise from theirs; without Z on the "
        "ground there (X,Y,,AZIMUTH).",
        default=(), metavar="LAYER=X,Y[,Z][,AZIMUTH]",
    )  # fmt: skip
    lift: tuple[str, ...] = _reading(
        "texts",
        "Raise a layer by this length, or set its lowest point on the others' ground; after its "
        "move.",
        default=(), metavar="LAYER=M|ground",
    )  # fmt: skip
    move: tuple[str, ...] = _reading(
        "texts", "Move a layer by these lengths along x, y and z, after it was turned clockwise by "
        "TURN degrees about the middle of its plan.",
        default=(), metavar="LAYER=DX,DY[,DZ][,TURN]",
    )  # fmt: skip
    allow_outside: bool = _reading(
        "flag",
        "Let models name files outside their own folder (buffers, materials, textures); only for "
        "models that you trust.",
        default=False, is_kept=False,
    )  # fmt: skip
    max_memory: float | None = _reading(
        "number",
        "Memory that reading may take [GB]; raise it for a file that is refused; default: "
        "128 times their size, at least 0.5 GB, at most half of the memory.",
        unit="GB", metavar="GB", is_kept=False,
    )  # fmt: skip
    no_cache: bool = _reading(
        "flag",
        "Do not use the cache of files that were read; umbra doctor shows where it is.",
        default=False, is_kept=False,
    )  # fmt: skip


@record
class CanopyOptions(Options):
    """What canopy rasters do not state; see ``umbra.read``."""

    trunk: str | None = _canopy(
        "text",
        "Height at which crowns begin in a canopy raster: a share of the tree's, or a GeoTIFF; "
        "default: 0.25.",
        metavar="SHARE|FILE",
    )
    canopy_heights: str | None = _canopy(
        "choice", "Datum of the heights in a canopy raster; default: the ground below.",
        choices=("above-ground", "absolute"),
    )  # fmt: skip
