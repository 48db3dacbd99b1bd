"""Files that measures take: the probability of sunshine by month; the weather."""

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import InputError, show_value
from umbra.study.measures.measure import Measure, guard

__all__ = ["check_files", "read_sunshine"]

_MONTHS = 12
_LARGEST = 1_000_000  # [byte]
_TAKEN_BY = {"weather": "irradiation", "sunshine": "probable_sun_hours"}


def check_files(options: Any, measures: Sequence[Measure]) -> None:
    """
    Read and check the options that name files, and let each measure check what it takes.

    Parameters
    ----------
    options : StudyOptions
        Its fields are set.
    measures : sequence of Measure

    Raises
    ------
    InputError
        If the table is wrong, or a file is given in vain.
    """
    if isinstance(options.weather, (str, Path)):
        object.__setattr__(options, "weather", str(Path(options.weather).absolute()))
    if options.sunshine is not None:
        object.__setattr__(options, "sunshine", read_sunshine(options.sunshine))
    taken = {name for measure in measures for name in measure.takes}
    for name, measure in _TAKEN_BY.items():
        if getattr(options, name) is not None and name not in taken:
            msg = f"{name}= is given, but no measure takes it; add measure='{measure}'"
            raise InputError(msg, option=name)
    for known in measures:
        guard(known, known.check, options)


def read_sunshine(given: Any) -> tuple[float, ...]:
    """
    Read the probability of sunshine of each month.

    Parameters
    ----------
    given : path, or (12,) float
        A table ``month,share``, months 1 to 12; fractions of 1, or percents where one is above 1.

    Returns
    -------
    shares : tuple of 12 float
        Fractions of 1.

    Raises
    ------
    InputError
        If the file cannot be read, a month lacks or comes twice, or a share is none.
    """
    where = ""
    if isinstance(given, (str, Path)):
        where = f"{given}: "
        months = _read_table(Path(given))
        missing = [month for month in range(1, _MONTHS + 1) if month not in months]
        if missing:
            msg = (
                f"{where}{len(missing)} of 12 months are missing (first: month {missing[0]}); give "
                "a line month,share for each of 1 to 12"
            )
            raise InputError(msg, option="sunshine")
        shares = np.array([months[month] for month in range(1, _MONTHS + 1)])
    else:
        try:
            shares = np.asarray(given, np.float64)
        except (TypeError, ValueError, OverflowError):
            shares = np.zeros(0)
        if shares.shape != (_MONTHS,):
            msg = f"sunshine is a file or 12 shares, one for each month; got {show_value(given)}"
            raise InputError(msg, option="sunshine")
    if shares.max() > 1:
        shares /= 100
    if not np.isfinite(shares).all() or shares.min() < 0 or shares.max() > 1:
        wrong = int(np.flatnonzero(~((shares >= 0) & (shares <= 1)))[0])
        msg = (
            f"{where}month {wrong + 1} has no valid share; give fractions of 0 to 1, or percentages"
        )
        raise InputError(msg, option="sunshine")
    if not shares.any():
        msg = f"{where}all shares are 0, so no sun is probable; correct the table"
        raise InputError(msg, option="sunshine")
    return tuple(shares.tolist())


def _read_table(path: Path) -> dict[int, float]:
    """Return the shares of a table by month."""
    try:
        with path.open("rb") as file:
            data = file.read(_LARGEST + 1)
        if len(data) > _LARGEST:
            msg = f"{path}: is larger than 1 MB; give 12 lines month,share"
            raise InputError(msg, option="sunshine")  # noqa: TRY301 - not one of those below
        rows = list(csv.reader(io.StringIO(data.decode("utf-8-sig"), newline="")))
    except InputError:
        raise
    except (OSError, ValueError, csv.Error) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        msg = f"{path}: {reason}; name a table of 12 lines month,share"
        raise InputError(msg, option="sunshine") from None
    months: dict[int, float] = {}
    for line, row in enumerate(rows, 1):
        words = [word.strip() for word in row]
        if not any(words) or (line == 1 and words[0].lower() == "month"):
            continue
        try:
            month, share = int(words[0]), float(words[1])
        except (ValueError, IndexError):
            month, share = 0, math.nan
        if not 1 <= month <= _MONTHS or month in months:
            msg = f"{path}: line {line} ({','.join(row)[:40]}) is no new month,share; correct it"
            raise InputError(msg, option="sunshine", line=line)
        months[month] = share
    return months
