"""CSV: comma, point, UTF-8, a heading with units; the columns and bands of several dates."""

import contextlib
import csv
import gzip
import io
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study, split_dates
from umbra.study.attributes import is_sum
from umbra.sun.clock import Stamps

__all__ = [
    "find_columns",
    "list_texts",
    "name_cells",
    "tell_instants",
    "write_cells",
    "write_instants",
    "write_samples",
    "write_table",
]

MOST_NUMBERS = 6_000_000
"""In a table of cells that is written plainly: some 50 MB."""

# Characters that begin a formula in spreadsheets, also in full width, and after a semicolon or
# tab, at which some split a line.
_FORMULA = re.compile("(?:^|(?<=[;\t\n]))(?=\\s*[=+\\-@\uff0b\uff0d\uff1d\uff20])|^(?=[\t\n])")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def write_table(
    path: str | os.PathLike[str], columns: Sequence[str], rows: Iterable[Sequence[object]]
) -> None:
    """
    Write rows under named columns.

    Text that a spreadsheet would run as a formula, such as a model's name, gets an apostrophe
    before it; numbers stay numbers, also as text.
    """
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(map(_guard, columns))
        writer.writerows(map(_guard, row) for row in rows)


def _guard(cell: object) -> object:
    """Escape text that a spreadsheet would run as a formula."""
    if not isinstance(cell, str) or _NUMBER.fullmatch(cell):
        return cell
    # A bare return would end the line, and csv quotes line feeds only.
    return _FORMULA.sub("'", re.sub("\r\n?", "\n", cell))


def name_cells(study: Study) -> str:
    """Name the table of cells; large ones are compressed, to about an eighth."""
    columns = 2 + len(_find_columns_of_cells(study))
    return "cells.csv.gz" if study.shadow_hours.size * columns > MOST_NUMBERS else "cells.csv"


def _find_columns_of_cells(study: Study) -> dict[str, np.ndarray]:
    return find_columns(study, study.dims, ("receiver_z", "sun_hours", "shadow_hours"))


def write_cells(path: str | os.PathLike[str], study: Study) -> int:
    """
    Write a line for each cell, from the south-west, row by row; return the size unpacked [byte].

    Every array over the cells becomes a column; instants are
    UTC. Of several dates there is a column for each. A name that ends with ``.gz`` is packed.
    """
    arrays = _find_columns_of_cells(study)
    digits = {name: 3 if name == "receiver_z" else 4 for name in arrays}
    rows, cols = study.shadow_hours.shape
    xs, ys = ([f"{v:.3f}" for v in axis] for axis in (study.x, study.y))
    with contextlib.ExitStack() as stack:
        raw: Any = stack.enter_context(Path(path).open("wb"))
        if Path(path).suffix == ".gz":  # without name and time, for reproducible bytes
            raw = stack.enter_context(gzip.GzipFile("", "wb", 6, raw, 0))
        file = stack.enter_context(io.TextIOWrapper(raw, "utf-8", newline=""))
        file.write(",".join([*study.dims[::-1], *arrays]) + "\n")
        for row in range(rows):
            columns = [xs, [ys[row]] * cols]
            columns += [_to_text(array[row], digits[name]) for name, array in arrays.items()]
            file.write("\n".join(map(",".join, zip(*columns, strict=True))) + "\n")
        file.flush()
        return int(raw.tell())


def tell_instants(instants: NDArray[np.datetime64]) -> list[str]:
    """Write instants in UTC to a second, and missing ones as nothing."""
    texts = np.datetime_as_string(instants.astype("datetime64[s]"), timezone="UTC")
    return ["" if text == "NaT" else str(text) for text in texts]


def _to_text(values: np.ndarray, digits: int) -> list[str]:
    """Format numbers briefly, and missing values as nothing."""
    if values.dtype.kind == "M":
        return tell_instants(values)
    if values.dtype.kind in "iub":
        return list(map(str, values.tolist()))
    rounded = np.round(values.astype(np.float64), digits) + 0.0
    return ["" if v != v else f"{v:.10g}" for v in rounded.tolist()]  # noqa: PLR0124  (NaN)


