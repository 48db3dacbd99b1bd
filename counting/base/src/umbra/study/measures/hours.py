"""Hours of sun and of shadow over the dates of a study."""

from umbra.lights import Lights
from umbra.study.measures.measure import Asked, Measure

__all__ = ["ShadowHours", "SunHoursMeasure"]


class SunHoursMeasure(Measure):
    """Hours in the sun; counted by the study's loop, which also keeps intervals and dates."""

    name, unit, long_name = "sun_hours", "h", "hours in sun"
    needs_sun = True

    def make_lights(self, asked: Asked) -> Lights:
        """Return the suns at the midpoints of the steps, weighted by hours."""
        return asked.period.make_lights()


class ShadowHours(SunHoursMeasure):
    """Hours in shadow, of the time with the sun up."""

    name, long_name = "shadow_hours", "hours in shadow"
