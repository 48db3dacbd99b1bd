"""Rules as asks and groups: which receivers must keep which hours."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.errors import InputError
from umbra.lights import Period
from umbra.massing.asks import Ask, measure_pieces
from umbra.massing.flat_choice import FlatChoice
from umbra.massing.planes import LONGEST, SPELLS, SUM
from umbra.massing.problem import ReceiverGroup
from umbra.rules import Alternative, Condition, Requirement, Rule
from umbra.rules.words import MEASURES, tell_interval
from umbra.scene.grid import Places
from umbra.study.options import StudyOptions
from umbra.study.study_period import find_period
from umbra.sun import name_date
from umbra.verdicts.asked import choose_asked, find_flat_room
from umbra.verdicts.dates import settle_dates
from umbra.verdicts.judged_receivers import Gathered, Lacking
from umbra.verdicts.subjects import Subjects

__all__ = ["AskedRules", "ask_rules"]


_KINDS = {
    "sun_hours": SUM, "shadow_hours": SUM, "longest_sun_hours": LONGEST,
    "sun_hours_in_spells": SPELLS,
}  # fmt: skip
_STEPPED = re.compile(r"\bevery\s*:")
_INVERSE = "give max_height='PART', which takes any rule, or leave the rule out"


@dataclass(frozen=True, eq=False)
class _Clause:
    """Members of asks, of which so much weight must be met."""

    ask: list[int]
    receiver: list[int]
    weight: list[float]
    wanted: float

    @property
    def is_any(self) -> bool:
        """Whether one of its members is enough."""
        return self.wanted <= 1.0 and set(self.weight) == {1.0}

    def group(self, name: str) -> ReceiverGroup:
        """Return it as a group with a name."""
        return ReceiverGroup(
            name, np.array(self.ask), np.array(self.receiver), np.array(self.weight), self.wanted
        )


@dataclass(eq=False)
class AskedRules:
    """
    What rules ask, over a plot.

    Parameters
    ----------
    gathered : Gathered
        Receivers of the rules.
    around : Casting or None
        What stands around.
    asks : list of Ask
    groups : list of Group
    candidates : list of Group
        Of flats, of which ``choices`` take some.
    choices : list of FlatChoice
    times : list of str
        Dates, hours and clock, for the reader.
    notes : list of str
    """

    gathered: Gathered
    around: Casting | None
    asks: list[Ask] = field(default_factory=list)
    groups: list[ReceiverGroup] = field(default_factory=list)
    candidates: list[ReceiverGroup] = field(default_factory=list)
    choices: list[FlatChoice] = field(default_factory=list)
    times: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, rule: Rule) -> None:
        """Add a rule's requirements."""
        for requirement in rule.requirements:
            if requirement.share_of:
                self._add_share(rule, requirement)
                continue
            for subjects in self._find(rule, requirement):
                chosen = choose_asked(subjects, requirement)
                if chosen:
                    self._add_subjects(rule, requirement, subjects.pick(chosen))

    def _find(self, rule: Rule, requirement: Requirement) -> list[Subjects]:
        """Return the receivers of a requirement."""
        receivers = self.gathered.find(requirement)
        if isinstance(receivers, Lacking):
            msg = f"rule '{rule.name}', {requirement.name}: {receivers.needs}"
            raise InputError(msg, option="rules", rule=rule.name)
        return [sunlight.subjects for sunlight in receivers]

    def _add_subjects(self, rule: Rule, requirement: Requirement, subjects: Subjects) -> None:
        maker = _Clauses(self, rule, requirement, subjects)
        clauses = maker.make(requirement.condition)
        if requirement.of_each and requirement.one_is_enough:
            clauses = maker.join(clauses)
        for name, own in clauses:
            for clause in own:
                self.groups.append(clause.group(f"{name} ({requirement.name})"))

    def _add_share(self, rule: Rule, requirement: Requirement) -> None:
        """Add that a share of the flats meets a condition."""

        def refuse(what: str) -> NoReturn:
            msg = f"rule '{rule.name}', {requirement.name}, {what}; {_INVERSE}"
            raise InputError(msg, option="rules", rule=rule.name)

        if requirement.share_at_least is None:
            refuse("limits a share of flats from the other side: more building would keep it")
        found = self._find(rule, requirement)
        named = {flat for subjects in found for flat in subjects.flats if flat}
        flats: dict[str, dict[str, list[list[_Clause]]]] = {}
        for subjects in found:
            rows = [find_flat_room(subjects, k, named, requirement) for k in range(len(subjects))]
            own = [k for k, (flat, _) in enumerate(rows) if flat]
            if not own:
                continue
            maker = _Clauses(self, rule, requirement, subjects.pick(own))
            for k, (_, clauses) in zip(own, maker.make(requirement.condition), strict=True):
                flat, room = rows[k]
                flats.setdefault(flat, {}).setdefault(room, []).append(clauses)
        if not flats:
            refuse("names no flats: give them in the column flat of windows=")
        wanted = math.ceil(requirement.share_at_least / 100 * len(flats) - 1e-9)
        rooms = {len(requirement.rooms) or 1}
        alone = [own for by_room in flats.values() for every in by_room.values() for own in every]
        is_single = len(alone) == len(flats) and rooms == {1}
        if is_single and all(len(own) == 1 and len(own[0].ask) == 1 for own in alone):
            self._add_single(f"{wanted} of {len(flats)} flats ({requirement.name})", alone, wanted)
            return
        choice = FlatChoice(f"{wanted} of {len(flats)} flats ({requirement.name})", wanted)
        for flat, by_room in flats.items():
            if requirement.rooms and {*requirement.rooms} - {*by_room}:
                continue  # a flat without such a room is unknown, whatever is built
            choice.flats.append([
                [self._add_candidate(flat, requirement, clauses) for clauses in option]
                for option in _list_slots(by_room, requirement)
            ])  # fmt: skip
        if not choice.flats:
            refuse(f"asks of rooms that no flat has all of: {', '.join(requirement.rooms)}")
        self.choices.append(choice)

    def _add_single(self, name: str, alone: list[list[_Clause]], wanted: int) -> None:
        """Add that so many of some receivers are met."""
        if wanted:
            members = [own[0] for own in alone]
            self.groups.append(ReceiverGroup(
                name, np.array([clause.ask[0] for clause in members]),
                np.array([clause.receiver[0] for clause in members]),
                np.ones(len(members)), float(wanted),
            ))  # fmt: skip

    def _add_candidate(
        self, flat: str, requirement: Requirement, clauses: list[_Clause]
    ) -> list[int]:
        """Add what a receiver of a flat must keep if it is chosen; return the groups' indices."""
        first = len(self.candidates)
        self.candidates += [clause.group(f"flat {flat} ({requirement.name})") for clause in clauses]
        return list(range(first, len(self.candidates)))


