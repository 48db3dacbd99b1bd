"""Verdicts in sentences and in rows of tables."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from umbra.rules.words import MEASURES, STANDINGS, tell_amount
from umbra.study.rules.measurement import read_clock
from umbra.sun import name_date
from umbra.verdicts.judge import Finding, RuleVerdict
from umbra.verdicts.outcome import FAIL, PASS, UNKNOWN, Outcome

__all__ = [
    "COLUMNS", "list_brief", "list_conditions_of", "list_rows", "list_shown", "sum_up",
    "tell_reason", "tell_rule", "tell_value", "tell_verdicts",
]  # fmt: skip

COLUMNS = (
    "rule", "title", "edition", "source", "standing", "variant", "check", "receiver", "name",
    "date", "verdict", "level", "measure", "value", "unit", "limit", "margin", "off_by", "before",
    "after", "close", "wanted", "because", "first_sun", "last_sun", "needs", "counted",
)  # fmt: skip
_MOST_TOLD = 12  # receivers of a rule that are told in lines
_NOUNS = {"areas": "area", "windows": "window", "places": "place", "band": "band", "flats": "check"}


def list_rows(verdicts: Sequence[RuleVerdict], zone: str) -> list[tuple[object, ...]]:
    """Return a row of ``verdicts.csv`` for each finding."""
    return [
        _make_row(finding, finding.outcome, zone) for rule in verdicts for finding in rule.findings
    ]


def list_conditions_of(verdicts: Sequence[RuleVerdict], zone: str) -> list[tuple[object, ...]]:
    """Return a row of ``conditions.csv`` for each condition of each finding."""
    return [
        _make_row(finding, outcome, zone)
        for rule in verdicts
        for finding in rule.findings
        for outcome in _list_parts(finding.outcome)
    ]


def _list_parts(outcome: Outcome) -> list[Outcome]:
    if not outcome.parts:
        return [outcome]
    return [leaf for part in outcome.parts for leaf in _list_parts(part)]


def _make_row(finding: Finding, outcome: Outcome, zone: str) -> tuple[object, ...]:
    rule = finding.rule
    return (
        rule.name, rule.title, rule.edition, rule.source, rule.standing, " ".join(finding.variants),
        finding.check, finding.kind, finding.where, None if outcome.date is None else
        str(outcome.date), outcome.verdict, outcome.level, outcome.measure, _round(outcome.value),
        outcome.unit, _round(outcome.limit), _round(outcome.margin), _round(outcome.off),
        _round(outcome.before), _round(outcome.after), "yes" if outcome.is_close else "",
        outcome.wanted, finding.because,
        _tell_time(outcome.first, zone), _tell_time(outcome.last, zone), outcome.needs,
        outcome.counted,
    )  # fmt: skip


def _round(value: float | None) -> float | None:
    return None if value is None else round(float(value), 4)


def _tell_time(instant: np.datetime64 | None, zone: str) -> str:
    if instant is None or np.isnat(instant):
        return ""
    return read_clock(zone, instant)


def tell_value(outcome: Outcome) -> str:
    """Describe a value with what it may be off by, beside its limit."""
    if outcome.value is None:
        return ""
    unit = outcome.unit
    value = tell_amount(outcome.value, unit)
    off = f" ± {tell_amount(outcome.off, unit)}" if outcome.off >= _LEAST.get(unit, 0.0005) else ""
    return value + off


_LEAST = {"h": 1 / 120, "%": 0.05}


def tell_rule(verdict: RuleVerdict) -> str:
    """Describe the verdict on a rule in a sentence with numbers."""
    return f"{verdict.rule.title}: {verdict.verdict.upper()}. {tell_reason(verdict)}"


def tell_reason(verdict: RuleVerdict) -> str:
    """Describe how many pass and fail a rule, and which decides."""
    findings = verdict.findings
    counts = {word: verdict.count(word) for word in (PASS, FAIL, UNKNOWN)}
    if len(findings) == 1:
        return _tell_one(findings[0])
    nouns = {_NOUNS.get(finding.kind, finding.kind) for finding in findings}
    noun = nouns.pop() if len(nouns) == 1 else "receiver"
    whole = len(findings)
    again = len({(finding.check, finding.where) for finding in findings}) < whole
    and_dates = " and dates" if again and noun != "receiver" else ""
    ends = ("passes" if counts[PASS] == 1 else "pass", "fails" if counts[FAIL] == 1 else "fail")
    sentence = f"{counts[PASS]:,} of {whole:,} {noun}s{and_dates} {ends[0]}"
    if counts[FAIL]:
        sentence += f", {counts[FAIL]:,} {ends[1]}"
    if counts[UNKNOWN]:
        sentence += f", {counts[UNKNOWN]:,} {'is' if counts[UNKNOWN] == 1 else 'are'} unknown"
    judged = [finding for finding in findings if finding.verdict == verdict.verdict]
    shown = min(judged, key=lambda finding: finding.outcome.slack)
    word = {FAIL: "worst", PASS: "nearest to the limit", UNKNOWN: "such as"}[verdict.verdict]
    return f"{sentence}; {word} {_tell_one(shown)}"


def _tell_one(finding: Finding) -> str:
    outcome = finding.outcome
    if outcome.value is None:
        return f"{outcome.needs[:1].upper()}{outcome.needs[1:]}." if outcome.needs else "."
    # In full: an amount alone does not say of what it is.
    limit = f" where the rule asks for {outcome.wanted}" if outcome.wanted else ""
    date = f" on {name_date(outcome.date)}" if outcome.date else ""
    if date and outcome.counted:  # a map beside it may show other hours of the day
        date += f", {outcome.counted},"
    before = ""
    if outcome.before is not None:
        former = _tell_measured(outcome, outcome.before)
        before = f" of the former {former}" if _is_ratio(outcome) else f" ({former} before)"
    who = f"'{finding.where}'" + (f" ({finding.because})" if finding.because else "")
    needs = f"; {outcome.needs}" if outcome.needs else ""
    return f"{who} with {tell_value(outcome)}{before}{date}{limit}{needs}."


def _sort(verdict: RuleVerdict) -> list[Finding]:
    """Return the findings, the worst first."""
    return sorted(
        verdict.findings,
        key=lambda finding: (
            _ORDER[finding.verdict],
            round(finding.outcome.slack, 6),
            finding.where,
        ),
    )


def list_brief(verdict: RuleVerdict) -> list[tuple[str, str, str, str]]:
    """Return name, value, limit and verdict of each finding, the worst first."""
    rows = []
    for finding in _sort(verdict):
        outcome = finding.outcome
        rows.append((finding.where, _tell_judged(outcome), _tell_bound(outcome), finding.verdict))
    return rows


def tell_verdicts(verdicts: Sequence[RuleVerdict]) -> list[str]:
    """Tell the verdict on each rule, and then a line for each of the worst receivers."""
    lines = []
    for verdict in verdicts:
        rows = list_brief(verdict)
        lines.append(tell_rule(verdict))
        lines += [
            f"  {word}: {name}{f', {value}' if value else ''}{f' ({bound})' if bound else ''}"
            for name, value, bound, word in rows[:_MOST_TOLD] if len(rows) > 1
        ]  # fmt: skip
        if len(rows) > _MOST_TOLD:
            lines.append(f"  and {len(rows) - _MOST_TOLD:,} more, in verdicts.csv")
        lines += [f"  note: {note}" for note in verdict.notes]
    return lines


def _tell_bound(outcome: Outcome) -> str:
    """Describe the limit and its side."""
    if outcome.limit is None or outcome.margin is None or outcome.value is None:
        return ""
    return f"{'≥' if outcome.is_least else '≤'} {tell_amount(outcome.limit, outcome.unit)}"


def list_shown(verdict: RuleVerdict, zone: str) -> list[tuple[str, ...]]:
    """Return the rows of a table for a person: name, date, value, limit, margin, verdict, note."""
    rows: list[tuple[str, ...]] = []
    for finding in _sort(verdict):
        outcome = finding.outcome
        first, last = _tell_time(outcome.first, zone), _tell_time(outcome.last, zone)
        notes = [
            f"level {outcome.level}" if outcome.level else "",
            f"by {finding.because}" if finding.because else "",
            "close to the limit" if outcome.is_close else "",
            outcome.needs,
        ]
        rows.append((
            finding.where, str(outcome.date or ""),
            _tell_measured(outcome, outcome.before),
            "" if outcome.before is None else _tell_measured(outcome, outcome.after),
            _tell_judged(outcome),
            "" if outcome.limit is None else tell_amount(outcome.limit, outcome.unit),
            "" if outcome.margin is None else _sign(outcome.margin, outcome.unit),
            f"{first} to {last}" if first and outcome.unit == "h" else "", outcome.verdict,
            "; ".join(filter(None, notes)),
        ))  # fmt: skip
    return rows


SHOWN = (
    "name", "date", "before", "after", "value", "limit", "margin", "from, to", "verdict", "remark",
)  # fmt: skip
_ORDER = {FAIL: 0, UNKNOWN: 1, PASS: 2}


def _is_ratio(outcome: Outcome) -> bool:
    return outcome.unit == "1" and outcome.measure != "sky_view_factor"


def _tell_measured(outcome: Outcome, value: float | None) -> str:
    """Describe a value in the unit of its measure, also where a ratio is judged."""
    if value is None:
        return ""
    share = outcome.measure.startswith("share_with_")
    known = MEASURES.get(outcome.measure)
    return tell_amount(value, "%" if share or known is None else known.unit)


def _tell_judged(outcome: Outcome) -> str:
    """Describe what is compared with the limit: a value, a ratio to before, or a loss."""
    is_other = outcome.before is not None and outcome.after != outcome.value
    what = " of before" if _is_ratio(outcome) else " lost" if is_other else ""
    return tell_value(outcome) + what


def _sign(value: float, unit: str) -> str:
    sign = "\u2212" if value < 0 else "+"
    return sign + tell_amount(abs(value), unit)


def sum_up(verdicts: Sequence[RuleVerdict], zone: str) -> list[dict[str, Any]]:
    """Return the verdicts for JSON."""
    rules = []
    for verdict in verdicts:
        rule = verdict.rule
        rules.append({
            "rule": rule.name, "title": rule.title, "edition": rule.edition, "source": rule.source,
            "standing": rule.standing, "standing_means": STANDINGS[rule.standing],
            "verdict": verdict.verdict, "sentence": tell_rule(verdict),
            **{word: verdict.count(word) for word in (PASS, FAIL, UNKNOWN)},
            "notes": [*rule.notes, *verdict.notes],
            "findings": [
                dict(zip(COLUMNS[5:], _make_row(finding, finding.outcome, zone)[5:], strict=True))
                for finding in verdict.findings
            ],
        })  # fmt: skip
    return rules
