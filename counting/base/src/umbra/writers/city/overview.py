"""
Pictures of a whole study in tiles; tiles that are not done are hatched and named.

What a picture of a plan in tiles says and shows besides hours: captions, and buildings.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from umbra.folders.atomic import replace_file
from umbra.receivers.plan import PlanKind, PlanRaster
from umbra.receivers.zenith import find_surface
from umbra.scene import Scene, Triangles
from umbra.scene.grid import Grid
from umbra.scene.mesh import ADDED_GROUND
from umbra.study import Study
from umbra.study.measures import Quantity
from umbra.tiles.city_areas import list_judged
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.city_proposal import find_proposal
from umbra.tiles.job import CityJob, Workplace, read_job
from umbra.tiles.neighbourhood import Neighbourhood
from umbra.writers.city.store_window import CityResult, StoredTile
from umbra.writers.folder.captions import (
    describe_making,
    find_mean,
    join_names,
    outline_areas,
    tell_place,
    tell_times,
)
from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.measure_map import find_end, make_measure_sheet
from umbra.writers.picture_content import DayMap, Plan, Show, find_map_size, name_hours
from umbra.writers.pixels import Ramp
from umbra.writers.sheet import Sheet

__all__ = ["CityPlan", "shrink_hours", "write_overviews"]

_ROOF = 1e-6  # height above the ground that is rounding [m]


@dataclass(frozen=True)
class CityPlan:
    """
    The plan of a run.

    Parameters
    ----------
    job : CityJob
    result : CityResult
    """

    job: CityJob
    result: CityResult

    @classmethod
    def of(cls, result: CityResult) -> Self | None:
        """Read the plan in the folder of a result; None if no run has described it there."""
        job = read_job(result.folder, str(result.facts.get("receivers")))
        return None if job is None else cls(job, result)

    @cached_property
    def place(self) -> Workplace:
        """What counting kept between tiles."""
        return self.job.open()

    @cached_property
    def study(self) -> Study:
        """The study, of whose receivers only the cells are known."""
        result, place, kind = self.result, self.place, self.place.kind
        assert isinstance(kind, PlanKind)
        assert self.job.lattice is not None
        nothing: Any = None
        laid = PlanRaster(
            kind, nothing, (len(result.y), len(result.x)), ("y", "x"), math.prod(result.cell), {},
            x=result.x, y=result.y, ground=self.job.frame.ground, grid=self.job.lattice.grid,
            assumed=None,
        )  # fmt: skip
        hours = np.zeros((1, 1), np.float32)
        options = self.job.options
        return Study(
            laid, place.period, hours, result.up_hours, None, result.facts,
            has_hours=options.asks_hours, quantities=options.quantities,
        )  # fmt: skip

    def describe(self) -> dict[str, Any]:
        """Return the words around a picture, as those of a study in memory."""
        study, options = self.study, self.job.options
        lowest = [f"suns below {self.job.min_altitude:g}° left out"] * (self.job.min_altitude > 0)
        # A ground that was added has no path.
        files = [one for one in self.place.catalogue.files if one.path]
        names = dict.fromkeys(one.path.rsplit("/", 1)[-1] for one in files)
        view = study.kind.tell_view(study.facts, options.receivers)
        return {
            "title": join_names(list(names)) + view,
            "place": tell_place(study),
            "date": tell_times(study, options, range(len(study.period.days))),
            "note": " · ".join([describe_making(study, options), *lowest]),
            "roofs_cover": study.kind.lies_under_roofs,
            "areas": outline_areas(list_judged(options)),
        }

    @property
    def has_roofs(self) -> bool:
        """Whether roofs lie over the receivers."""
        return self.place.kind.lies_under_roofs

    def find_proposed(self, squares: Grid) -> NDArray[np.bool_] | None:
        """Return the squares, in the city's coordinates, below a proposal; None without one."""
        if not self.job.options.proposed:
            return None
        x, y, _ = self.place.origin.tolist()
        local = replace(squares, x0=squares.x0 - x, y0=squares.y0 - y)
        soup = find_proposal(self.place)
        floor = float(soup.vertices[:, 2].min(initial=0.0)) - 1.0
        return find_surface(soup, local, floor, self.job.threads).face >= 0

    def find_roofs(self, tile: StoredTile) -> NDArray[np.float64]:
        """Return the heights of what stands over the ground on a tile's cells, (rows, cols) [m]."""
        lattice, near, roles = self.job.lattice, Neighbourhood(self.place), self.place.roles
        assert lattice is not None
        south, west = tile.rows.start, tile.cols.start
        heights = np.zeros((tile.rows.stop - south, tile.cols.stop - west))
        cells = CityTile(tile.number, (south, tile.rows.stop), (west, tile.cols.stop))
        floor = self.job.frame.floor
        for rows, cols in lattice.cut(cells, lattice.block):
            grid = lattice.find_window(rows, cols)
            aside = np.array([grid.dx, grid.dy])
            seen = near.find_seen(np.array([grid.x[0], grid.y[0]]) - aside,
                                  np.array([grid.x[-1], grid.y[-1]]) + aside)  # fmt: skip
            scene = near.read(seen).with_words(self.place.catalogue)
            stands = ~scene.spread(roles.find_replaced)
            if roles.season is not None:
                stands &= ~scene.spread(roles.find_canopies)
            soup = scene.pick(stands)
            if len(soup.faces):
                found = self._find_heights(scene, soup, grid, floor)
                where = (slice(rows.start - south, rows.stop - south),
                         slice(cols.start - west, cols.stop - west))  # fmt: skip
                heights[where] = np.where(found > _ROOF, found, 0.0)
        return heights

    def _find_heights(
        self, scene: Scene, soup: Triangles, grid: Grid, floor: float
    ) -> NDArray[np.float64]:
        """Return the heights of what stands over the ground, a plane or a surface [m]."""
        threads = self.job.threads
        if not self.job.frame.is_added:
            return find_surface(soup, grid, floor, threads).heights - floor
        is_ground = np.array([part.kind in ADDED_GROUND for part in scene.parts], np.bool_)
        ground, top = (
            find_surface(
                replace(soup, faces=soup.faces[some], part=soup.part[some]), grid, floor, threads,
                has_end=True,
            )
            for some in (is_ground[soup.part], ~is_ground[soup.part])
        )  # fmt: skip
        return np.where((top.face >= 0) & (ground.face >= 0), top.heights - ground.heights, 0.0)


