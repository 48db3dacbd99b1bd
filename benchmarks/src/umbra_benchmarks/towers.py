"""Towers to measure with: one of lattice, one of offices, as large as Wallner's scenes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra_benchmarks.scenes import Soup, SquareModel, make_boxes

__all__ = ["Tower", "make_lattice_tower", "make_office_tower"]


_STEEP = 0.9  # a beam's direction along z from which another axis gives its width


@dataclass(frozen=True, eq=False)
class Tower:
    """
    An office tower: its shell, and with all that is in it.

    Parameters
    ----------
    shell, whole : SquareModel
        Facade and concrete; these and the fittings.
    """

    shell: SquareModel
    whole: SquareModel


def make_lattice_tower() -> SquareModel:
    """
    Make a tower of beams, 300 m high, that gets narrower as a power of what is left.

    Returns
    -------
    tower : SquareModel
        929 beams, 11,148 triangles, each beam closed.
    """
    bays = [6, 5, 5, 4, 4, 4, 3, 3, 3, 3, 2, 2, 2, 2, 2, 2, 1, 1, 1, 1, 1, 1]
    heights = 300.0 * np.linspace(0, 1, len(bays) + 1) ** 0.8
    half = 2.0 + 58.0 * (1 - heights / 300.0) ** 2.2
    ends: list[NDArray[np.float64]] = []
    for level, count in enumerate(bays):
        low, high = (_find_ring(half[level + k], heights[level + k], count) for k in range(2))
        along_low, along_high = np.roll(low, -1, 0), np.roll(high, -1, 0)
        for one, two in ((low, high), (low, along_high), (along_low, high), (high, along_high)):
            ends.append(np.stack([one, two], 1))
    ends.append(np.array([[[0, 0, 295], [0, 0, 324.0]]]))
    beams = np.concatenate(ends)
    thick = np.interp(beams[:, :, 2].mean(1), [0, 300], [0.9, 0.25])
    return _as_model([_make_beams(beams, thick)], 160.0)


def make_office_tower() -> Tower:
    """
    Make an office tower of 21 oval floors that turn as they rise.

    Returns
    -------
    tower : Tower
        A shell of 147,084 triangles, 181,860 with its fittings, every piece closed.
    """
    shell: list[Soup] = []
    fittings: list[Soup] = []
    for floor in range(21):
        turn = 0.04 * floor
        bottom = 3.6 * floor
        across = np.array([16.0, 11.0]) * (1 + 0.12 * np.sin(0.3 * floor))
        shell.append(_make_prism(_find_oval(across, turn, 96), bottom, bottom + 0.35))
        for x, y in _find_oval(0.82 * across, turn, 24):
            column = [x, y] + _find_oval(np.array([0.3, 0.3]), 0.0, 12)
            shell.append(_make_prism(column, bottom + 0.35, bottom + 3.6))
        # A bay of the facade: mullion, sill, lintel and a pane.
        bay = _find_oval(across, turn, 116)
        middle, angle = _find_sides(bay)
        for shift, size, high in (
            (bay, (0.06, 0.12), (0.35, 3.6)),
            (middle, (0.36, 0.09), (0.35, 1.1)),
            (middle, (0.36, 0.09), (2.9, 3.6)),
            (middle, (0.36, 0.02), (1.1, 2.9)),
        ):
            shell.append(_make_upright(shift, angle, size, bottom + np.array(high)))
        inner = _find_oval(0.6 * across, turn, 138)
        fittings.append(
            _make_upright(inner, _find_sides(inner)[1], (0.14, 0.3), bottom + np.array([0.35, 1.1]))
        )
    return Tower(_as_model(shell, 80.0), _as_model([*shell, *fittings], 80.0))


def _find_ring(half: float, height: float, bays: int) -> NDArray[np.float64]:
    """Go around a level square of nodes, ``bays`` to a side, (4 * bays, 3)."""
    step = np.linspace(-half, half, bays, endpoint=False)
    side = np.full(bays, half)
    x = np.concatenate([step, side, -step, -side])
    y = np.concatenate([-side, step, side, -step])
    return np.column_stack([x, y, np.full(len(x), height)])


def _find_oval(half: NDArray[np.float64], turn: float, count: int) -> NDArray[np.float64]:
    """Go around an oval, (count, 2)."""
    angle = 2 * np.pi * np.arange(count) / count
    x, y = half[:, None] * [np.cos(angle), np.sin(angle)]
    cos, sin = np.cos(turn), np.sin(turn)
    return np.column_stack([x * cos - y * sin, x * sin + y * cos])


def _find_sides(ring: NDArray[np.float64]) -> Soup:
    """Return the middles of a ring's sides and the angles at which they run."""
    onward = np.roll(ring, -1, 0)
    x, y = (onward - ring).T
    return 0.5 * (ring + onward), np.arctan2(y, x)


def _make_beams(ends: NDArray[np.float64], thick: NDArray[np.float64]) -> Soup:
    """Make a box along each line, ends (n, 2, 3)."""
    along = ends[:, 1] - ends[:, 0]
    long = np.linalg.norm(along, axis=1, keepdims=True)
    up = along / long
    # Any direction that is not the beam's own gives it a width.
    aside = np.cross(up, np.where(np.abs(up[:, 2:]) < _STEEP, [0, 0, 1.0], [1.0, 0, 0]))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    frame = np.stack([aside, np.cross(up, aside), up], 1)
    size = np.column_stack([thick, thick, long[:, 0]]) / 2
    return make_boxes(ends.mean(1), size, frame)


def _make_upright(
    where: NDArray[np.float64], angle: NDArray, size: Sequence[float], high: ArrayLike
) -> Soup:
    """Make boxes that stand upright, turned by an angle each, of one half size in plan."""
    low, top = np.asarray(high)
    n = len(where)
    cos, sin, zero = np.cos(angle), np.sin(angle), np.zeros(n)
    frame = np.stack(
        [
            np.stack([cos, sin, zero], 1),
            np.stack([-sin, cos, zero], 1),
            np.tile([0.0, 0.0, 1.0], (n, 1)),
        ],
        1,
    )
    centres = np.column_stack([where, np.full(n, 0.5 * (low + top))])
    return make_boxes(centres, np.tile([*size, 0.5 * (top - low)], (n, 1)), frame)


def _make_prism(ring: NDArray[np.float64], low: float, high: float) -> Soup:
    """Make an upright prism over a convex ring that runs counter-clockwise."""
    n = len(ring)
    here = np.arange(n)
    onward = (here + 1) % n
    fan = np.column_stack([np.zeros(n - 2, int), here[1:-1], here[2:]])
    faces = [
        fan[:, ::-1], fan + n,
        np.column_stack([here, onward, onward + n]), np.column_stack([here, onward + n, here + n]),
    ]  # fmt: skip
    vertices = np.concatenate([np.column_stack([ring, np.full(n, z)]) for z in (low, high)])
    return vertices, np.concatenate(faces).astype(np.int32)


def _as_model(soups: Sequence[Soup], side: float) -> SquareModel:
    """Join soups, and move their middle to that of the square."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in soups[:-1]])
    vertices = np.concatenate([vertices for vertices, _ in soups]) + [side / 2, side / 2, 0]
    faces = np.concatenate([faces + start for start, (_, faces) in zip(starts, soups)])
    return SquareModel(vertices.astype(np.float32).astype(np.float64), faces.astype(np.int32), side)
