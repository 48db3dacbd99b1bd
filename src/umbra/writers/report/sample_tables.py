"""Tables of samples: parts and surfaces, or points."""

import zoneinfo
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study, split_dates
from umbra.study.accumulators.hours import MASKS
from umbra.writers.report.markup import Table
from umbra.writers.report.tables import NEVER, join_dates

__all__ = ["MOST_ROWS", "list_receivers"]

MOST_ROWS = 2000
"""Of a table in the page, all dates together; the largest areas come first into it."""


def list_receivers(study: Study) -> list[Table]:
    """List the results of parts and surfaces, or of points."""
    most = MOST_ROWS // len(split_dates(study))
    makers = [_list_points] if study.samples is None else [_list_parts, _list_surfaces]
    tables = (join_dates(study, partial(make, most=most)) for make in makers)
    return [table for table in tables if table is not None]


def _find_arrays(study: Study) -> dict[str, NDArray]:
    # In-shadow masks are packed, and large: nothing here asks for them.
    return {n: np.asarray(array) for n, (_, array) in study.more.items() if n not in MASKS}


def _list_parts(study: Study, most: int) -> Table:
    arrays = _find_arrays(study)
    area = arrays["part_area"]
    which = _choose(area, most)
    never = _find_share_without(study, arrays["surface_part"][arrays["surface_of_sample"]], area)
    count = np.bincount(arrays["surface_part"], minlength=len(area))
    rows = [
        (
            str(arrays["part"][k]),
            round(float(area[k]), 1),
            int(count[k]),
            *_round_hours(arrays, "part", k),
            round(float(never[k]), 1),
        )
        for k in which
    ]
    columns = ("part", "area [m²]", "surfaces", *_HOURS, "never in the sun [%]")
    return Table("Part by part", columns, rows, _tell(len(area), len(which)), "part", which)


def _list_surfaces(study: Study, most: int) -> Table:
    arrays = _find_arrays(study)
    area = arrays["surface_area"]
    which = _choose(area, most)
    never = _find_share_without(study, arrays["surface_of_sample"], area)
    azimuth, tilt = np.round(arrays["surface_azimuth"], 1), np.round(arrays["surface_tilt"], 1)
    rows = [
        (
            str(arrays["part"][arrays["surface_part"][k]]),
            str(arrays["surface_kind"][k]),
            None if np.isnan(azimuth[k]) else float(azimuth[k]),
            float(tilt[k]),
            round(float(area[k]), 1),
            *_round_hours(arrays, "surface", k),
            round(float(never[k]), 1),
        )
        for k in which
    ]
    columns = (
        "part", "kind", "faces [°]", "tilt [°]", "area [m²]", *_HOURS, "never in the sun [%]",
    )  # fmt: skip
    note = "Faces: azimuth from true north. Tilt: 0 level, 90 upright. " + _tell(
        len(area), len(which)
    )
    return Table("Surface by surface", columns, rows, note, "surface", which)


_HOURS = ("mean sun [h]", "least [h]", "most [h]")


def _list_points(study: Study, most: int) -> Table:
    arrays = _find_arrays(study)
    zone = zoneinfo.ZoneInfo(study.site.zone)
    names = arrays.get("name", np.array([f"point {k + 1}" for k in range(len(study.sun_hours))]))
    which = list(range(min(len(names), most)))
    columns = ["point", "x [m]", "y [m]", "z [m]", "sun [h]", "shadow [h]"]
    extra: list[NDArray] = []
    for name, title in (
        ("first_sun", "first sun"),
        ("last_sun", "last sun"),
        ("sun_spells", "spells"),
        ("longest_sun_hours", "longest [h]"),
        ("hours_lost", "lost [h]"),
    ):
        if name in arrays:
            columns.append(title)
            extra.append(arrays[name])

    def tell(value: object) -> object:
        if isinstance(value, np.datetime64):
            return _read_clock(value, zone, len(study.period.days) > 1)
        if isinstance(value, np.integer):
            return int(value)
        number = float(value)  # type: ignore[arg-type]
        return None if np.isnan(number) else round(number, 2)

    rows = [
        (
            str(names[k]) or f"point {k + 1}",
            *(round(float(v), 2) for v in study.places.points[k]),
            round(float(study.sun_hours[k]), 2),
            round(float(study.shadow_hours[k]), 2),
            *(tell(values[k]) for values in extra),
        )
        for k in which
    ]
    note = "" if len(which) == len(names) else f"The first {len(which):,} of {len(names):,}."
    return Table("Point by point", columns, rows, note, "point", which)


def _read_clock(instant: np.datetime64, zone: zoneinfo.ZoneInfo, with_date: bool) -> str:
    if np.isnat(instant):
        return "none"
    utc = instant.astype("datetime64[s]").item().replace(tzinfo=zoneinfo.ZoneInfo("UTC"))
    return f"{utc.astimezone(zone):{'%Y-%m-%d ' if with_date else ''}%H:%M}"


def _round_hours(arrays: dict[str, NDArray], what: str, k: int) -> list[float]:
    keys = (f"{what}_{name}_sun_hours" for name in ("mean", "least", "most"))
    return [round(float(arrays[key][k]), 2) for key in keys]


def _find_share_without(
    study: Study, owner: NDArray[np.integer], area: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the share of each that never has sun [%]."""
    each = np.asarray(study.more["area"][1])
    dark = np.bincount(owner, each * (study.sun_hours <= NEVER), len(area))
    return 100 * dark / np.maximum(area, 1e-12)


def _choose(area: NDArray[np.float64], most: int) -> list[int]:
    """Return all rows, or the largest, in their order."""
    return np.sort(np.argsort(-area, kind="stable")[:most]).tolist()


def _tell(count: int, shown: int) -> str:
    where = "study.nc and the tables as CSV files have all."
    return f"The {shown:,} largest of {count:,}; {where}" if shown < count else ""
