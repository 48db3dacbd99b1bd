"""UMEP's shadows on a surface model (``umep``, its algorithms without QGIS)."""

import time
from importlib.metadata import version

import numpy as np
from block import PeerSeconds, TownBlock, serve_tool
from numpy.typing import NDArray
from umep.util.shadowingfunctions import shadowingfunctionglobalradiation


class UmepShadows:
    """
    What UMEP's daily shading does, at the block's suns.

    Parameters
    ----------
    block : TownBlock
    """

    def __init__(self, block: TownBlock) -> None:
        self.name = f"umep {version('umep')}"
        self.suns = block.suns
        self._angles = np.transpose(block.find_angles())
        self._scale = 1 / block.cell
        self._dsm = block.heights[::-1].copy()
        self._lit: list[NDArray[np.float64]] = []

    def run(self) -> PeerSeconds:
        """Find what is in the sun at each instant."""
        begun = time.perf_counter()
        self._lit = [
            shadowingfunctionglobalradiation(self._dsm, azimuth, altitude, self._scale, 1)
            for azimuth, altitude in self._angles
        ]
        sum(self._lit)
        return PeerSeconds(time.perf_counter() - begun)

    def find_masks(self) -> NDArray[np.bool_]:
        """Turn the last run's answers about."""
        return np.array(self._lit)[:, ::-1] == 0


if __name__ == "__main__":
    serve_tool(UmepShadows)
