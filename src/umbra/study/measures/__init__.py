"""
Measures: what a study can be asked, each in one file.

    measure.py   what a measure is                  Measure, Quantity, Asked
    hours.py     hours of sun and shadow            sun_hours, shadow_hours
    sky.py       the sky before a receiver          sky_view_factor, sky_component, sky_blocked_by
    probable.py  probable sun of a year             probable_sun_hours, ..._share
    weather.py   a weather file's sun and sky       sunshine_hours, irradiation, irradiation_...

A package installed beside umbra adds one by an entry point of the group ``umbra.measures``.
"""

from collections.abc import Sequence

from umbra.errors import InputError
from umbra.registry import Registry
from umbra.study.measures.measure import Asked, Measure, Quantity, guard

__all__ = [
    "HOURS", "MEASURES", "Asked", "Measure", "Quantity", "find_measures", "guard",
]  # fmt: skip

HOURS = ("sun_hours", "shadow_hours")
"""Names of the measures that the study's own loop counts, with intervals, spells and groups."""


_PLACE = "umbra.study.measures"
MEASURES: Registry[Measure] = Registry(
    "measure",
    "measure",
    {
        "sun_hours": f"{_PLACE}.hours:SunHoursMeasure",
        "shadow_hours": f"{_PLACE}.hours:ShadowHours",
        "sky_view_factor": f"{_PLACE}.sky:SkyViewFactor",
        "sky_component": f"{_PLACE}.sky:SkyComponent",
        "sky_blocked_by": f"{_PLACE}.sky:SkyBlockedBy",
        "probable_sun_hours": f"{_PLACE}.probable:ProbableSunHours",
        "probable_sun_share": f"{_PLACE}.probable:ProbableSunShare",
        "winter_probable_sun_share": f"{_PLACE}.probable:WinterProbableSunShare",
        "sunshine_hours": f"{_PLACE}.weather:SunshineHours",
        "irradiation": f"{_PLACE}.weather:Irradiation",
        "irradiation_beam": f"{_PLACE}.weather:IrradiationBeam",
        "irradiation_sky": f"{_PLACE}.weather:IrradiationSky",
        "irradiation_ground": f"{_PLACE}.weather:IrradiationGround",
    },
    Measure,
    "Measure",
    ("name", "unit", "long_name"),
)
"""All measures by the name that ``measure=`` takes."""


def find_measures(names: Sequence[str]) -> list[Measure]:
    """
    Return measures by name, each once, without those that another one includes.

    Raises
    ------
    InputError
        If one is unknown or cannot be loaded, or two give a variable of one name.
    """
    found = [MEASURES.find(name) for name in dict.fromkeys(names)]
    included = {name for measure in found for name in measure.includes}
    found = [measure for measure in found if measure.name not in included]
    known: dict[str, str] = {}
    for measure in found:
        for quantity in measure.quantities:
            other = known.setdefault(quantity.name, measure.name)
            if other != measure.name:
                msg = (
                    f"measures '{other}' and '{measure.name}' both give '{quantity.name}'; ask for "
                    "one of them"
                )
                raise InputError(msg, option="measure")
    return found
