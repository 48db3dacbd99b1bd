"""What is settled of a city before anything is counted: files, place, ground, roles of parts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from umbra.errors import InputError
from umbra.machine import choose_threads
from umbra.readers.georeference import locate_bounds
from umbra.readers.model import Crowns, FilePlace, state_site
from umbra.receivers.kind import ReceiverKind
from umbra.scene import Scene
from umbra.study.land import settle_land
from umbra.study.options import StudyOptions
from umbra.sun import Site, find_site
from umbra.tiles.city_areas import settle_areas
from umbra.tiles.city_catalogue import Catalogue, make_catalogue
from umbra.tiles.city_ground import CityGround, find_city_ground
from umbra.tiles.city_layout import choose_kind, find_frame, find_merged
from umbra.tiles.city_options import CityOptions
from umbra.tiles.job import CATALOGUE, CityJob, sees_whole_sky
from umbra.tiles.matched_parts import settle_outline
from umbra.tiles.roles import Roles

__all__ = ["SettledCity", "locate_city", "settle_city"]

RASTER = "Raster"
FOOTPRINTS = {"GeoJSON", "GeoPackage", "Shapefile", "GeoParquet"}


class SettledCity(NamedTuple):
    """
    A city, settled.

    Parameters
    ----------
    job : CityJob
        Without a lattice.
    catalogue : Catalogue
        Of the files, without a ground that is added.
    ground : CityGround
    told : tuple of str
        Notes on files that are named beside the city's.
    kind : ReceiverKind
    """

    job: CityJob
    catalogue: Catalogue
    ground: CityGround
    told: tuple[str, ...]
    kind: ReceiverKind


def settle_city(
    files: Sequence[Any],
    site: Site | Mapping[str, Any] | None,
    options: StudyOptions,
    city: CityOptions,
    folder: Path,
    reading: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> SettledCity:
    """Read the files that are new, and settle the city's place, ground and roles of parts."""
    catalogue = make_catalogue(files, folder / CATALOGUE, reading, progress, city.bytes)
    _check_alone(catalogue, options)
    if options.horizon is not None and sees_whole_sky(replace(options, disc=False)):
        msg = "the exact sky and sky_blocked_by take no horizon= in tiles; leave one out"
        raise InputError(msg, option="horizon")
    where = locate_city(catalogue)
    options, remarks = settle_outline(options, where, catalogue.bounds)
    options, placed = settle_areas(options, catalogue, where)
    ground = find_city_ground(catalogue, options, folder / CATALOGUE)
    kind = choose_kind(options, ground)
    frame = find_frame(catalogue, kind, ground)
    if not isinstance(site, Site):
        site = find_city_site(catalogue, is_needed=options.needs_site, **(site or {}))
    options = settle_land(options, catalogue.bounds, site)
    merged = find_merged(catalogue)
    Roles(catalogue, options, merged).check()
    job = CityJob(
        str(folder.absolute()), options, site, kind.name, frame, None, "",
        min_altitude=city.min_altitude or 0.0, memory=city.bytes,
        threads=choose_threads(options.threads), merged=tuple(merged),
    )  # fmt: skip
    return SettledCity(job, catalogue, ground, (*remarks, *placed), kind)


def _check_alone(catalogue: Catalogue, options: StudyOptions) -> None:
    """Refuse files that stand on the terrain of another: each is read alone."""
    crowns = Crowns(tuple(options.canopy))
    terrain = next((file for file in catalogue.files if RASTER in file.kinds), None)
    for file in catalogue.files:
        path = Path(file.path)
        if crowns.matches(file.layer, path):
            msg = (
                f"{file.path}: a canopy raster stands on the terrain of another file, and each "
                "file of a study in tiles is read alone; leave tiles= out"
            )
            raise InputError(msg, option="canopy")
        is_footprint = (
            file.sources[0].format in FOOTPRINTS and "'base_column', '" not in file.reading
        )
        if terrain is not None and is_footprint:
            msg = (
                f"{file.path}: footprints stand on the terrain of another file ({terrain.path}), "
                "and each file of a study in tiles is read alone; give base_column=, or leave "
                "tiles= out"
            )
            raise InputError(msg, option="tiles")


def find_city_site(catalogue: Catalogue, *, is_needed: bool = True, **given: Any) -> Site | None:
    """
    Find the site in the middle of a city; ``given`` are arguments of ``find_site``.

    None where nothing says it and it is not needed.
    """
    scene = locate_city(catalogue)
    said = [given.get("latitude"), given.get("longitude"), scene.latitude, scene.longitude]
    if not is_needed and said == [None] * 4:
        return None
    # ``notes`` tell of a site far away.
    return find_site(scene, **given, tell=lambda _told: None)


def locate_city(catalogue: Catalogue) -> Scene:
    """Return a scene without parts at the place that the files say."""
    scene = Scene((), np.zeros(3), crs=catalogue.crs)
    if catalogue.crs is not None:
        return locate_bounds(scene, catalogue.bounds)
    names = {"latitude", "longitude", "elevation", "is_ellipsoidal", "true_north"}
    places = {
        file.path: FilePlace(**{name: file.place[name] for name in names & set(file.place)})
        for file in catalogue.files
    }
    return state_site(scene, places)
