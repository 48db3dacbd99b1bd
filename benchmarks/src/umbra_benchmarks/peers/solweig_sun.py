"""
SOLWEIG's shadows on a surface model (``solweig``, in Rust), on one thread of the processor.

It draws with a GPU where it finds one; the software that stands for one without is
slower than its own way on the processor.
"""

import os

os.environ["RAYON_NUM_THREADS"] = "1"  # before it is imported

from typing import Any

import numpy as np
from block import RasterTool, TownBlock, serve_tool
from solweig.rustalgos import shadowing


def _open(block: TownBlock) -> RasterTool:
    shadowing.disable_gpu()

    def find_lit(dsm: Any, azimuth: float, altitude: float) -> Any:
        height = float(np.ptp(dsm))
        found = shadowing.calculate_shadows_wall_ht_25(azimuth, altitude, block.cell, height, dsm)
        return found.bldg_sh

    return RasterTool("solweig", block, find_lit, np.float32)


if __name__ == "__main__":
    serve_tool(_open)
