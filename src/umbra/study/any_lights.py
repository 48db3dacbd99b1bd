"""Any lights on any receivers: directions and lamps, each with its weights."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from umbra.machine import count_cores
from umbra.rays.hidden import find_hidden_from
from umbra.receivers import find_kind
from umbra.receivers.kind import Receivers, Request, Tile
from umbra.scene import Scene
from umbra.study.checks import select_casters
from umbra.study.lights import Lights
from umbra.study.loop import add_up
from umbra.study.options import StudyOptions

__all__ = ["RayCounter", "count_lights"]


class RayCounter:
    """
    Counts homogeneous lights of any place on a tile, by rays.

    Parameters
    ----------
    tile : Tile
    threads : int
    """

    def __init__(self, tile: Tile, threads: int = 1) -> None:
        self.tile, self.threads = tile, threads

    def masks(self, lights: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Tell for each light (n, 4) which receivers are in shadow, cast or attached."""
        tile, where = self.tile, self.tile.places
        found = find_hidden_from(tile.tree, where.points, where.normals, lights, self.threads)
        return found.reshape(-1, *tile.shape)

    def add_steps(
        self,
        lights: NDArray[np.float64],
        steps: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Count for each receiver how many lights leave it in shadow."""
        for light in lights:
            steps += self.masks(light[None])[0]
            progress(1)


def count_lights(
    scene: Scene, lights: Lights, options: StudyOptions
) -> tuple[Receivers, NDArray[np.float32]]:
    """
    Add the weights of the lights that are hidden from each receiver.

    Directions above the horizon are counted as suns are; lamps, and lights that shine
    upward, by rays.

    Parameters
    ----------
    scene : Scene
    lights : Lights
    options : StudyOptions
        Of the receivers and casters; those of time are not read.

    Returns
    -------
    laid : Receivers
    sums : (k, ...) float32
        Of each column of weights.

    Raises
    ------
    InputError
        If an option is wrong.
    """
    kind = find_kind(options.receivers, scene, options.ground)
    threads = options.threads or count_cores()
    suns, others = lights.split()
    casters = select_casters(scene, options.cast, options.no_cast)
    request = Request(
        scene, options, casters, threads, lights=len(suns), find_reaching=lambda: suns.directions
    )
    laid = kind.lay_out(request)
    sums = np.zeros((lights.weights.shape[1], *laid.shape), np.float32)
    for where, make_tile in laid.make_tiles(request):
        tile = make_tile()
        inside = where if isinstance(where, tuple) else (where,)
        if len(suns):
            sums[:, *inside] += add_up(tile.make_counter(), tile.shape, suns)
        if len(others):
            sums[:, *inside] += add_up(RayCounter(tile, threads), tile.shape, others)
    nothing = laid.finish()
    if nothing is not None:
        sums[:, nothing] = np.nan
    return laid, sums
