"""Clock times of a local date: those that a person asks for, and round ones."""

import datetime as dt
import itertools
import zoneinfo
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.sun.local_time import find_instant

__all__ = ["ROUND", "Stamps", "find_round_stamps", "find_stamps"]

ROUND = (1, 2, 5, 10, 15, 20, 30, 60, 120, 180, 240, 360, 720, 1440)
"""Spacings at which clock times are round [min]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Stamps:
    """
    Instants of a local date, and how its clock shows them.

    Parameters
    ----------
    stamps : (n,) datetime64[us]
        UTC, ascending.
    zone : str
        IANA name of the local clock.
    """

    stamps: NDArray[np.datetime64]
    zone: str

    def labels(self) -> list[str]:
        """
        Read the stamps off the local clock.

        Returns
        -------
        labels : list of str
            ``HH:MM``, or ``HH:MM:SS`` where seconds are needed; the end of the day
            is 24:00. Where the clock goes back within the period, each carries its
            abbreviation: ``02:30 CEST``, ``02:30 CET``.
        """
        local = self.local()
        spec = "minutes"
        if any(when.second or when.microsecond for when in local):
            spec = "microseconds" if any(when.microsecond for when in local) else "seconds"
        labels = [when.time().isoformat(spec) for when in local]
        if local[-1].date() > local[0].date():
            labels[-1] = dt.time().isoformat(spec).replace("00", "24", 1)
        if any(later <= label for label, later in itertools.pairwise(labels)):
            labels = [f"{label} {name}" for label, name in zip(labels, self.abbreviations())]
        return labels

    def abbreviations(self) -> list[str]:
        """
        Name the local time of each stamp.

        Returns
        -------
        names : list of str
            Such as ``CEST``; ``UTC+05:45`` where the zone has letters for none.
        """
        offsets = self.offsets()
        names = [when.tzname() or "" for when in self.local()]
        return [name if name.isalpha() else offset for name, offset in zip(names, offsets)]

    def offsets(self) -> list[str]:
        """
        Give what the local clock is ahead of UTC at each stamp.

        Returns
        -------
        offsets : list of str
            Such as ``UTC+02:00``.
        """
        return [f"UTC{when.isoformat()[len(_clock_text(when)) :]}" for when in self.local()]

    def local(self) -> list[dt.datetime]:
        """Give the stamps by the local clock."""
        zone = zoneinfo.ZoneInfo(self.zone)
        return [when.replace(tzinfo=dt.UTC).astimezone(zone) for when in self.stamps.tolist()]


def _clock_text(when: dt.datetime) -> str:
    return when.replace(tzinfo=None).isoformat()


def find_stamps(day: dt.date, times: Sequence[str], zone: str) -> Stamps:
    """
    Find the instants at which a date's clock shows some times.

    Parameters
    ----------
    day : datetime.date
        Local date.
    times : sequence of str
        ``09:00``, or several by commas, ``09:00,12:00,15:00``; in any order.
    zone : str
        IANA name.

    Raises
    ------
    InputError
        If one is no clock time, or the clock skips it or shows it twice.
    """
    words = [word for text in times for word in str(text).replace(",", " ").split()]
    clock = zoneinfo.ZoneInfo(zone)
    found = {find_instant(day, word, clock, "time of --at") for word in words}
    naive = [when.replace(tzinfo=None) for when in sorted(found)]
    return Stamps(stamps=np.array(naive, "datetime64[us]"), zone=zone)


def find_round_stamps(period: Stamps, minutes: int) -> Stamps:
    """
    Find the round clock times within a period, both ends included.

    Parameters
    ----------
    period : Stamps
        From its first to its last.
    minutes : int
        One of ``ROUND``: 30 for whole and half hours by the local clock.
    """
    zone = zoneinfo.ZoneInfo(period.zone)
    at, last = (when.replace(tzinfo=dt.UTC) for when in period.stamps[[0, -1]].tolist())
    found = []
    while at <= last:
        local = at.astimezone(zone)
        past = dt.timedelta(
            hours=local.hour, minutes=local.minute, seconds=local.second,
            microseconds=local.microsecond,
        ) % dt.timedelta(minutes=minutes)  # fmt: skip
        if not past:
            found.append(at.replace(tzinfo=None))
        # Looked at anew at each, as a clock may jump between.
        at += dt.timedelta(minutes=minutes) - past
    return Stamps(stamps=np.array(found, "datetime64[us]"), zone=period.zone)
