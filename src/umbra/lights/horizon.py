"""The horizon: the elevation of the land far away by azimuth."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

__all__ = ["Horizon", "LandRaster"]


@dataclass(frozen=True)
class LandRaster:
    """
    A raster of the land's heights, whose horizon is found when the place of the model is known.

    Parameters
    ----------
    path : Path
    """

    path: Path


@dataclass(frozen=True, eq=False)
class Horizon:
    """
    The land far away, the same from every receiver.

    Parameters
    ----------
    name, sha256 : str
        Of its file; of a raster of heights the digest is that of the elevations.
    azimuth : (n,) float64
        Clockwise from true north, ascending, 0 to below 360 [degrees].
    elevation : (n,) float64
        Of the land's upper edge, 0 to 90 [degrees]; between azimuths it is linear.
    distance : (n,) float64, optional
        Of the land's upper edge, 0 where it is not above the horizon [m].
    told : tuple of str
        What was read, one line each.
    """

    name: str
    sha256: str
    azimuth: NDArray[np.float64]
    elevation: NDArray[np.float64]
    distance: NDArray[np.float64] | None = None
    told: tuple[str, ...] = ()

    @property
    def highest(self) -> float:
        """The highest elevation [degrees]."""
        return float(self.elevation.max())

    @property
    def plain(self) -> dict[str, object]:
        """The record as JSON and literals hold it."""
        return {
            field.name: value.tolist() if isinstance(value, np.ndarray) else value
            for field in fields(self)
            for value in (getattr(self, field.name),)
        }

    @classmethod
    def of_plain(cls, plain: Mapping[str, Any]) -> Self:
        """Return the record that is plain; KeyError, TypeError or ValueError if it is none."""
        arrays = {
            name: None if plain[name] is None else np.array(plain[name], np.float64)
            for name in ("azimuth", "elevation", "distance")
        }
        return cls(**{**plain, **arrays, "told": tuple(plain["told"])})

    @property
    def facts(self) -> dict[str, object]:
        """Attributes of a result that counts it."""
        land = {"horizon_land": "; ".join(self.told)} if self.told else {}
        named = f"{self.name} sha256:{self.sha256}"
        return {"horizon": named, "horizon_highest_deg": self.highest, **land}

    def find_edge(self, azimuth: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the land's elevation at azimuths from true north, of any shape [degrees]."""
        return np.interp(azimuth, self.azimuth, self.elevation, period=360.0)

    def covers(self, directions: NDArray[np.float64], true_north: float) -> NDArray[np.bool_]:
        """
        Return which directions meet the land.

        Parameters
        ----------
        directions : (n, 3) or (n, 4) float64
            Toward the light in the model's axes: unit vectors, or homogeneous lights, of which
            lamps (w = 1) stand before the land.
        true_north : float
            Azimuth of true north in the model's plan [degrees].

        Returns
        -------
        covered : (n,) bool
            Level directions, and those above, below the land's upper edge. Those from below level
            are not: the ground near by shines from there.
        """
        x, y, z = directions[:, :3].T
        edge = self.find_edge(np.degrees(np.arctan2(x, y)) - true_north)
        is_far = directions[:, 3] == 0 if directions.shape[1] > 3 else np.True_
        return is_far & (z >= 0) & (np.degrees(np.arctan2(z, np.hypot(x, y))) < edge)
