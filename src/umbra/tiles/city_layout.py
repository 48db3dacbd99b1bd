"""What is decided once for a whole city: its frame, its ground, its lattice, and its duplicates."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.devices import DEFAULT
from umbra.errors import InputError
from umbra.lights import Period
from umbra.receivers import name_kind
from umbra.receivers.kind import ReceiverKind
from umbra.receivers.layout import TILE, Skyline, lay_out
from umbra.receivers.plan import STREAMED_TILE
from umbra.receivers.plan_frame import find_held, join_boxes
from umbra.scene.grid import Grid
from umbra.study.accumulators.arrays import ResultOptions
from umbra.study.options import StudyOptions
from umbra.tiles.city_catalogue import Catalogue, CityFile
from umbra.tiles.city_ground import CityGround, find_origin
from umbra.tiles.city_lattice import Lattice, find_side
from umbra.tiles.job import CityFrame
from umbra.tiles.roles import Roles

__all__ = ["choose_kind", "find_frame", "find_merged", "lay_out_lattice"]

IN_TILES = ("ground", "top", "surfaces")
CELL = 1.0
"""Side of a cell by default [m]."""
_LEAST = 8  # cells along a tile, else each caster is prepared for every few cells
_SAME = 1e-3  # bounds of one object in two files differ by at most this [m]


def choose_kind(options: StudyOptions, ground: CityGround) -> ReceiverKind:
    """
    Choose the receivers of a city.

    Raises
    ------
    InputError
        If they cannot be counted in tiles.
    """
    name = options.receivers
    if name == "auto":
        name = "ground" if ground.known.is_plane or ground.is_added else "top"
    if name not in IN_TILES:
        msg = (
            f"receivers='{name}' are not counted in tiles; choose {', '.join(IN_TILES)}, or leave "
            "tiles= out and read what lies around them with bbox="
        )
        raise InputError(msg, option="receivers")
    if options.device not in {"auto", DEFAULT}:
        msg = f"tiles are counted on the {DEFAULT} device; leave device= out"
        raise InputError(msg, option="device")
    return name_kind(name, is_added=ground.is_added)


def find_frame(catalogue: Catalogue, kind: ReceiverKind, ground: CityGround) -> CityFrame:
    """Find the local frame of a run, as of one scene of all files."""
    has_end = kind.is_plan and not kind.is_level and not ground.known.is_plane
    box = tuple(map(tuple, catalogue.bounds.tolist()))
    origin = tuple(find_origin(catalogue).tolist())
    ends = ground.level, ground.known.lowest
    return CityFrame(origin, box, *ends, has_end, ground.is_added, ground.known.is_plane)  # type: ignore[arg-type]


def lay_out_lattice(
    catalogue: Catalogue,
    roles: Roles,
    kind: ReceiverKind,
    frame: CityFrame,
    period: Period,
    options: StudyOptions,
    length: float,
    limit: Callable[[int], int],
) -> tuple[Lattice, NDArray[np.float64], NDArray[np.float64]]:
    """
    Choose the cells of a plan and its tiles, or the squares of objects.

    Parameters
    ----------
    catalogue : Catalogue
    roles : Roles
    kind : ReceiverKind
    frame : CityFrame
    period : Period
    options : StudyOptions
    length : float
        Side of a tile [m].
    limit : callable
        Returns the longest side of a block in which pieces of casters fit, at most the given one.

    Returns
    -------
    lattice : Lattice
    x : (cols,) float64
    y : (rows,) float64
        Cell centres of a plan in the city's own coordinates [m].

    Raises
    ------
    InputError
        If the tiles are too small, or the cells wrong.
    """
    low, high = catalogue.bounds[:, :2]
    if not kind.is_plan:
        _check_side(length, CELL, (high - low).max().item())
        # Squares of objects, by their centres.
        count = np.maximum(np.ceil((high - low) / length), 1).astype(int).tolist()
        x0, y0 = (low + length / 2 - frame.origin[:2]).tolist()
        return Lattice(Grid(x0, y0, length, length, *count), 1, TILE), np.zeros(0), np.zeros(0)
    ends = frame.has_end and not frame.is_added
    reaching = np.zeros((0, 3)) if ends else period.find_reaching_suns()
    corners = catalogue.find_corners() if options.extent is None else iter(())
    skyline = Skyline.gather(corners, low, high, frame.ground)
    held = None
    if options.extent is None:
        ground = catalogue.bounds if ends else None
        areas = _bound_areas(options)
        held = find_held(roles.find_built_bounds(), areas, options.band, ground=ground)
    size, cell = options.size, options.cell
    if size is None and cell is None:
        cell = CELL
    grid, x, y = lay_out(
        skyline, reaching, held=held, extent=options.extent, cell=cell, size=size, is_cut=True,  # type: ignore[arg-type]
    )  # fmt: skip
    origin = frame.origin
    local = Grid(grid.x0 - origin[0], grid.y0 - origin[1], grid.dx, grid.dy, grid.cols, grid.rows)
    is_streamed = ResultOptions.of(period, options).is_streamed
    widest = max(grid.dx, grid.dy)
    _check_side(length, widest, max(grid.cols, grid.rows) * widest)
    side = min(find_side(length, widest), max(grid.cols, grid.rows))
    return Lattice(local, side, limit(min(TILE, STREAMED_TILE) if is_streamed else TILE)), x, y


def _bound_areas(options: StudyOptions) -> NDArray[np.float64] | None:
    """Return the bounds (2, 2) of the named areas [m]; None without areas."""
    areas: Any = options.areas
    return join_boxes([np.reshape(area.polygon.bounds, (2, 2)) for area in areas or ()])


def _check_side(length: float, cell: float, whole: float) -> None:
    """Refuse tiles of a length that are a few cells wide, unless one is the whole [m]."""
    if length < min(_LEAST * cell, whole):
        msg = (
            f"tiles='{length:g}m' are too small: {_LEAST} cells of {cell:g} m, {_LEAST * cell:g} "
            "m, are the least; choose a longer side, such as tiles='1km'"
        )
        raise InputError(msg, option="tiles")


def find_merged(catalogue: Catalogue) -> list[tuple[int, int]]:
    """
    Find objects that an earlier file brings, too: of one name, size and place.

    Files of tiles often both hold an object on their border. Identical triangles twice cast the
    same shadow, but would be sampled twice.

    Returns
    -------
    merged : list of (int, int)
        Number of the later file, and of the object in it.
    """
    files, merged = catalogue.files, []
    boxes = np.array([file.bounds for file in files])
    known: dict[tuple[str, int], list[NDArray[np.float64]]] = {}
    for number, file in enumerate(files):
        low, high = boxes[number]
        meets = ((boxes[:, 0] <= high) & (boxes[:, 1] >= low)).all(1)
        others = [int(k) for k in np.flatnonzero(meets) if k != number]
        if not others:
            continue
        names, bounds, counts = _measure_objects(file)
        touches = np.zeros(len(bounds), np.bool_)
        for other in others:
            touches |= ((bounds[:, 0] <= boxes[other, 1]) & (bounds[:, 1] >= boxes[other, 0])).all(
                1
            )
        own: list[tuple[tuple[str, int], NDArray[np.float64]]] = []
        for index in np.flatnonzero(touches).tolist():
            key = names[index], int(counts[index])
            if any(np.abs(box - bounds[index]).max() <= _SAME for box in known.get(key, ())):
                merged.append((number, index))
            else:
                own.append((key, bounds[index]))
        for key, box in own:
            known.setdefault(key, []).append(box)
    return merged


def _measure_objects(
    file: CityFile,
) -> tuple[Sequence[str], NDArray[np.float64], NDArray[np.int64]]:
    """Return the name, the bounds (n, 2, 3) and the number of triangles of each object."""
    geometry: Any = file.geometry
    count = file.counts["objects"]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, geometry.objects, geometry.boxes[:, 0])
    np.maximum.at(high, geometry.objects, geometry.boxes[:, 1])
    sizes = np.diff(geometry.unit_start)
    counts = np.bincount(geometry.objects, sizes, count).astype(np.int64)
    return file.names_of_objects, np.stack([low, high], axis=1) + np.array(file.origin), counts
