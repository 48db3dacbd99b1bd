"""
Ground of a city: that of one scene of all files.

A surface that is added is made once, from the feet of all files, and kept as one more file of the
catalogue; tiles read the triangles that they need of it, as of any terrain.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from umbra.ground.choice import Ground, add_file_ground, choose_feet, make_ground_parts
from umbra.ground.level import Level, settle_level
from umbra.ground_option import is_file
from umbra.scene import Scene
from umbra.study.options import StudyOptions
from umbra.tiles.city_catalogue import Catalogue, add_scene
from umbra.tiles.matched_parts import find_matching

__all__ = ["CityGround", "find_city_ground", "find_origin"]


@dataclass(frozen=True)
class CityGround:
    """
    The ground of a city.

    Parameters
    ----------
    known : Ground
        As of one scene; its scene holds what is added alone.
    is_added : bool
        Whether a surface is added to the files.
    """

    known: Ground
    is_added: bool

    @property
    def level(self) -> float:
        """Height of the plane or, of a surface, of the lowest foot [m]."""
        return self.known.level

    @property
    def assumed(self) -> Level | None:
        """Basis of the height; None if it is stated."""
        return self.known.assumed


def find_origin(catalogue: Catalogue) -> np.ndarray:
    """Return the origin of a city's local frame, (3,) [m]."""
    bounds = catalogue.bounds
    # Whole metres, so that adding the origin back restores the files' digits.
    far = np.abs(bounds).max(0) > 4 * np.ptp(bounds, axis=0) + 1000
    return np.where(far, np.floor(bounds.mean(0)), 0.0)


def find_city_ground(catalogue: Catalogue, options: StudyOptions, folder: Path) -> CityGround:
    """
    Find the ground of a city, and add it to the catalogue in a folder.

    Raises
    ------
    InputError
        If no building has a foot, or the file of the ground is wrong.
    """
    choice, origin = options.ground, find_origin(catalogue)
    nowhere = Scene((), origin, crs=catalogue.crs)
    stated = _find_stated(catalogue) if choice is None else choice
    if isinstance(stated, float | int):
        return CityGround(Ground(nowhere, float(stated), is_plane=True), is_added=False)
    hanging = None  # canopies tell nothing of the ground's height, as in one scene
    if options.canopy:
        hanging = [
            np.unique(file.geometry.object_of[find_matching(file, options.canopy)])
            for file in catalogue.files
        ]
    bases, bounds = catalogue.find_bases(hanging), catalogue.bounds
    level = settle_level(bases)
    surface, name = None, ""
    notes: list[str] = []
    if is_file(choice):
        with_ground, notes = add_file_ground(nowhere, str(choice), bounds, bases.boxes)
        name = Path(str(choice)).name
    elif choice is None and catalogue.terrain.holds(bounds):
        return CityGround(Ground(nowhere, level.low, is_plane=False, assumed=level), is_added=False)
    else:
        surface = choose_feet(bases, level, bounds, choice)
        if surface is None:
            known = Ground(nowhere, level.middle, is_plane=True, assumed=level)
            return CityGround(known, is_added=False)
        with_ground = Scene(make_ground_parts(surface, origin), origin)
    add_scene(catalogue, folder, with_ground)
    known = Ground(
        with_ground, level.low, is_plane=False, assumed=level, surface=surface, file=name,
        notes=tuple(notes),
    )  # fmt: skip
    return CityGround(known, is_added=True)


def _find_stated(catalogue: Catalogue) -> float | None:
    """Return the level ground that all files state; None unless they agree."""
    levels = {file.place["ground"] for file in catalogue.files}
    return levels.pop() if len(levels) == 1 else None
