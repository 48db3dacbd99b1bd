"""
Files of the horizon.

They are tables ``azimuth,elevation`` from true north clockwise; PVGIS' horizon profile, as text or
JSON (``A``, from south clockwise, and ``H_hor``); bare elevations, one a line from north clockwise
at equal steps, as ``umbra sky --write horizon`` writes them and PVGIS takes them; and rasters of
the land's heights (GeoTIFF), whose horizon `umbra.land` finds. All angles in degrees.
"""

import hashlib
import json
import math
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np

from umbra.errors import InputError, make_printable, shorten, show_value
from umbra.lights.horizon import Horizon, LandRaster

__all__ = ["read_horizon"]

_LARGEST = 4_000_000  # [byte]; 36,000 azimuths have 1 MB
_WIDEST = 45.0  # gap between azimuths: PVGIS takes 8 or more elevations [degrees]
_SLACK = 1e-6  # by which the steps between written azimuths differ [degrees]
_TURNS = ("azimuth", "horizon_azimuth")
_HEIGHTS = ("elevation", "altitude", "horizon_elevation")
_ROUND = "give azimuth,elevation all around, 0 to 360 degrees"
_RASTERS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
"""Beginnings of GeoTIFF, and of large ones."""
_TO_RASTER = "convert it: gdal_translate FILE land.tif"
_OTHERS = {
    b"ncols": ("is an ASCII grid", _TO_RASTER),
    b"CDF": ("is a NetCDF file", _TO_RASTER),
    b"\x89HDF": ("is an HDF5 file", _TO_RASTER),
    b"<VRTDataset": ("is a list of rasters (VRT)", _TO_RASTER),
    b"EHFA_HEADER_TAG": ("is an IMG raster", _TO_RASTER),
    b"\x89PNG": ("is a picture", "give a raster of heights, or azimuth,elevation"),
    b"PK": ("is an archive", "unpack it and name the file inside"),
}  # fmt: skip
_SRTM = ".hgt"  # has no head


class _File:
    """A file with line numbers, for error messages."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.data = path, data
        self.is_raster = data[:4] in _RASTERS
        if self.is_raster:
            return
        self._refuse_others()
        if len(data) > _LARGEST:
            self.refuse(f"is larger than {_LARGEST / 1e6:.0f} MB", "give a step of 0.01 or more")
        self.text = data.decode("utf-8-sig", "replace")
        words = (re.split(r"[,;\t ]+", line.strip(" ,;\t")) for line in self.text.splitlines())
        self.rows = [(line, row) for line, row in enumerate(words, 1) if row != [""]]

    @classmethod
    def open(cls, path: Path) -> Self:
        """Read a file; of a raster its first bytes."""
        try:
            with path.open("rb") as file:
                data = file.read(4)
                return cls(path, data if data in _RASTERS else data + file.read(_LARGEST - 3))
        except (OSError, ValueError) as error:  # ValueError: a name with a null byte
            if isinstance(error, InputError):
                raise
            reason = (getattr(error, "strerror", None) or str(error)).lower()
            msg = f"{path}: {reason}; name a file of azimuth,elevation, or a raster of heights"
            raise InputError(msg, option="horizon", path=path) from None

    def refuse(self, what: str, remedy: str) -> NoReturn:
        """Raise the error of a wrong file."""
        msg = f"{self.path}: {what}; {remedy}"
        raise InputError(msg, option="horizon", path=self.path) from None

    def _refuse_others(self) -> None:
        """Refuse files that hold no table, by what they are."""
        for begin, (what, remedy) in _OTHERS.items():
            if self.data.lstrip().startswith(begin):
                self.refuse(what, remedy)
        if self.path.suffix.lower() == _SRTM:
            self.refuse("is an SRTM tile", _TO_RASTER)

    def read_numbers(self, row: tuple[int, list[str]], columns: Sequence[int]) -> list[float]:
        """Return the finite numbers of some columns of a row."""
        line, words = row
        numbers = [_as_number(words[k]) if k < len(words) else math.nan for k in columns]
        if not all(map(math.isfinite, numbers)):
            shown = shorten(make_printable(",".join(words)), 40)
            self.refuse(f"line {line} ({shown}) has not the numbers it should", "correct it")
        return numbers


def _as_number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan


def read_horizon(given: Any) -> Horizon | LandRaster:
    """
    Read a horizon.

    Parameters
    ----------
    given : str, path, pandas.Series, Horizon or LandRaster
        A series has elevations by azimuth, as ``pvlib.iotools.get_pvgis_horizon`` returns it.

    Returns
    -------
    horizon : Horizon or LandRaster
        A raster of heights is only found to be one.

    Raises
    ------
    InputError
        If the file cannot be read, has one column under a head, azimuths that do not ascend or
        leave more than 45 degrees out, or elevations below 0 or above 90 degrees.
    """
    if isinstance(given, (Horizon, LandRaster)):
        return given
    if isinstance(given, dict):  # of a city's run
        with suppress(KeyError, TypeError, ValueError):
            return Horizon.of_plain(given)
    file = _File.open(Path(given)) if isinstance(given, (str, Path)) else _write_table(given)
    if file.is_raster:
        return LandRaster(file.path)
    if file.data.lstrip()[:1] == b"{":
        return _close(file, *_read_json(file))
    if not file.rows:
        file.refuse("is empty", _ROUND)
    is_bare = math.isfinite(_as_number(file.rows[0][1][0]))
    lines, azimuth, elevation = _read_bare(file) if is_bare else _read_columns(file)
    return _close(file, lines, azimuth, elevation)


def _write_table(given: Any) -> _File:
    """Write a pandas series of elevations by azimuth as a table."""
    try:
        rows = [f"{float(turn)!r},{float(high)!r}" for turn, high in given.items()]
    except (AttributeError, TypeError, ValueError):
        msg = (
            "horizon= is a file (azimuth,elevation, or a raster of heights), or a pandas series of "
            f"elevations by azimuth; got {show_value(given)}"
        )
        raise InputError(msg, option="horizon") from None
    return _File(Path("horizon"), "\n".join(["azimuth,elevation", *rows]).encode())


def _read_bare(file: _File) -> tuple[list[int], list[float], list[float]]:
    """Read elevations at equal steps from north on, or rows of both without a head."""
    columns = {len(words) for _, words in file.rows}
    if columns != {1}:
        file.refuse("has columns without names", "begin it with a line azimuth,elevation")
    heights = [file.read_numbers(row, (0,))[0] for row in file.rows]
    turns = [360 * k / len(heights) for k in range(len(heights))]
    return [line for line, _ in file.rows], turns, heights


def _read_columns(file: _File) -> tuple[list[int], list[float], list[float]]:
    """Read a table with names; PVGIS' head and foot are words around it."""
    for k, (_, words) in enumerate(file.rows):
        names = [word.strip('"').lower() for word in words]
        rows = file.rows[k + 1 :]
        if names[:2] == ["a", "h_hor"]:
            return _read_profile(file, rows)
        turn = next((names.index(name) for name in _TURNS if name in names), None)
        height = next((names.index(name) for name in _HEIGHTS if name in names), None)
        if turn is not None and height is not None:
            both = [file.read_numbers(row, (turn, height)) for row in rows]
            return [n for n, _ in rows], [turn for turn, _ in both], [high for _, high in both]
    return file.refuse("has no head that names azimuth and elevation", _ROUND)


