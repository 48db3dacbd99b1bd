"""UMEP's shadows on a surface model (``umep``, its algorithms without QGIS)."""

from typing import Any

from block import RasterTool, TownBlock, serve_tool
from umep.util.shadowingfunctions import shadowingfunctionglobalradiation


def _open(block: TownBlock) -> RasterTool:
    """Do what UMEP's daily shading does, at the block's suns."""

    def find_lit(dsm: Any, azimuth: float, altitude: float) -> Any:
        return shadowingfunctionglobalradiation(dsm, azimuth, altitude, 1 / block.cell, 1)

    return RasterTool("umep", block, find_lit)


if __name__ == "__main__":
    serve_tool(_open)
