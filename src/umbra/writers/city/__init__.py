"""
Further files of a study in tiles, made from its store tile by tile.

    result.py   the store: axes, tiles, which of them are done, windows of arrays
    rasters.py  a cloud-optimised GeoTIFF for each tile, and a VRT over them
    overview.py map.png, a picture of the whole
    stac.py     item.json, a STAC item
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from umbra.errors import InputError

__all__ = ["CITY_FORMATS", "check_city_formats", "write_city_files"]

CITY_FORMATS = ("geotiff", "map", "stac")
"""Names of the files of a study in tiles."""


def write_city_files(
    folder: str | Path,
    names: Sequence[str] = CITY_FORMATS,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> list[Path]:
    """
    Write files from the store in a results folder; tiles that are not done are left out.

    Parameters
    ----------
    folder : path
        Of a study in tiles.
    names : sequence of str
        Of ``CITY_FORMATS``.
    progress : callable
        Called with the number of GeoTIFFs done and of all.

    Returns
    -------
    paths : list of Path

    Raises
    ------
    InputError
        If the folder holds no such study, a name is unknown, or a package is missing.
    """
    from umbra.writers.city.overview import write_overview  # noqa: PLC0415
    from umbra.writers.city.rasters import write_rasters  # noqa: PLC0415
    from umbra.writers.city.result import CityResult  # noqa: PLC0415
    from umbra.writers.city.stac import write_stac  # noqa: PLC0415

    check_city_formats(names)
    result = CityResult(Path(folder))
    paths: list[Path] = []
    if "geotiff" in names:
        paths += write_rasters(result, progress)
    if "map" in names:
        paths.append(write_overview(result))
    if "stac" in names:
        paths.append(write_stac(result))
    return paths


def check_city_formats(names: Sequence[str], *, is_plan: bool = True) -> None:
    """
    Refuse formats that cannot be made of a study in tiles, before it is counted.

    Parameters
    ----------
    names : sequence of str
    is_plan : bool
        Whether the receivers are a plan's cells.

    Raises
    ------
    InputError
        If a name is unknown, is not for such receivers, or needs a package that is missing.
    """
    from umbra.writers.formats import check_extra  # noqa: PLC0415

    strange = [name for name in names if name not in CITY_FORMATS]
    if strange:
        msg = (
            f"write='{strange[0]}' is not made of a study in tiles; there are "
            f"{', '.join(CITY_FORMATS)}; choose of these, or leave tiles= out"
        )
        raise InputError(msg, option="write", formats=strange)
    if names and not is_plan:
        msg = (
            f"write='{names[0]}' is of plans, and surfaces in tiles are in study.zarr only; leave "
            "it out, or choose receivers='ground' or 'top'"
        )
        raise InputError(msg, option="write", formats=names)
    check_extra("a study in tiles", ["zarr"], "city")
    if "geotiff" in names:
        check_extra("write='geotiff'", ["rasterio"], "gis")
