"""Verdicts of rules on a model's areas, windows, bands and places."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from umbra.rules.record import Alternative, Condition, Requirement, Rule, list_conditions
from umbra.rules.words import MEASURES
from umbra.verdicts.asked import choose_asked, find_flat_room, tell_choice
from umbra.verdicts.judged_receivers import Gathered, Lacking
from umbra.verdicts.outcome import (
    FAIL,
    PASS,
    UNKNOWN,
    Outcome,
    join,
    join_all,
    join_any,
    judge_value,
    tell_limit,
)
from umbra.verdicts.sunlight import SunlightOf
from umbra.verdicts.values import measure

__all__ = ["Finding", "RuleVerdict", "judge_rules", "spell_out"]

NO_PROPOSAL = "what stood before is not known; name the proposal's parts with proposed="

_MOST_NAMED = 3  # variants of a verdict


@dataclass(frozen=True, kw_only=True)
class Finding:
    """
    A verdict: one check of a rule at one receiver.

    Parameters
    ----------
    rule : Rule
    check : str
    kind : str
        ``areas``, ``windows``, ``band``, ``places``, ``flat``, ...
    where : str
        Name of the receiver, or of the group.
    outcome : Outcome
    because : str
        Receiver that decides for a group; how many decide for a share.
    members : tuple of str
        Names of the receivers.
    of : str
        Kind of the receivers.
    variants : tuple of str
        Variants of the rule that it holds for.
    """

    rule: Rule
    check: str
    kind: str
    where: str
    outcome: Outcome
    because: str = ""
    members: tuple[str, ...] = ()
    of: str = ""
    variants: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """``pass``, ``fail`` or ``unknown``."""
        return self.outcome.verdict


@dataclass(frozen=True, eq=False, kw_only=True)
class RuleVerdict:
    """
    All verdicts of a rule.

    Parameters
    ----------
    rule : Rule
    findings : tuple of Finding
    notes : tuple of str
    """

    rule: Rule
    findings: tuple[Finding, ...]
    notes: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """``fail`` if any finding fails, else ``unknown`` if any is, else ``pass``."""
        verdicts = [finding.verdict for finding in self.findings]
        return FAIL if FAIL in verdicts else UNKNOWN if UNKNOWN in verdicts else PASS

    def count(self, verdict: str) -> int:
        """Return the number of findings of a verdict."""
        return sum(finding.verdict == verdict for finding in self.findings)


def judge_rules(gathered: Gathered, rules: Sequence[Sequence[Rule]]) -> list[RuleVerdict]:
    """
    Judge a model by rules.

    Parameters
    ----------
    gathered : Gathered
        The model and what is judged of it.
    rules : sequence of sequences of Rule
        The variants of each rule, as ``umbra.rules.read_rule`` returns them.

    Returns
    -------
    verdicts : list of RuleVerdict
        One of each rule.
    """
    return [_judge_rule(gathered, variants) for variants in rules]


def _judge_rule(gathered: Gathered, variants: Sequence[Rule]) -> RuleVerdict:
    judged = [_judge_variant(gathered, rule) for rule in variants]
    notes = tuple(dict.fromkeys(note for judgement in judged for note in judgement.notes))
    if len(judged) == 1:
        return judged[0]
    together = [
        _join_variants(alike)
        for alike in zip(*(judgement.findings for judgement in judged), strict=True)
    ]
    return RuleVerdict(rule=variants[0], findings=tuple(together), notes=notes)


def _join_variants(findings: Sequence[Finding]) -> Finding:
    """Join the verdicts of variants of which none was chosen: one that differs is unknown."""
    verdicts = {finding.verdict for finding in findings}
    names = tuple(finding.rule.variant for finding in findings)
    if len(verdicts) == 1:
        passes = verdicts == {PASS}
        nearest = (min if passes else max)(findings, key=lambda finding: finding.outcome.slack)
        return replace(nearest, variants=names)
    by_verdict = []
    for verdict in (PASS, FAIL, UNKNOWN):
        alike = [finding.rule.variant for finding in findings if finding.verdict == verdict]
        if alike:
            named = ", ".join(alike[:_MOST_NAMED])
            more = f" and {len(alike) - _MOST_NAMED} more" if len(alike) > _MOST_NAMED else ""
            by_verdict.append(f"{verdict} as {named}{more}")
    shown = next(finding for finding in findings if finding.verdict != PASS)
    name = shown.rule.name
    needs = f"{'; '.join(by_verdict)}; choose a variant, such as rules='{name}:{names[0]}'"
    return replace(
        shown, variants=names, outcome=replace(shown.outcome, verdict=UNKNOWN, needs=needs)
    )


def _judge_variant(gathered: Gathered, rule: Rule) -> RuleVerdict:
    findings: list[Finding] = []
    notes: list[str] = []
    for requirement in rule.requirements:
        for finding in _judge_requirement(gathered, rule, requirement, notes):
            findings.append(replace(finding, variants=(rule.variant,) if rule.variant else ()))
    return RuleVerdict(rule=rule, findings=tuple(findings), notes=tuple(dict.fromkeys(notes)))


def _judge_requirement(
    gathered: Gathered, rule: Rule, requirement: Requirement, notes: list[str]
) -> list[Finding]:
    """Judge a requirement at all its receivers."""

    def conclude(kind: str, where: str, verdict: str, needs: str) -> list[Finding]:
        wanted = " or ".join(
            dict.fromkeys(
                tell_wanted(condition) for condition in list_conditions(requirement.condition)
            )
        )
        outcome = Outcome(verdict=verdict, wanted=wanted, needs=needs)
        return [Finding(rule=rule, check=requirement.name, kind=kind, where=where,
                        outcome=outcome)]  # fmt: skip

    model = gathered.model
    if requirement.applies_above is not None:
        height = gathered.find_height()
        if height <= requirement.applies_above:
            reason = (f"does not apply: the proposal is {height:.1f} m high, not above "
                    f"{requirement.applies_above:g} m")  # fmt: skip
            return conclude("proposal", "the proposal", PASS, reason)
    sunlit = gathered.find(requirement)
    if isinstance(sunlit, Lacking):
        return conclude(requirement.receivers[0], "none", UNKNOWN, sunlit.needs)
    if not model.proposed and any(
        condition.casters == "proposed" for condition in list_conditions(requirement.condition)
    ):
        notes.append("there is no proposed=, so the shadows of all parts count as the building's")
    if requirement.share_of:
        by_date = _judge_all(sunlit, requirement, model.proposed)
        has_flats = any(any(sunlight.subjects.flats) for sunlight in sunlit)
        return [_judge_share(rule, requirement, rows, has_flats) for rows in by_date]
    findings: list[Finding] = []
    for sunlight in sunlit:
        judged = choose_asked(sunlight.subjects, requirement)
        left = len(sunlight.subjects) - len(judged)
        if left:
            notes.append(f"{left:,} of {len(sunlight.subjects):,} {sunlight.subjects.kind} are not "
                         f"asked of ({tell_choice(requirement)})")  # fmt: skip
        outcomes = _judge_subjects(sunlight, requirement, bool(model.proposed))
        findings += _list_findings(rule, requirement, sunlight, judged, outcomes, notes)
    if not findings:
        return conclude(requirement.receivers[0], "none of these", PASS,
                        f"the rule asks nothing of them: {tell_choice(requirement)}")  # fmt: skip
    return findings


def spell_out(verdicts: Sequence[RuleVerdict], spell: Callable[[str], str]) -> list[RuleVerdict]:
    """Return the verdicts with options in what is needed as a user types them."""
    return [
        replace(
            verdict, notes=tuple(map(spell, verdict.notes)),
            findings=tuple(
                replace(
                    finding, outcome=replace(finding.outcome, needs=spell(finding.outcome.needs))
                )
                for finding in verdict.findings
            ),
        )
        for verdict in verdicts
    ]  # fmt: skip


def tell_wanted(condition: Condition) -> str:
    """Describe a condition's limit where nothing is measured."""
    share = condition.share is not None or condition.ratio_to_before is not None
    return tell_limit(condition, "%" if share else MEASURES[condition.measure].unit)


