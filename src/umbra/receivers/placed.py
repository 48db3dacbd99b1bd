"""
Receivers at places of their own: points with normals, areas and names.

A kind of samples says where they lie; all else (layout in memory, counting, tables, maps) follows.
Given points are one such kind; packages beside umbra bring others.
"""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, UmbraError
from umbra.receivers.counted import Counted
from umbra.receivers.kind import DIMS, Request, SampleKind, Variables
from umbra.receivers.single import SingleReceivers
from umbra.scene.grid import Places
from umbra.scene.numbers import read_array

if TYPE_CHECKING:
    from umbra.scene import Scene

__all__ = ["PlacedKind", "PlacedReceivers", "PlacedSamples"]


@dataclass(frozen=True)
class PlacedSamples:
    """
    Where samples lie.

    Parameters
    ----------
    points : (n, 3) float
        In the model's own coordinates [m].
    normals : (n, 3) float, optional
        Of the side that receives; NaN, or none, for points that receive from all sides.
    areas : (n,) float, optional
        That each stands for [m2]; without them each counts as one.
    parts : (n,) int, optional
        Index of the part of the model that each lies on; -1 for none.
    names : sequence of str
        Of each, if any.
    """

    points: ArrayLike
    normals: ArrayLike | None = None
    areas: ArrayLike | None = None
    parts: ArrayLike | None = None
    names: Sequence[str] = ()


class PlacedKind(SampleKind):
    """Base of kinds of samples that say where they lie."""

    belongs_to_parts = False
    spot = "point"
    formats: ClassVar[tuple[str, ...]] = ("csv", "geojson", "gpkg", "solids")
    tables = {"points.csv": "sample"}  # noqa: RUF012  (a constant)

    @abstractmethod
    def place(self, scene: "Scene", options: Any) -> PlacedSamples:
        """
        Find the samples of a scene.

        Parameters
        ----------
        scene : Scene
            In its local frame: ``scene.origin`` [m] leads to the model's own coordinates.
        options : StudyOptions
            Those named in ``takes`` may be given with this kind.

        Raises
        ------
        InputError
            If there are none, or an option is wrong.
        """

    def lay_out(self, request: Request) -> "PlacedReceivers":
        """Lay out the samples."""
        placed = self._place(request)
        points = np.array(read_array("points", placed.points))
        count = len(points)
        normals = self._read(placed.normals, (count, 3), np.nan)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.divide(normals, length, out=np.full_like(normals, np.nan), where=length > 0)
        if points.shape != (count, 3) or not count or not np.isfinite(points).all():
            msg = f"receivers='{self.name}' found no points, or such as are not finite"
            raise InputError(msg, option="receivers")
        areas = None if placed.areas is None else self._read(placed.areas, (count,), 1.0)
        return PlacedReceivers(
            self, request.prepare(), (count,), DIMS, np.ones(count) if areas is None else areas,
            local=Places(points - request.scene.origin, normals),
            part=self._read(placed.parts, (count,), -1).astype(np.intp),
            # No text in a file may hold a null: netCDF, SQLite, XML.
            names=tuple(str(name).replace("\0", "\ufffd") for name in placed.names),
            areas=areas,
        )  # fmt: skip

    def _place(self, request: Request) -> PlacedSamples:
        """Find the samples; name the kind where it fails."""
        try:
            return self.place(request.scene, request.options)
        except UmbraError:
            raise
        except Exception as error:
            msg = (
                f"receivers='{self.name}' failed ({type(error).__name__}: {error}); update the "
                "package that brings them, or choose others"
            )
            raise InputError(msg, option="receivers") from error

    def _read(self, given: ArrayLike | None, shape: tuple[int, ...], by: float) -> NDArray:
        """Return an array of a shape; filled where nothing is given."""
        if given is None:
            return np.full(shape, by, np.float64)
        values = np.array(given, np.float64)
        if values.shape != shape:
            msg = f"receivers='{self.name}' gave an array {values.shape} for {shape[0]} points"
            raise InputError(msg, option="receivers")
        return values

    def describe_receivers(self, study: Any) -> str:
        """Describe the samples."""
        return f"the places of '{self.name}'"

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Describe the number of points, and of points with normals."""
        count = len(study.shadow_hours)
        free = int(np.isnan(study.places.normals).any(1).sum())
        words = f"{count:,}, {count - free:,} with a normal" if free else f"{count:,}, with normals"
        return "Points", words + (
            "; the others are judged from both sides of a surface" if free else ""
        )

    def find_counted(self, study: Any) -> Counted:
        """Weight each point by its area, or count it once."""
        which = np.isfinite(study.shadow_hours)
        if study.laid.areas is None:
            return Counted(which, np.ones(which.shape), "points", "points")
        return Counted(which, study.laid.areas, "m²", self.name)


@dataclass(eq=False, kw_only=True)
class PlacedReceivers(SingleReceivers):
    """
    Samples, some with names and areas.

    Parameters
    ----------
    areas : (n,) float64, optional
    """

    areas: NDArray[np.float64] | None = None

    def sum_up(self, study: Any) -> Variables:
        """Return names and areas, if any."""
        variables: Variables = {"name": (DIMS, np.array(self.names))} if self.names else {}
        return variables if self.areas is None else {**variables, "area": (DIMS, self.areas)}