LONGEST = 1600
"""Cells along the longer side of the picture's raster; each is the mean of those that it holds."""
_LOST = "hours_lost"
_FEW = 12  # missing tiles that are named


def write_overviews(result: CityResult) -> list[Path]:
    """
    Write ``map.png``, hours in shadow of the whole, ``hours_lost.png``, and a map of each measure.

    What each caster takes of it is in the store alone.

    Parameters
    ----------
    result : CityResult

    Returns
    -------
    paths : list of Path
        Without hours lost where nothing is.
    """
    told = CityPlan.of(result)
    paths = _draw_hours(result, told) if result.has_hours else []
    quantities = () if told is None else told.study.quantities
    for one in (one for one in quantities if one.is_drawn and not one.per):
        values, times, roofs = shrink_hours(result, one.name, plan=told)
        drawn = _Drawing(result, told, times, roofs)
        paths.append(drawn.draw_measure(values, f"{one.name}.png", one))
        if f"{one.name}_lost" in result.bands:
            lost, *_ = shrink_hours(result, f"{one.name}_lost", plan=told)
            if np.nanmax(lost, initial=0.0) > 0:
                paths.append(drawn.draw_measure(lost, f"{one.name}_lost.png", one.of_loss()))
    return paths


def _draw_hours(result: CityResult, told: CityPlan | None) -> list[Path]:
    """Draw the hours, and what a proposal takes of them."""
    hours, times, roofs = shrink_hours(result, plan=told)
    show: Show = "shadow"
    divisor, words = 1, ""
    if told is not None:
        divisor, words = find_mean(told.study, told.job.options)
        if len(told.study.period.days) > 1:  # long days have more of both: those of sun compare
            show = "sun"
    what = f"{name_hours(show)}{words}" if words else ""
    end = result.up_hours / divisor
    drawn = _Drawing(result, told, times, roofs)
    hours = hours / np.float32(divisor)
    paths = [drawn.draw(hours, "map.png", what, end, dark_from=end, show=show)]
    if _LOST in result.bands:
        lost, *_ = shrink_hours(result, _LOST, plan=told)
        lost /= np.float32(divisor)
        most = float(np.nanmax(lost, initial=0.0))
        if most > 0:
            what = f"hours of sun lost to the proposal{words}"
            paths.append(drawn.draw(lost, f"{_LOST}.png", what, most, ramp="loss"))
    return paths


