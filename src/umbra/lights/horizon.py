"""
The horizon: the elevation of the land far away by azimuth, and its files.

Files are tables ``azimuth,elevation`` from true north clockwise, PVGIS' horizon profile (``A``,
from south clockwise, and ``H_hor``), and bare elevations, one a line from north clockwise at equal
steps, as ``umbra sky --write horizon`` writes them and PVGIS takes them. All in degrees.
"""

import hashlib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, make_printable, shorten, show_value

__all__ = ["Horizon", "read_horizon"]

_LARGEST = 4_000_000  # [byte]; 36,000 azimuths have 1 MB
_WIDEST = 45.0  # gap between azimuths: PVGIS takes 8 or more elevations [degrees]
_SLACK = 1e-6  # by which the steps between written azimuths differ [degrees]
_TURNS = ("azimuth", "horizon_azimuth")
_HEIGHTS = ("elevation", "altitude", "horizon_elevation")
_ROUND = "give azimuth,elevation all around, 0 to 360 degrees"


@dataclass(frozen=True, eq=False)
class Horizon:
    """
    The land far away, the same from every receiver.

    Parameters
    ----------
    name, sha256 : str
        Of its file.
    azimuth : (n,) float64
        Clockwise from true north, ascending, 0 to below 360 [degrees].
    elevation : (n,) float64
        Of the land's upper edge, 0 to 90 [degrees]; between azimuths it is linear.
    """

    name: str
    sha256: str
    azimuth: NDArray[np.float64]
    elevation: NDArray[np.float64]

    @property
    def highest(self) -> float:
        """The highest elevation [degrees]."""
        return float(self.elevation.max())

    def covers(self, directions: NDArray[np.float64], true_north: float) -> NDArray[np.bool_]:
        """
        Return which directions meet the land.

        Parameters
        ----------
        directions : (n, 3) or (n, 4) float64
            Toward the light in the model's axes: unit vectors, or homogeneous lights, of which
            lamps (w = 1) stand before the land.
        true_north : float
            Azimuth of true north in the model's plan [degrees].

        Returns
        -------
        covered : (n,) bool
            Directions below the land's upper edge. Those from below the plane of the receivers'
            own horizon are not: the ground near by shines from there.
        """
        x, y, z = directions[:, :3].T
        azimuth = np.degrees(np.arctan2(x, y)) - true_north
        edge = np.interp(azimuth, self.azimuth, self.elevation, period=360.0)
        is_far = directions[:, 3] == 0 if directions.shape[1] > 3 else np.True_
        return is_far & (z > 0) & (np.degrees(np.arctan2(z, np.hypot(x, y))) < edge)


class _File:
    """A file whose faults are told by line."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with path.open("rb") as file:
                self.data = file.read(_LARGEST + 1)
        except (OSError, ValueError) as error:  # ValueError: a name with a null byte
            reason = (getattr(error, "strerror", None) or str(error)).lower()
            self.refuse(reason, "name a file of azimuth,elevation")
        if len(self.data) > _LARGEST:
            self.refuse(f"is larger than {_LARGEST / 1e6:.0f} MB", "give a step of 0.01 or more")
        text = self.data.decode("utf-8-sig", "replace")
        words = (re.split(r"[,;\t ]+", line.strip(" ,;\t")) for line in text.splitlines())
        self.rows = [(line, row) for line, row in enumerate(words, 1) if row != [""]]

    def refuse(self, what: str, remedy: str) -> NoReturn:
        """Raise the error of a wrong file."""
        msg = f"{self.path}: {what}; {remedy}"
        raise InputError(msg, option="horizon", path=self.path) from None

    def read_numbers(self, row: tuple[int, list[str]], columns: Sequence[int]) -> list[float]:
        """Return the finite numbers of some columns of a row."""
        line, words = row
        found = [_as_number(words[k]) if k < len(words) else math.nan for k in columns]
        if not all(map(math.isfinite, found)):
            shown = shorten(make_printable(",".join(words)), 40)
            self.refuse(f"line {line} ({shown}) has not the numbers it should", "correct it")
        return found


def _as_number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan


def read_horizon(given: Any) -> Horizon:
    """
    Read a horizon.

    Parameters
    ----------
    given : str, path or Horizon

    Returns
    -------
    horizon : Horizon

    Raises
    ------
    InputError
        If the file cannot be read, has one column under a head, azimuths that do not ascend or
        leave more than 45 degrees out, or elevations below 0 or above 90 degrees.
    """
    if isinstance(given, Horizon):
        return given
    if not isinstance(given, (str, Path)):
        msg = f"horizon= is a file of azimuth,elevation; got {show_value(given)}"
        raise InputError(msg, option="horizon")
    file = _File(Path(given))
    if not file.rows:
        file.refuse("is empty", _ROUND)
    is_bare = math.isfinite(_as_number(file.rows[0][1][0]))
    lines, azimuth, elevation = _read_bare(file) if is_bare else _read_columns(file)
    for line, height in zip(lines, elevation, strict=True):
        if not 0 <= height <= 90:
            remedy = "give 0 to 90 degrees, and 0 where the land lies lower"
            file.refuse(f"line {line} has an elevation of {height:g} degrees", remedy)
    return _close(file, lines, np.array(azimuth), np.array(elevation))


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


def _close(
    file: _File, lines: Sequence[int], azimuth: NDArray[np.float64], elevation: NDArray[np.float64]
) -> Horizon:
    """Return the horizon of a closed circle of ascending azimuths."""
    if not len(azimuth):
        file.refuse("has no azimuths", _ROUND)
    for line, turn in zip(lines, azimuth.tolist(), strict=True):
        if not 0 <= turn <= 360:
            file.refuse(f"line {line} has an azimuth of {turn:g} degrees", _ROUND)
    falls = np.flatnonzero(np.diff(azimuth) <= 0)
    if len(falls):
        k = int(falls[0])
        told = f"line {lines[k + 1]}: azimuth {azimuth[k + 1]:g} after {azimuth[k]:g} degrees"
        file.refuse(told, "give azimuths that ascend, each once")
    if azimuth[-1] == 360 and azimuth[0] == 0:
        if elevation[-1] != elevation[0]:
            told = f"has {elevation[0]:g} degrees at azimuth 0 and {elevation[-1]:g} at 360"
            file.refuse(told, "give one elevation to the north")
        azimuth, elevation = azimuth[:-1], elevation[:-1]
    gaps = np.diff(azimuth, append=azimuth[0] + 360)
    k = int(gaps.argmax())
    if gaps[k] > _WIDEST + _SLACK:
        told = f"leaves out {gaps[k]:g} degrees after azimuth {azimuth[k]:g}"
        file.refuse(told, f"give azimuths at most {_WIDEST:g} degrees apart, all around")
    name, digest = make_printable(file.path.name), hashlib.sha256(file.data).hexdigest()
    return Horizon(name, digest, azimuth, elevation)
