"""The protocol of receivers, of all kinds."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.casters.casting import Casting, prepare_casting
from umbra.errors import InputError
from umbra.receivers.counted import Counted
from umbra.receivers.tile import Counter, PieceShares, Tile
from umbra.scene import Scene
from umbra.scene.grid import Grid

if TYPE_CHECKING:
    from umbra.ground.level import Level

__all__ = [
    "DIMS", "Counter", "PieceShares", "ReceiverKind", "Receivers", "Request", "SampleKind", "Tile",
    "Variables",
]  # fmt: skip

DIMS = ("sample",)
"""Axis of single receivers."""
Variables = dict[str, tuple[tuple[str, ...], NDArray]]
"""Arrays of a result by name, each with its dimensions."""


@dataclass(frozen=True, eq=False)
class Request:
    """
    Data that a study passes to its receivers' layout.

    Parameters
    ----------
    scene : Scene
    options : StudyOptions
        The options of receivers are read.
    casters : list of int
        Indices of the parts that cast.
    threads : int
    canopy : Canopy, optional
    true_north : float
        Azimuth of true north in the model's plan [degrees].
    lights : int
        Number of lights.
    find_reaching : callable
        Returns the directions (n, 3) whose shadows the default extent holds.
    bytes_kept, bytes_of_masks : int
        Memory per receiver for results besides hours, and for masks [byte].
    by_day : bool
        Whether results by day are kept, too; errors suggest leaving them out.
    is_streamed : bool
        Whether lights come in time order, which takes more memory per receiver.
    has_groups : bool
        Whether shadows of single casters are needed.
    limit_tiles : callable
        Returns the longest allowed tile side, at most the given one.
    is_cut : bool
        Whether parts of the receivers are counted alone, so that not all are held in memory.
    casting : Casting, optional
        The casters, if they are prepared.
    gone : collection of int
        Indices of the scene's parts that a proposal replaces; none where the scene leaves them out.
    """

    scene: Scene
    options: Any
    casters: list[int]
    threads: int
    canopy: Canopy | None = None
    true_north: float = 0.0
    lights: int = 0
    find_reaching: Callable[[], NDArray[np.float64]] = lambda: np.zeros((0, 3))
    bytes_kept: int = 0
    bytes_of_masks: int = 0
    by_day: bool = False
    is_streamed: bool = False
    has_groups: bool = False
    limit_tiles: Callable[[int], int] = lambda side: side
    is_cut: bool = False
    casting: Casting | None = None
    gone: Collection[int] = ()

    def prepare(self) -> Casting:
        """Prepare the casters."""
        if self.casting is not None:
            return self.casting
        return prepare_casting(self.scene, self.casters, self.threads, self.canopy)

    def find_shown(self) -> list[int] | None:
        """
        Return the parts that a view shows; None: all.

        Canopies and the parts of a proposal are left out, so that what is behind them is
        shown, unless the model has no other parts.
        """
        on = self.options.on
        shown = self.scene.select(on, option="on") if on else None
        if self.canopy is not None:
            shown = self.canopy.find_receivers(self.scene, on)
        proposed = set(self.find_proposed())
        if not proposed:
            return shown
        parts = range(len(self.scene.parts)) if shown is None else shown
        return [part for part in parts if part not in proposed] or shown

    def find_proposed(self) -> list[int]:
        """Return the parts of the proposed development."""
        proposed = self.options.proposed
        return self.scene.select(proposed, option="proposed") if proposed else []

    def find_room(self) -> dict[str, Any]:
        """Return the options of a raster, and the memory of a cell."""
        return {
            **{name: getattr(self.options, name) for name in ("extent", "cell", "size")},
            "masks": self.bytes_of_masks,
            "bytes_kept": self.bytes_kept,
            "threads": self.threads,
            "by_day": self.by_day,
            "is_cut": self.is_cut,
        }


@dataclass(eq=False)
class Receivers:
    """
    Receivers of a study, laid out.

    Parameters
    ----------
    kind : ReceiverKind
    casting : Casting
        Casters of their shadows.
    shape : tuple of int
    dims : tuple of str
        Names of their axes.
    area : (...) float64 or float
        Of each receiver [m2].
    facts : dict
        Attributes of the result.
    """

    kind: "ReceiverKind"
    casting: Casting
    shape: tuple[int, ...]
    dims: tuple[str, ...]
    area: NDArray[np.float64] | float
    facts: dict[str, Any] = field(default_factory=dict)

    @property
    def group_names(self) -> Sequence[str]:
        """Names of the groups of receivers, such as areas and windows; none of others."""
        return ()

    def make_tiles(self, request: Request) -> Sequence[tuple[Any, Callable[[], Tile]]]:
        """Cut them into tiles: index of each among all receivers, and its maker."""
        raise NotImplementedError

    def make_ray_tiles(self) -> Sequence[tuple[Any, Callable[[], Any]]]:
        """Return, as ``make_tiles``, tiles that count a few more instants by rays."""
        raise NotImplementedError

    def finish(self) -> NDArray[np.bool_] | None:
        """Complete the facts after the last tile; return where nothing receives, if anywhere."""
        return None

    def coordinates(self) -> Variables:
        """Return the coordinates of their axes."""
        return {}

    def variables(self) -> Variables:
        """Return the arrays of each receiver's position."""
        return {}

    def locate(self) -> Variables:
        """Return positions found by counting, as results."""
        return {}

    def sum_up(self, study: Any) -> Variables:
        """Return the results of whole surfaces and parts."""
        return {}