@dataclass(frozen=True)
class _Drawing:
    """
    What the pictures of a run share.

    Parameters
    ----------
    result : CityResult
    told : CityPlan or None
    times : int
        Cells along a square of the pictures.
    roofs : (rows, cols) float32 or None
        Height of what stands over each square [m].
    """

    result: CityResult
    told: CityPlan | None
    times: int
    roofs: NDArray[np.float32] | None

    def draw(
        self,
        hours: NDArray[np.float32],
        name: str,
        what: str,
        most: float,
        dark_from: float = math.inf,
        ramp: Ramp = "shade",
        show: Show = "shadow",
    ) -> Path:
        """Draw hours on squares, those of a place without any sun from ``dark_from`` on."""
        plan, hatched = self._lay_out(hours.shape)
        sheet = make_hours_sheet(
            plan, [DayMap(hours, hatched=hatched, dark_from=dark_from)], most, what,
            hatch="tiles not counted" if self.result.missing else "",
            show=show,
            has_lines=self.times == 1,  # around means lines would show noise
            ramp=ramp,
        )  # fmt: skip
        return self._save(sheet, name)

    def draw_measure(self, values: NDArray[np.float32], name: str, quantity: Quantity) -> Path:
        """Draw a measure on squares."""
        plan, _ = self._lay_out(values.shape)
        return self._save(
            make_measure_sheet(plan, values, quantity, find_end(quantity, values)), name
        )

    def _save(self, sheet: Sheet, name: str) -> Path:
        path = self.result.folder / name
        with replace_file(path) as beside:
            sheet.save(beside)
        return path

    def _lay_out(self, shape: tuple[int, ...]) -> tuple[Plan, NDArray[np.bool_]]:
        """Return the plan of squares, and those that were not counted."""
        result, times = self.result, self.times
        rows, cols = shape
        west, south, *_ = result.extent
        x, y = (
            start + times * side * (np.arange(n, dtype=np.float64) + 0.5)
            for start, side, n in zip((west, south), result.cell, (cols, rows), strict=True)
        )
        missing = result.missing
        hatched = np.zeros(shape, np.bool_)
        for tile in missing:
            hatched[_shrink(tile.rows, times), _shrink(tile.cols, times)] = True
        words: dict[str, Any] = {}
        if self.told is not None:
            dx, dy = (times * side for side in result.cell)
            squares = Grid(float(x[0]), float(y[0]), dx, dy, cols, rows)
            words = self.told.describe() | {"proposed": self.told.find_proposed(squares)}
        if times > 1:
            drawn = f"drawn as means of {times} x {times} cells"
            words["note"] = " · ".join(filter(None, [words.get("note"), drawn]))
        subtitle = f"{len(result.tiles) - len(missing):,} of {len(result.tiles):,} tiles"
        if missing:
            names = ", ".join(str(tile.number) for tile in missing[:_FEW])
            more = f" and {len(missing) - _FEW:,} more" if len(missing) > _FEW else ""
            subtitle += f"; not counted (hatched): {names}{more}"
        return _shade(result, Plan(
            x, y, self.roofs, true_north=result.facts.get("true_north_deg", 0.0),
            subtitle=subtitle, **words,
        )), hatched  # fmt: skip


def _shade(result: CityResult, plan: Plan) -> Plan:
    """Add the shade and the edges of the topmost surface, unless roofs are drawn over a plane."""
    if not result.has_heights or plan.building_height is not None:
        return plan
    from umbra.writers.edges import find_height_appearance  # noqa: PLC0415  (kernels)

    heights, *_ = shrink_hours(result, "receiver_z")
    if np.isnan(heights).all():
        return plan
    return replace(
        plan, appearance=find_height_appearance(heights, min(plan.cell), find_map_size(plan))
    )


def shrink_hours(
    result: CityResult, name: str = "shadow_hours", plan: CityPlan | None = None
) -> tuple[NDArray[np.float32], int, NDArray[np.float32] | None]:
    """
    Average the hours of whole squares of cells, whatever the tiles.

    Parameters
    ----------
    result : CityResult
    name : str
        Of the variable.
    plan : CityPlan, optional
        Of which roofs are left out of the means where they lie over the receivers.

    Returns
    -------
    hours : (rows, cols) float32
        Means of the cells that have hours; NaN where none has.
    times : int
        Cells along a square.
    roofs : (rows, cols) float32 or None
        Mean height of what stands over the squares that are covered by half or more, else 0 [m].
    """
    shape = len(result.y), len(result.x)
    times = max(1, math.ceil(max(shape) / LONGEST))
    small = math.ceil(shape[0] / times), math.ceil(shape[1] / times)
    has_roofs = plan is not None and plan.has_roofs
    total, count = np.zeros(small), np.zeros(small, np.int64)
    heights, covered = np.zeros(small), np.zeros(small, np.int64)
    for tile in result.find_done():
        hours = result.read(name, tile).astype(np.float64)
        is_there = np.isfinite(hours)
        where = _shrink(tile.rows, times), _shrink(tile.cols, times)
        if has_roofs:
            above = plan.find_roofs(tile)  # type: ignore[union-attr]
            heights[where] += _add_squares(above, tile.rows, tile.cols, times)
            covered[where] += _add_squares((above > 0).astype(int), tile.rows, tile.cols, times)
            is_there &= above <= 0
        total[where] += _add_squares(np.where(is_there, hours, 0.0), tile.rows, tile.cols, times)
        count[where] += _add_squares(is_there.astype(np.int64), tile.rows, tile.cols, times)
    mean = np.full(small, np.nan, np.float32)
    np.divide(total, count, out=mean, where=count > 0, casting="unsafe")
    if not has_roofs:
        return mean, times, None
    is_roof = (covered > 0) & (covered >= count)
    roofs = np.where(is_roof, heights / np.maximum(covered, 1), 0.0).astype(np.float32)
    return mean, times, roofs


def _shrink(cells: slice, times: int) -> slice:
    """Return the squares that hold some cells."""
    return slice(cells.start // times, (cells.stop - 1) // times + 1)


def _add_squares(values: NDArray, rows: slice, cols: slice, times: int) -> NDArray:
    """Add up the values of cells in each square."""
    for axis, cells in enumerate((rows, cols)):
        begin = np.arange(_shrink(cells, times).start, _shrink(cells, times).stop) * times
        starts = np.maximum(begin - cells.start, 0)
        values = np.add.reduceat(values, starts, axis=axis)
    return values
