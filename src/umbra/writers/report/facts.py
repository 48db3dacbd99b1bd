"""What a study assumed, in words that a reader without umbra understands."""

import datetime as dt
import zoneinfo
from collections.abc import Sequence

import numpy as np

from umbra.study import PointStudy, Study
from umbra.study.canopy import Canopy
from umbra.writers.report.counted import find_counted
from umbra.writers.report.markup import Table
from umbra.writers.report.tables import join_dates

__all__ = ["find_facts", "find_sun_areas"]

_PENUMBRA = 0.0093  # the sun's disc of 0.53 degrees [rad]: a blur per length
_ACCURACY = (
    "at each {spot} and step's midpoint the answer is exact for these triangles and this "
    "sun, but for rounding (some 10⁻⁹ m at a shadow's edge). A first or last hour is known to half "
    "a step each way, and hours may be off by part of {step} min each time a shadow's edge passes. "
    "The sun's true disc blurs edges by 0.9 % of the distance to what casts them: {blur:.2g} m "
    "from {tall:.3g} m overhead, more where the sun is low. {left_out} are "
    "not counted."
)
_RECEIVERS = {
    "ground": "the level ground at z = {ground:.6g} m, also under buildings",
    "top": "whatever is topmost: roofs, terrain, and the ground at z = {ground:.6g} m",
}


