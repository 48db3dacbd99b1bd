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

__all__ = ["list_verdict_tables", "write_study_verdicts", "write_verdicts"]


def write_study_verdicts(
    path: Path, study: Study, options: StudyOptions, rules: Sequence[Rule]
) -> list[Table]:
    """Judge a study's named receivers by a cited rule, write the verdicts, and return tables."""
    return write_verdicts(path, judge_study(study, options, rules), study.site.zone)


def write_verdicts(path: Path, verdicts: Sequence[RuleVerdict], zone: str) -> list[Table]:
    """Write verdicts, with times of a zone, and return a table for each rule."""
    write_table(path, COLUMNS, list_rows(verdicts, zone))
    return list_verdict_tables(verdicts, zone)


def list_verdict_tables(verdicts: Sequence[RuleVerdict], zone: str) -> list[Table]:
    """Return a table for each rule."""
    return [
        Table(
            tell_rule(verdict),
            SHOWN,
            list_shown(verdict, zone),
            f"{_tell_counted(verdict)}{verdict.rule.edition}. Source: {verdict.rule.source}. "
            f"{verdict.rule.before_use}",
        )
        for verdict in verdicts
    ]


def _tell_counted(verdict: RuleVerdict) -> str:
    """Tell which hours the rule counts, which may be others than the study's."""
    counted = dict.fromkeys(
        finding.outcome.counted for finding in verdict.findings if finding.outcome.counted
    )
    return f"The rule counts {'; '.join(counted)}, whatever the study's hours. " if counted else ""
