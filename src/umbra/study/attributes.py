"""CF attributes of a result's variables, for files and the axes of plots."""

from collections.abc import Sequence

from umbra.errors import InputError, show_value
from umbra.study.measures import Measure, Quantity, guard

__all__ = ["check_quantities", "find_attributes", "is_sum"]

_ATTRIBUTES: dict[str, dict[str, str]] = {
    "x": {"long_name": "x of cell centres", "units": "m", "axis": "X"},
    "y": {"long_name": "y of cell centres", "units": "m", "axis": "Y"},
    "time": {"long_name": "sample instant, UTC", "standard_name": "time", "axis": "T"},
    "shadow_hours": {"long_name": "hours in shadow", "units": "h"},
    "sun_hours": {"long_name": "hours in sun", "units": "h"},
    "receiver_z": {"long_name": "z of the receiver", "units": "m"},
    "sun_altitude": {
        "long_name": "altitude of the sun",
        "standard_name": "solar_elevation_angle",
        "units": "degree",
    },
    "sun_azimuth": {
        "long_name": "azimuth of the sun, clockwise from true north",
        "standard_name": "solar_azimuth_angle",
        "units": "degree",
    },
    "sun_direction": {"long_name": "unit vector toward the sun in the model's axes", "units": "1"},
    "in_shadow": {"long_name": "whether the cell is in shadow", "units": "1"},
    "canopy_hours": {"long_name": "hours behind canopies alone", "units": "h"},
    "canopy_transmissivity": {
        "long_name": "share of the light that canopies transmit",
        "units": "1",
    },
    "under_canopy": {"long_name": "whether the cell is behind canopies alone", "units": "1"},
    "day": {"long_name": "local date"},
    "up_hours_by_day": {"long_name": "hours with the sun up on the day", "units": "h"},
    "month": {"long_name": "month of the year, January is 1"},
    "dates_by_month": {"long_name": "number of dates in the month", "units": "1"},
    "up_hours_by_month": {
        "long_name": "hours a day with the sun up, mean of the month's dates",
        "units": "h",
    },
    "first_sun": {"long_name": "when the first spell of sun begins, UTC", "standard_name": "time"},
    "first_contact": {
        "long_name": "when a part of the sun's disc first appears, UTC",
        "standard_name": "time",
    },
    "last_contact": {
        "long_name": "when the last of the sun's disc goes, UTC",
        "standard_name": "time",
    },
    "last_sun": {"long_name": "when the last spell of sun ends, UTC", "standard_name": "time"},
    "sun_spells": {"long_name": "number of spells of sun", "units": "1"},
    "longest_sun_hours": {"long_name": "longest unbroken spell of sun", "units": "h"},
    "sun_hours_in_spells": {
        "long_name": "hours in spells of sun of at least min_spell_minutes",
        "units": "h",
    },
    "along": {"long_name": "distance along the view, to its right", "units": "m"},
    "z": {"long_name": "z of cell centres", "units": "m", "axis": "Z", "positive": "up"},
    "row": {"long_name": "row of the picture, upward", "units": "1"},
    "col": {"long_name": "column of the picture", "units": "1"},
    "position": {"long_name": "where the receiver lies, in the model's axes", "units": "m"},
    "normal": {"long_name": "unit normal of the receiver's side that is seen", "units": "1"},
    "part": {"long_name": "part: its name, or its index; -2: the ground, -1: nothing is seen"},
    "up": {"long_name": "distance upward in the view", "units": "m"},
    "name": {"long_name": "name of the point"},
    "area": {"long_name": "area that the sample stands for", "units": "m2"},
    "surface_of_sample": {"long_name": "index of the sample's surface"},
    "surface_part": {"long_name": "index of the surface's part"},
    "surface_kind": {"long_name": "kind of the surface"},
    "surface_area": {"long_name": "area of the surface", "units": "m2"},
    "surface_azimuth": {
        "long_name": "azimuth that the surface faces, clockwise from true north",
        "units": "degree",
    },
    "surface_tilt": {"long_name": "tilt of the surface, 0 level, 90 upright", "units": "degree"},
    "surface_mean_sun_hours": {"long_name": "hours in sun, mean of the surface", "units": "h"},
    "surface_least_sun_hours": {"long_name": "least hours in sun on the surface", "units": "h"},
    "surface_most_sun_hours": {"long_name": "most hours in sun on the surface", "units": "h"},
    "part_area": {"long_name": "area of the part's surfaces", "units": "m2"},
    "part_mean_sun_hours": {"long_name": "hours in sun, mean of the part", "units": "h"},
    "part_least_sun_hours": {"long_name": "least hours in sun on the part", "units": "h"},
    "part_most_sun_hours": {"long_name": "most hours in sun on the part", "units": "h"},
    "caster": {"long_name": "chosen casters"},
    "cast_hours": {"long_name": "hours in the shadow of the caster alone", "units": "h"},
    "sole_hours": {"long_name": "hours that would be sun without the caster", "units": "h"},
    "hours_lost": {"long_name": "hours of sun lost to the proposal", "units": "h"},
    "newly_under": {
        "long_name": "whether under_hours of sun were reached before and no longer are",
        "units": "1",
    },
    "newly_under_days": {
        "long_name": "number of dates on which under_hours of sun were reached before and no "
        "longer are",
        "units": "1",
    },
    "neighbour": {"long_name": "parts that lose sun to the proposal, most first"},
    "neighbour_area": {"long_name": "area of the neighbour's receivers", "units": "m2"},
    "neighbour_area_touched": {"long_name": "area that loses sun", "units": "m2"},
    "neighbour_area_newly_under": {
        "long_name": "area newly under under_hours of sun",
        "units": "m2",
    },
    "neighbour_most_hours_lost": {"long_name": "most hours of sun lost anywhere", "units": "h"},
    "neighbour_mean_hours_lost": {"long_name": "hours of sun lost, mean of the area", "units": "h"},
    "shaded_share": {"long_name": "share of the time with the sun up in shadow", "units": "1"},
}
_BY_DAY, _BY_MONTH = "_by_day", "_by_month"
_SUMMED = {
    *("shadow_hours", "sun_hours", "canopy_hours", "cast_hours", "sole_hours", "hours_lost"),
    *("sun_spells", "sun_hours_in_spells", "neighbour_most_hours_lost"),
    *("neighbour_mean_hours_lost", "shaded_share"),
    *(f"{of}_{what}_sun_hours" for of in ("surface", "part") for what in ("mean", "least", "most")),
}
_JUDGED = {"newly_under", "neighbour_area_touched", "neighbour_area_newly_under"}
"""Variables judged date by date: the limit applies to one date."""


