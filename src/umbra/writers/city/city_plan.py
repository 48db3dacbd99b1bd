"""What a picture of a plan in tiles says and shows besides hours: captions, and buildings."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.plan import PlanKind, PlanRaster
from umbra.receivers.zenith import find_surface
from umbra.scene import Scene, Triangles
from umbra.scene.grid import Grid
from umbra.scene.mesh import ADDED_GROUND
from umbra.study import Study
from umbra.study.finer import FinerSteps
from umbra.tiles.city_areas import list_judged
from umbra.tiles.city_lattice import CityTile, Lattice
from umbra.tiles.city_proposal import find_proposal
from umbra.tiles.job import CityJob, WorkerContext, read_job
from umbra.tiles.neighbourhood import Neighbourhood
from umbra.writers.city.store_window import CityResult, StoredTile
from umbra.writers.folder.captions import (
    name_model,
    name_sun,
    outline_areas,
    tell_place,
    tell_times,
)
from umbra.writers.folder.foot import describe_making

__all__ = ["CityPlan"]

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
    def context(self) -> WorkerContext:
        """What counting kept between tiles."""
        return self.job.open()

    @cached_property
    def study(self) -> Study:
        """The study, of whose receivers only the cells are known."""
        result, context, kind = self.result, self.context, self.context.kind
        assert isinstance(kind, PlanKind)
        nothing: Any = None
        laid = PlanRaster(
            kind, nothing, (len(result.y), len(result.x)), ("y", "x"), math.prod(result.cell), {},
            x=result.x, y=result.y, ground=self.job.frame.ground, grid=self.lattice.grid,
            assumed=None,
        )  # fmt: skip
        hours = np.zeros((1, 1), np.float32)
        options = self.job.options
        return Study(
            laid, context.period, hours, result.up_hours, None, result.facts,
            has_hours=options.asks_hours, quantities=options.quantities,
        )  # fmt: skip

    @property
    def lattice(self) -> Lattice:
        """Its raster, in the run's local frame."""
        assert self.job.lattice is not None
        return self.job.lattice

    def describe(self, what: str = "sun", finer: FinerSteps | None = None) -> dict[str, Any]:
        """
        Return the words around a picture of ``what``, as those of a study in memory.

        ``finer`` are the steps of its hours, if not the study's own.
        """
        study, options = self.study, self.job.options
        lowest = [f"suns below {self.job.min_altitude:g}° left out"] * (self.job.min_altitude > 0)
        # A ground that was added has no path.
        files = [file for file in self.context.catalogue.files if file.path]
        names = dict.fromkeys(file.path.rsplit("/", 1)[-1] for file in files)
        view = study.kind.tell_view(study.facts, options.receivers)
        days = range(len(study.period.days))
        return {
            "title": name_model(list(names)) + view + name_sun(study.period, days, what),
            "place": tell_place(study),
            "date": tell_times(study.period, options, days),
            "note": " · ".join([describe_making(study, options, finer), *lowest]),
            "roofs_cover": study.kind.lies_under_roofs,
            "areas": outline_areas(list_judged(options)),
        }

    @property
    def has_roofs(self) -> bool:
        """Whether roofs lie over the receivers."""
        return self.context.kind.lies_under_roofs

    def find_proposed(self, squares: Grid) -> NDArray[np.bool_] | None:
        """Return the squares, in the city's coordinates, below a proposal; None without one."""
        if not self.job.options.proposed:
            return None
        x, y, _ = self.context.origin.tolist()
        local = replace(squares, x0=squares.x0 - x, y0=squares.y0 - y)
        soup = find_proposal(self.context)
        floor = float(soup.vertices[:, 2].min(initial=0.0)) - 1.0
        return find_surface(soup, local, floor, self.job.threads).face >= 0

    def find_roofs(self, tile: StoredTile) -> NDArray[np.float64]:
        """Return the heights of what stands over the ground on a tile's cells, (rows, cols) [m]."""
        lattice, near, roles = self.lattice, Neighbourhood(self.context), self.context.roles
        south, west = tile.rows.start, tile.cols.start
        heights = np.zeros((tile.rows.stop - south, tile.cols.stop - west))
        cells = CityTile(tile.number, (south, tile.rows.stop), (west, tile.cols.stop))
        floor = self.job.frame.floor
        for rows, cols in lattice.cut(cells, lattice.block):
            grid = lattice.find_window(rows, cols)
            aside = np.array([grid.dx, grid.dy])
            seen = near.find_seen(np.array([grid.x[0], grid.y[0]]) - aside,
                                  np.array([grid.x[-1], grid.y[-1]]) + aside)  # fmt: skip
            scene = near.read(seen).with_words(self.context.catalogue)
            stands = ~scene.spread(roles.find_replaced)
            if roles.season is not None:
                stands &= ~scene.spread(roles.find_canopies)
            soup = scene.pick(stands)
            if len(soup.faces):
                risen = self._find_heights(scene, soup, grid, floor)
                where = (slice(rows.start - south, rows.stop - south),
                         slice(cols.start - west, cols.stop - west))  # fmt: skip
                heights[where] = np.where(risen > _ROOF, risen, 0.0)
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
                replace(soup, faces=soup.faces[chosen], part=soup.part[chosen]), grid, floor,
                threads, has_end=True,
            )
            for chosen in (is_ground[soup.part], ~is_ground[soup.part])
        )  # fmt: skip
        return np.where((top.face >= 0) & (ground.face >= 0), top.heights - ground.heights, 0.0)
