"""The horizon that a caller named, when the place and the size of the model are known."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import Horizon, LandRaster, read_horizon
from umbra.option_fields import read_length
from umbra.scene import Scene
from umbra.sun import Site

__all__ = ["NamedLand", "check_nearest", "is_raster", "settle_horizon"]

_FARTHEST = 50_000.0  # distance from which land may begin to count [m]


@dataclass(frozen=True)
class NamedLand:
    """
    The land as a caller named it.

    Parameters
    ----------
    horizon : Horizon, LandRaster or None
    nearest : float, optional
        Distance from which the land of a raster counts [m].
    is_refracted : bool
    """

    horizon: Horizon | LandRaster | None = None
    nearest: float | None = None
    is_refracted: bool = True

    @classmethod
    def of(cls, horizon: Any, nearest: Any = None, *, is_refracted: bool = True) -> Self:
        """Read what ``horizon=`` and ``horizon_from=`` name; InputError if it is wrong."""
        land = None if horizon is None else read_horizon(horizon)
        if isinstance(nearest, str):
            try:
                nearest = read_length(nearest)
            except ValueError as error:
                msg = f"horizon_from= {error}"
                raise InputError(msg, option="horizon_from") from None
        check_nearest(land, nearest)
        return cls(land, nearest, is_refracted)

    def settle(
        self, bounds: NDArray[np.float64], site: Site | None,
        progress: Callable[[int, int], object] = lambda _done, _all: None,
    ) -> Horizon | None:  # fmt: skip
        """Return the horizon of a model's middle, as ``settle_horizon``."""
        return settle_horizon(
            self.horizon, bounds, site, nearest=self.nearest, is_refracted=self.is_refracted,
            progress=progress,
        )  # fmt: skip

    def check_sun(self, scene: Scene, site: Site, toward: NDArray[np.float64], when: str) -> None:
        """Refuse a sun, in a direction (4,) of the model's axes, that is behind the land."""
        land = self.settle(scene.model_bounds(), site)
        if land is not None and land.covers(np.array([toward]), site.true_north)[0]:
            msg = (
                f"the sun is behind the land of {land.name} on {when} ({site.zone}); choose "
                "another time, or leave horizon= out"
            )
            raise InputError(msg, option="horizon")


def is_raster(given: object) -> bool:
    """Return whether a horizon is a raster of heights, which needs a site."""
    return isinstance(given, LandRaster)


def check_nearest(horizon: object, nearest: float | None, *, is_settled: bool = False) -> None:
    """Refuse a distance from which land counts where it is none, or no raster says the land."""
    if nearest is None or is_settled:
        return
    if not is_raster(horizon):
        msg = "horizon_from= is of a raster of heights; give horizon='FILE.tif', or leave it out"
        raise InputError(msg, option="horizon_from")
    if not 0 <= nearest <= _FARTHEST:
        msg = f"horizon_from= is 0 to {_FARTHEST:g} m; got {nearest:g}"
        raise InputError(msg, option="horizon_from")


def settle_horizon(
    horizon: "Horizon | LandRaster | None", bounds: NDArray[np.float64], site: Site | None, *,
    nearest: float | None = None, is_refracted: bool = True,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> Horizon | None:  # fmt: skip
    """
    Find the horizon of a raster's land from the middle of a model; others are returned as given.

    Parameters
    ----------
    horizon : Horizon, LandRaster or None
    bounds : (2, 3) float64
        Of the model [m].
    site : Site, optional
        Its middle.
    nearest : float, optional
        Distance from which the land counts; half the diagonal of the bounds by default [m].
    is_refracted : bool
        Whether the sun's place is the apparent one, so that the land's is.
    progress : callable
        Called with the number of blocks read, and of all.
    """
    if not isinstance(horizon, LandRaster):
        return horizon
    from umbra.land.raster_horizon import REFRACTION, find_horizon  # noqa: PLC0415  (loads kernels)

    if site is None:
        msg = (
            "horizon= is a raster, whose land is seen from the model's place, which is not known; "
            "give latitude and longitude with site="
        )
        raise InputError(msg, option="latitude")
    radius = float(np.hypot(*np.ptp(bounds[:, :2], axis=0))) / 2
    return find_horizon(
        horizon, site.longitude, site.latitude, radius, float(np.ptp(bounds[:, 2])),
        nearest=nearest, refraction=REFRACTION if is_refracted else 0.0, progress=progress,
    )  # fmt: skip