Judged = list[list[Outcome]]
"""Outcomes of all receivers: for each date that is judged by itself, or once."""


def _judge_subjects(sunlight: SunlightOf, requirement: Requirement, has_before: bool) -> Judged:
    """Judge all receivers of a kind: outcomes by date, then by receiver."""
    conditions = list_conditions(requirement.condition)
    compares = any(condition.needs_before or not condition.has_limit for condition in conditions)
    return _judge_condition(
        sunlight, requirement.condition, "" if has_before else NO_PROPOSAL, compares and has_before
    )


def _judge_condition(
    sunlight: SunlightOf, condition: Condition | Alternative, lacking: str, reads_before: bool
) -> Judged:
    if isinstance(condition, Alternative):
        branches = [
            _judge_condition(sunlight, inner, lacking, reads_before)
            for inner in condition.conditions
        ]
        dates = max(map(len, branches))
        branches = [branch * dates if len(branch) == 1 else branch for branch in branches]
        return [
            [join(condition, parts) for parts in zip(*of_date, strict=True)]
            for of_date in zip(*branches, strict=True)
        ]
    needs = lacking if condition.needs_before else ""
    if needs and not condition.has_value_alone:
        wanted = tell_wanted(condition)
        blank = Outcome(verdict=UNKNOWN, wanted=wanted, measure=condition.measure, needs=needs)
        return [[blank] * len(sunlight.subjects)]
    values = measure(condition, sunlight, has_before=reads_before)
    sunlight.keep_line(condition, values)
    return [
        [judge_value(condition, value, k, needs) for k in range(len(sunlight.subjects))]
        for value in values
    ]


