"""Sites: coordinates, time zone, and the model's azimuth of true north."""

import difflib
import math
import warnings
import zoneinfo
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from umbra.errors import InputError, check_type, show_value

if TYPE_CHECKING:
    from umbra.scene import Scene

__all__ = ["Site", "find_site", "find_zone", "tell_moved"]

# Names that the database holds and that are no civil time of a place: the copies
# with and without leap seconds, and aliases that depend on the machine.
_ALIKE = 0.6  # names that share more may be meant
_FAR = 1.0  # degrees between a given site and the file's that are worth a word
_NO_PLACE = ("posix/", "right/", "Factory", "localtime", "posixrules")


@dataclass(frozen=True)
class Site:
    """
    A place on earth, and the azimuth of true north in the model's plan.

    Parameters
    ----------
    latitude : float
        North is positive, -90 to 90 [degrees].
    longitude : float
        East is positive, -180 to 180 [degrees].
    zone : str, optional
        IANA name of the time zone, such as ``Europe/Vienna``. By default the zone
        at the coordinates (package tzfpy).
    elevation : float
        Above sea level, -500 to 20,000 [m]. Thins the air that bends sunlight.
    true_north : float
        Azimuth of true north in the model's plan, clockwise from +y [degrees].

    Raises
    ------
    InputError
        If a number is not finite or outside its range, or the zone is unknown.
    """

    latitude: float
    longitude: float
    # None is for the call only: once made, a site always has a zone.
    zone: str = None  # type: ignore[assignment]
    elevation: float = 0.0
    true_north: float = 0.0

    def __post_init__(self) -> None:
        """Check every number, and look up the zone if none was given."""
        _set_number(self, "latitude", -90, 90)
        _set_number(self, "longitude", -180, 180)
        _set_number(self, "elevation", -500, 20_000)
        _set_number(self, "true_north", -math.inf, math.inf)
        if self.zone is None:
            object.__setattr__(self, "zone", _zone_at(self.latitude, self.longitude))
        find_zone(self.zone)

    def show(self, digits: int = 3) -> str:
        """Return the coordinates for people: ``48.200° N, 16.370° E``."""
        north, east = "NS"[self.latitude < 0], "EW"[self.longitude < 0]
        return f"{abs(self.latitude):.{digits}f}° {north}, {abs(self.longitude):.{digits}f}° {east}"


def find_site(
    scene: "Scene",
    latitude: float | None = None,
    longitude: float | None = None,
    zone: str | None = None,
    true_north: float | None = None,
    *,
    tell: Callable[[str], object] | None = None,
) -> Site:
    """
    Find the site of a scene; arguments override its file.

    Parameters
    ----------
    scene : Scene
        Its ``latitude``, ``longitude`` and ``true_north`` are the defaults, and its
        ``elevation`` is taken.
    latitude, longitude : float, optional
        [degrees]
    zone : str, optional
        IANA name; by default the zone at the coordinates.
    true_north : float, optional
        Azimuth of true north in the model's plan, clockwise from +y [degrees];
        0 if the file does not say.
    tell : callable, optional
        Called with a line on a site far from the file's own; by default it is a warning.

    Returns
    -------
    site : Site

    Warns
    -----
    UserWarning
        If the site is far from the file's own.

    Raises
    ------
    InputError
        If ``scene`` is no `Scene`; if neither the caller nor the file gives a latitude and a
        longitude, or they are wrong.
    """
    if not all(hasattr(scene, name) for name in ("latitude", "longitude", "true_north")):
        from umbra.scene import Scene  # noqa: PLC0415 - a site alone needs no scene

        check_type("scene", scene, Scene)
    latitude = scene.latitude if latitude is None else latitude
    longitude = scene.longitude if longitude is None else longitude
    elevation = getattr(scene, "elevation", None)
    true_north = scene.true_north if true_north is None else true_north
    if latitude is None or longitude is None:
        missing = [
            word
            for word, value in (("latitude", latitude), ("longitude", longitude))
            if value is None
        ]
        reason = getattr(scene, "site_doubt", None)
        reason = reason or f"the file does not say its {' and '.join(missing)}"
        remedy = f"give {' and '.join(w + '=' for w in missing)} in degrees"
        msg = f"the site is not known: {reason}; {remedy}"
        raise InputError(msg, missing=missing)
    site = Site(
        latitude,
        longitude,
        zone,  # type: ignore[arg-type]
        elevation=0.0 if elevation is None else elevation,
        true_north=0.0 if true_north is None else true_north,
    )
    for told in tell_moved(scene, site):
        warnings.warn(told, stacklevel=2) if tell is None else tell(told)
    return site


