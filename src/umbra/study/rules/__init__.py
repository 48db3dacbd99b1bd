"""
Rules as data: a YAML file says what is to be measured, where and when, and how much is enough.

``read.py`` reads a file's checks, ``measure.py`` measures them on their own dates, and ``judge.py``
gives verdicts with their evidence.
"""

from umbra.study.rules.judge import judge
from umbra.study.rules.measure import Verdict
from umbra.study.rules.read import Check, Place, Rules, read_rules

__all__ = ["Check", "Place", "Rules", "Verdict", "judge", "read_rules"]
