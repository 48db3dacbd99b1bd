"""Named receivers of a city, laid out and counted among all that reaches them, without tiles."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.packages import need
from umbra.receivers import find_kind
from umbra.receivers.areas import AreaGround, AreaKind, AreaReceivers, lay_out_areas
from umbra.receivers.kind import Request
from umbra.receivers.single import SingleReceivers
from umbra.scene.named_places import Area
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.tiles.job import CityJob, WorkerContext
from umbra.tiles.neighbourhood import Neighbourhood, PartScene, Selection, make_tile_casters
from umbra.tiles.receive import count_receivers
from umbra.tiles.roles import Roles

__all__ = ["RolePlace", "count_among", "lay_out_among", "look_around"]


class RolePlace(WorkerContext):
    """
    What a process needs to count receivers with options of their own.

    Parameters
    ----------
    job : CityJob
        With the options of these receivers.
    roles : StudyOptions
        By which parts cast.
    is_before : bool
        Whether what casts is what did before the proposal.
    """

    def __init__(self, job: CityJob, roles: StudyOptions, *, is_before: bool = False) -> None:
        super().__init__(job)
        self._role_options, self._is_before = roles, is_before

    @cached_property
    def roles(self) -> Roles:
        """Roles of the files' parts."""
        merged = self.job.merged
        return Roles(self.catalogue, self._role_options, merged, is_before=self._is_before)


def _prepare(own: WorkerContext, units: Selection, *, has_names: bool = False) -> Casting:
    """Prepare the casters among some units, whose parts have names if these are asked for."""
    scene = Neighbourhood(own).read(units).with_words(own.catalogue)
    if has_names:
        files, numbers = own.catalogue.files, scene.number.tolist()
        names = {file: files[file].words["names"] for file in {number for number, _ in numbers}}
        parts = tuple(
            replace(part, name=names[file][k], layer=files[file].layer)
            for part, (file, k) in zip(scene.parts, numbers, strict=True)
        )
        scene = replace(scene, parts=parts)
    caster, canopy, soup = make_tile_casters(own, scene)
    return Casting(scene, soup, caster, own.job.threads, canopy=canopy)


def look_around(
    own: WorkerContext,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    *,
    has_names: bool = False,
) -> Request:
    """
    Return a request for receivers in a rectangle of the local frame, among what is seen there.

    Parts have names if these are asked for.
    """
    casting = _prepare(own, Neighbourhood(own).find_seen(low, high), has_names=has_names)
    gone = np.flatnonzero(cast("PartScene", casting.scene).spread(own.roles.find_replaced))
    return Request(
        casting.scene, own.job.options, [], own.job.threads, casting.canopy, casting=casting,
        gone=gone.tolist(),
    )  # fmt: skip


def lay_out_among(
    own: WorkerContext, areas: Sequence[Area], judged: Sequence[Area] = ()
) -> AreaReceivers:
    """Lay out areas, or bands around them that are ``judged``, among what is seen in their plan."""
    shapely = need("shapely", "gis", "areas")
    polygons = [area.polygon for area in (*areas, *judged)]
    low, high = np.reshape(shapely.total_bounds(polygons), (2, 2)) - own.origin[:2]
    frame = own.job.frame
    ground = AreaGround(frame.ground, is_plane=frame.is_plane, is_added=frame.is_added)
    kind = cast("AreaKind", find_kind("areas"))
    return lay_out_areas(kind, look_around(own, low, high), areas, ground)


def count_among(own: WorkerContext, laid: SingleReceivers) -> tuple[Study, int]:
    """Count receivers among all that reaches them; return their study, and the number of faces."""
    near, points = Neighbourhood(own), laid.local.points
    box = np.stack([points.min(0), points.max(0)])
    request = Request(
        laid.casting.scene, own.job.options, [], own.job.threads, laid.casting.canopy,
        lights=len(own.lights),
    )  # fmt: skip

    def place(lights: NDArray[np.float64]) -> Any:
        return replace(laid, casting=_prepare(own, near.find_casting(box, lights)))

    among = place(own.lights.vectors)
    study, _ = count_receivers(
        own, among, among.make_tiles(request), lambda lights: place(lights).make_tiles(request),
        is_due=False,
    )  # fmt: skip
    return study, len(among.casting.caster.faces)
