"""What a study assumed, in words that a reader without umbra understands."""

import datetime as dt
import zoneinfo
from collections.abc import Sequence

import numpy as np

from umbra.study import Study
from umbra.writers.report.table import Table

__all__ = ["find_facts", "find_sun_areas"]

_PENUMBRA = 0.0093  # the sun's disc of 0.53 degrees [rad]: a blur per length
_ACCURACY = (
    "at each cell's centre and step's midpoint the answer is exact for these triangles and this "
    "sun, but for rounding (some 10⁻⁹ m at a shadow's edge). A first or last hour is known to half "
    "a step each way, and hours may be off by part of {step} min each time a shadow's edge passes. "
    "The sun's true disc blurs edges by 0.9 % of the distance to what casts them: {blur:.2g} m "
    "from {tall:.3g} m overhead, more where the sun is low. Reflected light, clouds and leaves are "
    "not counted."
)
_RECEIVERS = {
    "ground": "the level ground at z = {ground:.6g} m, also under buildings",
    "top": "whatever is topmost: roofs, terrain, and the ground at z = {ground:.6g} m",
}


def find_facts(
    study: Study, casters: Sequence[str] = (), notes: Sequence[str] = ()
) -> list[tuple[str, str]]:
    """
    List what the study assumed and how exact it is.

    Parameters
    ----------
    study : Study
    casters : sequence of str
        The patterns by which casters were chosen, as typed.
    notes : sequence of str
        What the reader of the files left out or could not tell.

    Returns
    -------
    facts : list of (str, str)
        A heading and what is to be said under it.
    """
    site, facts, grid = study.site, study.facts, study.grid
    north = "N" if site.latitude >= 0 else "S"
    east = "E" if site.longitude >= 0 else "W"
    every = study.period.steps
    names = list(dict.fromkeys(name for steps in every for name in steps.abbreviations()))
    offsets = list(dict.fromkeys(offset for steps in every for offset in steps.offsets()))
    n_soup, n_cast = len(study.model.soup.faces), len(study.model.caster.faces)
    lengths = np.unique(np.round(study.period.hours * 60, 3))
    step = " or ".join(f"{length:g}" for length in lengths[::-1][:2])
    z = study.model.soup.vertices[:, 2]
    tall = float(np.ptp(z))
    cell = f"{grid.dx:.4g} m" if grid.dx == grid.dy else f"{grid.dx:.4g} x {grid.dy:.4g} m"
    size = "" if study.receivers == "camera" else f" of {cell}"
    rows = [
        (
            "Site",
            f"{abs(site.latitude):.5f}° {north}, {abs(site.longitude):.5f}° {east}"
            + (f", {site.elevation:.6g} m above sea level" if site.elevation else ""),
        ),
        ("Days", _tell_days(study)),
        ("Time zone", f"{site.zone}: {', '.join(names)} ({', '.join(offsets)})"),
        ("Daylight saving", _tell_daylight_saving(study)),
        (
            "True north",
            "along the plan's y axis"
            if site.true_north == 0
            else f"{abs(site.true_north):.3g}° "
            f"{'clockwise' if site.true_north > 0 else 'counter-clockwise'} from the plan's y axis",
        ),
        (
            "The sun",
            "its centre, a point, by NREL's Solar Position Algorithm (0.0003°); "
            + (
                "raised by the refraction of air of 12 °C and 1010 hPa at sea level"
                if study.refraction == "standard"
                else "without refraction, where it is and not where it is seen"
            ),
        ),
        ("What receives", _tell_receivers(study)),
        (
            "What casts",
            (f"the parts chosen by {' '.join(casters)}: " if casters else "every part: ")
            + f"{n_cast:,} of {n_soup:,} triangles, as the file has them, opaque",
        ),
        (
            "Cells",
            f"{len(study.x):,} x {len(study.y):,}{size}, judged at their centres",
        ),
        (
            "Steps",
            f"{len(study.period.hours):,} of {step} min, judged at their midpoints",
        ),
        (
            "Accuracy",
            _ACCURACY.format(step=step, blur=_PENUMBRA * tall, tall=tall),
        ),
        (
            "Coordinates",
            str(facts.get("crs") or "the model's own, in metres; the file names no CRS"),
        ),
        ("Files", str(facts["source"])),
        ("Command", str(facts["command"])),
    ]
    if notes:
        rows.insert(-2, ("Notes on the files", "; ".join(notes)))
    return rows


def find_sun_areas(study: Study) -> Table | None:
    """
    Tell how much of the open ground, or of all surfaces, gets at least so many hours of sun.

    Parameters
    ----------
    study : Study

    Returns
    -------
    table : Table, optional
        None where the sun is not up for an hour.
    """
    whole = int(study.up_hours + 1e-6)
    if whole < 1:
        return None
    counted = np.isfinite(study.shadow_hours)
    if study.receivers == "camera":
        return None  # pixels of a perspective have no area
    if study.receivers == "ground":
        counted &= study.heights <= study.ground + 1e-6
    sun = study.sun_hours[counted]
    if not sun.size:
        return None
    area = study.grid.dx * study.grid.dy
    step = max(1, -(-whole // 8))
    rows = []
    for hours in range(step, whole + 1, step):
        n = int(np.count_nonzero(sun >= hours - 1e-3))
        rows.append((f"{hours} h", round(n * area, 1), round(100 * n / sun.size, 1)))
    what = {
        "top": "all that is seen from above",
        "ground": "open ground, not under buildings",
    }.get(study.receivers, "all that is seen, as it is seen")
    return Table(
        "Area in the sun",
        ("at least", "area [m²]", "share [%]"),
        rows,
        f"Of {sun.size * area:,.0f} m² of {what} here; areas follow the extent.",
    )


def _tell_receivers(study: Study) -> str:
    if study.receivers in _RECEIVERS:
        return _RECEIVERS[study.receivers].format(ground=study.ground)
    facts = study.facts
    if study.receivers == "camera":
        return (
            f"what is seen from {_list(facts['eye'])} toward {_list(facts['target'])}, "
            f"{facts['fov_deg']:g}° high"
        )
    words = f"what is seen from azimuth {facts['view_azimuth_deg']:g}°, clockwise from true north"
    tilt = facts.get("view_tilt_deg")
    return f"{words}, looking down {tilt:g}°" if tilt else f"{words}, level and orthographic"


def _list(numbers: object) -> str:
    return ", ".join(f"{float(v):g}" for v in np.asarray(numbers).ravel())


def _tell_days(study: Study) -> str:
    days = study.period.days
    if len(days) <= 12:
        return ", ".join(map(str, days))
    return f"{len(days)} days from {days[0]} to {days[-1]}"


def _tell_daylight_saving(study: Study) -> str:
    zone = zoneinfo.ZoneInfo(study.site.zone)

    stamps = np.concatenate([steps.stamps for steps in study.period.steps])
    states = {
        bool(dt.datetime.fromtimestamp(t, dt.UTC).astimezone(zone).dst())
        for t in stamps.astype("datetime64[s]").astype(np.int64).tolist()
    }
    if states == {True, False}:
        return "in force for a part of the period; times are those of the clock"
    return "in force: times are those of the clock" if states == {True} else "not in force"