def _list_findings(
    rule: Rule, requirement: Requirement, sunlight: SunlightOf, chosen: list[int],
    judged: Judged, notes: list[str],
) -> list[Finding]:  # fmt: skip
    """Return a finding for each receiver, or each flat, and date."""
    subjects, findings = sunlight.subjects, []
    groups: dict[tuple[str, str, int], list[int]] = {}
    for k in chosen:
        label = subjects.name_group(requirement.of_each, k)
        # Receivers may have one name: each that is of no group is judged by itself.
        key = (requirement.of_each, label, -1) if label else (subjects.kind, subjects.names[k], k)
        groups.setdefault(key, []).append(k)
    if requirement.of_each and any(kind == subjects.kind for kind, *_ in groups):
        notes.append(f"windows that name no {requirement.of_each} are judged one by one, each as "
                     f"the only one of its {requirement.of_each}")  # fmt: skip
    how = join_any if requirement.one_is_enough else join_all
    for outcomes in judged:
        for (kind, where, _), members in groups.items():
            own = [outcomes[k] for k in members]
            outcome = own[0] if len(own) == 1 else replace(how(own), wanted=own[0].wanted)
            decides = next((k for k, other in zip(members, own) if other.value == outcome.value
                            and other.date == outcome.date), members[0])  # fmt: skip
            because = subjects.names[decides] if kind == requirement.of_each else ""
            findings.append(Finding(
                rule=rule, check=requirement.name, kind=kind, where=where, outcome=outcome,
                because=because, members=tuple(subjects.names[k] for k in members),
                of=subjects.kind,
            ))  # fmt: skip
    return findings


_FlatRow = tuple[str, str, Outcome]
"""Flat, room and outcome of a receiver."""


def _judge_all(
    sunlit: list[SunlightOf], requirement: Requirement, proposed: Sequence[str]
) -> list[list[_FlatRow]]:
    """Return, by date, the rows of all receivers that name a flat, of all kinds."""
    by_date: list[list[_FlatRow]] = []
    flats = {flat for sunlight in sunlit for flat in sunlight.subjects.flats if flat}
    for sunlight in sunlit:
        judged = _judge_subjects(sunlight, requirement, bool(proposed))
        by_date += [[] for _ in judged[len(by_date) :]]
        for rows, outcomes in zip(by_date, judged, strict=True):
            for k, outcome in enumerate(outcomes):
                flat, room = find_flat_room(sunlight.subjects, k, flats, requirement)
                if flat:
                    rows.append((flat, room, outcome))
    return by_date


def _judge_share(
    rule: Rule, requirement: Requirement, rows: list[_FlatRow], has_flats: bool
) -> Finding:
    """Judge the share of flats whose rooms meet the condition."""
    flats: dict[str, list[Outcome]] = {}
    for flat in dict.fromkeys(flat for flat, _, _ in rows):
        own = [(room, outcome) for name, room, outcome in rows if name == flat]
        parts = []
        for room in requirement.rooms or dict.fromkeys(room for room, _ in own):
            here = [outcome for kind, outcome in own if kind == room]
            lacks = Outcome(verdict=UNKNOWN, wanted="", needs=f"flat '{flat}' has no {room}")
            how = join_any if requirement.one_is_enough else join_all
            parts.append(how(here) if here else lacks)
        flats[flat] = [join_all(parts)]
    limit = requirement.share_at_least
    is_least = limit is not None
    bound = limit if limit is not None else requirement.share_at_most
    assert bound is not None
    of_each = tell_wanted(next(list_conditions(requirement.condition)))
    wanted = f"{of_each} in at {'least' if is_least else 'most'} {bound:g} % of the flats"
    blank = Outcome(verdict=UNKNOWN, wanted=wanted, measure="share_of_flats", unit="%", limit=bound)
    made = {"rule": rule, "check": requirement.name, "kind": "flats", "where": "all flats"}
    if not flats:
        needs = "no flats are named; give them in the column flat of windows="
        if has_flats:
            needs = (f"no flat has a room called {' or '.join(requirement.rooms)}; give it in the "
                     "column room of windows=")  # fmt: skip
        return Finding(**made, outcome=replace(blank, needs=needs))  # type: ignore[arg-type]
    verdicts = [finding.verdict for (finding,) in flats.values()]
    met, unsure, whole = verdicts.count(PASS), verdicts.count(UNKNOWN), len(verdicts)
    share = 100 * met / whole
    low, high = share, 100 * (met + unsure) / whole
    passes = low >= bound if is_least else high <= bound
    fails = high < bound if is_least else low > bound
    dates = {outcome.date for _, _, outcome in rows}
    lacking = sorted({finding.needs for (finding,) in flats.values() if finding.verdict == UNKNOWN})
    outcome = replace(
        blank, verdict=PASS if passes else FAIL if fails else UNKNOWN, value=share,
        margin=share - bound if is_least else bound - share,
        needs="" if passes or fails else "; ".join(lacking[:3]),
        date=dates.pop() if len(dates) == 1 else None,
    )  # fmt: skip
    text = f"{met} of {whole} flats" + (f", {unsure} unknown" if unsure else "")
    return Finding(**made, outcome=outcome, because=text)  # type: ignore[arg-type]