def is_sum(name: str) -> bool:
    """Return whether a variable of several dates is their sum."""
    return name in _SUMMED


def find_attributes(
    name: str, dates: int = 1, quantities: Sequence[Quantity] = ()
) -> dict[str, str]:
    """
    Return a variable's attributes by its name; results by day share those of all days.

    Parameters
    ----------
    name : str
    dates : int
        Number of dates of the study, stated in the names of sums.
    quantities : sequence of Quantity
        Variables of the study's measures.

    Returns
    -------
    attributes : dict of str to str
        ``long_name`` and, if any, ``units``; empty for an unknown name.
    """
    attributes = dict(_ATTRIBUTES.get(name, {})) or _describe_measure(name, quantities)
    if not attributes and name.endswith(_BY_DAY):
        attributes = dict(_ATTRIBUTES.get(name.removesuffix(_BY_DAY), {}))
        if attributes:
            attributes["long_name"] += ", on the day"
    elif not attributes and name.endswith(_BY_MONTH):
        attributes = dict(_ATTRIBUTES.get(name.removesuffix(_BY_MONTH), {}))
        if attributes:
            attributes["long_name"] += " a day, mean of the month's dates"
    elif dates > 1 and name in _SUMMED:
        how = "of" if name == "shaded_share" else "sum of"
        attributes["long_name"] += f", {how} {dates} dates"
    elif dates > 1 and name in _JUDGED:
        attributes["long_name"] += f", on at least one of {dates} dates"
    return attributes


def check_quantities(measures: Sequence[Measure]) -> None:
    """
    Check the variables that measures say they give.

    Raises
    ------
    InputError
        If one has no words or unit, or the name of another variable of a study.
    """
    for measure in measures:
        for one in guard(measure, lambda measure=measure: tuple(measure.quantities)):
            told: object = one
            if not isinstance(told, Quantity):
                wrong = f"a quantity that is {show_value(told)}; make it a Quantity"
            elif texts := [
                t for t in (one.name, one.unit, one.long_name) if not isinstance(t, str)
            ]:
                wrong = f"a quantity with {show_value(texts[0])} for a text; give each as a str"
            elif find_attributes(one.name):
                wrong = f"'{one.name}', which is a variable of umbra's own; name it otherwise"
            else:
                continue
            msg = f"measure '{measure.name}' gives {wrong}"
            raise InputError(msg, option="measure", measure=measure.name)


_ENDS = {
    "_before": (", before the proposal", None),
    "_lost": (", lost to the proposal", None),
    "_ratio": (", after the proposal, of that before it", "1"),
}
"""What a variable of a measure is called beside a proposal, and its unit if not the measure's."""
_STARTS = {
    f"{of}_{which}_": f"{which} of the {of}"
    for of in ("surface", "part")
    for which in ("mean", "least", "most")
}
"""What the figures of whole surfaces and parts are called."""


def _describe_measure(name: str, quantities: Sequence[Quantity]) -> dict[str, str]:
    """Return the attributes of a measure's variable; empty for an unknown name."""
    for known in quantities:
        if name == known.name:
            return known.attributes
        if name.startswith(known.name) and name.removeprefix(known.name) in _ENDS:
            words, unit = _ENDS[name.removeprefix(known.name)]
            return {"long_name": known.long_name + words, "units": unit or known.unit}
        if name.endswith(known.name) and name.removesuffix(known.name) in _STARTS:
            words = _STARTS[name.removesuffix(known.name)]
            return {"long_name": f"{known.long_name}, {words}", "units": known.unit}
    return {}