def list_texts(values: np.ndarray) -> list[str]:
    """Return the cells of a column: text as it is, numbers briefly, missing values as nothing."""
    return values.astype(str).tolist() if values.dtype.kind in "UOS" else _to_text(values, 4)


def write_instants(
    path: str | os.PathLike[str], study: Study, areas: Sequence[float] | None = None
) -> None:
    """Write a line for each step: its clock times, the sun, and any area in shadow [m²]."""
    period = study.period

    def tell(instants: NDArray) -> list[str]:
        stamps = Stamps(stamps=instants.astype("datetime64[us]"), zone=study.site.zone)
        return [when.isoformat() for when in stamps.local()]

    columns = {
        "from": tell(period.starts),
        "to": tell(period.ends),
        "judged_at": tell(period.instants),
        "judged_at_utc": np.datetime_as_string(period.instants, "ms", timezone="UTC").tolist(),
        "hours": [f"{hours:.6g}" for hours in period.hours],
        "sun_altitude": [f"{angle:.4f}" for angle in study.sun.altitude],
        "sun_azimuth": [f"{angle:.4f}" for angle in study.sun.azimuth],
    }
    if areas is not None:
        columns["shadow_area_m2"] = [f"{area:.10g}" for area in areas]
    write_table(path, list(columns), zip(*columns.values(), strict=True))


def write_samples(folder: Path, study: Study) -> list[str]:
    """Write a line for each point; of sampled surfaces also for each surface and part."""
    places = study.places
    points = {
        axis: array[:, k]
        for array, axes in ((places.points, "xyz"), (places.normals, ("nx", "ny", "nz")))
        for k, axis in enumerate(axes)
    }
    files = study.kind.tables
    for file, dimension in files.items():
        own = find_columns(study, (dimension,))
        if dimension == "surface":
            names = np.asarray(study.more["part"][1])[own["surface_part"]]
            own = {dimension: np.arange(len(names))} | own | {"surface_part": names}
        first = [name for name in ("name", dimension) if name in own]
        columns = points if dimension == "sample" else {}
        own = {name: own.pop(name) for name in first} | columns | own
        texts = [list_texts(array) for array in own.values()]
        write_table(folder / file, list(own), zip(*texts, strict=True))
    return list(files)


def find_columns(
    study: Study, dims: tuple[str, ...], first: tuple[str, ...] = ()
) -> dict[str, NDArray]:
    """
    Return the arrays along some axes by name; the names of ``first`` come before the others.

    Arrays of several dates are named with each, ``sun_hours_2026-03-21``; where only sums are
    kept, ``sun_hours_sum``. Beside hours lost to proposed parts stands ``sun_kept``, the share of
    the hours of sun that is left.
    """
    dates = split_dates(study)
    if len(dates) == 1:
        has_sums = len(study.period.days) > 1
        return _add_shares_kept(
            {
                f"{name}_sum" if has_sums and is_sum(name) else name: array
                for name, array in _pick(study, dims, first).items()
            }
        )
    by_day: dict[str, NDArray] = {}
    of_dates = [(study.period.days[0], _pick(study, dims)) for study in dates]
    for name, array in _pick(study, dims, first).items():
        if f"{name}_by_day" not in study.more:
            by_day[name] = array
            continue
        by_day |= {f"{name}_{day}": arrays[name] for day, arrays in of_dates}
    return _add_shares_kept(by_day)


def _add_shares_kept(columns: dict[str, NDArray]) -> dict[str, NDArray]:
    """Add the share of its hours of sun that each place keeps beside the proposed parts."""
    shares = {}
    for name, lost in columns.items():
        if name.startswith("hours_lost"):
            ending = name.removeprefix("hours_lost")
            left = columns[f"sun_hours{ending}"]
            none = np.full(left.shape, np.nan, np.float32)
            before = left + lost
            shares[f"sun_kept{ending}"] = np.divide(left, before, where=before > 0, out=none)
    return columns | shares


def _pick(study: Study, dims: tuple[str, ...], first: tuple[str, ...] = ()) -> dict[str, NDArray]:
    arrays = {
        name: np.asarray(array)
        for name, (dimensions, array) in study.variables().items()
        if dimensions == dims
    }
    return {name: arrays.pop(name) for name in first if name in arrays} | arrays
