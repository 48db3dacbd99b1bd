"""Tables of samples: parts and surfaces, or points."""

import zoneinfo
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study, split_dates
from umbra.study.accumulators.step_masks import MASKS
from umbra.writers.report.markup import Table
from umbra.writers.report.measure_tables import find_columns_of_points
from umbra.writers.report.tables import NEVER, join_dates

__all__ = ["MOST_ROWS", "list_receivers"]

MOST_ROWS = 2000
"""Most rows of a table in the page, all dates together; the largest areas are kept."""


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
    columns = {
        "part": arrays["part"].tolist(),
        "area [m²]": _round(area, 1),
        "surfaces": np.bincount(arrays["surface_part"], minlength=len(area)).tolist(),
    }
    owner = arrays["surface_part"][arrays["surface_of_sample"]]
    columns |= _find_hours(study, arrays, "part", owner)
    return _make_table("part", columns, area, most)


def _list_surfaces(study: Study, most: int) -> Table:
    arrays = _find_arrays(study)
    area, azimuth = arrays["surface_area"], _round(arrays["surface_azimuth"], 1)
    columns = {
        "part": arrays["part"][arrays["surface_part"]].tolist(),
        "kind": arrays["surface_kind"].tolist(),
        "faces [°]": [None if np.isnan(angle) else angle for angle in azimuth],
        "tilt [°]": _round(arrays["surface_tilt"], 1),
        "area [m²]": _round(area, 1),
    }
    columns |= _find_hours(study, arrays, "surface", arrays["surface_of_sample"])
    note = "Faces: azimuth from true north. Tilt: 0 level, 90 upright. "
    return _make_table("surface", columns, area, most, note)


def _find_hours(
    study: Study, arrays: dict[str, NDArray], what: str, owner: NDArray[np.integer]
) -> dict[str, list]:
    """Return the hours of sun of parts or surfaces, and the shares that never have sun."""
    names = {"mean": "mean sun [h]", "least": "least [h]", "most": "most [h]"}
    hours = {title: _round(arrays[f"{what}_{name}_sun_hours"], 2) for name, title in names.items()}
    area = arrays[f"{what}_area"]
    dark = np.bincount(owner, arrays["area"] * (study.sun_hours <= NEVER), len(area))
    never = 100 * dark / np.maximum(area, 1e-12)
    return hours | {"never in the sun [%]": _round(never, 1)}


def _make_table(
    what: str, columns: dict[str, list], area: NDArray[np.float64], most: int, note: str = ""
) -> Table:
    """Make the table of all parts or surfaces, or of the largest, in their order."""
    which = np.sort(np.argsort(-area, kind="stable")[:most]).tolist()
    rows = [tuple(values[k] for values in columns.values()) for k in which]
    if len(which) < len(area):
        note += f"The {len(which):,} largest of {len(area):,}; study.nc and the tables as CSV "
        note += "files have all."
    return Table(f"{what} by {what}".capitalize(), tuple(columns), rows, note, what, which)


def _list_points(study: Study, most: int) -> Table:
    arrays = _find_arrays(study)
    zone = zoneinfo.ZoneInfo(study.site.zone)
    spot, count = study.kind.spot, len(study.sun_hours)
    names = arrays.get("name", np.full(count, ""))
    which = list(range(min(count, most)))
    columns = [spot, "x [m]", "y [m]", "z [m]", "sun [h]", "shadow [h]"]
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
    measured = find_columns_of_points(study)
    columns += measured

    def tell(value: object) -> object:
        if isinstance(value, np.datetime64):
            return _read_clock(value, zone, len(study.period.days) > 1)
        if isinstance(value, np.integer):
            return int(value)
        number = float(value)  # type: ignore[arg-type]
        return None if np.isnan(number) else round(number, 2)

    rows = [
        (
            str(names[k]) or f"{spot} {k + 1}",
            *(round(float(v), 2) for v in study.places.points[k]),
            round(float(study.sun_hours[k]), 2),
            round(float(study.shadow_hours[k]), 2),
            *(tell(values[k]) for values in extra),
            *(None if np.isnan(values[k]) else float(values[k]) for values in measured.values()),
        )
        for k in which
    ]
    note = "" if len(which) == count else f"The first {len(which):,} of {count:,}."
    return Table(f"{spot} by {spot}".capitalize(), columns, rows, note, "point", which)


def _read_clock(instant: np.datetime64, zone: zoneinfo.ZoneInfo, with_date: bool) -> str:
    if np.isnat(instant):
        return "none"
    utc = instant.astype("datetime64[s]").item().replace(tzinfo=zoneinfo.ZoneInfo("UTC"))
    return f"{utc.astimezone(zone):{'%Y-%m-%d ' if with_date else ''}%H:%M}"


def _round(values: NDArray, digits: int) -> list[float]:
    return np.round(values.astype(np.float64), digits).tolist()
