"""What objects take of the sky as polygons of a picture: bands between meridians, joined."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

__all__ = ["bend", "join_bands", "split_at_cut"]

_FINE = np.radians(1.5)  # of arcs drawn as straight pieces
_SAME = 9  # decimals in which neighbours' corners agree
_INWARD = 1e-7  # by which corners move off the cut of a turn, so that none jumps

Spot = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def bend(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points of the arc from p to q (n, 3)."""
    n = 1 + int(np.arccos(np.clip(p @ q, -1, 1)) / _FINE)
    points = p + np.linspace(0, 1, n + 1)[:, None] * (q - p)
    return points / np.linalg.norm(points, axis=1)[:, None]


def split_at_cut(line: NDArray[np.float64], widest: float) -> list[NDArray[np.float64]]:
    """Split a line of a picture (n, 2) where it jumps farther than ``widest``."""
    jumps = np.flatnonzero(np.linalg.norm(np.diff(line, axis=0), axis=1) > widest) + 1
    return [piece for piece in np.split(line, jumps) if len(piece) > 1]


def join_bands(
    bands: NDArray[np.float64],
    events: NDArray[np.float64],
    spot: Spot,
    ends: tuple[float, float] | None,
) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """
    Yield objects with polygons (n, 2) of a picture that bands, joined to their neighbours, fill.

    Parameters
    ----------
    bands, events : (n, 10) and (m, 2) float64
        As ``ExactSky.trace_bands`` returns them.
    spot : callable
        Returns the places of directions.
    ends : (float, float) or None
        Left and right end of a picture that is cut at a meridian; None: it is round.
    """
    open_: dict[tuple, list[list[NDArray[np.float64]]]] = {}
    done: list[tuple[int, list[list[NDArray[np.float64]]]]] = []
    for row in bands[np.argsort(bands[:, 1], kind="stable")]:
        owner, event = int(row[0]), int(row[1])
        from_, to_ = events[event], events[event + 1]
        lower = bend(_lift(from_, row[2:4]), _lift(to_, row[4:6]))
        upper = bend(_lift(from_, row[6:8]), _lift(to_, row[8:10]))
        sides = [_place(part, lower, upper, spot) for part in (lower, upper)]
        if not all(np.isfinite(side).all() for side in sides):
            continue
        if ends is not None:
            x = np.concatenate(sides)[:, 0]
            if np.ptp(x) > (ends[1] - ends[0]) / 2:  # over the cut: a part at each end
                middle = sum(ends) / 2
                for end, beyond in zip(ends, (x > middle, x < middle), strict=True):
                    shape = np.concatenate([sides[0], sides[1]])
                    shape[beyond, 0] = end
                    flipped = np.concatenate([shape[: len(lower)], shape[len(lower) :][::-1]])
                    yield owner, flipped
                continue
        left = np.round(np.concatenate([row[2:4], row[6:8]]), _SAME)
        right = np.round(np.concatenate([row[4:6], row[8:10]]), _SAME)
        chain = open_.pop((owner, event, *left.tolist()), None)
        if chain is None:
            chain = [[], []]
            done.append((owner, chain))
        for side, points in zip(chain, sides, strict=True):
            side.append(points)
        open_[owner, event + 1, *right.tolist()] = chain
    for owner, (low, high) in done:
        yield owner, np.concatenate([*low, *(points[::-1] for points in high[::-1])])


def _place(
    part: NDArray[np.float64], lower: NDArray[np.float64], upper: NDArray[np.float64], spot: Spot
) -> NDArray[np.float64]:
    """Return the places of one side of a band, moved off the cut of a turn."""
    middle = np.concatenate([lower, upper]).mean(0)
    return spot(part + _INWARD * (middle - part))


def _lift(event: NDArray[np.float64], level: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([event[0] * level[0], event[1] * level[0], level[1]])
