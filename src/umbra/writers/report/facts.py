"""Assumptions of a study, for readers who do not know umbra."""

from collections.abc import Sequence

import numpy as np

from umbra.casters import Canopy
from umbra.errors import show_count
from umbra.study import Study
from umbra.sun import name_days

__all__ = ["find_facts"]

_PENUMBRA = 0.0093  # the sun's disc of 0.53 degrees [rad]: a blur per length
_ACCURACY = (
    "at each {spot} and step's midpoint the answer is exact for these triangles and this "
    "sun, except for rounding (some 10⁻⁹ m at a shadow's edge). First and last sun are known to "
    "half a step, and hours may be off by part of {step} min each time a shadow's edge passes. "
    "The real sun is a disc and blurs shadow edges by 0.9 % of the distance to the caster: "
    "{blur:.2g} m from {tall:.3g} m overhead, more where the sun is low. {left_out} are "
    "not modelled."
)


def find_facts(
    study: Study, casters: Sequence[str] = (), notes: Sequence[str] = ()
) -> list[tuple[str, str]]:
    """
    List what the study assumed and how exact it is: headings with their texts.

    Casters are the patterns by which they were chosen, as typed; notes are the readers'.
    """
    site, facts = study.site, study.facts
    every = study.period.steps
    names = list(dict.fromkeys(name for steps in every for name in steps.abbreviations()))
    offsets = list(dict.fromkeys(offset for steps in every for offset in steps.offsets()))
    canopy, scene = study.model.canopy, study.model.scene
    n_all, n_cast = sum(part.triangles for part in scene.parts), len(study.model.caster.faces)
    own = scene.list_own()
    n_added = 0 if own is None else n_all - sum(scene.parts[k].triangles for k in own)
    lengths = np.unique(np.round(study.period.hours * 60, 3))
    step = " or ".join(f"{length:g}" for length in lengths[::-1][:2])
    tall = float(np.ptp(study.model.soup.vertices[:, 2]))
    is_ellipsoidal = scene.is_ellipsoidal and site.elevation == scene.elevation
    datum = "the ellipsoid (WGS 84)" if is_ellipsoidal else "sea level"
    rows = [
        (
            "Site",
            site.show(5) + (f", {site.elevation:.6g} m above {datum}" if site.elevation else ""),
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
            (
                f"a disc of {study.facts['sun_disc_deg']}° radius, by the share that is seen, "
                if "sun_disc_deg" in study.facts
                else "a point source at the centre of its disc, "
            )
            + "by NREL's Solar Position Algorithm (to 0.0003°), "
            + (
                "raised by refraction in air of 12 °C and 1010 hPa at sea level"
                if study.refraction == "standard"
                else "at its true position, without refraction"
            ),
        ),
        ("Receivers", study.kind.describe_receivers(study)),
        (
            "Casters",
            (f"the parts chosen by {' '.join(casters)}: " if casters else "all parts: ")
            + f"{n_cast:,} of {n_all:,} triangles, "
            + (f"of which the ground added has {n_added:,}, else " if n_added else "")
            + "as the file has them, "
            + ("opaque" if canopy is None else "opaque except for canopies"),
        ),
        *([] if canopy is None else [("Canopies", _tell_canopies(canopy))]),
        study.kind.describe_places(study),
        (
            "Steps",
            f"{len(study.period.hours):,} of {step} min, judged at their midpoints"
            + (
                f"; beginnings and ends of shadow are solved to {tolerance:g} s"
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
                spot=study.kind.spot,
            ),
        ),
        (
            "Coordinates",
            str(facts.get("crs") or "the model's own, in metres; the file names no CRS"),
        ),
        ("Files", str(facts["source"])),
        ("Command", f"{facts['command']} (umbra {facts['umbra_version']})"),
    ]
    if notes:
        rows.insert(-2, ("Notes on the files", "; ".join(notes)))
    return rows


def _tell_canopies(canopy: Canopy) -> str:
    """Describe the canopies and the share of light that they transmit."""
    season, count = canopy.season, len(canopy.casting)
    words = f"{show_count(count, 'part')}: a receiver that only canopies shade "
    words += f"gets {100 * season.with_leaves:.3g} % of the sun"
    if season.first is not None and season.last is not None:
        first, last = ("{:02}-{:02}".format(*day) for day in (season.first, season.last))
        words += f" from {first} to {last} and {100 * season.without:.3g} % on other dates"
    return words + (
        ", however many canopies stand in the way; that share of the hour counts as sun and the "
        "rest as shadow. Canopies are not receivers and are not drawn"
    )


def _tell_days(study: Study) -> str:
    days = study.period.days
    return name_days(days, 12)


def _tell_daylight_saving(study: Study) -> str:
    states = {bool(when.dst()) for steps in study.period.steps for when in steps.local()}
    if states == {True, False}:
        return "in force for a part of the period; times are clock times"
    return "in force: times are clock times" if states == {True} else "not in force"
