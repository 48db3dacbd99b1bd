"""
Receivers at places of their own: points with normals, areas and names.

A kind of samples says where they lie; all else (layout in memory, counting, tables, maps) follows.
Given points are one such kind; packages beside umbra bring others.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.casters.casting import prepare_casting
from umbra.errors import InputError, UmbraError, show_value
from umbra.ground.choice import find_ground
from umbra.ground.level import TERRAIN
from umbra.rays.nearest_hits import drop_plumb
from umbra.receivers.counted import Counted
from umbra.receivers.kind import DIMS, Request, SampleKind, Variables
from umbra.receivers.single import SingleReceivers
from umbra.registry import add_note
from umbra.scene.grid import Places
from umbra.scene.mesh import ADDED_GROUND
from umbra.scene.numbers import read_array

if TYPE_CHECKING:
    from umbra.scene import Scene

__all__ = ["PlacedKind", "PlacedReceivers", "PlacedSamples", "find_ground_heights"]

GROUND = -2
"""Index of the ground among parts."""
_FAR, _DIAGONALS = 1000.0, 10.0
"""From the model [m], and in its diagonals, samples are told to lie far."""


def find_ground_heights(
    scene: "Scene", plan: ArrayLike, ground: float | str | None = None
) -> NDArray[np.float64]:
    """
    Find the ground under places, as areas stand on it.

    Parameters
    ----------
    scene : Scene
    plan : (n, 2) float
        x and y in the model's own coordinates [m].
    ground : float or str, optional
        As asked for: a study's ``options.ground``.

    Returns
    -------
    heights : (n,) float64
        z in the model's own coordinates [m]: of the file's terrain, of the surface through the
        feet of buildings, or of the plane; NaN beside a terrain.
    """
    places = read_array("plan", plan)
    known = find_ground(scene, ground)
    if known.is_plane:
        return np.full(len(places), known.level)
    scene, kinds = known.scene, ADDED_GROUND if known.is_added else TERRAIN
    land = [k for k, part in enumerate(scene.parts) if part.kind in kinds]
    floor = float(scene.bounds()[0, 2] - scene.origin[2]) - 1.0
    tree = prepare_casting(scene, land, 1).tree
    heights, _, _ = drop_plumb(tree, places - scene.origin[:2], floor)
    return heights + scene.origin[2]


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


class PlacedKind(SampleKind, ABC):
    """
    Base of kinds of samples that say where they lie.

    Attributes
    ----------
    noun, spot : str
        What they are called in titles, tables and sentences, all of them and one: ``"steps of the
        path"``, ``"step"``.
    """

    belongs_to_parts = False
    noun, spot = "points", "point"
    far_remedy: ClassVar[str] = (
        "place returns points in the model's own coordinates (add scene.origin to the scene's)"
    )
    """What to do where all points lie far from the model."""
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
        points = self._read("points", placed.points)
        count = len(points)
        if points.shape != (count, 3) or not count:
            msg = f"points of the shape {points.shape}"
            raise self._blame(msg, "give (n, 3), at least one")
        self._refuse("points", np.asarray(~np.isfinite(points).all(axis=1)), points, "not finite")
        self._note_far(points, request.scene)
        normals = self._read("normals", placed.normals, (count, 3), np.nan)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        wrong = ~(np.isfinite(length[:, 0]) & (length[:, 0] > 0)) & ~np.isnan(normals).all(axis=1)
        self._refuse("normals", wrong, normals, "of no direction; give NaN for points without one")
        normals = np.divide(normals, length, out=np.full_like(normals, np.nan), where=length > 0)
        parts = self._read("parts", placed.parts, (count,), -1)
        wrong = (parts < GROUND) | (parts >= len(request.scene.parts)) | (parts % 1 != 0)
        self._refuse("parts", wrong, parts, f"no index of the model's {len(request.scene.parts)}")
        names = () if isinstance(placed.names, str) else placed.names
        if len(names) != count and len(placed.names):
            msg = f"{len(placed.names)} names for {count} points"
            raise self._blame(msg, "name each, or none")
        areas = None
        if placed.areas is not None:
            areas = self._read("areas", placed.areas, (count,))
            wrong = ~(np.isfinite(areas) & (areas >= 0))
            self._refuse("areas", wrong, areas, "no area of at least 0 m2")
            if not areas.any():
                msg = f"{count} areas of 0"
                raise self._blame(msg, "leave areas out, so that each counts as 1")
        return PlacedReceivers(
            self, request.prepare(), (count,), DIMS, np.ones(count) if areas is None else areas,
            local=Places(points - request.scene.origin, normals),
            part=parts.astype(np.intp),
            # No text in a file may hold a null: netCDF, SQLite, XML.
            names=tuple(str(name).replace("\0", "\ufffd") for name in names),
            areas=areas,
        )  # fmt: skip

    def _place(self, request: Request) -> PlacedSamples:
        """Find the samples; name the kind where it fails."""
        try:
            placed: object = self.place(request.scene, request.options)
        except UmbraError:
            raise
        except Exception as error:
            msg = (
                f"receivers='{self.name}' failed ({type(error).__name__}: {error}); update the "
                "package that brings them, or choose others"
            )
            raise InputError(msg, option="receivers") from error
        if not isinstance(placed, PlacedSamples):
            raise self._blame(show_value(placed), "place returns PlacedSamples(points, normals)")
        return placed

    def _read(
        self, what: str, given: ArrayLike | None, shape: tuple[int, ...] = (), by: float = 0.0
    ) -> NDArray[np.float64]:
        """Return a copy of an array of a shape; filled where nothing is given."""
        if given is None and shape:
            return np.full(shape, by, np.float64)
        try:
            values = np.array(read_array(what, given))
        except InputError as error:
            raise self._blame(what, str(error)) from None
        if shape and values.shape != shape:
            msg = f"{what} of the shape {values.shape}"
            raise self._blame(msg, f"make it {shape}")
        return values

    def _refuse(self, what: str, wrong: NDArray, given: NDArray, how: str) -> None:
        """Refuse points where ``wrong`` (n,), and tell the first."""
        if wrong.any():
            first, count = int(wrong.argmax()), int(np.count_nonzero(wrong))
            told = f"{what} of {count} of {len(wrong)} points (first: point {first}, "
            told += ", ".join(f"{x:g}" for x in np.atleast_1d(given[first])) + ")"
            raise self._blame(told, f"they are {how}")

    def _blame(self, what: str, remedy: str) -> InputError:
        """Return the error of a kind whose samples cannot be counted."""
        msg = f"receivers='{self.name}' gave {what}; {remedy}"
        return InputError(msg, option="receivers", receivers=self.name)

    def _note_far(self, points: NDArray[np.float64], scene: "Scene") -> None:
        """Tell of points that all lie far outside the model, as in its local frame."""
        if not any(part.triangles for part in scene.parts):  # a strip of a city may be empty
            return
        low, high = scene.model_bounds()
        gaps = np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0), axis=1)
        if gaps.min() > max(_FAR, _DIAGONALS * float(np.linalg.norm(high - low))):
            add_note(
                f"all {len(points):,} points of receivers='{self.name}' lie {gaps.min():,.0f} m or "
                f"more from the model; {self.far_remedy}"
            )

    def describe_receivers(self, study: Any) -> str:
        """Describe the samples."""
        return f"the {self.noun} of '{self.name}'"

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Describe the number of points, and of points with normals."""
        count = len(study.shadow_hours)
        free = int(np.isnan(study.places.normals).any(1).sum())
        words = f"{count:,}, {count - free:,} with a normal" if free else f"{count:,}, with normals"
        return self.noun.capitalize(), words + (
            "; the others are judged from both sides of a surface" if free else ""
        )

    def find_counted(self, study: Any) -> Counted:
        """Weight each point by its area, or count it once."""
        which = np.isfinite(study.shadow_hours)
        if study.laid.areas is None:
            return Counted(which, np.ones(which.shape), self.noun, self.noun)
        return Counted(which, study.laid.areas, "m²", self.noun)


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
