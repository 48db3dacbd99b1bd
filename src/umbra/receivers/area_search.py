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

__all__ = ["bound_areas", "check_areas", "find_areas", "join_plans"]

_GRID = 1e-6  # corners of parts that are nearer are one [m]


def check_areas(areas: Any, option: str = "areas") -> Any:
    """Read a file of areas that an option asks for; return all else as it is."""
    if is_area_file(areas):
        try:
            return load_areas(Path(areas))
        except InputError as error:
            error.data["option"] = option
            raise
    is_right = isinstance(areas, (str, Mapping, AreaFile)) or hasattr(areas, "geometry")
    if not is_right and isinstance(areas, Sequence):
        is_right = len(areas) > 0 and all(isinstance(item, (str, Area)) for item in areas)
    if not is_right:
        msg = (
            f"{option} is a file of polygons, a pattern of the model's parts or kinds, a "
            f"GeoDataFrame, or polygons by name; got {show_value(areas)}"
        )
        raise InputError(msg, option=option)
    return areas


def find_areas(scene: Scene, selection: Any, option: str = "areas") -> tuple[list[Area], list[str]]:
    """
    Find areas in a model's own coordinates.

    Parameters
    ----------
    scene : Scene
    selection : path, str, sequence of str, AreaFile, mapping, sequence of Area, or GeoDataFrame
        A file; patterns of parts and kinds of the model; polygons by name.
    option : str
        That asks for them, for errors about patterns.

    Returns
    -------
    areas : list of Area
    notes : list of str

    Raises
    ------
    InputError
        If there are none, one is no valid polygon, two have one name, or they lie elsewhere.
    """
    selection = check_areas(selection, option)
    if isinstance(selection, AreaFile):
        return place_areas(selection, scene)
    if (patterns := _find_patterns(selection)) is not None:
        return _find_parts(scene, patterns, option), []
    shapely = need("shapely", "gis", "areas")
    if isinstance(selection, Mapping):
        given, crs = [Area(str(name), polygon) for name, polygon in selection.items()], None
    elif hasattr(selection, "geometry"):
        given = _read_frame(selection)
        crs = None if selection.crs is None else selection.crs.to_wkt()
    else:
        given, crs = list(selection), None
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


def bound_areas(scene: Scene, selection: Any) -> NDArray[np.float64]:
    """
    Return the bounds (2, 2) of areas, as `find_areas` takes them, in own coordinates [m].

    Those of parts are the parts' own, whose plans need not be joined for them.
    """
    if (patterns := _find_patterns(selection)) is not None:
        corners = scene.triangles(scene.select(patterns, option="areas")).find_corners()
        return np.stack([corners.min(0), corners.max(0)])[:, :2] + scene.origin[:2]
    areas, _ = find_areas(scene, selection)
    boxes = np.array([area.polygon.bounds for area in areas])
    return np.stack([boxes[:, :2].min(0), boxes[:, 2:].max(0)])


def _find_patterns(selection: Any) -> Sequence[str] | None:
    """Return the patterns of parts that are asked for; None of polygons."""
    if isinstance(selection, str):
        return (selection,)
    is_list = isinstance(selection, Sequence) and all(isinstance(item, str) for item in selection)
    return selection if is_list else None


def _read_frame(frame: Any) -> list[Area]:
    """Return the rows of a GeoDataFrame, named by their column ``name``, else by the index."""
    names = frame["name"] if "name" in frame.columns else frame.index
    return [Area(str(name), polygon) for name, polygon in zip(names, frame.geometry, strict=True)]


def _find_parts(scene: Scene, patterns: Sequence[str], option: str) -> list[Area]:
    """Return the plans of parts of the model that patterns match, one area for each object."""
    parts, labels = scene.select(patterns, option=option), scene.labels()
    areas = []
    for name in dict.fromkeys(labels[k] for k in parts):
        soup = scene.triangles([k for k in parts if labels[k] == name])
        shape = join_plans(soup.vertices[soup.faces][..., :2], scene.origin[:2])
        if shape is not None:
            areas.append(Area(name, shape))
    if not areas:
        msg = f"{option}='{', '.join(patterns)}' matches only upright parts, which have no plan"
        raise InputError(msg, option=option)
    return areas


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
    polygons = [
        polygon for polygon in shapely.get_parts(whole) if shapely.get_type_id(polygon) == 3
    ]
    if not polygons:
        return None
    shape = polygons[0] if len(polygons) == 1 else shapely.multipolygons(polygons)
    return shapely.transform(shape, lambda points: points + origin)
