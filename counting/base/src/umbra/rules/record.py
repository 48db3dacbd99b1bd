"""
Records of a rule: its source, what it asks of which receivers, and the limits.

A ``Rule`` holds ``Requirement`` s, each of named areas, windows, bands or places; a requirement's
condition is one ``Condition``, a measure with its time and limit, or an ``Alternative``.
"""

import datetime as dt
from collections.abc import Iterator
from dataclasses import dataclass, field

from umbra.sun.day_times import Clock

__all__ = ["Alternative", "Condition", "Place", "Requirement", "Rule", "list_conditions"]


@dataclass(frozen=True)
class Place:
    """
    A named point of a rule.

    Parameters
    ----------
    name : str
    x, y : float
        In the model's own coordinates [m].
    z : float, optional
        The ground by default [m].
    """

    name: str
    x: float
    y: float
    z: float | None = None


@dataclass(frozen=True, kw_only=True)
class Condition:
    """
    A measure with its time and its limit.

    Parameters
    ----------
    measure : str
        One of ``umbra.rules.words.MEASURES``.
    dates : tuple of str
        As written: ``03-21``, ``02-19..10-21``, ``winter-solstice``, ``year``; without a year, in
        that of the sheet. None where the measure has no dates.
    over : {'each', 'worst', 'best', 'sum'}
        Whether each date is judged by itself, the worst or the best of them, or their sum.
    start, end : str
        ``09:00``, ``sunrise+1h``, ``altitude:10``.
    every : str
        Step.
    clock : {'local', 'standard', 'solar'}
    casters : {'all', 'proposed'}
        Whose shadows count: with ``proposed`` those of the proposal alone.
    min_altitude : float
        Lowest altitude of the sun that counts [degrees].
    min_angle : float
        Lowest angle between the facade and the sun's azimuth that counts [degrees].
    min_spell : timedelta
        Length from which spells count.
    lit_area, lit_share : float, optional
        A receiver has sun at a moment when so much of it has [m2], or this share [%].
    at_least, at_most : float, optional
        Limit, in the unit of the measure (hours, percents).
    share : float, optional
        Share of an area that must meet the limit [%].
    ratio_to_before : float, optional
        Least ratio to the value without the proposal; of areas with ``at_least`` the ratio of the
        shares that have so much.
    loss_at_most : float, optional
        Most that the proposal may take, in the unit of the measure.
    level : str
        Name of the level, of a condition among levels.
    """

    measure: str = "sun_hours"
    dates: tuple[str, ...] = ()
    over: str = "each"
    start: str = "00:00"
    end: str = "24:00"
    every: str = "5min"
    clock: Clock = "local"
    casters: str = "all"
    min_altitude: float = 0.0
    min_angle: float = 0.0
    min_spell: dt.timedelta = dt.timedelta()
    lit_area: float | None = None
    lit_share: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    share: float | None = None
    ratio_to_before: float | None = None
    loss_at_most: float | None = None
    level: str = ""

    @property
    def needs_before(self) -> bool:
        """Whether it compares with what stands without the proposal."""
        limits = (self.ratio_to_before, self.loss_at_most)
        return not self.has_value_alone or any(limit is not None for limit in limits)

    @property
    def has_value_alone(self) -> bool:
        """Whether its measure has a value without a proposal."""
        return self.measure not in {"hours_lost", "new_shadow_hours", "new_shadow_share"}

    @property
    def has_limit(self) -> bool:
        """Whether it asks for a number; else it only reports."""
        limits = (self.at_least, self.at_most, self.ratio_to_before, self.loss_at_most)
        return any(limit is not None for limit in limits)


@dataclass(frozen=True)
class Alternative:
    """
    Several conditions.

    Parameters
    ----------
    needs : {'any', 'all', 'levels'}
        Levels are conditions from the lowest to the highest; the first must hold.
    conditions : tuple of Condition or Alternative
    """

    needs: str
    conditions: "tuple[Condition | Alternative, ...]"


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """
    What a rule asks of some receivers.

    Parameters
    ----------
    name : str
    receivers : tuple of str
        Of ``areas``, ``windows``, ``band`` and ``places``.
    condition : Condition or Alternative
    places : tuple of Place
        With receivers ``places``.
    facing : (float, float), optional
        Azimuths between which a window faces, clockwise from north [degrees].
    rooms : tuple of str
        Windows of these rooms alone, where their table names rooms.
    judge : {'centre', 'sill', 'pane'}
        Where a window is judged.
    of_each : str
        Receivers that are judged together: ``flat``, ``room``, ``storey``; empty: each by itself.
    one_is_enough : bool
        Whether of each such group one receiver is enough, else all must meet the condition.
    share_of : str
        Groups of which a share is judged: ``flat``.
    share_at_least, share_at_most : float, optional
        That share [%].
    band : (float, float), optional
        Distances from the plot's boundary [m]; the second may be infinite.
    height : float, optional
        Of the plane that is judged, above the plot's mean ground [m].
    applies_above : float, optional
        Height of the proposal from which the rule applies [m].
    """

    name: str
    receivers: tuple[str, ...]
    condition: Condition | Alternative
    places: tuple[Place, ...] = ()
    facing: tuple[float, float] | None = None
    rooms: tuple[str, ...] = ()
    judge: str = "centre"
    of_each: str = ""
    one_is_enough: bool = False
    share_of: str = ""
    share_at_least: float | None = None
    share_at_most: float | None = None
    band: tuple[float, float] | None = None
    height: float | None = None
    applies_above: float | None = None


@dataclass(frozen=True, kw_only=True)
class Rule:
    """
    A rule with its source and standing.

    Parameters
    ----------
    name : str
        Short name: ``bre-209-gardens``, or the stem of a file.
    title, place, edition, source : str
    asks : str
        What it asks, in a line.
    read : str
        Date of reading of the sources.
    standing : str
        One of ``umbra.rules.words.STANDINGS``.
    first_hand, second_hand : str
        What was read in the authority's text, and what elsewhere.
    before_use : str
        What the user must check.
    notes : tuple of str
        What the rule has that is not judged.
    variant : str
        The variant that was chosen, or that these requirements are of; empty without variants.
    about_variant : str
    requirements : tuple of Requirement
    is_first_format : bool
        Whether the file is of format 1.
    text : str
        The file.
    """

    name: str
    title: str
    place: str = ""
    edition: str
    source: str
    asks: str = ""
    read: str = ""
    standing: str = "own"
    first_hand: str = ""
    second_hand: str = ""
    before_use: str = ""
    notes: tuple[str, ...] = ()
    variant: str = ""
    about_variant: str = ""
    requirements: tuple[Requirement, ...] = ()
    is_first_format: bool = False
    text: str = field(default="", repr=False)


def list_conditions(condition: Condition | Alternative) -> Iterator[Condition]:
    """Yield the conditions of an alternative, or the one itself."""
    if isinstance(condition, Condition):
        yield condition
        return
    for part in condition.conditions:
        yield from list_conditions(part)