def tell_moved(scene: "Scene", site: Site) -> list[str]:
    """Report a site far from the one that the file states, as of swapped coordinates; or none."""
    if scene.latitude is None or scene.longitude is None:
        return []
    a, b = math.radians(scene.latitude), math.radians(site.latitude)
    turn = math.radians(site.longitude - scene.longitude)
    cosine = math.sin(a) * math.sin(b) + math.cos(a) * math.cos(b) * math.cos(turn)
    apart = math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))
    if apart < _FAR:
        return []
    told = (
        f"the site {site.latitude:.4f}°, {site.longitude:.4f}°, as given, lies "
        f"{apart * 111.2:,.0f} km from {scene.latitude:.4f}°, {scene.longitude:.4f}°, where the "
        "file says the model is; leave latitude= and longitude= out if that is not meant"
    )
    return [told]


def find_zone(name: str) -> zoneinfo.ZoneInfo:
    """Find a time zone by its IANA name; an error names the nearest."""
    try:
        if isinstance(name, str) and not name.startswith(_NO_PLACE):
            return zoneinfo.ZoneInfo(name)
    except (zoneinfo.ZoneInfoNotFoundError, ValueError, OSError):
        pass  # a folder of the database, or a name that is no path, is an OSError or ValueError
    known = zoneinfo.available_timezones()
    if not known:
        msg = "this machine has no time zone database; install it with: pip install tzdata"
        raise InputError(msg)
    nearest = _nearest_zones(str(name), known)
    advice = f"did you mean {' or '.join(nearest)}?" if nearest else "give an IANA name"
    msg = f"there is no time zone {show_value(name)}; {advice} (names are like Europe/Vienna)"
    raise InputError(msg, zone=name, nearest=nearest)


def _nearest_zones(name: str, known: set[str]) -> list[str]:
    # People write a city, lower case, blanks: compare with the whole name and with its last word.
    wanted = name.strip().replace(" ", "_").casefold()
    scores = {}
    for zone in sorted(known):
        if zone.startswith(_NO_PLACE):
            continue
        words = {zone.casefold(), zone.casefold().rpartition("/")[2]}
        scores[zone] = max(difflib.SequenceMatcher(None, word, wanted).ratio() for word in words)
    best = sorted(scores, key=lambda zone: (-scores[zone], zone))[:3]
    return [zone for zone in best if scores[zone] > _ALIKE]


def _zone_at(latitude: float, longitude: float) -> str:
    # 0.1 s and only needed when nobody named the zone, so it is imported here.
    import tzfpy  # noqa: PLC0415

    name = tzfpy.get_tz(longitude, latitude)
    if not name:
        msg = f"no time zone is known at latitude {latitude:g}, longitude {longitude:g}; give zone="
        raise InputError(msg, latitude=latitude, longitude=longitude)
    return name


def _set_number(site: Site, field: str, low: float, high: float) -> None:
    given = getattr(site, field)
    try:
        value = float(given)
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if math.isfinite(value) and low <= value <= high:
        object.__setattr__(site, field, value)
        return
    shown = field.replace("_", " ")
    what = f"{show_value(given)} is not a finite number"
    if math.isfinite(value):
        what = f"{value:g} is outside {low:g} to {high:g}"
    msg = f"the {shown} {what}; give it in {'metres' if field == 'elevation' else 'degrees'}"
    if field == "latitude" and abs(value) <= 180:
        msg += " (or are latitude and longitude swapped?)"
    raise InputError(msg, field=field, value=given)