def find_facts(
    study: Study | PointStudy, casters: Sequence[str] = (), notes: Sequence[str] = ()
) -> list[tuple[str, str]]:
    """
    List what the study assumed and how exact it is.

    Parameters
    ----------
    study : Study or PointStudy
    casters : sequence of str
        The patterns by which casters were chosen, as typed.
    notes : sequence of str
        What the reader of the files left out or could not tell.

    Returns
    -------
    facts : list of (str, str)
        A heading and what is to be said under it.
    """
    site, facts = study.site, study.facts
    north = "N" if site.latitude >= 0 else "S"
    east = "E" if site.longitude >= 0 else "W"
    every = study.period.steps
    names = list(dict.fromkeys(name for steps in every for name in steps.abbreviations()))
    offsets = list(dict.fromkeys(offset for steps in every for offset in steps.offsets()))
    canopy, scene = study.model.canopy, study.model.scene
    n_all, n_cast = sum(part.triangles for part in scene.parts), len(study.model.caster.faces)
    lengths = np.unique(np.round(study.period.hours * 60, 3))
    step = " or ".join(f"{length:g}" for length in lengths[::-1][:2])
    tall = float(np.ptp(study.model.soup.vertices[:, 2]))
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
            + f"{n_cast:,} of {n_all:,} triangles, as the file has them, "
            + ("opaque" if canopy is None else "opaque but for canopies"),
        ),
        *([] if canopy is None else [("Canopies", _tell_canopies(canopy))]),
        _tell_places(study),
        (
            "Steps",
            f"{len(study.period.hours):,} of {step} min, judged at their midpoints"
            + (
                f"; between them beginnings and ends are solved to {tolerance:g} s"
                if (tolerance := facts.get("exact_tolerance_seconds"))
                else ""
            ),
        ),
        (
            "Accuracy",
            _ACCURACY.format(
                step=step,
                blur=_PENUMBRA * tall,
                tall=tall,
                left_out="Reflected light, clouds and leaves"
                if canopy is None
                else "Reflected light and clouds",
                spot="point"
                if study.receivers == "points"
                else "sample"
                if study.receivers == "surfaces"
                else "cell's centre",
            ),
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


def find_sun_areas(study: Study | PointStudy) -> Table | None:
    """
    Tell how much of the open ground, or of all surfaces, gets at least so many hours of sun.

    Parameters
    ----------
    study : Study or PointStudy

    Returns
    -------
    table : Table, optional
        Of each date; None where the sun is not up for an hour.
    """
    return join_dates(study, _find_sun_areas)


def _find_sun_areas(study: Study | PointStudy) -> Table | None:
    """Tell it of one date, or of sums."""
    whole = int(study.up_hours + 1e-6)
    counted = find_counted(study)
    if whole < 1 or counted is None:
        return None
    sun, all_of_it = study.sun_hours, counted.whole
    step = max(1, -(-whole // 8))
    rows = []
    for hours in range(step, whole + 1, step):
        some = counted.add_up(sun >= hours - 1e-3)
        figure = round(some, 1) if counted.unit == "m²" else round(some)
        rows.append((f"{hours} h", figure, round(100 * some / all_of_it, 1)))
    if counted.unit == "points":
        note = f"Of {all_of_it:,.0f} points."
        return Table("Points in the sun", ("at least", "points", "share [%]"), rows, note)
    note = f"Of {all_of_it:,.0f} m² of {counted.what} here"
    note += "." if study.receivers == "surfaces" else "; areas follow the extent."
    return Table("Area in the sun", ("at least", "area [m²]", "share [%]"), rows, note)


def _tell_places(study: Study | PointStudy) -> tuple[str, str]:
    """Say how many receivers there are, and how far apart."""
    if isinstance(study, Study):
        grid = study.grid
        cell = f"{grid.dx:.4g} m" if grid.dx == grid.dy else f"{grid.dx:.4g} x {grid.dy:.4g} m"
        size = "" if study.receivers == "camera" else f" of {cell}"
        return "Cells", f"{len(study.x):,} x {len(study.y):,}{size}, judged at their centres"
    count = len(study.shadow_hours)
    if study.samples is None:
        free = int(np.isnan(study.places.normals).any(1).sum())
        words = f"{count:,}, {count - free:,} with a normal" if free else f"{count:,}, with normals"
        return "Points", words + ("; the others are turned to every sun" if free else "")
    return "Samples", (
        f"{count:,}, {study.samples.spacing:g} m apart in their planes, each standing for an equal "
        "share of its surface; a surface too small for one has one in its middle"
    )


def _tell_receivers(study: Study | PointStudy) -> str:
    if isinstance(study, PointStudy):
        if study.samples is None:
            return "the points that were given"
        surfaces, parts = len(study.samples.part), len(study.more["part"][1])
        return (
            f"{surfaces:,} surface{'s' if surfaces > 1 else ''} of {parts:,} "
            f"thing{'s' if parts > 1 else ''}: walls and roofs, on the side that their winding "
            "calls outward; what faces straight down never sees the sun and is left out"
        )
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


def _tell_canopies(canopy: Canopy) -> str:
    """Say what lets light through, and how much."""
    season, count = canopy.season, len(canopy.casting)
    words = f"{count:,} part{'s' if count > 1 else ''}: what is behind canopies and nothing else "
    words += f"gets {100 * season.with_leaves:.3g} % of the sun"
    if season.first is not None and season.last is not None:
        first, last = ("{:02}-{:02}".format(*day) for day in (season.first, season.last))
        words += f" from {first} to {last} and {100 * season.without:.3g} % on other dates"
    return words + (
        ", once, however many stand in its way; an hour there counts so much sun, and the rest of "
        "it shadow. Canopies receive nothing and are not drawn"
    )


def _list(numbers: object) -> str:
    return ", ".join(f"{float(v):g}" for v in np.asarray(numbers).ravel())


def _tell_days(study: Study | PointStudy) -> str:
    days = study.period.days
    if len(days) <= 12:
        return ", ".join(map(str, days))
    return f"{len(days)} days from {days[0]} to {days[-1]}"


def _tell_daylight_saving(study: Study | PointStudy) -> str:
    zone = zoneinfo.ZoneInfo(study.site.zone)

    stamps = np.concatenate([steps.stamps for steps in study.period.steps])
    states = {
        bool(dt.datetime.fromtimestamp(t, dt.UTC).astimezone(zone).dst())
        for t in stamps.astype("datetime64[s]").astype(np.int64).tolist()
    }
    if states == {True, False}:
        return "in force for a part of the period; times are those of the clock"
    return "in force: times are those of the clock" if states == {True} else "not in force"