def _list_slots(
    by_room: dict[str, list[list[_Clause]]], requirement: Requirement
) -> list[list[list[_Clause]]]:
    """Return what a flat needs, each with the receivers of which one must keep its clauses."""
    if requirement.one_is_enough:
        return list(by_room.values())
    return [[clauses] for every in by_room.values() for clauses in every]


def ask_rules(gathered: Gathered, rules: Sequence[Rule], around: Casting | None) -> AskedRules:
    """
    Find what rules ask of their receivers.

    Parameters
    ----------
    gathered : Gathered
    rules : sequence of Rule
    around : Casting or None
        What stands around.

    Raises
    ------
    InputError
        If a rule has no receivers, or is of a measure that heights cannot be found for.
    """
    needs = AskedRules(gathered, around)
    for rule in rules:
        needs.add(rule)
    if not needs.groups and not needs.candidates:
        names = ", ".join(rule.name for rule in rules)
        msg = f"{names}: no receiver is asked of; give areas, windows or places"
        raise InputError(msg, option="rules")
    needs.times[:] = dict.fromkeys(needs.times)
    return needs


@dataclass(frozen=True, eq=False)
class _Clauses:
    """Clauses of the receivers of a requirement."""

    asked: AskedRules
    rule: Rule
    requirement: Requirement
    subjects: Subjects

    def make(self, condition: Condition | Alternative) -> list[tuple[str, list[_Clause]]]:
        """Return each receiver's name and clauses, all of which must be met."""
        return list(zip(self.subjects.names, self._make(condition), strict=True))

    def join(self, clauses: list[tuple[str, list[_Clause]]]) -> list[tuple[str, list[_Clause]]]:
        """Join the receivers of a flat, a room or a storey, one of which is enough."""
        subjects, kind = self.subjects, self.requirement.of_each
        labels = {"flat": subjects.flats, "room": subjects.rooms, "storey": subjects.storeys}[kind]
        joined: dict[str, list[list[_Clause]]] = {}
        for label, (name, own) in zip(labels, clauses, strict=True):
            joined.setdefault(f"{kind} {label}" if label else name, []).append(own)
        return [(name, self._join_any(parts)) for name, parts in joined.items()]

    @property
    def _is_pane(self) -> bool:
        """Whether windows are judged by the mean over their panes."""
        return self.subjects.kind == "windows" and len(self.subjects.owner) > len(self.subjects)

    def _make(self, condition: Condition | Alternative) -> list[list[_Clause]]:
        if isinstance(condition, Condition):
            return self._make_one(condition)
        if condition.needs == "levels":
            return self._make(condition.conditions[0])
        clauses = [self._make(part) for part in condition.conditions]
        if condition.needs == "all":
            return [[clause for own in parts for clause in own] for parts in zip(*clauses)]
        return [self._join_any(parts) for parts in zip(*clauses, strict=True)]

    def _join_any(self, parts: Sequence[list[_Clause]]) -> list[_Clause]:
        """Return the clause that one of several is met."""
        if len(parts) == 1:
            return parts[0]
        if all(len(own) == 1 for own in parts):
            first = [own[0] for own in parts]
            if all(clause.is_any for clause in first):
                return [_Clause(
                    [a for clause in first for a in clause.ask],
                    [r for clause in first for r in clause.receiver],
                    [w for clause in first for w in clause.weight], 1.0,
                )]  # fmt: skip
            limits = [self.asked.asks[clause.ask[0]].limit[clause.receiver] for clause in first]
            alike = all(np.array_equal(limits[0], other) for other in limits[1:])
            if alike:  # shares of one area
                return [min(first, key=lambda clause: clause.wanted / sum(clause.weight))]
        return self._refuse("asks one of several things of whole areas")

    def _refuse(self, what: str) -> NoReturn:
        msg = f"rule '{self.rule.name}', {self.requirement.name}, {what}; {_INVERSE}"
        raise InputError(msg, option="rules", rule=self.rule.name)

    def _make_one(self, condition: Condition) -> list[list[_Clause]]:
        """Return the clauses of one condition."""
        self._check(condition)
        subjects = self.subjects
        dates = [self._ask(condition, period) for period in self._list_periods(condition)]
        if not dates:
            self._refuse("has no date")
        by_date: list[list[list[_Clause]]] = []
        for ask, before in dates:
            met = before >= self.asked.asks[ask].limit - 1e-4
            by_date.append([[self._make_clause(condition, ask, met, k)]
                          for k in range(len(subjects))])  # fmt: skip
        if condition.over == "best":
            return [self._join_any(parts) for parts in zip(*by_date, strict=True)]
        return [[clause for own in parts for clause in own] for parts in zip(*by_date, strict=True)]

    def _make_clause(
        self, condition: Condition, ask: int, met: NDArray[np.bool_], k: int
    ) -> _Clause:
        subjects = self.subjects
        if self._is_pane:
            return _Clause([ask], [k], [1.0], 1.0)
        samples = np.flatnonzero(subjects.owner == k)
        if len(samples) == 1:
            return _Clause([ask], samples.tolist(), [1.0], 1.0)
        if condition.share is None and condition.ratio_to_before is None:
            # All of them, by number: the least piece of an area is judged as the largest.
            count = len(samples)
            return _Clause([ask] * count, samples.tolist(), [1.0] * count, float(count))
        weight = subjects.areas[samples]
        whole = float(weight.sum())
        wanted = whole if condition.share is None else condition.share / 100 * whole
        if condition.ratio_to_before is not None:
            had = float(weight[met[samples]].sum())
            share = condition.ratio_to_before * had
            wanted = share if condition.share is None else max(wanted, share)
        return _Clause([ask] * len(samples), samples.tolist(), weight.tolist(), wanted)

    def _check(self, condition: Condition) -> None:
        """Refuse what heights cannot be found for."""
        words = MEASURES[condition.measure].words
        if condition.measure not in _KINDS:
            self._refuse(f"measures {words}, for which no planes of the sun are found")
        is_shadow = condition.measure == "shadow_hours"
        limit = condition.at_most if is_shadow else condition.at_least
        other = condition.at_least if is_shadow else condition.at_most
        if other is not None:
            self._refuse(f"limits {words} from the other side: more building would keep it")
        has_ratio = condition.ratio_to_before is not None or condition.loss_at_most is not None
        if limit is None and not has_ratio:
            self._refuse(f"has no limit of {words}")
        if condition.over == "sum":
            self._refuse("adds dates up")
        if condition.lit_area is not None or condition.lit_share is not None:
            self._refuse("judges how much of a window or an area is lit at one moment")
        if self._is_pane and _KINDS[condition.measure] != SUM:
            self._refuse("judges spells of whole panes, whose parts have spells of their own")
        if is_shadow and has_ratio:
            self._refuse("compares shadow with before")

    def _list_periods(self, condition: Condition) -> Iterator[Period]:
        model = self.asked.gathered.model
        time: dict[str, Any] = {
            "date": settle_dates(condition, model.year, model.site.zone), "start": condition.start,
            "end": condition.end, "every": condition.every, "clock": condition.clock,
        }  # fmt: skip
        land = model.options.horizon
        period = find_period(StudyOptions(**time, horizon=land), model.site)
        days = " to ".join(
            name_date(day) for day in dict.fromkeys(period.days[:1] + period.days[-1:])
        )
        counted = tell_interval(condition.start, condition.end, condition.clock)
        self.asked.times.append(f"{days}, {counted}")
        for day in range(len(period.days)):
            yield period.pick(day)

    def _ask(self, condition: Condition, period: Period) -> tuple[int, NDArray[np.float64]]:
        """Add an ask on one date; return its index, and the hours before."""
        subjects, asked = self.subjects, self.asked
        owner = subjects.owner
        of_place, share = None, None
        names = tuple(subjects.names[k] for k in owner)
        if self._is_pane:
            names = tuple(subjects.names)
            of_place = owner.astype(np.int64)
            share = subjects.areas / np.bincount(owner, subjects.areas)[owner]
        origin = asked.gathered.model.scene.origin
        is_continuous = _is_continuous(self.rule, condition)
        ask = Ask(
            f"{self.requirement.name}, {period.days[0]}", period,
            Places(subjects.points - origin, subjects.normals), names,
            np.zeros(len(names)), _KINDS[condition.measure],
            condition.min_spell.total_seconds() / 3600, condition.min_altitude,
            condition.min_angle, is_continuous, condition.casters == "proposed",
            owner=of_place, share=share, openings=subjects.openings,
        )  # fmt: skip
        around = None if ask.is_alone else asked.around
        before = measure_pieces(ask, ask.cut(ask.find_masks(around)))
        limit = np.zeros(len(names))
        if condition.measure == "shadow_hours":
            assert condition.at_most is not None
            whole = float(ask.lights.lengths.sum()) / 3.6e9
            # Of the envelope's own shadow a place turned away from the sun has none.
            limit += np.maximum((before if ask.is_alone else whole) - condition.at_most, 0.0)
        elif condition.at_least is not None:
            limit += condition.at_least
        is_share = subjects.kind in {"areas", "band"} and condition.at_least is not None
        if condition.ratio_to_before is not None and not is_share:
            limit = np.maximum(limit, condition.ratio_to_before * before)
        if condition.loss_at_most is not None:
            limit = np.maximum(limit, before - condition.loss_at_most)
        asked.asks.append(replace(ask, limit=limit))
        return len(asked.asks) - 1, before


def _is_continuous(rule: Rule, condition: Condition) -> bool:
    """Return whether a rule has no steps, so that the sun's whole path counts."""
    is_stepped = not rule.text or _STEPPED.search(rule.text)
    return not is_stepped and condition.min_altitude <= 0 and condition.min_angle <= 0
