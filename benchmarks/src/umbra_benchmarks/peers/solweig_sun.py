"""
SOLWEIG's shadows on a surface model (``solweig``, in Rust), on one thread of the processor.

It draws with a GPU where it finds one; the software that stands for one without is
slower than its own way on the processor.
"""

import os

os.environ["RAYON_NUM_THREADS"] = "1"  # before it is imported

import time
from importlib.metadata import version

import numpy as np
from block import PeerSeconds, TownBlock, serve_tool
from numpy.typing import NDArray
from solweig.rustalgos import shadowing


class SolweigShadows:
    """
    SOLWEIG's shadows of buildings at the block's suns.

    Parameters
    ----------
    block : TownBlock
    """

    def __init__(self, block: TownBlock) -> None:
        shadowing.disable_gpu()
        self.name = f"solweig {version('solweig')}"
        self.suns = block.suns
        self._angles = np.transpose(block.find_angles())
        self._scale = block.cell
        self._dsm = block.heights[::-1].astype(np.float32)
        self._lit: list[NDArray[np.float32]] = []

    def run(self) -> PeerSeconds:
        """Find what is in the sun at each instant."""
        begun = time.perf_counter()
        height = float(np.ptp(self._dsm))
        self._lit = [
            shadowing.calculate_shadows_wall_ht_25(
                azimuth, altitude, self._scale, height, self._dsm
            ).bldg_sh
            for azimuth, altitude in self._angles
        ]
        sum(self._lit)
        return PeerSeconds(time.perf_counter() - begun)

    def find_masks(self) -> NDArray[np.bool_]:
        """Turn the last run's answers about."""
        return np.array(self._lit)[:, ::-1] == 0


if __name__ == "__main__":
    serve_tool(SolweigShadows)
