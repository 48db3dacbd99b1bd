"""A raster of the land's heights: its place on the earth, and its blocks in metres."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.land.march import interpolate
from umbra.readers.georeference import assumes_height_unit, is_known_crs, show_crs
from umbra.readers.raster_file import FEET, LOWEST, METRES

__all__ = ["LandFile"]

_HIGHEST = 9000.0  # [m]; above all land
_HALF = 0.5  # from a centre to the edge of its cell
_TURN = 360.0


class LandFile:
    """An open raster: its place, its heights in metres."""

    def __init__(self, source: Any) -> None:
        self.source, self.rows, self.columns = source, source.height, source.width
        kind = source.dtypes[0]
        if kind.startswith("complex") or (kind == "uint8" and source.count >= 3):
            msg = f"is a picture of {source.count} bands ({kind}), not heights; give a terrain "
            raise InputError(msg + "model of the land around", dtype=kind)
        if min(source.shape) < 2:
            msg = f"has {self.columns} x {self.rows} cells; give a terrain model of the land around"
            raise InputError(msg)
        self.matrix = np.array(source.transform, np.float64).reshape(3, 3)[:2]
        flat = self.matrix[:, :2]
        if not np.isfinite(self.matrix).all() or np.linalg.det(flat) == 0:
            msg = "says that its cells have no area; repair its georeference"
            raise InputError(msg)
        self.inverse = np.linalg.inv(flat)
        self.notes: list[str] = []
        self.crs, self.name = self._find_crs()
        self.factor = self._find_unit()

    def _find_crs(self) -> tuple[Any, str]:
        """Return the reference system, and what it is called."""
        from pyproj import CRS  # noqa: PLC0415 - 0.1 s

        if self.source.crs is None:
            msg = "does not say its coordinate reference system; declare it (gdal_edit.py -a_srs "
            raise InputError(msg + "EPSG:CODE FILE)")
        text, code = self.source.crs.to_wkt(), self.source.crs.to_epsg()
        name = f"EPSG:{code}" if code else show_crs(text)
        if not is_known_crs(text):
            msg = f"has a reference system that is not known ({name}); convert it (gdalwarp -t_srs "
            raise InputError(msg + "EPSG:CODE)", crs=name)
        return CRS.from_user_input(text), name

    def _find_unit(self) -> float:
        """Return the metres of a unit of height."""
        said = (self.source.units[0] or "").strip()
        unit = said.casefold()
        if unit not in METRES | FEET.keys():
            msg = f"has heights in '{said}'; convert them to metres"
            raise InputError(msg, unit=unit)
        up = [axis.unit_conversion_factor for axis in self.crs.axis_info if axis.direction == "up"]
        if not unit and not up and assumes_height_unit(self.source.crs.to_wkt()):
            msg = f"is in feet ({self.name}) and does not say the unit of its heights; declare it "
            raise InputError(msg + "(gdal_edit.py -units ft FILE, or -units m)")
        factor = FEET.get(unit, 1.0) if unit else up[0] if up else 1.0
        if factor != 1.0:
            self.notes.append("heights were converted from feet")
        return factor

    def find_cells(
        self, longitude: NDArray[np.float64], latitude: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return columns and rows of cell centres, (n, 2), of places on WGS 84."""
        from pyproj import Transformer  # noqa: PLC0415 - 0.1 s

        flat = self.crs.to_2d()
        there = Transformer.from_crs("EPSG:4326", flat, always_xy=True)
        x, y = there.transform(longitude, latitude)
        plan = np.column_stack([x, y])
        if flat.is_geographic:  # of the turns around the earth the one about the raster's middle
            middle = self.matrix @ [self.columns / 2, self.rows / 2, 1.0]
            turns = np.round((middle[0] - plan[:, 0]) / (_TURN))
            plan[:, 0] += _TURN * turns
        return (plan - self.matrix[:, 2]) @ self.inverse.T - _HALF

    def find_places(self, cells: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
        """Return longitudes and latitudes of columns and rows (n, 2)."""
        from pyproj import Transformer  # noqa: PLC0415

        flat = self.crs.to_2d()
        back = Transformer.from_crs(flat, "EPSG:4326", always_xy=True)
        plan = (cells + _HALF) @ self.matrix[:, :2].T + self.matrix[:, 2]
        lon, lat = back.transform(*plan.T)
        return np.array(lon), np.array(lat)

    def read(
        self, c0: int, r0: int, c1: int, r1: int, thin: int = 1
    ) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """
        Read the heights of columns c0 to c1 and rows r0 to r1 (excluded), NaN without, thinned.

        With them comes their frame; see ``march``.
        """
        source, window = self.source, ((r0, r1), (c0, c1))
        shape = max(-(-(r1 - r0) // thin), 2), max(-(-(c1 - c0) // thin), 2)
        raw = source.read(1, window=window, out_shape=shape)
        there = source.read_masks(1, window=window, out_shape=shape) != 0
        heights = raw.astype(np.float32)
        if source.scales[0] != 1.0 or source.offsets[0] != 0.0:
            heights = (raw * source.scales[0] + source.offsets[0]).astype(np.float32)
        if self.factor != 1.0:
            heights *= np.float32(self.factor)
        there &= np.isfinite(heights)
        heights[~there] = np.nan
        if there.any():
            self._check(float(np.nanmin(heights)), float(np.nanmax(heights)))
        frame = np.array([c0, r0, (c1 - c0) / shape[1], (r1 - r0) / shape[0]], np.float64)
        return heights, frame

    def _check(self, lowest: float, highest: float) -> None:
        """Refuse heights that no land has."""
        wrong = lowest if lowest < LOWEST else highest if highest > _HIGHEST else None
        if wrong is not None:
            msg = (
                f"has heights of {wrong:g} m, which no land has: a value for no data that the file "
                f"does not declare, or another unit; declare it (gdal_edit.py -a_nodata {wrong:g} "
                "FILE)"
            )
            raise InputError(msg, value=wrong)

    @property
    def last(self) -> NDArray[np.float64]:
        """Column and row of the last edges, in centres (2,)."""
        return np.array([self.columns, self.rows]) - _HALF

    def holds(self, cell: NDArray[np.float64]) -> bool:
        """Return whether a place lies in the raster, by its column and row (2,)."""
        return bool((cell >= -_HALF).all() and (cell <= self.last).all())

    def find_height(self, cell: NDArray[np.float64]) -> float:
        """Return the height at a column and a row of centres (2,); NaN without [m]."""
        if not self.holds(cell):
            return math.nan
        most = np.array([self.columns, self.rows]) - 2
        i, j = np.clip(np.floor(cell), 0, most).astype(int).tolist()
        heights, _ = self.read(i, j, i + 2, j + 2)
        inside = np.clip(cell - (i, j), 0.0, 1.0)
        return float(interpolate(heights.astype(np.float64), inside[0], inside[1]))
