"""Bands: rings between two distances from the boundary of a plot, judged as areas."""

from collections.abc import Sequence
from dataclasses import replace

from umbra.errors import InputError, show_value
from umbra.option_fields import read_length
from umbra.packages import need
from umbra.scene.named_places import Area

__all__ = ["Band", "make_bands", "read_bands"]

Band = tuple[float, float]
"""Least and greatest distance from the boundary [m]."""
_FARTHEST = 1_000.0  # [m]
_CORNER = 32  # chords of a quarter of a circle: rings are right to 0.03 %


def read_bands(texts: Sequence[str]) -> tuple[Band, ...]:
    """
    Read bands such as ``5,10``.

    Raises
    ------
    InputError
        If one is none: two lengths of 0 to 1,000 m, the nearer first.
    """
    bands = []
    for text in texts:
        try:
            near, far = (read_length(word) for word in text.split(","))
            assert 0 <= near < far <= _FARTHEST
        except (ValueError, AssertionError):
            msg = (
                f"band= is NEAR,FAR: two distances from the boundary of 0 to {_FARTHEST:g} m, such "
                f"as '5,10'; got {show_value(text)}"
            )
            raise InputError(msg, option="band") from None
        bands.append((near, far))
    return tuple(dict.fromkeys(bands))


def make_bands(areas: Sequence[Area], bands: Sequence[Band]) -> tuple[list[Area], list[int]]:
    """
    Make the bands of some areas.

    Parameters
    ----------
    areas : sequence of Area
    bands : sequence of Band

    Returns
    -------
    rings : list of Area
        Called as the area with the distances: ``plot, 5 to 10 m``. Corners are round.
    plots : list of int
        Which of the areas each is of.
    """
    shapely = need("shapely", "gis", "areas")
    rings, plots = [], []
    for k, area in enumerate(areas):
        for near, far in bands:
            outer, inner = (
                shapely.buffer(area.polygon, reach, quad_segs=_CORNER) for reach in (far, near)
            )
            name = f"{area.name}, {near:g} to {far:g} m"
            rings.append(replace(area, name=name, polygon=shapely.difference(outer, inner)))
            plots.append(k)
    return rings, plots
