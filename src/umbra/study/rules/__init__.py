"""
Rules as data: a YAML file states what to measure, where and when, and the limit.

``read.py`` reads a file's checks, ``measure.py`` measures them on their own dates, and ``judge.py``
gives verdicts with their evidence.
"""

from umbra.study.rules.judge import judge
from umbra.study.rules.measure import Verdict
from umbra.study.rules.read import Check, Place, Rules, read_rules

__all__ = ["Check", "Place", "Rules", "Verdict", "judge", "read_rules"]
