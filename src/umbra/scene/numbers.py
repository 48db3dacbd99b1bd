"""Numbers that a caller passes to records: converted once, or refused in a line."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value

__all__ = ["FARTHEST", "OUTSIDE", "check_reach", "read_array", "read_number", "read_vector"]

FARTHEST = 1e10
"""
Largest coordinate of a model [m]; larger ones are damaged or in another unit.

Pictures and OpenGL keep lengths in float32, which ends at 2^128, and multiply three: the area of a
face, 2^34 m a side, by the distance of a lamp, 2^40 m, is below 2^115 with sums of a few. Kernels
in float64, which ends at 2^1024, multiply four, as in the square of an area: with coordinates of
2^254 m they overflow, from 2^340 m on other shadows come of it.
"""
OUTSIDE = 100 * FARTHEST
"""Largest coordinate of a lamp or a camera [m], which may stand far from a model."""

_NUMBERS = "biuf"  # kinds of dtypes that hold real numbers


def read_array(what: str, value: object, dtype: Any = np.float64) -> NDArray[Any]:
    """
    Return real numbers as a contiguous array; the array itself if it is one.

    Parameters
    ----------
    what : str
        Subject of the error, plural: ``vertices``.
    value : array_like
    dtype : dtype
        None keeps the dtype.

    Raises
    ------
    InputError
        If it holds text, complex numbers, or rows of different lengths.
    """
    if type(value) is np.ndarray and value.dtype == dtype:
        return np.ascontiguousarray(value)
    try:
        array = np.asarray(value)
        # Decimal, Fraction, very large integers; not None, which numpy takes for NaN.
        if array.dtype.kind == "O" and not any(value is None for value in array.flat):
            array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError, RuntimeError):
        array = np.array("")
    if array.dtype.kind not in _NUMBERS:
        msg = f"{what} are an array of numbers; got {show_value(value)}"
        raise InputError(msg)
    with np.errstate(over="ignore"):  # to infinity, which is refused where it is used
        return np.ascontiguousarray(array, dtype)


def read_vector(what: str, value: object, width: int = 3) -> NDArray[np.float64]:
    """Return a copy of ``width`` numbers, (width,); refuse other shapes and NaN and infinity."""
    words = {3: "three finite numbers", 4: "four finite numbers x, y, z, w"}[width]
    try:
        vector = np.array(read_array(what, value)).reshape(-1)
    except InputError:
        vector = np.zeros(0)
    if vector.shape != (width,) or not np.isfinite(vector).all():
        msg = f"{what} needs {words}; got {show_value(value)}"
        raise InputError(msg)
    return vector


def read_number(what: str, value: Any) -> float:
    """Return one real number, also an infinite one, as a float; refuse all else."""
    try:
        array = read_array(what, value)
    except InputError:
        array = np.zeros(0)
    # A contiguous array has at least one dimension.
    if array.size != 1 or np.ndim(value) or isinstance(value, (bool, np.bool_)):
        msg = f"{what} is a number; got {show_value(value)}"
        raise InputError(msg)
    return float(array.ravel()[0])


def check_reach(
    what: str, numbers: NDArray[np.float64], remedy: str, most: float = FARTHEST
) -> None:
    """Refuse coordinates that are farther from zero than ``most`` [m], or are not finite."""
    far = float(np.abs(numbers).max(initial=0.0))
    # Very large numbers may have overflowed to NaN, which is not below either.
    if not far <= most:
        reach = f"{far:g}" if np.isfinite(far) else f"more than {most:g}"
        msg = f"{what} reach {reach} m from zero, and {most:g} m is the most; {remedy}"
        raise InputError(msg, far=far)
