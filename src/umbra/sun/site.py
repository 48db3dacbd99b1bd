"""Sites: coordinates, time zone, and the model's azimuth of true north."""

import datetime as dt
import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from umbra.errors import InputError, check_type, show_value
from umbra.sun.zones import find_local_zone, find_zone

if TYPE_CHECKING:
    from umbra.scene import Scene

__all__ = ["Site", "find_site", "tell_moved"]

_FAR = 1.0  # degrees between a given site and the file's that are worth a word
_FAR_NOON = 2.15  # from a zone's clock, by more than anywhere that it may be swapped with [h]


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
            object.__setattr__(self, "zone", find_local_zone(self.latitude, self.longitude))
        find_zone(self.zone, (self.latitude, self.longitude))

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
    for note in tell_moved(scene, site):
        warnings.warn(note, stacklevel=2) if tell is None else tell(note)
    return site


def tell_moved(scene: "Scene", site: Site) -> list[str]:
    """Report a site that cannot be meant: far from the file's own, or swapped; or none."""
    here, swapped = (site.latitude, site.longitude), (site.longitude, site.latitude)
    shown = f"the site {site.latitude:.4f}°, {site.longitude:.4f}°, as given,"
    remedy = f"swap them: latitude={site.longitude:g} longitude={site.latitude:g}"
    if scene.latitude is None or scene.longitude is None:
        if _looks_swapped(site):
            return [f"{shown} may have latitude and longitude swapped; {remedy}"]
        return []
    file = (scene.latitude, scene.longitude)
    apart = _find_angle(file, here)
    if apart < _FAR:
        return []
    fault = (
        f"{shown} lies {apart * 111.2:,.0f} km from {file[0]:.4f}°, {file[1]:.4f}°, where the "
        "file says the model is; "
    )
    if _find_angle(file, swapped) < _FAR:
        return [fault + remedy]
    return [fault + "leave latitude= and longitude= out if that is not meant"]


def _looks_swapped(site: Site) -> bool:
    """Return whether a site lies at sea or outside its zone, and would not if it were swapped."""
    if abs(site.longitude) > 90 or _fits_clock(site):
        return False
    try:
        here = find_local_zone(site.latitude, site.longitude)
        swapped = find_local_zone(site.longitude, site.latitude)
    except InputError:
        return False  # the caller named a zone where none is known
    if here.startswith("Etc/"):
        return not swapped.startswith("Etc/")
    return site.zone == swapped != here


def _fits_clock(site: Site) -> bool:
    """
    Return whether the noon of a named zone is that of the site, and not of the swapped one.

    No zone that holds a swapped site is so: in Western Sahara, the nearest to it, noon is 2.14 h
    from the clock's. Loading the borders of zones takes 0.1 s, which this saves.
    """
    if site.zone.startswith("Etc/"):  # as found at sea
        return False
    clock = find_zone(site.zone)
    offsets = [dt.datetime(2026, month, 1, tzinfo=clock).utcoffset() for month in (1, 7)]
    ahead = min(offset.total_seconds() / 3600 for offset in offsets if offset is not None)
    return abs(site.longitude / 15 - ahead) < 1 and abs(site.latitude / 15 - ahead) > _FAR_NOON


def _find_angle(start: tuple[float, float], other: tuple[float, float]) -> float:
    """Return the angle between two places on earth [degrees]."""
    a, b = math.radians(start[0]), math.radians(other[0])
    turn = math.radians(other[1] - start[1])
    cosine = math.sin(a) * math.sin(b) + math.cos(a) * math.cos(b) * math.cos(turn)
    return math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))


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
