"""
pybdshadow: each building's shadow on the ground as a polygon, then cells that touch it.

It knows places by longitude and latitude and finds the sun itself (suncalc) for an
instant and the middle of the buildings.
"""

import time
import warnings
from importlib.metadata import version

import geopandas as gpd
import numpy as np
import pandas as pd
import pybdshadow
import pyproj
import shapely
from block import PeerSeconds, TownBlock, serve_tool
from numpy.typing import NDArray
from pybdshadow.analysis import cal_shadowcoverage
from pybdshadow.preprocess import bd_preprocess
from suncalc import get_position

warnings.simplefilter("ignore")


class Sunshine:
    """
    What ``cal_sunshine`` does, at the block's instants and cells.

    Parameters
    ----------
    block : TownBlock
    """

    def __init__(self, block: TownBlock) -> None:
        self.name = f"pybdshadow {version('pybdshadow')}"
        self._block = block
        self._instants = [pd.Timestamp(instant) for instant in block.instants]
        self._shadows: gpd.GeoDataFrame | None = None
        self._place = pyproj.Transformer.from_crs(
            pyproj.CRS.from_proj4(
                f"+proj=aeqd +lat_0={block.latitude} +lon_0={block.longitude} +datum=WGS84"
            ),
            4326,
            always_xy=True,
        )
        boxes = block.vertices.reshape(-1, 8, 3)
        self._buildings = gpd.GeoDataFrame(
            {"building_id": np.arange(len(boxes)), "height": boxes[:, 4, 2]},
            geometry=shapely.polygons(self._to_degrees(boxes[:, :4, :2])),
            crs=4326,
        )
        rows, cols = block.heights.shape
        corners = np.stack(np.meshgrid(np.arange(cols + 1), np.arange(rows + 1)), -1) * block.cell
        at = self._to_degrees(corners)
        quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], 2)
        self._cells = shapely.polygons(quads.reshape(-1, 4, 2))
        row, col = np.divmod(np.arange(rows * cols), cols)
        self._grid = gpd.GeoDataFrame({"LONCOL": col, "LATCOL": row}, geometry=self._cells)
        self.suns = np.array([self._find_sun(instant) for instant in self._instants])

    def run(self) -> PeerSeconds:
        """Make the shadows' polygons, which is the calculation; then count cells."""
        begun = time.perf_counter()
        shadows = []
        for instant in self._instants:
            shadow = pybdshadow.bdshadow_sunlight(self._buildings, instant)
            shadow["date"] = instant
            shadows.append(shadow)
        calculated = time.perf_counter() - begun
        self._shadows = pd.concat(shadows)
        # It changes what it is given.
        cal_shadowcoverage(
            self._shadows.copy(), self._buildings.copy(), self._grid.copy(), roof=False,
            precision=3600 * self._block.hours,
        )  # fmt: skip
        return PeerSeconds(calculated, time.perf_counter() - begun)

    def find_masks(self) -> NDArray[np.bool_]:
        """Find the cells that touch an instant's shadow, as ``cal_shadowcoverage`` does."""
        shadows = bd_preprocess(self._shadows)
        masks = []
        for instant in self._instants:
            polygons = shadows.geometry[shadows["date"] == instant]
            shadow = shapely.MultiPolygon(list(polygons)).buffer(0)
            shapely.prepare(shadow)
            masks.append(shapely.intersects(shadow, self._cells))
        return np.array(masks).reshape(-1, *self._block.heights.shape)

    def _to_degrees(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Place x and y, metres from the town's south-west corner, at longitude and latitude."""
        rows, cols = self._block.heights.shape
        middle = np.array([cols, rows]) * self._block.cell / 2
        longitude, latitude = self._place.transform(*np.moveaxis(places - middle, -1, 0))
        return np.stack([longitude, latitude], -1)

    def _find_sun(self, instant: pd.Timestamp) -> NDArray[np.float64]:
        """Ask its astronomer, whose azimuth runs from the south to the west."""
        west, south, east, north = self._buildings.bounds.mean()
        sun = get_position(instant, (west + east) / 2, (south + north) / 2)
        level = -np.cos(sun["altitude"])
        return np.array([
            level * np.sin(sun["azimuth"]), level * np.cos(sun["azimuth"]),
            np.sin(sun["altitude"]),
        ])  # fmt: skip


if __name__ == "__main__":
    serve_tool(Sunshine)
