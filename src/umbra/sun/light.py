"""The sun as a light: where it stands on a date, at a time of the site's clock."""

import datetime as dt

from umbra.errors import InputError
from umbra.scene import Light, directional_light
from umbra.sun.local_time import find_instant, parse_date
from umbra.sun.position import find_sun
from umbra.sun.site import Site, find_zone

__all__ = ["sun_light"]


def sun_light(site: Site, date: str | dt.date, time: str | dt.time) -> Light:
    """
    Make the light of the sun at a clock time.

    Parameters
    ----------
    site : Site
    date : str or datetime.date
        Local date, ``"2026-03-21"``.
    time : str or datetime.time
        Local clock time, ``"15:00"``.

    Returns
    -------
    light : Light
        A direction toward the apparent sun, in the model's axes.

    Raises
    ------
    InputError
        If the date or the time is not written so, the clock skips the time, or the sun is
        below the horizon then.

    Examples
    --------
    >>> light = umbra.sun_light(umbra.find_site(scene), "2026-03-21", "15:00")
    """
    day = parse_date(date)
    path = find_sun(site, [find_instant(day, time, find_zone(site.zone), "time")])
    if not path.is_up[0]:
        msg = (
            f"the sun is {-path.altitude[0]:.1f}° below the horizon on {day} at {time} "
            f"({site.zone}); choose another time"
        )
        raise InputError(msg, altitude=float(path.altitude[0]))
    return directional_light(path.direction[0])
