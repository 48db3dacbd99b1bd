"""What a study asks of a kind of receivers, whatever it is."""

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.receivers.counted import Counted

if TYPE_CHECKING:
    pass

__all__ = ["PlanKind", "ReceiverKind", "SampleKind"]


class ReceiverKind:
    """
    A kind of receivers: what its results are called, and how they are told, drawn and written.

    One object of each stands in ``umbra.receivers.KINDS``; nobody else compares names.

    Attributes
    ----------
    name : str
        As results say it.
    is_plan : bool
        Whether cells lie in x and y, seen from the zenith.
    is_raster : bool
        Whether receivers are the cells or pixels of a raster; else they are single samples.
    is_level : bool
        Whether all lie in one level plane: no shade and no edges are drawn on it, and the
        outlines of shadows are exact.
    lies_under_roofs : bool
        Whether receivers lie under buildings, too: roofs are drawn over them, and those under
        roofs do not count.
    belongs_to_parts : bool
        Whether each receiver belongs to a part of the model, or to the ground.
    has_scale : bool
        Whether a length in the picture is one length in the model.
    follows_extent : bool
        Whether areas grow with the extent of what is shown.
    spot : str
        Where in a receiver the answer holds.
    formats : tuple of str
        Of ``umbra.writers.formats.FORMATS``, in which it is written.
    has_roofs : bool
        Whether roofs are among the receivers of a plan.
    tables : dict of str to str
        Names of CSV files of samples, each with the dimension whose lines it has.
    what_counts : str
        The receivers whose hours mean something, in words.
    """

    name: ClassVar[str]
    is_plan: ClassVar[bool] = False
    is_raster: ClassVar[bool] = True
    is_level: ClassVar[bool] = False
    lies_under_roofs: ClassVar[bool] = False
    belongs_to_parts: ClassVar[bool] = True
    has_scale: ClassVar[bool] = True
    follows_extent: ClassVar[bool] = True
    spot: ClassVar[str] = "cell's centre"
    formats: ClassVar[tuple[str, ...]] = ("geojson", "gpkg", "dxf", "csv")
    has_roofs: ClassVar[bool] = False
    tables: ClassVar[dict[str, str]] = {}
    what_counts: ClassVar[str] = "all that is seen of the model, as it is seen"

    def is_asked(self, receivers: str) -> bool:
        """Tell whether a study's option names this kind."""
        return receivers == self.name

    def describe_receivers(self, study: Any) -> str:
        """Say what receives shadows in a study, for a report."""
        raise NotImplementedError

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Say how many receivers there are, and how far apart: a heading, and the words."""
        grid = study.grid
        cell = f"{grid.dx:.4g} m" if grid.dx == grid.dy else f"{grid.dx:.4g} x {grid.dy:.4g} m"
        size = f" of {cell}" if self.has_scale else ""
        return "Cells", f"{len(study.x):,} x {len(study.y):,}{size}, judged at their centres"

    def find_counted(self, study: Any) -> Counted | None:
        """Return the receivers whose hours mean something; None where there are none."""
        which = np.isfinite(study.shadow_hours) & study.is_of_model & self.find_open(study)
        weight = np.full(which.shape, study.grid.dx * study.grid.dy)
        return Counted(which, weight, "m²", self.what_counts) if which.any() else None

    def find_open(self, study: Any) -> NDArray[np.bool_]:
        """Tell which receivers lie under no roof."""
        return np.ones(study.shadow_hours.shape, np.bool_)

    def check_judged(self, receivers: str) -> None:
        """
        Refuse to judge such receivers by rules, if they cannot be.

        Parameters
        ----------
        receivers : str
            As they were asked for.

        Raises
        ------
        InputError
        """
        msg = (
            f"rules= judge plans, surfaces and points, not receivers='{receivers}', which hides a "
            "part of what is judged; choose receivers='surfaces' and the facades with on="
        )
        raise InputError(msg, receivers=receivers)


class PlanKind(ReceiverKind):
    """Receivers of a plan: one a cell, seen from the zenith."""

    is_plan = True
    formats = ("geotiff", "geojson", "gpkg", "dxf", "csv", "glb", "gif", "mp4")

    def check_judged(self, receivers: str) -> None:
        """Let rules judge it."""


class SampleKind(ReceiverKind):
    """Single receivers, each with a place and a normal of its own."""

    is_raster = False

    def check_judged(self, receivers: str) -> None:
        """Let rules judge it."""
