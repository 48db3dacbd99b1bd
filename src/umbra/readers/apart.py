"""Files that lie too far apart to make one study."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.georeference import find_on_plan, is_in_degrees, show_crs, swap_on_plan

__all__ = [
    "BESIDE", "FilePlan", "check_apart", "find_offset", "find_site_among", "make_crs_error",
]  # fmt: skip

FAR = 10_000.0
"""A file without a CRS that lies farther from all others is in other coordinates [m]."""
FARTHEST = 100_000.0
"""Files of known places that lie farther apart share no shadow [m]."""
SWAPPED = (
    "its latitude and longitude are swapped: with the longitude first it lies there; swap the two "
    "numbers of every corner"
)
PLACED = 2_000.0
"""A file that the caller placed lies no farther from all others [m]."""
BESIDE = 1_000.0  # a site at most so far outside the files' bounds is theirs [m]


@dataclass(frozen=True, eq=False)
class FilePlan:
    """
    Where a file lies in the plan of all files.

    Parameters
    ----------
    name : str
    bounds : (2, 2) float64
        Lowest and highest x and y [m].
    crs : str, optional
        That the file names.
    latitude, longitude : float, optional
        Of the site that the file states [degrees].
    true_north : float
        Azimuth in the file's plan, clockwise from +y [degrees].
    altitude : float, optional
        Of its origin, if the file states it [m].
    is_ellipsoidal : bool
        Whether its heights are above the ellipsoid.
    layer : str
    is_placed : bool
        Whether the caller placed it.
    """

    name: str
    bounds: NDArray[np.float64]
    crs: str | None = None
    latitude: float | None = None
    longitude: float | None = None
    true_north: float = 0.0
    altitude: float | None = None
    is_ellipsoidal: bool = False
    layer: str = ""
    is_placed: bool = False

    @property
    def site(self) -> tuple[float, float] | None:
        """Latitude, longitude; None if the file states none."""
        if self.latitude is None or self.longitude is None:
            return None
        return self.latitude, self.longitude


def make_crs_error(file: str | Path, other: str | Path, crs: tuple[str, str]) -> InputError:
    """Return the error of two files whose CRSs cannot be brought together."""
    msg = (
        f"{file} is in {show_crs(crs[0])} but {other} is in {show_crs(crs[1])}; convert them to "
        "one coordinate reference system, or place one of them by hand: place='LAYER=X,Y'"
    )
    return InputError(msg, option="place", crs=crs)


def find_offset(start: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    """
    Return the way from one place to another along the ellipsoid, east and north [m].

    Parameters
    ----------
    start, other : (2,) float
        Latitude, longitude (WGS 84) [degrees].
    """
    from pyproj import Geod  # noqa: PLC0415 - 0.1 s, only with a site

    azimuth, _, length = Geod(ellps="WGS84").inv(start[1], start[0], other[1], other[0])
    turn = np.radians(azimuth)
    return float(length * np.sin(turn)), float(length * np.cos(turn))


def check_apart(files: Sequence[FilePlan], crs: str | None) -> list[str]:
    """
    Check that files make one study: that each lies near one that lies near the first.

    Parameters
    ----------
    files : sequence of FilePlan
    crs : str, optional
        The coordinate reference system of all.

    Returns
    -------
    notes : list of str
        On files of known places that lie far apart.

    Raises
    ------
    InputError
        If files lie too far apart: ``distance`` [m] and ``files``, the names of those that lie
        apart. If a file's site lies among the others, ``site`` is where, (x, y) [m];
        ``is_swapped`` is whether it would with latitude and longitude swapped.
    """
    low, high = (np.array([file.bounds[k] for file in files]) for k in (0, 1))
    is_known = np.array([file.crs is not None for file in files])
    is_placed = np.array([file.is_placed for file in files])
    # The first file that names a CRS, or that was not placed, or of all.
    first = int(np.argmax(2 * (is_known & ~is_placed) + ~is_placed))
    gaps = _find_gaps(low, high, first)
    reach = np.where(is_placed, PLACED, np.where(is_known, FARTHEST, FAR))
    near = _spread(low, high, reach, first)
    if near.all():
        close = _spread(low, high, np.full(len(files), FAR), first)
        return [] if close.all() else [_tell_far(files, gaps, ~close, first)]
    apart = np.flatnonzero(~near)
    other = files[apart[0]]
    nearest = _find_gaps(low, high, int(apart[0]))
    neighbour = int(np.argmin(np.where(near, nearest, np.inf)))
    distance = float(nearest[neighbour])
    site = find_site_among(other, low[near], high[near], crs)
    by = ""
    if site is None and other.site is not None and crs is not None:
        there = find_on_plan(crs, *other.site)
        if there is not None and np.isfinite(there).all():
            gap = np.maximum(low[neighbour] - there, there - high[neighbour])
            distance = float(np.hypot(*np.maximum(gap, 0.0)))
            by = f" by its site, {_tell_site(other.site)}"
    middle = other.bounds.mean(0)
    swapped = swap_on_plan(crs, middle) if crs and is_in_degrees(other.crs or "") else None
    is_swapped = _lies_among(swapped, low[near], high[near])
    names = [files[k].name for k in apart.tolist()]
    msg = (
        f"{_name(names)} {_show(distance)} from {files[neighbour].name}{by}, too far for one "
        f"study ({'; '.join(_tell_crs(file) for file in (other, files[neighbour]))}); "
        f"{SWAPPED if is_swapped else _advise(other, files[neighbour], site)}"
    )
    raise InputError(msg, distance=distance, files=names, site=site, is_swapped=is_swapped)


def _find_gaps(
    low: NDArray[np.float64], high: NDArray[np.float64], index: int
) -> NDArray[np.float64]:
    """Return the distance of each box from one of them [m]."""
    gaps = np.maximum(np.maximum(low - high[index], low[index] - high), 0.0)
    return np.hypot(*gaps.T)


def _spread(
    low: NDArray[np.float64], high: NDArray[np.float64], reach: NDArray[np.float64], first: int
) -> NDArray[np.bool_]:
    """Find the boxes that a chain of steps, each within the reach of both boxes, leads to."""
    is_reached = np.zeros(len(low), np.bool_)
    is_reached[first] = True
    todo = [first]
    while todo:
        index = todo.pop()
        # Not above, instead of below: coordinates that are not finite are reported elsewhere.
        is_near = ~(_find_gaps(low, high, index) > np.minimum(reach, reach[index]))
        todo += np.flatnonzero(is_near & ~is_reached).tolist()
        is_reached |= is_near
    return is_reached


def _tell_far(
    files: Sequence[FilePlan], gaps: NDArray[np.float64], far: NDArray[np.bool_], first: int
) -> str:
    names = [files[k].name for k in np.flatnonzero(far).tolist()]
    distance = float(gaps[far].min())
    return (
        f"{_name(names)} {_show(distance)} from {files[first].name}; a plan holds both unless "
        "extent= chooses a part, and bbox= leaves out what lies outside a box"
    )


def find_site_among(
    file: FilePlan, low: NDArray[np.float64], high: NDArray[np.float64], crs: str | None
) -> tuple[float, float] | None:
    """Return where a file's site lies among the others; None if it lies elsewhere."""
    if crs is None or file.latitude is None or file.longitude is None:
        return None
    point = find_on_plan(crs, file.latitude, file.longitude)
    if point is None or not _lies_among(point, low, high):
        return None
    return float(point[0]), float(point[1])


