"""Outcomes of conditions, joined by any, all and levels: pass, fail and unknown."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from umbra.rules.record import Alternative, Condition
from umbra.rules.words import MEASURES, tell_amount, tell_hours, tell_interval
from umbra.verdicts.doubt import bound_ratio
from umbra.verdicts.values import SLACK, Values

__all__ = [
    "FAIL",
    "PASS",
    "UNKNOWN",
    "Outcome",
    "join_all",
    "join_any",
    "join_levels",
    "judge_value",
    "tell_counted",
]

PASS, FAIL, UNKNOWN = "pass", "fail", "unknown"


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """
    Outcome of a condition at one receiver.

    Parameters
    ----------
    verdict : {'pass', 'fail', 'unknown'}
    wanted : str
        The limit, in words.
    measure, unit : str
    value, limit, margin, off : float, optional
        What is compared with the limit; the margin is positive where it is kept; ``off`` is what
        the value may be off by.
    before, after : float, optional
        The measure without and with the proposal: the value is theirs, or their ratio, or loss.
    counted : str
        Hours of the day that count, and their clock.
    date : datetime.date, optional
    first, last : numpy.datetime64, optional
        UTC.
    spells : int
    level : str
        The highest level that is reached.
    needs : str
        What to give where it is unknown.
    parts : tuple of Outcome
        Those of the alternatives.
    """

    verdict: str
    wanted: str
    measure: str = ""
    unit: str = ""
    value: float | None = None
    limit: float | None = None
    margin: float | None = None
    off: float = 0.0
    before: float | None = None
    after: float | None = None
    counted: str = ""
    date: dt.date | None = None
    first: np.datetime64 | None = None
    last: np.datetime64 | None = None
    spells: int = 0
    level: str = ""
    needs: str = ""
    parts: "tuple[Outcome, ...]" = field(default=(), repr=False)

    @property
    def is_close(self) -> bool:
        """Whether the value may be off by more than the margin."""
        return self.margin is not None and abs(self.margin) < self.off

    @property
    def slack(self) -> float:
        """Margin by the limit, to compare outcomes of different measures."""
        if self.margin is None:
            return -np.inf
        return self.margin / max(abs(self.limit or 0.0), 1e-6)


def judge_value(condition: Condition, values: Values, k: int, needs_before: str) -> Outcome:
    """Judge the value of a receiver by a condition's limit."""
    value = float(values.value[k])
    before = None if values.before is None else float(values.before[k])
    is_share = values.unit == "%" and MEASURES[condition.measure].unit != "%"
    outcome = Outcome(
        verdict=UNKNOWN, wanted=tell_limit(condition, values.unit),
        measure=f"share_with_{condition.measure}" if is_share else condition.measure,
        unit=values.unit, value=value, off=float(values.off[k]), before=before, after=value,
        counted=tell_counted(condition),
        date=values.date[k], first=values.first[k], last=values.last[k],
        spells=int(values.spells[k]), level=condition.level,
    )  # fmt: skip
    if not condition.has_limit:
        return replace(outcome, needs="no number in law: a court weighs it")
    if needs_before:
        return replace(outcome, needs=needs_before)
    if condition.ratio_to_before is not None:
        assert before is not None
        ratio = 1.0 if before <= 0 else value / before
        off = bound_ratio(value, before, _at(values.before_off, k), _at(values.lost_off, k))
        return _close(outcome, ratio, condition.ratio_to_before, unit="1", off=off)
    if condition.loss_at_most is not None:
        assert before is not None
        off = _at(values.lost_off, k)
        return _close(outcome, before - value, condition.loss_at_most, is_least=False, off=off)
    if values.unit == "%" and condition.share is not None:
        return _close(outcome, value, condition.share)
    if condition.at_least is not None:
        return _close(outcome, value, condition.at_least)
    assert condition.at_most is not None
    return _close(outcome, value, condition.at_most, is_least=False)


def _at(values: NDArray[np.float64] | None, k: int) -> float:
    return 0.0 if values is None else float(values[k])


def _close(
    outcome: Outcome, value: float, limit: float, *, is_least: bool = True, unit: str = "",
    off: float | None = None,
) -> Outcome:  # fmt: skip
    margin = value - limit if is_least else limit - value
    return replace(
        outcome, verdict=PASS if margin >= -SLACK else FAIL, value=value, limit=limit,
        margin=margin, unit=unit or outcome.unit, off=outcome.off if off is None else off,
    )  # fmt: skip


def tell_counted(condition: Condition) -> str:
    """Describe the hours of the day that a condition counts; empty of measures without dates."""
    if not MEASURES[condition.measure].is_of_dates:
        return ""
    return tell_interval(condition.start, condition.end, condition.clock)


def tell_limit(condition: Condition, unit: str) -> str:
    """Describe a condition's limit."""
    quantity = MEASURES[condition.measure]
    is_least = condition.at_least is not None
    amount = condition.at_least if is_least else condition.at_most
    words = quantity.words
    if condition.min_spell:
        words += f" of at least {tell_hours(condition.min_spell.total_seconds() / 3600)}"
    limit = ""
    if amount is not None:
        limit = (
            f"at {'least' if is_least else 'most'} {tell_amount(amount, quantity.unit)} of {words}"
        )
        if not amount and not is_least:
            limit = f"no {words}"
    if condition.ratio_to_before is not None:
        of = f" of the share with {limit}" if limit and unit == "%" and quantity.unit == "h" else ""
        what = of or f" of the former {words}"
        return f"at least {condition.ratio_to_before:g}{what}"
    if condition.loss_at_most is not None:
        return f"a loss of at most {tell_amount(condition.loss_at_most, quantity.unit)} of {words}"
    if condition.share is not None and limit:
        return f"{limit} on {condition.share:g} % of the area"
    return limit or f"{words}, without a limit"


def join_any(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the outcome where one is enough: unknown where none passes and one may."""
    return _decide(outcomes, PASS, FAIL, " or ")


def join_all(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the outcome where all must pass: unknown overrides pass."""
    return _decide(outcomes, FAIL, PASS, " and ")


def _decide(outcomes: Sequence[Outcome], first: str, other: str, word: str) -> Outcome:
    """Take ``first`` if any outcome is so, else unknown if any is, else ``other``."""
    verdicts = [outcome.verdict for outcome in outcomes]
    verdict = first if first in verdicts else UNKNOWN if UNKNOWN in verdicts else other
    alike = [outcome for outcome in outcomes if outcome.verdict == verdict]
    # The nearest to the limit decides; of several that pass by choice, the clearest.
    by_choice = verdict == first == PASS or verdict == other == FAIL
    shown = (max if by_choice else min)(alike, key=lambda outcome: outcome.slack)
    wanted = word.join(dict.fromkeys(outcome.wanted for outcome in outcomes))
    return replace(shown, wanted=wanted, parts=tuple(outcomes))


def join_levels(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the outcome of levels from the lowest: the first must hold; the highest is shown."""
    lowest = outcomes[0]
    reached = [outcome for outcome in outcomes if outcome.verdict == PASS]
    level = reached[-1].level if reached and lowest.verdict == PASS else ""
    wanted = ", ".join(f"{outcome.wanted} ({outcome.level})" for outcome in outcomes)
    return replace(lowest, level=level, wanted=wanted, parts=tuple(outcomes))


def join(alternative: Alternative, outcomes: Sequence[Outcome]) -> Outcome:
    """Join the outcomes of an alternative's conditions."""
    how = {"any": join_any, "all": join_all, "levels": join_levels}
    return how[alternative.needs](outcomes)
