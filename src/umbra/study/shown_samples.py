"""
A study of surfaces as a view shows it.

Each pixel of a sampled surface has the hours of that surface's nearest sample. The ground around
the model, which has no samples, is counted on a plan, and a pixel of it has the hours of the
nearest open cell. Nothing that was counted is counted again.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.devices import CHOICES, DEFAULT
from umbra.rays.hidden import find_hidden
from umbra.receivers.nearest_samples import find_nearest
from umbra.receivers.orthographic import SurfacesFromAbove
from umbra.receivers.seen import ViewTile
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.study.setup import Setup
from umbra.study.shadow_study import run

__all__ = ["show_samples"]

_SHOWN = ("shadow_hours", "hours_lost", "newly_under")
"""Hours of each sample that pictures show; those of each date have the same names."""
_SMOOTH = 1000
"""Suns beyond which cells of ground are half as wide again as pixels."""
_REACH = 2
"""Cells each way in which the nearest open one is looked for: a wall's foot is built over."""


@dataclass(frozen=True, eq=False)
class _GroundPixels:
    """The pixels of a view that show ground, flat, and the cell of a plan whose hours each has."""

    plan: Study
    pixels: NDArray[np.intp]
    cells: NDArray[np.intp]


def show_samples(study: Study, options: StudyOptions, *, is_drawn: bool = True) -> Study:
    """
    Return a study's surfaces as seen by a view.

    Parameters
    ----------
    study : Study
        Of surfaces.
    options : StudyOptions
        Its options, with the receivers of the view, such as ``215/35``.
    is_drawn : bool
        Whether what was counted is drawn; if not, the ground need not be counted.

    Returns
    -------
    shown : Study
        Pixels with the hours of all dates together and of each, and the sun that they lose;
        NaN where nothing was asked for, and on the backs of surfaces.
    """
    scene, samples = study.model.scene, study.samples
    kind = SurfacesFromAbove(samples)
    laid = kind.lay_out(Setup.of(scene, study.site, options).request)
    tile = laid.tile
    nothing = tile.nothing
    facts = {**study.facts, **laid.facts, "receivers": kind.name}
    surface = np.where(nothing, -1, tile.sampled).ravel()
    # What is seen lies in no other body; a sample that is hidden from the view may.
    toward = -np.asarray(tile.camera.axes()[2], np.float64)[None]
    hidden = find_hidden(tile.tree, samples.points, samples.normals, toward, study.model.threads)[0]
    nearest = find_nearest(samples, tile.places.points, surface, hidden == 0)
    pixels = np.flatnonzero(tile.is_ground & (tile.sampled < 0) & ~nothing)
    ground = None
    if len(pixels):
        # Cells are as large as pixels are on level ground; many suns leave no edges to resolve.
        is_smooth = int(study.period.sun.is_up.sum()) > _SMOOTH
        side = laid.grid.dx * (1.5 if is_smooth else 1.0)
        cell = float(f"{side / math.sqrt(-tile.camera.axes()[2][2]):.2g}")
        facts["ground_cell_m"] = cell
        if is_drawn:
            ground = _count_ground(study, options, cell, tile, pixels)

    def show(name: str, values: NDArray[Any]) -> NDArray[Any]:
        """Lay values (..., samples) on the pixels, (..., rows, cols)."""
        lead = values.shape[:-1]
        empty = np.nan if values.dtype.kind == "f" else 0
        image = np.full((*lead, nearest.size), empty, values.dtype)
        seen = np.flatnonzero(nearest >= 0)
        image[..., seen] = values[..., nearest[seen]]
        if ground is not None:
            plan = ground.plan
            hours = plan.shadow_hours if name == "shadow_hours" else plan.more[name][1]
            image[..., ground.pixels] = hours.reshape(*lead, -1)[..., ground.cells]
        return image.reshape(*lead, *laid.shape)

    shown = {name for of in _SHOWN for name in (of, f"{of}_by_day", f"{of}_by_month")}
    shown |= {
        name for quantity in study.quantities for name in (quantity.name, f"{quantity.name}_lost")
    }
    more = {
        name: ((*dims[:-1], *laid.dims), show(name, values))
        for name, (dims, values) in study.more.items()
        if name in shown
    }
    others = {"day", "month", "neighbour", "caster"}
    more |= {
        name: variable for name, variable in study.more.items() if others.issuperset(variable[0])
    }
    hours = show("shadow_hours", study.shadow_hours)
    return replace(
        study, laid=laid, shadow_hours=hours, masks=None, facts=facts, more=more | laid.locate()
    )


def _count_ground(
    study: Study, options: StudyOptions, cell: float, tile: ViewTile, pixels: NDArray[np.intp]
) -> _GroundPixels:
    """Count the ground that some pixels of a view show."""
    x, y = tile.frame.position[::-1].reshape(-1, 3)[pixels, :2].T
    room = (_REACH + 1) * cell
    same = {name: getattr(options, name) for name in ("proposed", "under", "exact")}
    if options.device not in CHOICES:  # that of a package counts what was asked, not backgrounds
        same["device"] = DEFAULT
    extent = (x.min() - room, y.min() - room, x.max() + room, y.max() + room)
    ground_options = options.ask_hours(
        "ground", measures=True, cell=cell, size=None, extent=extent, **same
    )
    plan = run(study.model.scene, study.site, ground_options)
    return _GroundPixels(plan, pixels, _find_cells(plan, x, y))


def _find_cells(plan: Study, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the nearest open cell of a plan to each place, flat; the nearest if none is near."""
    position = np.stack([(y - plan.y[0]) / plan.grid.dy, (x - plan.x[0]) / plan.grid.dx])
    most = np.array(plan.shadow_hours.shape)[:, None] - 1
    cell = np.clip(np.rint(position), 0, most).astype(np.intp)
    is_open = np.isfinite(plan.shadow_hours) & plan.kind.find_open(plan)
    built = np.flatnonzero(~is_open[tuple(cell)])
    best, least = cell[:, built], np.full(len(built), np.inf)
    steps = range(-_REACH, _REACH + 1)
    for step in ((row, col) for row in steps for col in steps):
        other = np.clip(cell[:, built] + np.array(step)[:, None], 0, most)
        far = ((other - position[:, built]) ** 2).sum(0)
        is_nearer = is_open[tuple(other)] & (far < least)
        best = np.where(is_nearer, other, best)
        least = np.where(is_nearer, far, least)
    cell[:, built] = best
    return cell[0] * (most[1] + 1) + cell[1]
