"""Named areas and windows of a city, laid out in runs that lie together."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.receivers import find_kind
from umbra.receivers.areas import AreaLevel, tell_sampling
from umbra.receivers.openings import Openings
from umbra.receivers.windows import MOST_HELD
from umbra.scene.grid import Places
from umbra.tiles.city_receivers import RolePlace, lay_out_among, look_around

__all__ = ["Laid", "cut_squares", "lay_out_city_areas", "lay_out_windows"]

_SIDE = 500.0
"""Side of the squares whose receivers are counted together, with the casters of all [m]."""
_SAMPLES = 500_000
"""Most samples of a run."""
_AROUND = 12.0  # of a window and its reveal, in which bodies that hold it are looked for [m]


@dataclass(frozen=True, eq=False)
class Laid:
    """
    Named receivers of all runs, in the order in which they were given.

    Parameters
    ----------
    records : tuple
        ``Area`` or ``Window`` of each.
    owner : (n,) int
        Receiver of each sample, ascending.
    places : Places
        Samples in the city's own coordinates.
    areas : (n,) float64
        That each sample stands for [m2].
    notes : tuple of str
    openings : Openings, optional
        Of the samples of windows.
    """

    records: tuple[Any, ...]
    owner: NDArray[np.intp]
    places: Places
    areas: NDArray[np.float64]
    notes: tuple[str, ...] = ()
    openings: Openings | None = None

    @property
    def group_names(self) -> list[str]:
        """Names of the receivers."""
        return [record.name for record in self.records]

    def average(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return means (k,) of values of samples (n,), weighted by area."""
        first = np.searchsorted(self.owner, np.arange(len(self.records)))
        whole = np.bincount(self.owner, self.areas, len(self.records))
        return np.asarray(np.add.reduceat(values * self.areas, first) / whole)


def cut_squares(
    points: NDArray[np.float64], side: float | None = None
) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of points (n, 2) or (n, 3) in each square, at most so many at a time."""
    squares = np.floor(points[:, :2] / (side or _SIDE)).astype(np.int64)
    order = np.lexsort((np.arange(len(points)), squares[:, 0], squares[:, 1]))
    changes = np.flatnonzero((np.diff(squares[order], axis=0) != 0).any(1)) + 1
    for run in np.split(order, changes):
        for first in range(0, len(run), _SAMPLES):
            yield run[first : first + _SAMPLES]


def lay_out_city_areas(own: RolePlace) -> Laid:
    """Lay out the areas of a place's options, without bands."""
    options = own.job.options
    areas: list[Any] = list(options.areas)
    middles = np.array([area.polygon.centroid.coords[0] for area in areas])
    sides, covered = np.zeros(len(areas)), np.zeros(len(areas))

    def lay_out(run: NDArray[np.intp]) -> Any:
        laid = lay_out_among(own, [areas[k] for k in run.tolist()])
        sides[run], covered[run] = laid.sides, laid.covered
        return laid

    found = _join(len(areas), cut_squares(middles, own.job.square), lay_out)
    level = AreaLevel.of(options.areas_on)
    notes = tell_sampling([one.name for one in areas], covered, sides, options.cell, level)
    return replace(found, notes=tuple(notes))


def lay_out_windows(own: RolePlace) -> Laid:
    """Lay out the windows of a table."""
    options, north = own.job.options, own.job.site.true_north if own.job.site else 0.0
    rows: Sequence[Any] = list(options.windows)
    middles = np.array([(row.x, row.y) for row in rows])
    kind, notes = find_kind("windows"), list[str]()
    # Of too many none is looked for within bodies, of the whole table as of a run.
    runs = (
        cut_squares(middles, own.job.square)
        if len(rows) <= MOST_HELD
        else iter([np.arange(len(rows))])
    )

    def lay_out(run: NDArray[np.intp]) -> Any:
        some = [rows[k] for k in run.tolist()]
        low, high = middles[run].min(0) - _AROUND, middles[run].max(0) + _AROUND
        if len(rows) > MOST_HELD:
            high = low
        shift = own.origin[:2]
        request = look_around(own, low - shift, high - shift, has_names=True)
        request = replace(request, options=replace(options, windows=some), true_north=north)
        laid: Any = kind.lay_out(request)
        notes.extend(laid.notes)
        return laid

    return replace(_join(len(rows), runs, lay_out), notes=tuple(dict.fromkeys(notes)))


def _join(
    count: int, runs: Iterator[NDArray[np.intp]], lay_out: Callable[[NDArray[np.intp]], Any]
) -> Laid:
    """Join the receivers of runs in the order of their indices."""
    records: list[Any] = [None] * count
    pieces: list[Any] = [None] * count
    openings: list[Any] = [None] * count
    for run in runs:
        laid = lay_out(run)
        places = laid.places
        for row, k in enumerate(run.tolist()):
            mine = laid.owner == row
            records[k] = laid.records[row]
            pieces[k] = places.points[mine], places.normals[mine], laid.areas[mine]
            if hasattr(laid, "openings"):
                openings[k] = laid.openings.pick(mine)
    points, normals, areas = (np.concatenate(one) for one in zip(*pieces, strict=True))
    owner = np.repeat(np.arange(count), [len(one) for one, _, _ in pieces])
    before = None if openings[0] is None else Openings.join(openings)
    return Laid(tuple(records), owner, Places(points, normals), areas, openings=before)