def _lies_among(
    point: NDArray[np.float64] | None, low: NDArray[np.float64], high: NDArray[np.float64]
) -> bool:
    if point is None:
        return False
    return bool(((point >= low - BESIDE) & (point <= high + BESIDE)).all(1).any())


def _advise(file: FilePlan, neighbour: FilePlan, site: tuple[float, float] | None) -> str:
    by_hand = f"place='{file.layer or 'LAYER'}=X,Y'"
    if file.is_placed:
        (x, y), (right, top) = neighbour.bounds
        return (
            f"it was placed there: {by_hand} takes x and y of the other layers, which lie at "
            f"x {x:.0f} to {right:.0f}, y {y:.0f} to {top:.0f}, or latitude, longitude"
            + ("" if neighbour.crs else " once crs= names the CRS that they are in")
        )
    if site is not None and file.site is not None:
        x, y = site
        return (
            f"its site, {_tell_site(file.site)}, lies there, at x {x:.0f}, y {y:.0f}: place it "
            f"with {by_hand}"
        )
    if file.crs is not None and neighbour.crs is not None:
        return "read one place with bbox=, or study each alone"
    remedy = f"export it in the coordinates of {neighbour.name}"
    own = "name the CRS that it is in with crs="
    return f"place it with {by_hand}, {remedy}, {own}, or study each alone"


def _tell_site(site: tuple[float, float]) -> str:
    return "latitude {:.5f}°, longitude {:.5f}°".format(*site)


def _tell_crs(file: FilePlan) -> str:
    return f"{file.name} is in {show_crs(file.crs)}" if file.crs else f"{file.name} names no CRS"


def _name(names: Sequence[str]) -> str:
    return f"{names[0]} lies" if len(names) == 1 else f"{names[0]} and {len(names) - 1} more lie"


def _show(distance: float) -> str:
    return f"{distance / 1000:,.0f} km"
