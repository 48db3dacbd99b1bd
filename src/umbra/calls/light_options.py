"""Options of a picture's lights: each with its type, default, unit, help, flag and heading."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from umbra.errors import InputError
from umbra.option_fields import Options, check_types, option, record
from umbra.sun.day_times import TIMES_OF_DAY

if TYPE_CHECKING:
    from umbra.scene import Light
    from umbra.sun import Site

__all__ = ["LightOptions"]

ASSUMED = "afternoon"
"""Time of day of a sun that has a date alone."""

_lights = partial(option, heading="Lights")


@record
class LightOptions(Options):
    """
    The lights of a command, checked; Python passes records or vectors to ``umbra.render``.

    Raises
    ------
    InputError
        If a light is wrong, or the sun's date or time is missing.
    """

    lights: Sequence[Sequence[float]] = _lights(
        "numbers",
        "A light; W=1 is a point (default), W=0 a direction toward the light.",
        default=(), flag="--light", count=(3, 4), is_repeated=True, unit="m", metavar="X,Y,Z[,W]",
    )  # fmt: skip
    spots: Sequence[Sequence[float]] = _lights(
        "numbers", "A spot light: its position, target and half angle.",
        default=(), flag="--spot", count=7, is_repeated=True, metavar="X,Y,Z,TX,TY,TZ,DEG",
    )  # fmt: skip
    date: str | None = _lights(
        "text",
        "Add the sun on this local date, YYYY-MM-DD, at the time at=, else in the afternoon.",
        metavar="DATE",
    )
    at: str | None = _lights(
        "text", "Local time of the sun; or sunrise+1h, sunset-90min, altitude:20.", metavar="HH:MM"
    )
    time_of_day: str | None = _lights(
        "choice", "The sun in place of at=: half-way from sunrise to noon, at noon by the sun, "
        "half-way to sunset, or a sixth of that time before it; date= is 21 March by default.",
        choices=tuple(TIMES_OF_DAY),
    )  # fmt: skip
    horizon: Any = _lights("table", "Refuse a sun behind the land of a file.", metavar="FILE")

    def __post_init__(self) -> None:
        check_types(self)
        self._make_given()
        if self.time_of_day is not None:
            if self.at is not None:
                msg = "time_of_day= and at= both say when; leave one of them out"
                raise InputError(msg, option="time_of_day")
        elif self.at is not None and self.date is None:
            msg = "the sun's light at a time, at=, needs date=, too (date='2026-03-21')"
            raise InputError(msg, option="date")
        if self.date is not None:
            from umbra.sun.local_time import parse_date  # noqa: PLC0415

            parse_date(self.date)

    @property
    def has_sun(self) -> bool:
        """Whether the sun is one of the lights."""
        return self.date is not None or self.time_of_day is not None

    @property
    def assumes_time(self) -> bool:
        """Whether a date has no time: then it is ``ASSUMED``."""
        return self.date is not None and self.at is None and self.time_of_day is None

    @property
    def count(self) -> int:
        """Number of lights."""
        return len(self.lights) + len(self.spots) + self.has_sun

    def settle(self, find_site: Callable[[], Site]) -> LightOptions:
        """Return the same with the sun's date and clock time; the site is found only for it."""
        if not self.has_sun:
            return self
        from umbra.sun.day_times import show_on_clock  # noqa: PLC0415
        from umbra.sun.local_time import parse_date  # noqa: PLC0415

        date = self.date or f"{dt.date.today().year}-03-21"
        name = "at" if self.time_of_day is None else "time_of_day"
        when = ASSUMED if self.assumes_time else str(getattr(self, name))
        try:
            at = show_on_clock(find_site(), parse_date(date), when)
        except InputError as error:
            raise InputError(str(error), option=name) from error
        return replace(self, date=date, at=at, time_of_day=None)

    def tell_assumed(self) -> str:
        """Tell the clock time that was assumed, of settled options."""
        return f"the sun is that of the {ASSUMED}, {self.at}; at= sets another time"

    def make(self, find_site: Callable[[], Site]) -> list[Light]:
        """Make the lights; the site is found only if the sun is one of them."""
        from umbra.sun import sun_light  # noqa: PLC0415

        made = self._make_given()
        if self.date is not None and self.at is not None:
            made.append(sun_light(find_site(), self.date, self.at))
        return made

    def tell_sun(self, site: Site) -> str:
        """Describe the sun's date, time and place."""
        from umbra.sun import name_date  # noqa: PLC0415
        from umbra.sun.clock import find_stamps  # noqa: PLC0415
        from umbra.sun.local_time import parse_date  # noqa: PLC0415

        stamp = find_stamps(parse_date(str(self.date)), [str(self.at)], site.zone)
        when = f"{name_date(parse_date(str(self.date)))}, {self.at}"
        return f"{when} {'/'.join(stamp.abbreviations())} · {site.show()}"

    def _make_given(self) -> list[Light]:
        from umbra.scene.lights import make_lights, spot_light  # noqa: PLC0415

        made = [_name_slips("lights", make_lights, v)[0] for v in self.lights]
        return made + [
            _name_slips("spots", lambda v: spot_light(v[:3], v[3:6], v[6]), v) for v in self.spots
        ]


def _name_slips(name: str, make: Callable[[Sequence[float]], Any], values: Sequence[float]) -> Any:
    """Call ``make`` on an option's values; name the option and value in errors."""
    try:
        return make(values)
    except InputError as error:
        if error.option is not None:
            raise
        msg = f"{name}=({', '.join(f'{value:g}' for value in values)}): {error}"
        raise InputError(msg, option=name) from error