def _read_profile(
    file: _File, rows: Sequence[tuple[int, list[str]]]
) -> tuple[list[int], list[float], list[float]]:
    """Read PVGIS' profile, whose azimuths are from south; what follows explains its columns."""
    count = next((k for k, (_, w) in enumerate(rows) if math.isnan(_as_number(w[0]))), len(rows))
    both = [file.read_numbers(row, (0, 1)) for row in rows[:count]]
    lines = [line for line, _ in rows[:count]]
    return lines, [turn + 180 for turn, _ in both], [height for _, height in both]


def _read_json(file: _File) -> tuple[list[int], list[float], list[float]]:
    """Read PVGIS' profile as JSON: ``outputs.horizon_profile``, whose rows are counted from 1."""
    remedy = "give PVGIS' printhorizon (outputformat=json), or a table azimuth,elevation"
    try:
        rows = json.loads(file.text)["outputs"]["horizon_profile"]
        both = [(float(row["A"]), float(row["H_hor"])) for row in rows]
    except (ValueError, TypeError, KeyError, RecursionError, OverflowError):
        file.refuse("has no outputs.horizon_profile with A and H_hor", remedy)
    lines = list(range(1, len(both) + 1))
    return lines, [turn + 180 for turn, _ in both], [height for _, height in both]


def _close(
    file: _File, lines: Sequence[int], turns: Sequence[float], heights: Sequence[float]
) -> Horizon:
    """Return the horizon of a closed circle of ascending azimuths."""
    azimuth, elevation = np.array(turns, np.float64), np.array(heights, np.float64)
    if not len(azimuth):
        file.refuse("has no azimuths", _ROUND)
    for line, turn, height in zip(lines, azimuth.tolist(), elevation.tolist(), strict=True):
        if not 0 <= height <= 90:
            remedy = "give 0 to 90 degrees, and 0 where the land lies lower"
            file.refuse(f"line {line} has an elevation of {height:g} degrees", remedy)
        if not 0 <= turn <= 360:
            file.refuse(f"line {line} has an azimuth of {turn:g} degrees", _ROUND)
    falls = np.flatnonzero(np.diff(azimuth) <= 0)
    if len(falls):
        k = int(falls[0])
        fault = f"line {lines[k + 1]}: azimuth {azimuth[k + 1]:g} after {azimuth[k]:g} degrees"
        file.refuse(fault, "give azimuths that ascend, each once")
    if azimuth[-1] == 360 and azimuth[0] == 0:
        if elevation[-1] != elevation[0]:
            fault = f"has {elevation[0]:g} degrees at azimuth 0 and {elevation[-1]:g} at 360"
            file.refuse(fault, "give one elevation to the north")
        azimuth, elevation = azimuth[:-1], elevation[:-1]
    gaps = np.diff(azimuth, append=azimuth[0] + 360)
    k = int(gaps.argmax())
    if gaps[k] > _WIDEST + _SLACK:
        fault = f"leaves out {gaps[k]:g} degrees after azimuth {azimuth[k]:g}"
        file.refuse(fault, f"give azimuths at most {_WIDEST:g} degrees apart, all around")
    name, digest = make_printable(file.path.name), hashlib.sha256(file.data).hexdigest()
    return Horizon(name, digest, azimuth, elevation)
