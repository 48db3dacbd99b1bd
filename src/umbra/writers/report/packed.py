"""Data of both kinds of page: the steps' clock and sun, and masks."""

import datetime as dt

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Period
from umbra.study import Study
from umbra.study.timeline import Instants
from umbra.sun.clock import Stamps
from umbra.writers.packing import pack
from umbra.writers.pixels import NO_SUN, shade_ramp

__all__ = [
    "make_common_data",
    "tell_left_out",
    "tell_steps",
]

_MICROSECONDS = 1_000_000


def make_common_data(
    study: Study, instants: Instants, chosen: NDArray[np.integer] | None = None
) -> dict[str, object]:
    """Gather the script's data on any study, of the receivers ``chosen`` if not of all."""
    return {
        "up_hours": study.up_hours,
        "days": [day.isoformat() for day in study.period.days],
        "steps": _make_steps(study.period, instants.which, instants.last),
        **_pack_instants(instants, study.sun.is_up, chosen),
        "ramp": np.round(shade_ramp(128) * 255).astype(int).tolist(),
        "no_sun": np.rint(np.array(NO_SUN) * 255).astype(int).tolist(),
    }


def _pack_instants(
    instants: Instants, is_up: NDArray[np.bool_], chosen: NDArray[np.integer] | None = None
) -> dict[str, object]:
    """Pack the masks of the steps with the sun up, and the light that canopies transmit."""
    up = is_up[instants.which]

    def choose(bits: NDArray[np.uint8]) -> str:
        if chosen is None:
            return _pack_masks(bits[up])
        return _pack_masks(np.packbits(np.unpackbits(bits[up], axis=1)[:, chosen], axis=1))

    if instants.behind is None or instants.share is None:
        return {"bits": choose(instants.bits)}
    return {
        "bits": choose(instants.bits),
        "behind": choose(instants.behind),
        "share": instants.share.tolist(),
    }


def _pack_masks(bits: NDArray[np.uint8]) -> str:
    """Pack masks, each as the changes since the one before: shadows move slowly."""
    changes = bits.copy()
    changes[1:] ^= bits[:-1]
    return pack(changes.tobytes())


def _make_steps(
    period: Period, which: NDArray[np.integer], last: NDArray[np.integer]
) -> dict[str, list]:
    """Return the times of each shown step [s since 1970, UTC], clock, and sun."""
    begins, ends = period.starts[which], period.ends[last]
    middles = period.instants.astype("datetime64[us]").astype(np.int64)[which]
    clock = Stamps(stamps=middles.view("datetime64[us]"), zone=period.site.zone)
    offsets = [when.utcoffset() or dt.timedelta() for when in clock.local()]
    return {
        "start": _seconds(begins),
        "end": _seconds(ends),
        "mid": _seconds(middles),
        "day": period.day_of_step[which].tolist(),
        "offset": [offset.total_seconds() for offset in offsets],
        "name": clock.abbreviations(),
        "altitude": np.round(period.sun.altitude[which], 3).tolist(),
        "azimuth": np.round(period.sun.azimuth[which], 3).tolist(),
        "up": period.sun.is_up[which].astype(int).tolist(),
    }


def _seconds(microseconds: NDArray[np.int64]) -> list[float]:
    return [t // _MICROSECONDS if t % _MICROSECONDS == 0 else t / _MICROSECONDS
            for t in microseconds.tolist()]  # fmt: skip


def tell_left_out(study: Study, instants: Instants, own_hours: bool) -> str:
    """Name the dates that the page leaves out, and how to see them; nothing if it has all."""
    days, every = study.period.days, instants.strides[0]
    if every == 1:
        return ""
    shown = days[::every]
    all_of_it = "Tables and figures above are of all dates; "
    if own_hours:
        all_of_it = "Tables, figures and hours in the picture are of all dates; "
    return (
        f"The picture moves through {len(shown):,} of the study's {len(days):,} dates, one in "
        f"{every} from {shown[0]} to {shown[-1]}: all would not fit into a page. {all_of_it}"
        "times, spells and lines at a place are of those shown. For another date run the "
        "study of that date, with a report."
    )


def tell_steps(study: Study, instants: Instants, own_hours: bool) -> str:
    """Name the instants that are shown, as the end of a sentence about the receivers."""
    _, steps = instants.strides
    words = ""
    if steps > 1:
        words += f". Of a day's steps one in {steps} is judged for all"
    if own_hours:
        is_one = len(study.period.days) == 1
        words += f". {'Hours' if is_one else 'Sums of all dates'} are the study's own"
        if "exact_tolerance_seconds" in study.facts:
            words += f", solved to {study.facts['exact_tolerance_seconds']:g} s"
    if instants.behind is not None:
        words += (
            ". What only canopies shade counts its share of sun; spells, first and last "
            "are of sun that nothing weakens"
        )
    return words + ". First, last and longest sun are rounded to steps."
