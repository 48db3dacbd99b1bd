"""
Named areas of a city, counted beside its tiles as tasks of their own.

A task holds the areas whose middle lies in one square as wide as a tile. An area has a lattice of
its own and all casters that reach it, so its figures do not depend on the tiles, nor on the task.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.folders.atomic import replace_file
from umbra.packages import need
from umbra.receivers.area_search import check_areas, find_areas, join_plans
from umbra.receivers.areas import AreaLevel, refuse_outside, tell_sampling
from umbra.receivers.bands import make_bands, read_bands
from umbra.receivers.lattice import choose_side
from umbra.receivers.moved_boundary import join_roads, move_areas
from umbra.scene import Scene
from umbra.scene.named_places import Area
from umbra.study.area_table import AreaTable, compare_areas
from umbra.study.compare import read_hours
from umbra.study.options import StudyOptions
from umbra.tiles.city_catalogue import Catalogue
from umbra.tiles.city_ground import find_origin
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.city_receivers import RolePlace, count_among, lay_out_among
from umbra.tiles.job import CityJob, WorkerContext
from umbra.tiles.matched_parts import fill_bounds, find_matching
from umbra.tiles.store import CityStore

__all__ = [
    "count_areas", "list_judged", "list_tasks", "read_area_table", "settle_areas", "settle_roads",
]  # fmt: skip

_PIECE = "areas.npz"
_SQUARES = 500_000
"""Most squares of areas that one task counts, unless one area has more."""


def settle_areas(
    options: StudyOptions, catalogue: Catalogue, where: Scene
) -> tuple[StudyOptions, list[str]]:
    """
    Return options whose areas are polygons in the city's own coordinates; and notes.

    Parameters
    ----------
    options : StudyOptions
    catalogue : Catalogue
        Of the files, without a ground that is added.
    where : Scene
        At the place of the city, without parts.

    Raises
    ------
    InputError
        If there are none, one is wrong, or they lie elsewhere.
    """
    wanted: Any = options.areas
    if wanted is None:
        return options, []
    areas, notes = _find(wanted, "areas", catalogue, where)
    refuse_outside(areas, options.extent)
    roads = settle_roads(options.roads, catalogue, where)
    return replace(options, areas=areas, roads=roads), notes


def settle_roads(wanted: Any, catalogue: Catalogue, where: Scene) -> list[Area] | None:
    """
    Return roads as polygons in the city's own coordinates; None without.

    Raises
    ------
    InputError
        If there are none, one is wrong, or they lie elsewhere.
    """
    return None if wanted is None else _find(wanted, "roads", catalogue, where)[0]


def _find(
    wanted: Any, option: str, catalogue: Catalogue, where: Scene
) -> tuple[list[Area], list[str]]:
    wanted = check_areas(wanted, option)
    patterns = (wanted,) if isinstance(wanted, str) else wanted
    if not isinstance(patterns, Mapping) and isinstance(patterns, Sequence) and all(
        isinstance(pattern, str) for pattern in patterns
    ):  # fmt: skip
        return _find_parts(catalogue, patterns, option), []
    try:
        return find_areas(fill_bounds(where, catalogue.bounds), wanted, option)
    except InputError as error:
        error.data["option"] = option
        raise


def _find_parts(catalogue: Catalogue, patterns: Sequence[str], option: str) -> list[Area]:
    """Return the plans of parts of all files that patterns match, one area for each object."""
    origin, soups = find_origin(catalogue), dict[str, list[NDArray[np.float64]]]()
    for pattern in patterns:
        if not any(find_matching(file, [pattern]).any() for file in catalogue.files):
            msg = (
                f"{option}='{pattern}' matches no part of {len(catalogue.files)} files, and is no "
                "file of polygons (umbra inspect lists the parts of a file)"
            )
            raise InputError(msg, option=option, pattern=pattern)
    for file in catalogue.files:
        chosen, geometry = find_matching(file, patterns), file.geometry
        faces = np.flatnonzero(chosen[geometry.part])
        parts, which = np.unique(geometry.part[faces], return_inverse=True)
        labels = catalogue.label_parts(file)
        names = list(dict.fromkeys(labels[k] for k in parts.tolist()))
        numbers = {name: k for k, name in enumerate(names)}
        owner = np.array([numbers[labels[k]] for k in parts.tolist()], np.intp)[which]
        order, shift = np.argsort(owner, kind="stable"), np.array(file.origin) - origin
        corners = (geometry.vertices[geometry.faces[faces[order]]] + shift)[..., :2]
        ends = np.cumsum(np.bincount(owner, minlength=len(names)))
        for name, own in zip(names, np.split(corners, ends[:-1]), strict=False):
            soups.setdefault(name, []).append(own)
    shapes = {name: join_plans(np.concatenate(own), origin[:2]) for name, own in soups.items()}
    areas = [Area(name, shape) for name, shape in shapes.items() if shape is not None]
    if not areas:
        msg = f"{option}='{', '.join(patterns)}' matches only upright parts, which have no plan"
        raise InputError(msg, option=option)
    return areas


def list_tasks(job: CityJob) -> list[CityTile]:
    """Return all that is counted: the tiles, and then runs of areas."""
    tiles = job.tiles()
    if job.options.areas is None or job.lattice is None:
        return tiles
    shapely = need("shapely", "gis", "areas")
    grid, areas = job.lattice.grid, list(cast("Any", job.options.areas))
    length = job.lattice.side * max(grid.dx, grid.dy)
    middle = shapely.get_coordinates(shapely.centroid([area.polygon for area in areas]))
    squares: dict[tuple[int, ...], list[int]] = {}
    for k, square in enumerate(np.floor(middle / length).astype(int).tolist()):
        squares.setdefault(tuple(square), []).append(k)
    runs = [run for _, own in sorted(squares.items()) for run in _cut(job.options, areas, own)]
    return [
        *tiles,
        *(CityTile(len(tiles) + k, (0, 0), (0, 0), (-1, -1), tuple(run))
          for k, run in enumerate(runs)),
    ]  # fmt: skip


def _cut(options: StudyOptions, areas: Sequence[Area], own: Sequence[int]) -> Iterator[list[int]]:
    """Cut areas into runs of not too many squares."""
    run, squares = list[int](), 0.0
    for k in own:
        judged = _judge(options, [areas[k]])
        count = sum(a.area_m2 / choose_side(a.area_m2, options.cell) ** 2 for a in judged)
        if run and squares + count > _SQUARES:
            yield run
            run, squares = [], 0.0
        run, squares = [*run, k], squares + count
    yield run


def list_judged(options: StudyOptions) -> Sequence[Area]:
    """Return all areas that are judged."""
    return () if options.areas is None else _judge(options, list(cast("Any", options.areas)))


def _judge(options: StudyOptions, areas: Sequence[Area]) -> Sequence[Area]:
    """Return the areas that are judged of some: these, or their bands."""
    bands = read_bands(options.band)
    return make_bands(areas, bands, _move(options, areas)[0])[0] if bands else areas


def _move(options: StudyOptions, areas: Sequence[Area]) -> tuple[list[Any], list[str]]:
    """Return what areas are with their boundary moved across roads, and notes; none without."""
    if options.roads is None:
        return [], []
    return move_areas(areas, join_roads(options.roads))


def count_areas(context: WorkerContext, tile: CityTile) -> int:
    """Count the areas of a task and write their figures; return the number of casting triangles."""
    job = context.job
    own = _make_place(job, is_before=False)
    areas = [cast("Any", job.options.areas)[k] for k in tile.areas]
    laid = lay_out_among(own, areas, _judge(job.options, areas))
    after, faces = count_among(own, laid)
    before, more = None, 0
    if job.options.proposed:
        before, more = count_among(_make_place(job, is_before=True), laid)
    columns: Any = compare_areas(after, before)
    columns |= {"sides": laid.sides, "covered": laid.covered}
    path = CityStore(job.store).find_place(tile.number) / _PIECE
    path.parent.mkdir(parents=True, exist_ok=True)
    with replace_file(path) as beside, beside.open("wb") as file:
        np.savez(file, **columns)
    return faces + more


def _make_place(job: CityJob, *, is_before: bool) -> RolePlace:
    """Return what counts areas with the proposal, or as it was before."""
    options = job.options
    own = options.ask_hours("areas", measures=True, exact=options.exact)
    proposal = {name: getattr(options, name) for name in ("proposed", "replace", "replace_in")}
    return RolePlace(replace(job, options=own), replace(own, **proposal), is_before=is_before)


def read_area_table(job: CityJob) -> AreaTable | None:
    """Read the figures of all areas, in their order, once all tasks are done; None without."""
    if job.options.areas is None:
        return None
    options, store = job.options, CityStore(job.store)
    judged, bands = list_judged(options), max(len(read_bands(options.band)), 1)
    columns: dict[str, NDArray[Any]] = {}
    for task in list_tasks(job):
        if not task.areas:
            continue
        rows = (np.array(task.areas)[:, None] * bands + np.arange(bands)).ravel()
        with np.load(store.find_place(task.number) / _PIECE) as piece:
            for name, values in piece.items():
                if name not in columns:
                    columns[name] = np.zeros((len(judged), *values.shape[1:]), values.dtype)
                columns[name][rows] = values
    covered, sides = columns.pop("covered"), columns.pop("sides")
    level = AreaLevel.of(options.areas_on)
    notes = tell_sampling([area.name for area in judged], covered, sides, options.cell, level)
    has_hours = options.asks_hours and options.date is not None
    least = read_hours(options.least, "least") if has_hours else None
    notes = [*_move(options, list(cast("Any", options.areas)))[1], *notes]
    return AreaTable(judged, job.open().period, columns, least, tuple(notes))
