"""Plans: cells that receive on the ground plane, or on the topmost surface."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.ground.choice import find_ground
from umbra.ground.level import TERRAIN, Level, check_stated, has_terrain, measure_bases
from umbra.receivers.counted import (
    Counted,
    choose_near,
    find_near,
    meets_frame,
    reach_from_centres,
)
from umbra.receivers.gridded import Raster
from umbra.receivers.kind import ReceiverKind, Request, Tile, Variables
from umbra.receivers.layout import TILE, Skyline, lay_out
from umbra.receivers.plan_frame import find_built_bounds, find_held, find_skyline
from umbra.receivers.plan_tiles import PlaneTile, PlanModel, PlanTile, ThroughTile, TopmostTile
from umbra.receivers.scattered import find_dense, tell_coarse, tell_dense
from umbra.scene import Scene
from umbra.scene.derived import derive
from umbra.scene.grid import Grid
from umbra.scene.mesh import find_standing

__all__ = ["GroundPlane", "GroundSurface", "PlanKind", "PlanRaster", "TopmostSurface"]

STREAMED_TILE = 1024
"""Tile side of a study whose instants come in time order: its cells hold more [cell]."""
_LEVEL = 1e-6  # height above the ground that is rounding [m]


@dataclass(eq=False)
class PlanRaster(Raster):
    """
    The cells of a plan.

    Parameters
    ----------
    assumed : Level, optional
        Basis of the ground's height, if assumed.
    cut : (Grid, slice, slice), optional
        The whole plan, and which of its rows and columns these are.
    """

    casting: PlanModel
    kind: "PlanKind"
    assumed: Level | None = field(kw_only=True)
    cut: tuple[Grid, slice, slice] | None = field(default=None, kw_only=True)
    _parts: list[tuple[slice, slice, Grid]] = field(default_factory=list, init=False)
    _looked: dict[Grid, tuple[int, Any, NDArray[np.bool_] | None]] = field(
        default_factory=dict, init=False
    )

    def pick(self, rows: slice, cols: slice) -> "PlanRaster":
        """Return a part of the plan, to be counted alone with the bits of the whole."""
        return replace(
            self, shape=(rows.stop - rows.start, cols.stop - cols.start), x=self.x[cols],
            y=self.y[rows], grid=self.grid.part(rows, cols), facts=dict(self.facts),
            cut=(self.grid, rows, cols),
        )  # fmt: skip

    def make_tiles(self, request: Request) -> Sequence[tuple[Any, Callable[[], Tile]]]:
        """Cut the plan into tiles."""
        side = request.limit_tiles(min(TILE, STREAMED_TILE) if request.is_streamed else TILE)
        self._parts = list(self._list_parts(side))
        return [
            ((rows, cols), partial(self._make_tile, (rows, cols), part))
            for rows, cols, part in self._parts
        ]

    def _list_parts(self, side: int) -> Iterator[tuple[slice, slice, Grid]]:
        """Cut the plan as the whole of which it is a part: rows, columns, grid."""
        if self.cut is None:
            yield from self.grid.tiles(side)
            return
        whole, south, west = self.cut
        for rows, cols, tile in whole.tiles(side):
            low, high = max(rows.start, south.start), min(rows.stop, south.stop)
            left, right = max(cols.start, west.start), min(cols.stop, west.stop)
            if low < high and left < right:
                yield (
                    slice(low - south.start, high - south.start),
                    slice(left - west.start, right - west.start),
                    tile.window(
                        slice(low - rows.start, high - rows.start),
                        slice(left - cols.start, right - cols.start),
                    ),
                )

    def _make_tile(self, where: tuple[slice, slice], part: Grid) -> PlanTile:
        tile = self.casting.make_tile(part)
        if not tile.on_plane:
            nothing = tile.nothing
            bare = int(((tile.surface.face < 0) & ~nothing).sum())
            self._looked[part] = bare, where, nothing if self.casting.has_end else None
        return tile

    @property
    def bare(self) -> int:
        """Number of cells without any of the model in the tiles made so far; 0 on a plane."""
        return sum(bare for bare, _, _ in self._looked.values())

    @cached_property
    def heights(self) -> NDArray[np.float64]:
        """Surface heights, found on first access: while a study counts they would take memory."""
        return self._gather(lambda tile: tile.surface.heights)

    @cached_property
    def receiver_heights(self) -> NDArray[np.float64]:
        """Heights of the receivers, which may lie under that surface; found on first access."""
        return self._gather(lambda tile: tile.find_z())

    def _gather(self, find: Callable[[PlanTile], NDArray[np.float64]]) -> NDArray[np.float64]:
        heights = np.zeros(self.shape)
        for *where, part in self._parts:
            tile, window = self.casting.make_tile(part), heights[*where]
            np.add(find(tile), self.casting.scene.origin[2], out=window)
            window[tile.nothing] = np.nan
        return heights

    @cached_property
    def is_built(self) -> NDArray[np.bool_]:
        """Cells with anything but ground on top."""
        kinds = [part.kind not in TERRAIN for part in self.casting.scene.parts]
        stands = np.array([*kinds, False])
        built = np.zeros(self.shape, np.bool_)
        for *where, part in self._parts:
            built[*where] = stands[self.casting.make_tile(part).find_parts()]
        return built

    @cached_property
    def is_near(self) -> NDArray[np.bool_]:
        """Cells that count in figures: those near buildings."""
        cell = self.grid.dx, self.grid.dy
        return find_near(self.is_built, cell, reach_from_centres(self.near, cell))

    @cached_property
    def near(self) -> float:
        """Farthest that ground counts in figures from a building [m]."""
        return choose_near(find_built_bounds(self.casting))

    def finish(self) -> NDArray[np.bool_] | None:
        """Add the assumptions about the ground to the facts."""
        scene, share = self.casting.scene, self.bare / math.prod(self.shape)
        self.facts |= self.kind.describe_level(scene, self.ground, self.assumed, share)
        nothing = np.zeros(self.shape if self.casting.has_end else 0, np.bool_)
        for _, where, mask in self._looked.values():
            if mask is not None:
                nothing[where] = mask
        return nothing if nothing.any() else None

    def variables(self) -> Variables:
        """Return the height of each receiver."""
        return {"receiver_z": (self.dims, self.kind.find_receiver_z(self))}


class PlanKind(ReceiverKind):
    """Base of ground planes and topmost surfaces."""

    is_plan = True
    nothing = "no surface: not counted"
    area_of = ""
    formats = ("geotiff", "geojson", "gpkg", "dxf", "csv", "glb", "3dtiles", "solids", "gif", "mp4")
    tile: ClassVar[type[PlanTile]]

    def check_judged(self, receivers: str) -> None:
        """Accept rules."""

    def has_end(self, request: Request, *, is_assumed: bool) -> bool:
        """Return whether only the visible parts receive."""
        return False

    def find_receiver_z(self, laid: PlanRaster) -> NDArray[np.float64]:
        """Return the height of each receiver [m]."""
        raise NotImplementedError

    def find_counted(self, study: Any) -> Counted | None:
        """Return what lies near buildings: far ground would make any share a matter of frame."""
        *_, whole = self.list_counted(study)
        which = whole.which & study.laid.is_near
        if not which.any():
            return None
        if not study.laid.is_built.any():
            return replace(whole, which=which, what=whole.name)
        where = " in the frame" if meets_frame(which) else ""
        within = f"{where}, within {study.laid.near:g} m of buildings"
        return replace(whole, which=which, what=f"{whole.name}{within}")

    def list_counted(self, study: Any) -> list[Counted]:
        """Return the receivers of the whole frame."""
        which = np.isfinite(study.shadow_hours) & self.find_open(study)
        weight = np.broadcast_to(np.float64(study.grid.dx * study.grid.dy), which.shape)
        return [Counted(which, weight, "m²", self.what_counts)]

    def lay_out(self, request: Request) -> PlanRaster:
        """Choose the cells of the plan."""
        scene, origin = request.scene, request.scene.origin
        ground = find_ground(scene, request.options.ground)
        level, assumed = ground.level, ground.assumed
        has_end = self.has_end(request, is_assumed=assumed is not None)
        cast = request.prepare()
        model = PlanModel(
            scene, cast.soup, cast.caster, request.threads, level - origin[2], self.tile,
            canopy=request.canopy, has_end=has_end, lowest=ground.lowest - origin[2],
        )  # fmt: skip
        is_stated = request.options.extent is not None
        boxes = derive(scene, "standing", None, lambda: _find_standing(scene))
        facts: dict[str, object] = {"ground_z": level, **ground.describe()}
        dense = None if is_stated else find_dense(boxes)
        if dense is not None:
            facts["extent_note"] = tell_dense(dense, boxes)
        skyline = (
            Skyline.of(scene.model_bounds(), level)
            if is_stated
            else find_skyline(model, level, dense)
        )
        # If nothing receives beyond a terrain, the extent need not hold shadows.
        ends = has_end and not ground.is_added
        reaching = np.zeros((0, 3)) if ends or is_stated else request.find_reaching()
        held = None if is_stated else _hold_counted(model, request.options, dense, has_end=ends)
        grid, x, y = lay_out(skyline, reaching, held=held, **request.find_room())
        if coarse := tell_coarse(grid, boxes):
            facts["cell_note"] = coarse
        return PlanRaster(
            self, model, (grid.rows, grid.cols), ("y", "x"), grid.dx * grid.dy,
            facts, x=x, y=y, ground=level, assumed=assumed,
            grid=replace(grid, x0=grid.x0 - origin[0], y0=grid.y0 - origin[1]),
        )  # fmt: skip


def _hold_counted(
    model: PlanModel, options: Any, dense: NDArray[np.float64] | None, *, has_end: bool
) -> NDArray[np.float64] | None:
    """Return the rectangle (2, 2) of all ground that figures are of, in own coordinates [m]."""
    scene, areas = model.scene, None
    if options.areas is not None:
        from umbra.receivers.area_search import bound_areas  # noqa: PLC0415  (readers of areas)

        areas = bound_areas(scene, options.areas)
    ground = scene.model_bounds() if has_end else None
    return find_held(find_built_bounds(model), areas, options.band, dense=dense, ground=ground)


def _find_standing(scene: Scene) -> NDArray[np.float64]:
    """Return the plans (n, 2, 3) of the objects that stand on no other: buildings, not dormers."""
    own = scene.list_own()
    if own is not None:  # all stands on a ground that was added
        scene = replace(scene, parts=tuple(scene.parts[k] for k in own))
    boxes = measure_bases(scene).boxes
    return boxes[find_standing(boxes)]


class GroundPlane(PlanKind):
    """The plane z = ground, also under buildings."""

    name = "ground"
    is_level = True
    lies_under_roofs = True
    what_counts = "open ground, not under buildings"
    tile = PlaneTile

    def find_receiver_z(self, laid: PlanRaster) -> NDArray[np.float64]:
        """Return the ground's height everywhere."""
        return np.broadcast_to(np.float64(laid.ground), laid.shape)

    def describe_level(
        self, scene: Scene, level: float, assumed: Level | None, bare: float
    ) -> dict[str, object]:
        """Report that a model's own ground is not shown, or that its buildings' bases differ."""
        if has_terrain(scene):
            note = (
                f"the model brings ground of its own, of which a plane at z = {level:.6g} m shows "
                "nothing; receivers='top' shows the shadows on it"
            )
            return {"assumption": note}
        return check_stated(scene, level) if assumed is None else assumed.describe(level)

    def describe_receivers(self, study: Any) -> str:
        """Describe the ground plane."""
        level = f"the level ground at z = {study.ground:.6g} m"
        return f"{level}; figures leave out what lies under buildings"

    def find_open(self, study: Any) -> NDArray[np.bool_]:
        """Find the cells under no roof."""
        return study.heights <= study.ground + _LEVEL


