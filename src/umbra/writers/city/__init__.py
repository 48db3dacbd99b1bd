"""
Further files of a study in tiles, made from its store tile by tile.

    sealed_files.py  checksums of the files of tiles
    result.py   the store of a plan: axes, tiles, which of them are done, windows of arrays
    rasters.py  a cloud-optimised GeoTIFF for each tile, and a VRT over them
    overview.py map.png and hours_lost.png, pictures of the whole
    city_map.py the map of a report: hours as a raster, areas by verdict over it
    city_report.py report.html
    city_figures.py what counts in figures, and months.csv
    stac.py     item.json, a STAC item
    city_surfaces.py surfaces and their results, also in the city's own CityJSON files
    models.py   coloured 3D Tiles, with figures of each surface
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from umbra.errors import InputError
from umbra.packages import require
from umbra.rules.first_format import convert
from umbra.rules.record import Rule
from umbra.study.options import StudyOptions
from umbra.writers.output_formats import CITY_FORMATS, FORMATS, PLAN_FORMATS, SURFACE_FORMATS

__all__ = ["check_city_formats", "check_city_rules", "write_city_files", "write_city_months"]


def write_city_files(
    folder: str | Path,
    names: Sequence[str] = (),
    progress: Callable[[int, int], object] = lambda _done, _all: None,
    say: Callable[[str], object] = lambda _line: None,
) -> list[Path]:
    """
    Write files from the store in a results folder; tiles that are not done are left out.

    Parameters
    ----------
    folder : path
        Of a study in tiles.
    names : sequence of str
        Of ``CITY_FORMATS``; by default all that its receivers can
        have but ``'cityjson'``.
    progress : callable
        Called with the number of tiles done and of all.
    say : callable
        Called with each line that the user should read.

    Returns
    -------
    paths : list of Path

    Raises
    ------
    InputError
        If the folder holds no such study, a name is unknown, or a package is missing.
    """
    from umbra.writers.city.store_window import CityResult, is_of_plan  # noqa: PLC0415

    folder = Path(folder)
    check_city_formats(names)
    is_plan = is_of_plan(folder)
    names = names or (PLAN_FORMATS if is_plan else SURFACE_FORMATS[:2])
    check_city_formats(names, is_plan=is_plan)
    paths: list[Path] = []
    if not is_plan:
        from umbra.writers.city.city_surfaces import (  # noqa: PLC0415
            CitySurfaces,
            write_city_attributes,
            write_surfaces,
        )
        from umbra.writers.city.models import write_models  # noqa: PLC0415

        surfaces = CitySurfaces(folder)
        if "geoparquet" in names:
            paths.append(write_surfaces(surfaces))
        if "3dtiles" in names:
            paths += write_models(surfaces, progress)
        if "cityjson" in names:
            paths += write_city_attributes(surfaces, say)
        return paths
    from umbra.writers.city.overview import write_overviews  # noqa: PLC0415
    from umbra.writers.city.rasters import write_rasters  # noqa: PLC0415
    from umbra.writers.city.stac import write_stac  # noqa: PLC0415

    result = CityResult(folder)
    if "geotiff" in names:
        paths += write_rasters(result, progress)
    if "map" in names:
        paths += write_overviews(result)
    if "stac" in names:
        paths.append(write_stac(result))
    return paths


def check_city_rules(rules: Any, options: StudyOptions) -> list[Rule]:
    """
    Return the variants of a rule that judges named areas in tiles; none without a rule.

    Parameters
    ----------
    rules : Rules, list of Rule, or None
        As ``umbra.rules.read.read_any`` returns them.
    options : StudyOptions

    Raises
    ------
    InputError
        If it judges the cells or points of one study, or there is no sun to judge.
    """
    if rules is None:
        return []
    if not isinstance(rules, list):
        cells = [check.name for check in rules.checks if not check.places]
        if cells:
            msg = (
                f"check '{cells[0]}' of format 1 judges a share of one study's cells; in tiles a "
                "rule judges its places (where: a list of name, x, y) or areas= (format 2, 'umbra "
                "rules' lists some); give one of these, or leave tiles= out"
            )
            raise InputError(msg, option="rules")
        return [convert(rules, rules.name)]
    if options.areas is None and not any(
        "places" in one.receivers for rule in rules for one in rule.requirements
    ):
        msg = (
            "a rule judges named areas of a study in tiles; give them with areas=, or leave tiles= "
            "out for windows and points"
        )
        raise InputError(msg, option="areas")
    return rules


def write_city_months(folder: Path) -> list[Path]:
    """Write ``months.csv`` if hours are kept of several months; return its path."""
    from umbra.writers.city.city_figures import find_figures, list_city_months  # noqa: PLC0415
    from umbra.writers.city.store_window import open_store, read_months  # noqa: PLC0415
    from umbra.writers.folder.month_maps import write_month_rows  # noqa: PLC0415

    months = read_months(open_store(folder))
    figures = None if months is None else find_figures(folder)
    rows = [] if figures is None else list_city_months(figures, months)
    return [folder / name for name in write_month_rows(folder, rows)]


def check_city_formats(names: Sequence[str], *, is_plan: bool | None = None) -> None:
    """
    Refuse formats that cannot be made of a study in tiles, before it is counted.

    Parameters
    ----------
    names : sequence of str
    is_plan : bool, optional
        Whether the receivers are a plan's cells; unknown by default.

    Raises
    ------
    InputError
        If a name is unknown, is not for such receivers, or needs a package that is missing.
    """
    strange = [name for name in names if name not in CITY_FORMATS]
    if strange:
        msg = (
            f"write='{strange[0]}' is not made of a study in tiles; there are "
            f"{', '.join(CITY_FORMATS)}; choose of these, or leave tiles= out"
        )
        raise InputError(msg, option="write", formats=strange)
    own = CITY_FORMATS if is_plan is None else PLAN_FORMATS if is_plan else SURFACE_FORMATS
    strange = [name for name in names if name not in own]
    if strange:
        kinds = ("surfaces", "plans", "receivers='surfaces'")
        if not is_plan:
            kinds = ("plans", "surfaces", "receivers='ground' or 'top'")
        msg = (
            f"write='{strange[0]}' is of {kinds[0]} in tiles, and these receivers are {kinds[1]}; "
            f"choose of {', '.join(own)}, or {kinds[2]}"
        )
        raise InputError(msg, option="write", formats=strange)
    require(["zarr"], "city", "a study in tiles")
    for name in names:
        if name in FORMATS:
            require(FORMATS[name].packages, FORMATS[name].extra, f"write='{name}'")
