"""The result of a search for heights: numbers, raster, solid, and what was assumed."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.massing.search import Found, Violation
from umbra.scene import Mesh, Scene
from umbra.sun import Site

__all__ = ["HeightEnvelope"]

_CAPPED = 0.01  # below the cap by which a cell counts as capped [m]


@dataclass(frozen=True, eq=False)
class HeightEnvelope:
    """
    The greatest heights over a plot that keep rules.

    Parameters
    ----------
    scene : Scene
        What stands around, without what is replaced.
    site : Site
    found : Found
    rules : tuple of str
        Titles of the rules.
    times : tuple of str
        Dates, hours and clock of their checks.
    highest : float
        The cap of all heights [m].
    replaced : tuple of str
        Names of what stood on the plot and was left out.
    notes : tuple of str
        What was assumed, a line each.
    """

    scene: Scene
    site: Site
    found: Found
    rules: tuple[str, ...]
    times: tuple[str, ...]
    highest: float
    replaced: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def heights(self) -> NDArray[np.float64]:
        """Heights above the ground, (rows, cols), row 0 the south; NaN off the plot [m]."""
        return self.found.plot.spread(self.found.heights)

    @property
    def x(self) -> NDArray[np.float64]:
        """Centres of the columns in the model's own coordinates, (cols,) [m]."""
        plot = self.found.plot
        along = np.arange(plot.index.shape[1], dtype=np.float64) + 0.5
        return plot.x0 + along * plot.cell + float(self.scene.origin[0])

    @property
    def y(self) -> NDArray[np.float64]:
        """Centres of the rows in the model's own coordinates, (rows,) [m]."""
        plot = self.found.plot
        along = np.arange(plot.index.shape[0], dtype=np.float64) + 0.5
        return plot.y0 + along * plot.cell + float(self.scene.origin[1])

    @property
    def cell(self) -> float:
        """Side of a cell [m]."""
        return self.found.plot.cell

    @property
    def volume_m3(self) -> float:
        """Volume over the ground [m3]."""
        return self.found.volume

    @property
    def max_height_m(self) -> float:
        """Greatest height above the ground [m]."""
        return float(self.found.heights.max(initial=0.0))

    @property
    def bound_m3(self) -> float:
        """Upper bound of the volume that any choice of hours allows [m3]."""
        return self.found.bound

    @property
    def violations(self) -> tuple[Violation, ...]:
        """What the exact study with the envelope in the scene found broken."""
        return self.found.violations

    @property
    def mesh(self) -> Mesh | None:
        """The closed solid in the model's own coordinates; None where nothing may stand."""
        mesh = self.found.mesh
        return None if mesh is None else Mesh(mesh.vertices + self.scene.origin, mesh.faces)

    @cached_property
    def broken(self) -> tuple[str, ...]:
        """Receivers that have too little before anything is built."""
        problem = self.found.problem
        return tuple(problem.groups[g].name for g in np.flatnonzero(problem.broken))

    def list_receivers(self) -> tuple[NDArray[np.float64], NDArray[np.bool_], list[str]]:
        """
        List the places of receivers, each once.

        Returns
        -------
        points : (n, 3) float64
            In the model's own coordinates [m].
        is_broken : (n,) bool
            Whether what it belongs to has too little before anything is built.
        names : list of str
        """
        problem = self.found.problem
        lacks = [np.zeros(len(ask.labels), np.bool_) for ask in problem.asks]
        for g in np.flatnonzero(problem.broken):
            for a, r in zip(problem.groups[g].ask, problem.groups[g].receiver, strict=True):
                lacks[a][r] = True
        points = np.concatenate([ask.places.points for ask in problem.asks]) + self.scene.origin
        labels = [label for ask in problem.asks for label in ask.labels]
        is_broken = np.concatenate(lacks)
        order = np.argsort(~is_broken, kind="stable")
        _, first = np.unique(np.round(points[order], 3), axis=0, return_index=True)
        kept = order[first]
        return points[kept], is_broken[kept], [labels[k] for k in kept]

    @property
    def capped(self) -> int:
        """Number of cells that the cap binds."""
        return int((self.found.heights > self.highest - _CAPPED).sum())

    def sum_up(self) -> dict[str, Any]:
        """Return the numbers as plain values, for JSON."""
        return {
            "volume_m3": self.volume_m3,
            "max_height_m": self.max_height_m,
            "violations": len(self.violations),
            "bound_m3": self.bound_m3,
            "cells": len(self.found.heights),
            "cell_m": self.cell,
            "capped_cells": self.capped,
            "cap_m": self.highest,
            "receivers": len(self.list_receivers()[0]),
            "broken_before": list(self.broken),
            "replaced": list(self.replaced),
            "shrunk_m3": self.found.shrunk,
        }
