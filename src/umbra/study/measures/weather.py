"""Measures of a weather file: hours of bright sun, and irradiation by the sun, sky and ground."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import (
    Lights,
    WeatherSuns,
    find_directions,
    find_shape,
    spread_directions,
    sum_sky,
)
from umbra.study.measures.measure import Asked, Measure, Quantity

__all__ = [
    "Irradiation", "IrradiationBeam", "IrradiationGround", "IrradiationSky", "SunshineHours",
]  # fmt: skip

BRIGHT = 120.0
"""Direct normal irradiance from which the sun shines (WMO-No. 8, 2021, chapter 8) [W/m2]."""
_GROUND = 256
"""Directions below the horizon; free planes of any tilt get the ground's share to 0.5 %."""
_HOURS = ("09:00", "17:00")  # of a study by default
_DAY = 24 * 3_600_000_000  # [us]


class OfWeather(Measure):
    """Base of measures of a weather file."""

    needs_site = True
    takes: ClassVar[tuple[str, ...]] = ("weather",)

    def check(self, options: Any) -> None:
        """Check the weather file, and that hours of a day have dates."""
        if options.weather is None:
            msg = f"measure {self.name} needs weather='FILE' (EPW, TMY3 or PVGIS); give it"
            raise InputError(msg, option="weather")
        _ = options.weather_year
        if options.date is None and (options.start, options.end) != _HOURS:
            msg = (
                "start= and end= are of dates, and none is given; add date='2025' for every day of "
                "a year, or leave them out for the weather file's whole year"
            )
            raise InputError(msg, option="date")

    def describe(self, asked: Asked) -> dict[str, object]:
        """Return the weather file's name, sum and place."""
        weather = asked.options.weather_year
        return {
            "weather": f"{weather.name} sha256:{weather.sha256}",
            "weather_latitude": weather.latitude,
            "weather_longitude": weather.longitude,
        }

    def tell(self, options: Any) -> str:
        """Name the weather file, and the dates and hours that are added up."""
        when = "its whole year"
        if options.date is not None:
            days = [options.date] if isinstance(options.date, (str, dt.date)) else options.date
            when = f"{', '.join(map(str, days))}, {options.start} to {options.end}"
        return f"weather of {options.weather_year.name}: {when}"

    def find_suns(self, asked: Asked) -> WeatherSuns:
        """Return the suns of the dates, or of the file's whole year, with their weather."""
        assert asked.site is not None
        return asked.options.weather_year.find_suns(
            asked.site, asked.period, asked.options.refraction
        )

    def make_suns(
        self, suns: WeatherSuns, which: NDArray[np.bool_], weights: NDArray[np.float64], unit: str
    ) -> Lights:
        """Return some suns as lights with their times."""
        shining = np.flatnonzero(which & suns.sun.is_up)
        lights = Lights.of(suns.sun.direction[shining], weights[shining], (self.name,), (unit,))
        return replace(lights, starts=suns.starts[shining], ends=suns.ends[shining])


class SunshineHours(OfWeather):
    """Hours of bright sun, by the weather file, in which the sun reaches the receiver."""

    name, unit, long_name = "sunshine_hours", "h", "hours of bright sun"

    def make_lights(self, asked: Asked) -> Lights:
        """Return the suns of the hours in which it shines, weighted by hours."""
        suns = self.find_suns(asked)
        return self.make_suns(suns, suns.beam >= BRIGHT, suns.hours, "h")


