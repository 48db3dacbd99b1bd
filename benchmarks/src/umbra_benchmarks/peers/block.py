"""
A town and a day's suns as a peer gets them, and its side of the pipe.

The peer makes the town in its own objects, says when it is ready, and finds for each
cell of the ground in which instants it is in shadow.
"""

import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from serve import answer_requests


class TownBlock(NamedTuple):
    """
    The work, as ``umbra_benchmarks.tools`` writes it.

    Parameters
    ----------
    vertices : (n, 3) float64
        Of boxes, 8 each, the lower 4 first [m]; x east, y north.
    faces : (m, 3) int32
    suns : (n_suns, 3) float64
        Unit vectors toward the sun.
    instants : (n_suns,) datetime64[ms]
        The same in UTC, for those who find the sun themselves.
    heights : (rows, cols) float64
        z of what is topmost at the cells' centres, row 0 in the south [m].
    cell : float
        Side of a cell; the first has a corner at x = y = 0 [m].
    hours : float
        What an instant stands for [h].
    latitude, longitude : float
        [degrees].
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    suns: NDArray[np.float64]
    instants: NDArray[np.datetime64]
    heights: NDArray[np.float64]
    cell: float
    hours: float
    latitude: float
    longitude: float

    def find_angles(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the suns' azimuths and altitudes [degrees]."""
        x, y, z = self.suns.T
        return np.degrees(np.arctan2(x, y)) % 360, np.degrees(np.arctan2(z, np.hypot(x, y)))


class PeerSeconds(NamedTuple):
    """
    How long a run took [s].

    Parameters
    ----------
    calculation : float
        Only what tells shadow from sun.
    whole : float or None
        From arrays of vertices, or of heights, to hours; None where that is all.
    """

    calculation: float
    whole: float | None = None


class PeerTool(Protocol):
    """What a peer offers."""

    name: str
    """Product and version."""
    suns: NDArray[np.float64]
    """The suns it uses: (n_suns, 3) unit vectors, the block's or its own."""

    def run(self) -> PeerSeconds:
        """Find the hours of shadow once."""

    def find_masks(self) -> NDArray[np.bool_]:
        """Tell what was in shadow in the last run: (n_suns, rows, cols), row 0 in the south."""


class RasterTool:
    """
    A tool that finds which cells of a surface model are lit, for one sun at a time.

    Parameters
    ----------
    package : str
        Its package, whose name and version are told.
    block : TownBlock
    find_lit : callable
        Takes the surface model, its first row in the north, and a sun's azimuth and altitude
        [degrees]; returns 1 where cells are lit and 0 in shadow.
    dtype : type
        Of the surface model.
    """

    def __init__(
        self, package: str, block: TownBlock, find_lit: Callable[..., Any], dtype: type = np.float64
    ) -> None:
        self.name = f"{package} {version(package)}"
        self.suns = block.suns
        self._angles = np.transpose(block.find_angles())
        self._dsm: NDArray[Any] = block.heights[::-1].astype(dtype)
        self._find_lit = find_lit
        self._lit: list[NDArray[np.float64]] = []

    def run(self) -> PeerSeconds:
        """Find what is in the sun at each instant."""
        begun = time.perf_counter()
        self._lit = [self._find_lit(self._dsm, *angles) for angles in self._angles]
        sum(self._lit)
        return PeerSeconds(time.perf_counter() - begun)

    def find_masks(self) -> NDArray[np.bool_]:
        """Turn the last run's answers about."""
        return np.array(self._lit)[:, ::-1] == 0


def serve_tool(make: Callable[[TownBlock], PeerTool]) -> None:
    """
    Answer requests until the pipe is closed.

    ``open`` reads the block; ``run`` does the work and says how long it took; ``save``
    writes masks and suns.

    Parameters
    ----------
    make : callable
        Gives the tool for a block.
    """

    def open_block(request: dict[str, Any]) -> tuple[PeerTool, dict[str, object]]:
        with np.load(request["block"]) as arrays:
            block = TownBlock(**{
                name: arrays[name] if arrays[name].ndim else arrays[name].item()
                for name in TownBlock._fields
            })  # fmt: skip
        tool: PeerTool = make(block)
        return tool, {"name": tool.name}

    answer_requests(open_block, _answer)


def _answer(tool: PeerTool, request: dict[str, Any]) -> dict[str, object]:
    if request["do"] == "run":
        return tool.run()._asdict()
    np.savez(request["path"], masks=tool.find_masks(), suns=tool.suns)
    return {}
