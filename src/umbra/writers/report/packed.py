"""What both kinds of page carry: the steps' clock and sun, and numbers packed into text."""

import base64
import datetime as dt
import zlib
import zoneinfo

import numpy as np
from numpy.typing import NDArray

from umbra.study.period import Period
from umbra.study.timeline import Instants

__all__ = ["make_steps", "pack", "pack_differences", "pack_hours", "pack_instants"]

_MICROSECONDS = 1_000_000


def pack(data: bytes) -> str:
    """Compress bytes and write them as text."""
    return base64.b64encode(zlib.compress(data, 9)).decode()


def pack_differences(values: NDArray[np.integer]) -> str:
    """Pack whole numbers, each as its difference to the one before; they must fit in int32."""
    flat = np.asarray(values, np.int64).ravel()
    return pack(np.diff(flat, prepend=0).astype("<i4").tobytes())


def pack_hours(hours: NDArray[np.floating]) -> str:
    """Pack hours in float32, 0 where nothing receives."""
    return pack(np.nan_to_num(hours).astype("<f4").tobytes())


def pack_instants(
    instants: Instants, is_up: NDArray[np.bool_], kept: NDArray[np.integer] | None = None
) -> dict[str, object]:
    """
    Pack the masks of the steps with the sun up, and what canopies let through.

    Parameters
    ----------
    instants : Instants
    is_up : (n_steps,) bool
        Of the study's steps.
    kept : (k,) int, optional
        The receivers that are shown; all by default.
    """
    up = is_up[instants.which]

    def choose(bits: NDArray[np.uint8]) -> str:
        if kept is None:
            return _pack_masks(bits[up])
        return _pack_masks(np.packbits(np.unpackbits(bits[up], axis=1)[:, kept], axis=1))

    if instants.behind is None or instants.share is None:
        return {"bits": choose(instants.bits)}
    return {
        "bits": choose(instants.bits),
        "behind": choose(instants.behind),
        "share": instants.share.tolist(),
    }


def _pack_masks(bits: NDArray[np.uint8]) -> str:
    """Pack masks, each as what changes since the one before: shadows move slowly."""
    changes = bits.copy()
    changes[1:] ^= bits[:-1]
    return pack(changes.tobytes())


def make_steps(
    period: Period, which: NDArray[np.integer], last: NDArray[np.integer]
) -> dict[str, list]:
    """
    Give each shown step's times [s since 1970, UTC], clock, and sun.

    Parameters
    ----------
    period : Period
    which : (n,) int
        The steps that are shown.
    last : (n,) int
        The last step that each one stands for.
    """
    begins, ends = period.starts[which], period.ends[last]
    middles = period.instants.astype("datetime64[us]").astype(np.int64)[which]
    day = period.day_of_step
    zone = zoneinfo.ZoneInfo(period.site.zone)
    local = [
        dt.datetime.fromtimestamp(t, dt.UTC).astimezone(zone)
        for t in (middles / _MICROSECONDS).tolist()
    ]
    offsets = [when.utcoffset() or dt.timedelta() for when in local]
    names = [when.tzname() or "" for when in local]
    clock = [
        name if name.isalpha() else f"UTC{when.isoformat()[-6:]}"
        for name, when in zip(names, local, strict=True)
    ]
    return {
        "start": _seconds(begins),
        "end": _seconds(ends),
        "mid": _seconds(middles),
        "day": day[which].tolist(),
        "offset": [offset.total_seconds() for offset in offsets],
        "name": clock,
        "altitude": np.round(period.sun.altitude[which], 3).tolist(),
        "azimuth": np.round(period.sun.azimuth[which], 3).tolist(),
        "up": period.sun.is_up[which].astype(int).tolist(),
    }


def _seconds(microseconds: NDArray[np.int64]) -> list[float]:
    return [t // _MICROSECONDS if t % _MICROSECONDS == 0 else t / _MICROSECONDS
            for t in microseconds.tolist()]  # fmt: skip
