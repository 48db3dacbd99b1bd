"""
Probable sun hours: a year of suns, times the probability that the sun shines.

BRE 209 judges rooms by them: of the probable sun hours of an open place in the year a living room
should have 25 %, and 5 % between 21 September and 21 March (Littlefair, King, Howlett, Ticleanu and
Longfield 2022, "Site layout planning for daylight and sunlight").
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights, make_period
from umbra.study.measures.measure import Asked, Measure, Quantity
from umbra.sun.clock import parse_duration

__all__ = ["ProbableSunHours", "ProbableSunShare", "WinterProbableSunShare"]

YEAR = 2001
"""Whose suns stand for every year's: within 0.1 degrees of them, without a leap day."""
STEP = "15min"
"""The longest step of the suns."""
_WINTER = ((9, 21), (3, 21))  # first and last day


class ProbableSunHours(Measure):
    """Hours of the year in which the sun probably reaches a receiver, and their shares."""

    name, unit, long_name = "probable_sun_hours", "h", "probable sun hours of the year"
    needs_site = True
    _quantities: ClassVar = (
        Quantity("probable_sun_hours", "h", "probable sun hours of the year"),
        Quantity(
            "probable_sun_share", "%", "probable sun hours, of an open place's in the year", 100.0
        ),
        Quantity(
            "winter_probable_sun_share", "%",
            "probable sun hours of 21 September to 21 March, of an open place's in the year",
        ),
    )  # fmt: skip
    includes: ClassVar[tuple[str, ...]] = ("probable_sun_share", "winter_probable_sun_share")
    takes = ("sunshine",)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The hours and both shares."""
        return self._quantities

    def describe(self, asked: Asked) -> dict[str, object]:
        """Return the probability of sunshine by month, and the open place's hours."""
        shares = asked.options.sunshine or (1.0,)
        text = ", ".join(f"{share:g}" for share in shares)
        return {
            "sunshine": text,
            "open_probable_sun_hours": float(asked.make_lights(self).weights.sum()),
        }

    def tell(self, options: Any) -> str:
        """Describe the probability of sunshine where none is given."""
        return "" if options.sunshine is not None else "probable sun: it shines whenever it is up"

    def make_lights(self, asked: Asked) -> Lights:
        """Return a year's suns, weighted by hours and probability: of summer, and of winter."""
        assert asked.site is not None
        every = min(asked.options.every, STEP, key=parse_duration)
        period = make_period(
            str(YEAR), "00:00", "24:00", every, asked.site, refraction=asked.options.refraction
        )
        suns = period.make_lights()
        month = np.array([day.month for day in period.days])
        shares = np.array(asked.options.sunshine or (1.0,) * 12)[month - 1]
        (first, last), day = _WINTER, [(day.month, day.day) for day in period.days]
        is_winter = np.array([number >= first or number <= last for number in day])
        which = period.day_of_step[suns.step]
        hours = suns.weights[:, 0] * shares[which]
        weights = np.stack([hours * ~is_winter[which], hours * is_winter[which]], 1)
        sunny = np.flatnonzero(hours > 0)
        lights = suns.pick(sunny)
        return replace(
            lights, weights=weights[sunny], names=("summer", "winter"), units=("h", "h"),
            starts=suns.starts[sunny], ends=suns.ends[sunny],
        )  # fmt: skip

    def derive(self, sums: NDArray, asked: Asked) -> Sequence[NDArray]:
        """Return the hours, and as shares of what an open level place has in the whole year."""
        open_hours = asked.make_lights(self).weights.sum()
        hours = sums.sum(0)
        values = {
            "probable_sun_hours": np.minimum(hours, open_hours),
            "probable_sun_share": np.minimum(hours * (100 / open_hours), 100.0),
            "winter_probable_sun_share": sums[1] * (100 / open_hours),
        }
        return [values[quantity.name] for quantity in self.quantities]


class ProbableSunShare(ProbableSunHours):
    """The share of the year alone."""

    name, unit, long_name = "probable_sun_share", "%", ProbableSunHours._quantities[1].long_name
    includes = ()

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The variable of its name."""
        return tuple(quantity for quantity in self._quantities if quantity.name == self.name)


class WinterProbableSunShare(ProbableSunShare):
    """The share of 21 September to 21 March alone."""

    name = "winter_probable_sun_share"
    long_name = ProbableSunHours._quantities[2].long_name
