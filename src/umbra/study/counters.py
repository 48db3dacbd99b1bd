"""Counters of any lights: suns by a tile's own counter, lamps and lights from below by rays."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from umbra.ground.level import TERRAIN
from umbra.rays.hidden import find_hidden
from umbra.rays.masks import CounterByMasks
from umbra.receivers.kind import Counter, Tile

__all__ = [
    "GroundLightCounter",
    "LandCounter",
    "LightCounter",
    "RayCounter",
    "find_ground_lights",
    "find_suns",
    "split_lights",
]


def find_suns(lights: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which homogeneous lights (n, 4) are directions above the horizon, (n,) bool."""
    return (lights[:, 3] == 0) & (lights[:, 2] > 0)


def find_ground_lights(lights: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which homogeneous lights (n, 4) are directions below the horizon, (n,) bool."""
    return (lights[:, 3] == 0) & (lights[:, 2] < 0)


def split_lights(
    counter: Counter, lights: NDArray[np.float64]
) -> Iterator[tuple[NDArray[np.bool_], Counter]]:
    """
    Yield runs of lights (n, 3), as selections, each with a counter for all of the run.

    A counter that makes others for runs of lights has ``split``; any other counts all in one run.
    """
    if hasattr(counter, "split"):
        yield from counter.split(lights)
    else:
        yield np.ones(len(lights), np.bool_), counter


class LandCounter:
    """
    Counter of suns of which some are behind the land: these leave every receiver in shadow.

    Parameters
    ----------
    counter : Counter
        Of the other suns.
    shape : tuple of int
        Of the receivers.
    meets_land : callable
        Returns which directions (n, 3) meet the land, (n,) bool.
    """

    def __init__(
        self, counter: Counter, shape: tuple[int, ...],
        meets_land: Callable[[NDArray[np.float64]], NDArray[np.bool_]],
    ) -> None:  # fmt: skip
        self.counter, self._shape, self._meets_land = counter, shape, meets_land

    def split(self, lights: NDArray[np.float64]) -> Iterator[tuple[NDArray[np.bool_], Counter]]:
        """Yield runs of lights (n, 3), each with its counter; see ``split_lights``."""
        for run, counter in split_lights(self.counter, lights):
            yield run, LandCounter(counter, self._shape, self._meets_land)

    def masks(self, lights: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each sun (n, 3) the receivers in shadow."""
        is_free = ~self._meets_land(lights)
        masks = np.ones((len(lights), *self._shape), np.uint8)
        if is_free.any():
            masks[is_free] = self.counter.masks(np.ascontiguousarray(lights[is_free]))
        return masks

    def add_weights(
        self,
        lights: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each receiver the weights (n, k) of the suns that leave it in shadow."""
        is_free = ~self._meets_land(lights)
        behind = weights[~is_free].sum(0, dtype=np.int32)
        sums += behind.reshape(-1, *[1] * (sums.ndim - 1))
        progress(int((~is_free).sum()))
        if is_free.any():
            free = np.ascontiguousarray(lights[is_free]), np.ascontiguousarray(weights[is_free])
            self.counter.add_weights(*free, sums, progress)


class RayCounter(CounterByMasks):
    """
    Counter of any homogeneous lights on a tile, by rays.

    Parameters
    ----------
    tile : Tile
    threads : int
    """

    def __init__(self, tile: Tile, threads: int = 1) -> None:
        self.tile, self.threads = tile, threads

    def masks(self, lights: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each light (n, 4) the receivers in shadow, cast or attached."""
        tile, where = self.tile, self.tile.places
        hidden = find_hidden(tile.tree, where.points, where.normals, lights, self.threads)
        return hidden.reshape(-1, *tile.shape)


class GroundLightCounter(CounterByMasks):
    """
    Counter of directions below the horizon, from which the ground shines: it hides none.

    Ground is a plane, which is no caster, or parts of the kinds of terrain. Points without a normal
    are level.

    Parameters
    ----------
    tile : Tile
    """

    def __init__(self, tile: Tile) -> None:
        casting, where = tile.casting, tile.places
        self.shape, self.threads = tile.shape, casting.threads
        self.tree = casting.find_tree_without(TERRAIN)
        self.points, normals = where.points, where.normals
        self.normals = np.where(np.isnan(normals[:, :1]), (0.0, 0.0, 1.0), normals)

    def masks(self, lights: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each direction (n, 4) the receivers that it does not reach."""
        hidden = find_hidden(self.tree, self.points, self.normals, lights, self.threads)
        return hidden.reshape(-1, *self.shape)


class LightCounter:
    """
    Counter of any lights on a tile.

    Parameters
    ----------
    tile : Tile
    counter : Counter, optional
        Of suns; the tile's own by default.
    """

    def __init__(self, tile: Tile, counter: Counter | None = None) -> None:
        self.tile = tile
        self._suns = counter

    @property
    def suns(self) -> Counter:
        """Counter of suns, made when the first is counted."""
        if self._suns is None:
            self._suns = self.tile.make_counter()
        return self._suns

    def masks(self, lights: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each light, (n, 3) suns or (n, 4) any, the receivers in shadow."""
        if lights.shape[1] == 3:
            return self.suns.masks(lights)
        is_sun = find_suns(lights)
        masks = np.zeros((len(lights), *self.tile.shape), np.uint8)
        if is_sun.any():
            masks[is_sun] = self.suns.masks(np.ascontiguousarray(lights[is_sun, :3]))
        if not is_sun.all():
            masks[~is_sun] = RayCounter(self.tile, self.tile.casting.threads).masks(lights[~is_sun])
        return masks

    def add_weights(
        self,
        lights: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each receiver the weights (n, k) of the lights that leave it in shadow."""
        if lights.shape[1] == 3:
            self.suns.add_weights(lights, weights, sums, progress)
            return
        is_sun = find_suns(lights)
        if is_sun.any():
            suns = np.ascontiguousarray(lights[is_sun, :3])
            self.suns.add_weights(suns, weights[is_sun], sums, progress)
        rays = RayCounter(self.tile, self.tile.casting.threads)
        rays.add_weights(lights[~is_sun], weights[~is_sun], sums, progress)
