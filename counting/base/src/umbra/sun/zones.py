"""Time zones by their IANA names, and the names that may be meant by others."""

import datetime as dt
import difflib
import re
import zoneinfo

from umbra.errors import InputError, show_value

__all__ = ["find_local_zone", "find_zone"]

# Names that the database holds and that are no civil time of a place: the copies
# with and without leap seconds, and aliases that depend on the machine.
_NO_PLACE = ("posix/", "right/", "Factory", "localtime", "posixrules")
_ALIKE = 0.6  # names that share more may be meant
_OFFSET = re.compile(r"(?:UTC|GMT)?\s*[+-]\d{1,2}(?::?\d{2})?", re.IGNORECASE)
_LARGE = (
    "Europe/London", "Europe/Dublin", "Europe/Lisbon", "Europe/Berlin", "Europe/Athens",
    "Europe/Moscow", "Asia/Jerusalem", "Asia/Karachi", "Asia/Kolkata", "Asia/Jakarta",
    "Asia/Shanghai", "Asia/Hong_Kong", "Asia/Manila", "Asia/Seoul", "Asia/Tokyo",
    "Australia/Perth", "Australia/Adelaide", "Australia/Sydney", "Pacific/Auckland",
    "Africa/Lagos", "Africa/Johannesburg", "Africa/Nairobi", "America/St_Johns",
    "America/Halifax", "America/New_York", "America/Chicago", "America/Denver",
    "America/Los_Angeles", "America/Anchorage", "Pacific/Honolulu",
)  # fmt: skip
"""A large city's zone for each abbreviation that clocks show, such as BST."""


def find_zone(name: str, place: tuple[float, float] | None = None) -> zoneinfo.ZoneInfo:
    """
    Find a time zone.

    Parameters
    ----------
    name : str
        IANA name.
    place : (float, float), optional
        Latitude and longitude of the site [degrees], whose zone an error names.

    Raises
    ------
    InputError
        If there is no such zone; ``nearest`` are those that may be meant.
    """
    try:
        if isinstance(name, str) and not name.startswith(_NO_PLACE):
            return zoneinfo.ZoneInfo(name)
    except (zoneinfo.ZoneInfoNotFoundError, ValueError, OSError):
        pass  # a folder of the database, or a name that is no path, is an OSError or ValueError
    known = zoneinfo.available_timezones()
    if not known:
        msg = "this machine has no time zone database; install it with: pip install tzdata"
        raise InputError(msg)
    nearest = _find_meant(str(name).strip(), known, place)
    if _OFFSET.fullmatch(str(name).strip()):
        # Etc/GMT+1 is an hour behind Greenwich, and no Etc zone has summer time.
        what = " (a difference from UTC is no zone: clocks change in summer)"
    else:
        what = " (names are like Europe/Vienna)"
    advice = f"did you mean {' or '.join(nearest)}?" if nearest else "give an IANA name"
    msg = f"there is no time zone {show_value(name)}; {advice}{what}"
    raise InputError(msg, zone=name, nearest=nearest)


def find_local_zone(latitude: float, longitude: float) -> str:
    """Return the name of the zone at a place [degrees]; at sea ``Etc/GMT+1`` and the like."""
    # 0.1 s and only needed when nobody named the zone, so it is imported here.
    import tzfpy  # noqa: PLC0415

    name = tzfpy.get_tz(longitude, latitude)
    if not name:
        msg = f"no time zone is known at latitude {latitude:g}, longitude {longitude:g}; give zone="
        raise InputError(msg, option="zone", latitude=latitude, longitude=longitude)
    return name


def _find_meant(name: str, known: set[str], place: tuple[float, float] | None) -> list[str]:
    """Return the zones that may be meant: by letters, or by what the clocks there show."""
    here = None if place is None else find_local_zone(*place)
    if here is not None and (_OFFSET.fullmatch(name) or name.upper() in _show_clock(here)):
        return [here]
    if _OFFSET.fullmatch(name):
        return []
    shown = [zone for zone in _LARGE if zone in known and name.upper() in _show_clock(zone)]
    return shown[:3] or _find_alike(name, known)


def _show_clock(zone: str) -> set[str]:
    """Return the abbreviations that a zone's clocks show, in winter and in summer."""
    clock = zoneinfo.ZoneInfo(zone)
    return {str(dt.datetime(2026, month, 1, tzinfo=clock).tzname()) for month in (1, 7)}


def _find_alike(name: str, known: set[str]) -> list[str]:
    # People write a city, lower case, blanks: compare with the whole name and with its last word.
    wanted = name.replace(" ", "_").casefold()
    scores = {}
    for zone in sorted(known):
        if "/" not in zone or zone.startswith((*_NO_PLACE, "Etc/")):
            continue
        words = {zone.casefold(), zone.casefold().rpartition("/")[2]}
        scores[zone] = max(difflib.SequenceMatcher(None, word, wanted).ratio() for word in words)
    best = sorted(scores, key=lambda zone: (-scores[zone], zone))[:3]
    return [zone for zone in best if scores[zone] > _ALIKE]
