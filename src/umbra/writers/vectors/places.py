"""Where a study's coordinates lie on the earth, for those who write maps."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pyproj import CRS

__all__ = ["find_crs", "make_to_wgs84", "name_crs"]


def find_crs(crs: object) -> "CRS | None":
    """
    Give the horizontal coordinate reference system that a study names.

    Parameters
    ----------
    crs : str or None
        The fact ``crs``; a compound one loses its heights.

    Returns
    -------
    crs : pyproj.CRS, optional
        None where there is none, or none that is known.
    """
    if not crs:
        return None
    from pyproj import CRS  # noqa: PLC0415  (a tenth of a second)
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    try:
        return CRS.from_user_input(crs).to_2d()
    except CRSError:
        return None


def name_crs(crs: "CRS | None") -> str:
    """Say which system it is: ``EPSG:31256 (MGI / Austria GK East)``."""
    if crs is None:
        return "the model's own coordinates in metres; no CRS is known"
    code = crs.to_epsg(min_confidence=70)
    return f"EPSG:{code} ({crs.name})" if code else crs.name


def make_to_wgs84(crs: "CRS") -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """
    Give the way from a system to longitude and latitude on WGS 84.

    Parameters
    ----------
    crs : pyproj.CRS

    Returns
    -------
    to_wgs84 : callable
        Takes and gives (n, 2) float64.
    """
    from pyproj import Transformer  # noqa: PLC0415

    transformer = Transformer.from_crs(crs, 4326, always_xy=True)

    def to_wgs84(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.column_stack(transformer.transform(points[:, 0], points[:, 1]))

    return to_wgs84