class ReceiverKind:
    """
    A kind of receivers: its layout, and how its results are described, drawn and written.

    ``umbra.receivers.REGISTRY`` makes one object of each.

    Attributes
    ----------
    name : str
        Name in results.
    is_plan : bool
        Whether cells lie along x and y, seen from the zenith.
    is_raster : bool
        Whether receivers are cells or pixels of a raster, else single samples.
    counts_cells : bool
        Whether the cells of a raster were counted themselves, not looked up in samples.
    is_level : bool
        Whether all lie in one level plane: it is drawn without shading and edges, and outlines
        of shadows are exact.
    lies_under_roofs : bool
        Whether receivers lie under roofs, too, which are drawn over them: these do not count.
    belongs_to_parts : bool
        Whether each receiver belongs to a part of the model, or to the ground.
    is_upright : bool
        Whether the rows of the raster are heights.
    nothing : str
        Name in the key of what is seen and receives nothing.
    has_scale : bool
        Whether a length in the picture is one length in the model.
    spot : str
        Description of the point of a receiver at which shadow is judged; of single receivers what
        one of them is called.
    noun : str
        What all of them are called, in titles, tables and sentences.
    formats : tuple of str
        Its formats, of ``umbra.writers.output_formats.FORMATS``.
    own_table : str
        File that a study of it writes without being asked; empty if none.
    has_roofs : bool
        Whether roofs are among the receivers of a plan.
    tables : dict of str to str
        Names of CSV files of samples, each with the dimension of its lines.
    takes : tuple of str
        Names of the study's options that are given with it, besides those that name it.
    what_counts : str
        Description of those with meaningful hours.
    area_of : str
        Words that follow the area of all neighbours in a picture.
    """

    name: ClassVar[str]
    is_plan: ClassVar[bool] = False
    is_raster: ClassVar[bool] = True
    counts_cells: ClassVar[bool] = True
    is_level: ClassVar[bool] = False
    lies_under_roofs: ClassVar[bool] = False
    belongs_to_parts: ClassVar[bool] = True
    is_upright: ClassVar[bool] = False
    nothing: ClassVar[str] = "back of a surface"
    has_scale: ClassVar[bool] = True
    spot: ClassVar[str] = "cell's centre"
    noun: ClassVar[str] = "cells"
    formats: ClassVar[tuple[str, ...]] = ("geojson", "gpkg", "dxf", "csv", "solids")
    own_table: ClassVar[str] = ""
    has_roofs: ClassVar[bool] = False
    tables: ClassVar[dict[str, str]] = {}
    takes: ClassVar[tuple[str, ...]] = ()
    what_counts: ClassVar[str] = "surfaces in view, measured in the picture's plane"
    area_of: ClassVar[str] = " of what is seen"

    def lay_out(self, request: Request) -> Receivers:
        """
        Find the receivers of a study.

        Parameters
        ----------
        request : Request

        Raises
        ------
        InputError
            If an option is wrong, or they do not fit in memory.
        """
        raise NotImplementedError

    def describe_level(
        self, scene: Scene, level: float, assumed: "Level | None", bare: float
    ) -> dict[str, object]:
        """
        Return attributes about an assumed ground.

        Parameters
        ----------
        scene : Scene
        level : float
            z of the ground [m].
        assumed : Level, optional
            Basis of the assumption; None if the caller or the file states a height.
        bare : float
            Share of the cells without any of the model.

        Returns
        -------
        facts : dict
            ``assumption``, a line, and ``assumed_ground_share``, if any.
        """
        return {}

    def describe_receivers(self, study: Any) -> str:
        """Describe the receivers of a study, for a report."""
        raise NotImplementedError

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Describe the number and spacing of the receivers: a heading and a text."""
        grid = study.grid
        cell = f"{grid.dx:.4g} m" if grid.dx == grid.dy else f"{grid.dx:.4g} x {grid.dy:.4g} m"
        size = f" of {cell}" if self.has_scale else ""
        return "Cells", f"{len(study.x):,} x {len(study.y):,}{size}, judged at their centres"

    def tell_count(self, study: Any) -> str:
        """Describe the number of single receivers, for the foot of a picture."""
        return f"{len(study.shadow_hours):,} {self.noun}"

    def tell_view(self, facts: dict[str, Any], receivers: str) -> str:
        """Describe a view other than from above, to follow a title."""
        return ""

    def tell_cells(self, grid: Grid, facts: dict[str, Any]) -> str:
        """Describe the size of a raster's cells, for the foot of a picture."""
        cell = f"{grid.dx:.4g} m" if grid.dx == grid.dy else f"{grid.dx:.4g} x {grid.dy:.4g} m"
        return f"cells of {cell}, exact at their centres"

    def find_north(self, facts: dict[str, Any], true_north: float) -> tuple[float | None, float]:
        """Find the direction of true north in a picture, and the foreshortening of the ground."""
        return true_north, 1.0

    def find_counted(self, study: Any) -> Counted | None:
        """Return the receivers with meaningful hours; None if there are none."""
        which = np.isfinite(study.shadow_hours) & study.is_of_model & self.find_open(study)
        weight = np.full(which.shape, study.grid.dx * study.grid.dy)
        return Counted(which, weight, "m²", self.what_counts) if which.any() else None

    def list_counted(self, study: Any) -> list[Counted]:
        """Return groups of the whole frame, on which a proposal is judged; all of them last."""
        return list(filter(None, [self.find_counted(study)]))

    def find_open(self, study: Any) -> NDArray[np.bool_]:
        """Find the receivers under no roof."""
        return np.ones(study.shadow_hours.shape, np.bool_)

    def check_judged(self, receivers: str) -> None:
        """
        Refuse receivers that rules cannot judge.

        Parameters
        ----------
        receivers : str
            As requested.

        Raises
        ------
        InputError
        """
        msg = (
            f"rules= judge plans, surfaces and points, not receivers='{receivers}', which hides a "
            "part of what is judged; choose receivers='surfaces' and the facades with on="
        )
        raise InputError(msg, option="rules", receivers=receivers)


class SampleKind(ReceiverKind):
    """Kind of single receivers, each with its position and normal."""

    is_raster = False

    def check_judged(self, receivers: str) -> None:
        """Accept rules."""
