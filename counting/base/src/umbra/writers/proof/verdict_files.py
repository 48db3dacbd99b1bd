"""Verdicts of cited rules beside a study's results."""

from collections.abc import Sequence
from pathlib import Path

from umbra.rules.record import Rule
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.verdicts.judge import RuleVerdict
from umbra.verdicts.study_verdicts import judge_study
from umbra.writers.csv_tables import write_table
from umbra.writers.proof.rows import COLUMNS, SHOWN, list_rows, list_shown, tell_rule
from umbra.writers.report.markup import Table

__all__ = ["write_study_verdicts"]


def write_study_verdicts(
    path: Path, study: Study, options: StudyOptions, rules: Sequence[Rule]
) -> list[Table]:
    """Judge a study's named receivers by a cited rule, write the verdicts, and return tables."""
    verdicts = judge_study(study, options, rules)
    write_table(path, COLUMNS, list_rows(verdicts, study.site.zone))
    return [
        Table(
            tell_rule(one),
            SHOWN,
            list_shown(one, study.site.zone),
            f"{_tell_counted(one)}{one.rule.edition}. Source: {one.rule.source}. "
            f"{one.rule.before_use}",
        )
        for one in verdicts
    ]


def _tell_counted(verdict: RuleVerdict) -> str:
    """Tell which hours the rule counts, which may be others than the study's."""
    counted = dict.fromkeys(one.outcome.counted for one in verdict.findings if one.outcome.counted)
    return f"The rule counts {'; '.join(counted)}, whatever the study's hours. " if counted else ""