class GroundSurface(PlanKind):
    """Ground that was added to a model, seen through its buildings."""

    name = "ground"
    lies_under_roofs = True
    what_counts = "open ground, not under buildings"
    tile = ThroughTile

    def has_end(self, request: Request, *, is_assumed: bool) -> bool:
        """Return that only the surface receives."""
        return True

    def find_receiver_z(self, laid: PlanRaster) -> NDArray[np.float64]:
        """Return the height of the ground."""
        return laid.receiver_heights

    def describe_receivers(self, study: Any) -> str:
        """Describe the surface."""
        return f"the {study.facts['ground']}, except under buildings"

    def find_open(self, study: Any) -> NDArray[np.bool_]:
        """Find the cells under no roof."""
        laid: Any = study.laid
        return study.heights <= laid.receiver_heights


class TopmostSurface(PlanKind):
    """Roofs, terrain, and assumed ground elsewhere."""

    name = "top"
    has_roofs = True
    what_counts = "ground and roofs"
    tile = TopmostTile

    def has_end(self, request: Request, *, is_assumed: bool) -> bool:
        """Return whether the model's own terrain ends without a stated ground beyond it."""
        return is_assumed and has_terrain(request.scene)

    def find_receiver_z(self, laid: PlanRaster) -> NDArray[np.float64]:
        """Return the height of the topmost surface."""
        return laid.heights

    def list_counted(self, study: Any) -> list[Counted]:
        """Return the ground, the roofs, and both."""
        (whole,) = super().list_counted(study)
        built = study.laid.is_built
        ground = replace(whole, which=whole.which & ~built, what="ground")
        roofs = replace(whole, which=whole.which & built, what="roofs")
        return [*(group for group in (ground, roofs) if group.which.any()), whole]

    def describe_level(
        self, scene: Scene, level: float, assumed: Level | None, bare: float
    ) -> dict[str, object]:
        """Report assumed ground where it is seen."""
        if bare <= 0:
            return {}
        if assumed is None:
            return check_stated(scene, level)
        note = (
            f"nothing of the model lies under {100 * bare:.3g} % of the plan; there the ground "
            f"is assumed level at z = {level:.6g} m (ground=)"
        )
        return {"assumption": note, "assumed_ground_share": float(bare)}

    def describe_receivers(self, study: Any) -> str:
        """Describe the topmost surface."""
        return f"the topmost surface: roofs, terrain; {study.facts['ground']}"