class Irradiation(OfWeather):
    """
    Energy that a receiver's plane gets: of the sun, of the sky, and of the ground before it.

    The sun: direct normal irradiance times the cosine. The sky: the diffuse irradiance, spread over
    the sky hour by hour as Perez, Seals and Michalsky (1993) do. The ground: an even share of the
    global irradiance (``--albedo``) from below the horizon, where nothing stands before it.
    """

    name, unit, long_name = "irradiation", "kWh/m2", "irradiation"
    follows_normal = True
    takes: ClassVar[tuple[str, ...]] = ("weather", "albedo")
    includes: ClassVar[tuple[str, ...]] = (
        "irradiation_beam", "irradiation_sky", "irradiation_ground",
    )  # fmt: skip
    sources: ClassVar[tuple[str, ...]] = ("beam", "sky", "ground")

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The whole, and what each source adds."""
        whole = Quantity("irradiation", self.unit, "irradiation by sun, sky and ground")
        return whole, *(_OF[source] for source in self.sources)

    def check(self, options: Any) -> None:
        """Check the weather file, the directions and the albedo."""
        super().check(options)
        find_directions(options.sky_directions)
        if not 0 <= options.albedo <= 1:
            msg = f"albedo is a share of 0 to 1; got {options.albedo:g}"
            raise InputError(msg, option="albedo")

    def describe(self, asked: Asked) -> dict[str, object]:
        """Return the weather, the albedo and the directions."""
        facts = super().describe(asked)
        if "sky" in self.sources:
            facts["sky_directions"] = str(asked.options.sky_directions)
        if "ground" in self.sources:
            facts |= {"albedo": asked.options.albedo, "ground_directions": _GROUND}
        return facts

    def make_lights(self, asked: Asked) -> Lights:
        """Return the lights of its sources, each with a column of its own [kWh/m2]."""
        suns = self.find_suns(asked)
        make = {"beam": self._make_beam, "sky": self._make_sky, "ground": self._make_ground}
        lights = [make[source](suns, asked.options) for source in self.sources]
        weights = np.zeros((sum(map(len, lights)), len(lights)))
        first = 0
        for k, group in enumerate(lights):
            weights[first : first + len(group), k] = group.weights[:, 0]
            first += len(group)
        whole = Lights.of(
            np.concatenate([group.vectors for group in lights]), weights, self.sources,
            (self.unit,) * len(lights),
        )  # fmt: skip
        return replace(
            whole, starts=np.concatenate([group.starts for group in lights]),
            ends=np.concatenate([group.ends for group in lights]),
        )  # fmt: skip

    def _make_beam(self, suns: WeatherSuns, options: Any) -> Lights:
        return self.make_suns(suns, suns.beam > 0, suns.beam * suns.hours / 1000, self.unit)

    def _make_sky(self, suns: WeatherSuns, options: Any) -> Lights:
        directions, angles = find_directions(options.sky_directions)
        is_diffuse = suns.diffuse > 0
        toward = suns.sun.direction[is_diffuse].copy()
        toward[:, 2] = np.maximum(toward[:, 2], 0.0)  # twilight: the sun as on the horizon
        toward /= np.linalg.norm(toward, axis=1, keepdims=True)
        day = suns.starts[is_diffuse] // _DAY
        year = day.astype("datetime64[D]").astype("datetime64[Y]").astype("datetime64[D]")
        number = day - year.astype(np.int64) + 1
        shape = find_shape(
            np.arccos(toward[:, 2]), suns.beam[is_diffuse], suns.diffuse[is_diffuse], number
        )
        energy = (suns.diffuse * suns.hours)[is_diffuse] / 1000
        return Lights.of(directions, angles * sum_sky(directions, angles, toward, shape, energy))

    def _make_ground(self, suns: WeatherSuns, options: Any) -> Lights:
        energy = options.albedo * float((suns.overall * suns.hours).sum()) / 1000
        count = _GROUND if energy > 0 else 0
        weights = np.full(count, 2 / max(count, 1) * energy)  # 2 pi / n of radiance energy / pi
        return Lights.of(-spread_directions(count), weights)

    def derive(self, sums: NDArray, asked: Asked) -> Sequence[NDArray]:
        """Return the sums, the whole ahead where there are several sources."""
        return list(sums) if len(sums) == 1 else [sums.sum(0), *sums]


class _OneSource(Irradiation):
    """Base of what one source adds."""

    includes = ()

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The variable of its name."""
        return (Quantity(self.name, self.unit, self.long_name),)


class IrradiationBeam(_OneSource):
    """What the sun alone adds."""

    name, long_name, sources = "irradiation_beam", "irradiation by the sun", ("beam",)
    takes = ("weather",)


class IrradiationSky(_OneSource):
    """What the sky alone adds."""

    name, long_name, sources = "irradiation_sky", "irradiation by the sky", ("sky",)
    takes = ("weather",)


class IrradiationGround(_OneSource):
    """What the ground alone adds."""

    name, long_name, sources = "irradiation_ground", "irradiation by the ground", ("ground",)


_OF = {
    source: Quantity(quantity.name, quantity.unit, quantity.long_name)
    for source, quantity in
    (("beam", IrradiationBeam), ("sky", IrradiationSky), ("ground", IrradiationGround))
}  # fmt: skip
