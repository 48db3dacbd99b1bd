"""Small plots and asks, solved by hand."""

import numpy as np
import pytest
import shapely
from support.shapes import box

from umbra.ground.choice import find_ground
from umbra.lights import make_period
from umbra.massing.asks import Ask
from umbra.massing.plot import lay_cells
from umbra.massing.problem import ReceiverGroup
from umbra.massing.search import search_heights
from umbra.scene import Mesh, Part, make_scene
from umbra.scene.grid import Places
from umbra.sun import Site

VIENNA = Site(48.2, 16.37, "Europe/Vienna")


class Quarter:
    """A plot of 8 x 8 m about the origin, and a tower beside it."""

    def __init__(self, side=8.0, cell=1.0):
        tower = Part("tower", "", Mesh(*box((-30, -6, 0), (-24, 0, 25))))
        self.ground = find_ground(make_scene([tower]))
        self.scene = self.ground.scene
        square = shapely.box(-side / 2, -side / 2, side / 2, side / 2)
        self.plot = lay_cells([square], self.ground, cell, 1)

    def ask(self, points, limit, start="09:00", end="15:00", every="15min", **more):
        points = np.atleast_2d(np.asarray(points, float)) - self.scene.origin
        toward = np.tile([0.0, -1.0, 0.0], (len(points), 1))
        period = make_period("2026-03-21", start, end, every, VIENNA)
        labels = tuple(f"window {k}" for k in range(len(points)))
        limits = np.broadcast_to(np.asarray(limit, float), len(points)).copy()
        return Ask("sun", period, Places(points, toward), labels, limits, **more)

    def search(self, *asks, groups=None, highest=60.0):
        each = [ReceiverGroup.one(label, a, r) for a, ask in enumerate(asks)
                for r, label in enumerate(ask.labels)]  # fmt: skip
        return search_heights(self.scene, [0], asks, groups or each, self.plot, highest, 1)

    def list_cells(self):
        """Return the cells as polygons, in the scene's local frame."""
        plot = self.plot
        rows, cols = plot.places
        return [
            shapely.box(plot.x0 + c * plot.cell, plot.y0 + r * plot.cell,
                        plot.x0 + (c + 1) * plot.cell, plot.y0 + (r + 1) * plot.cell)
            for r, c in zip(rows, cols, strict=True)
        ]  # fmt: skip


@pytest.fixture(scope="session")
def quarter():
    return Quarter()
