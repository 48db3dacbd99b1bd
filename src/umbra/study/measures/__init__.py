"""
Measures: what a study can be asked, each in one file.

    measure.py     what a measure is               Measure, Quantity, Asked
    hours.py       hours of sun and shadow         sun_hours, shadow_hours
    sky_shares.py  the sky before a receiver       sky_view_factor, sky_component, sky_blocked_by
    probable.py    probable sun of a year          probable_sun_hours, ..._share
    weather.py     a weather file's sun and sky    sunshine_hours, irradiation, irradiation_...

A package installed beside umbra adds one by an entry point of the group ``umbra.measures``.
"""

from collections.abc import Sequence

from umbra.errors import InputError, show_value
from umbra.registry import Registry
from umbra.study.measures.measure import Asked, Measure, Quantity, guard

__all__ = [
    "HOURS", "MEASURES", "Asked", "Measure", "Quantity", "find_measures", "guard",
]  # fmt: skip

HOURS = ("sun_hours", "shadow_hours")
"""Names of the measures that the study's own loop counts, with intervals, spells and groups."""

MEASURES: Registry[Measure] = Registry(
    "measure",
    "measure",
    {
        "sun_hours": "umbra.study.measures.hours:SunHoursMeasure",
        "shadow_hours": "umbra.study.measures.hours:ShadowHours",
        "sky_view_factor": "umbra.study.measures.sky_shares:SkyViewFactor",
        "sky_component": "umbra.study.measures.sky_shares:SkyComponent",
        "sky_blocked_by": "umbra.study.measures.sky_shares:SkyBlockedBy",
        "probable_sun_hours": "umbra.study.measures.probable:ProbableSunHours",
        "probable_sun_share": "umbra.study.measures.probable:ProbableSunShare",
        "winter_probable_sun_share": "umbra.study.measures.probable:WinterProbableSunShare",
        "sunshine_hours": "umbra.study.measures.weather:SunshineHours",
        "irradiation": "umbra.study.measures.weather:Irradiation",
        "irradiation_beam": "umbra.study.measures.weather:IrradiationBeam",
        "irradiation_sky": "umbra.study.measures.weather:IrradiationSky",
        "irradiation_ground": "umbra.study.measures.weather:IrradiationGround",
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
    measures = [MEASURES.find(name) for name in dict.fromkeys(names)]
    included = {name for measure in measures for name in measure.includes}
    measures = [measure for measure in measures if measure.name not in included]
    known: dict[str, str] = {}
    for measure in measures:
        for quantity in guard(measure, _list_quantities, measure):
            other = known.setdefault(quantity.name, measure.name)
            if other != measure.name:
                msg = (
                    f"measures '{other}' and '{measure.name}' both give '{quantity.name}'; ask for "
                    "one of them"
                )
                raise InputError(msg, option="measure")
    return measures


def _list_quantities(measure: Measure) -> tuple[Quantity, ...]:
    """Return the variables of a measure, all of them quantities."""
    quantities: tuple[object, ...] = tuple(measure.quantities)
    for quantity in quantities:
        if not isinstance(quantity, Quantity):
            msg = f"quantities hold {show_value(quantity)}, not a Quantity"
            raise TypeError(msg)
    return measure.quantities
