"""Lights with a size, as many points: soft shadows from hard ones."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, show_value
from umbra.scene.lights import WHITE, Light, point_light
from umbra.scene.numbers import read_array, read_number, read_vector

__all__ = ["area_light", "sphere_light", "spread", "volume_light"]

Color = tuple[float, float, float]
MOST = 1 << 20  # most lights; more is a mistake


def area_light(
    center: ArrayLike,
    edge_u: ArrayLike,
    edge_v: ArrayLike,
    n: int = 16,
    color: Color = WHITE,
    **more: Any,
) -> list[Light]:
    """
    Make point lights that sample a bright parallelogram.

    Parameters
    ----------
    center, edge_u, edge_v : (3,) float64
        Its middle and its sides, from end to end [m].
    n : int
        Number of points; each has an n-th of the colour.
    color : (3,) float
        Sum of all points.
    **more
        ``range`` and ``attenuation`` of `Light`.

    Returns
    -------
    lights : list of Light
        Deterministic.

    Raises
    ------
    InputError
        If a number is missing or not finite, or there is no point.
    """
    return _fill_edges("an area", center, [edge_u, edge_v], n, color, more)


def volume_light(
    center: ArrayLike,
    edge_u: ArrayLike,
    edge_v: ArrayLike,
    edge_w: ArrayLike,
    n: int = 64,
    color: Color = WHITE,
    **more: Any,
) -> list[Light]:
    """
    Make point lights that sample a bright box, as `area_light` samples a parallelogram.

    Parameters
    ----------
    center, edge_u, edge_v, edge_w : (3,) float64
        Its middle and its sides, from end to end [m].
    n, color, **more
        As of `area_light`.
    """
    return _fill_edges("a volume", center, [edge_u, edge_v, edge_w], n, color, more)


def sphere_light(
    center: ArrayLike, radius: float, n: int = 64, color: Color = WHITE, **more: Any
) -> list[Light]:
    """
    Make point lights that fill a ball evenly, as `volume_light` fills a box.

    Parameters
    ----------
    center : (3,) float64
    radius : float
        [m]; above 0.
    n, color, **more
        As of `area_light`.
    """
    radius = read_number("a sphere light's radius", radius)
    if not 0 < radius < np.inf:
        msg = f"a sphere light's radius must be above 0 m; got {radius:g}"
        raise InputError(msg)
    shares = spread(n, 3)
    # Equal shares of the volume: by the cube of the radius, the height and the longitude.
    away = radius * np.cbrt(shares[:, 0])
    height = 2 * shares[:, 1] - 1
    flat, longitude = np.sqrt(1 - height**2), 2 * np.pi * shares[:, 2]
    ways = np.stack([flat * np.cos(longitude), flat * np.sin(longitude), height], axis=1)
    return _share(
        read_vector("a sphere light's middle", center) + away[:, None] * ways, color, more
    )


def _fill_edges(
    what: str, center: ArrayLike, edges: Sequence[ArrayLike], n: int, color: Color, more: Any
) -> list[Light]:
    sides = np.stack([read_vector(f"{what} light's side", edge) for edge in edges])
    points = read_vector(f"{what} light's middle", center) + (spread(n, len(sides)) - 0.5) @ sides
    return _share(points, color, more)


def _share(points: NDArray[np.float64], color: Color, more: dict[str, Any]) -> list[Light]:
    shares = read_array("a light's color", color).ravel() / len(points)
    return [point_light(point, tuple(shares.tolist()), **more) for point in points]


def spread(n: int, width: int) -> NDArray[np.float64]:
    """
    Spread points (n, width) over [0, 1): evenly, yet on no grid, and always the same.

    Roberts' R sequence: multiples of the powers of 1/g, where g^(width + 1) = g + 1.
    A jitter within a fraction of a point's own cell breaks the lattice's rows.
    """
    if not isinstance(n, Integral) or isinstance(n, bool):
        msg = f"a light has a whole number of points; got n={show_value(n)}"
        raise InputError(msg, n=n)
    if not 1 <= n <= MOST:
        msg = f"a light of {n} points is not possible; give 1 to {MOST}"
        raise InputError(msg, n=n)
    golden = 1.5
    for _ in range(60):
        golden = (1 + golden) ** (1 / (width + 1))
    steps = golden ** -np.arange(1.0, width + 1)
    jitter = np.random.default_rng(20031).random((n, width)) - 0.5
    cell = 0.5 * n ** (-1 / width) if n > 1 else 0.0
    return np.mod(0.5 + np.arange(n)[:, None] * steps + cell * jitter, 1.0)
