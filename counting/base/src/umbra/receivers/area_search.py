"""Named areas that are asked for: polygons of a file, of a mapping or a frame, or parts' plans."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.option_fields import is_area_file
from umbra.packages import need
from umbra.readers.area_file import AreaFile, check_polygon, load_areas, place_areas
from umbra.scene import Scene
from umbra.scene.named_places import Area

__all__ = ["check_areas", "find_areas", "join_plans"]

_GRID = 1e-6  # corners of parts that are nearer are one [m]


def check_areas(asked: Any) -> Any:
    """Read a file of areas that is asked for; return all else as it is."""
    if is_area_file(asked):
        return load_areas(Path(asked))
    is_right = isinstance(asked, (str, Mapping, AreaFile)) or hasattr(asked, "geometry")
    if not is_right and isinstance(asked, Sequence):
        is_right = len(asked) > 0 and all(isinstance(one, (str, Area)) for one in asked)
    if not is_right:
        msg = (
            "areas is a file of polygons, a pattern of the model's parts or kinds, a GeoDataFrame, "
            f"or polygons by name; got {show_value(asked)}"
        )
        raise InputError(msg, option="areas")
    return asked


def find_areas(scene: Scene, asked: Any) -> tuple[list[Area], list[str]]:
    """
    Find areas in a model's own coordinates.

    Parameters
    ----------
    scene : Scene
    asked : path, str, sequence of str, AreaFile, mapping, sequence of Area, or GeoDataFrame
        A file; patterns of parts and kinds of the model; polygons by name.

    Returns
    -------
    areas : list of Area
    notes : list of str

    Raises
    ------
    InputError
        If there are none, one is no valid polygon, two have one name, or they lie elsewhere.
    """
    asked = check_areas(asked)
    if isinstance(asked, AreaFile):
        return place_areas(asked, scene)
    if isinstance(asked, str) or (
        isinstance(asked, Sequence) and all(isinstance(one, str) for one in asked)
    ):
        return _find_parts(scene, (asked,) if isinstance(asked, str) else asked), []
    shapely = need("shapely", "gis", "areas")
    if isinstance(asked, Mapping):
        given, crs = [Area(str(name), polygon) for name, polygon in asked.items()], None
    elif hasattr(asked, "geometry"):
        given, crs = _read_frame(asked), None if asked.crs is None else asked.crs.to_wkt()
    else:
        given, crs = list(asked), None
    names = set()
    for area in given:
        check_polygon(shapely, area.name, area.polygon)
        if area.name in names:
            msg = f"2 areas are called '{area.name}'; give each a name of its own"
            raise InputError(msg, option="areas", area=area.name, count=2)
        names.add(area.name)
    if not given:
        msg = "areas= holds no polygon; give one at least"
        raise InputError(msg, option="areas")
    areas, notes = place_areas(AreaFile(Path("areas="), tuple(given), crs, is_guess=False), scene)
    return areas, [note for note in notes if crs is not None]


def _read_frame(frame: Any) -> list[Area]:
    """Return the rows of a GeoDataFrame, named by their column ``name``, else by the index."""
    names = frame["name"] if "name" in frame.columns else frame.index
    return [Area(str(name), polygon) for name, polygon in zip(names, frame.geometry, strict=True)]


def _find_parts(scene: Scene, patterns: Sequence[str]) -> list[Area]:
    """Return the plans of parts of the model that patterns match, one area for each object."""
    parts, labels = scene.select(patterns, option="areas"), scene.labels()
    found = []
    for name in dict.fromkeys(labels[k] for k in parts):
        soup = scene.triangles([k for k in parts if labels[k] == name])
        shape = join_plans(soup.vertices[soup.faces][..., :2], scene.origin[:2])
        if shape is not None:
            found.append(Area(name, shape))
    if not found:
        msg = f"areas='{', '.join(patterns)}' matches only upright parts, which have no plan"
        raise InputError(msg, option="areas")
    return found


def join_plans(corners: NDArray[np.float64], origin: NDArray[np.float64]) -> Any:
    """
    Return the plan of some triangles as a polygon; None of upright ones, which have none.

    Parameters
    ----------
    corners : (n, 3, 2) float64
        In a local frame [m].
    origin : (2,) float64
        Of the frame [m].
    """
    shapely = need("shapely", "gis", "areas")
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    lies = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) > _GRID * _GRID
    whole = shapely.union_all(shapely.polygons(corners[lies]), grid_size=_GRID)
    kept = [one for one in shapely.get_parts(whole) if shapely.get_type_id(one) == 3]
    if not kept:
        return None
    shape = kept[0] if len(kept) == 1 else shapely.multipolygons(kept)
    return shapely.transform(shape, lambda points: points + origin)
