"""
Rules as data: a YAML file says what is to be measured, where and when, and how much is enough.

``blocks.py`` knows the format's words, ``read.py`` reads a file by them, ``judge.py``
measures and gives verdicts with their evidence.
"""

from umbra.study.rules.judge import Verdict, judge
from umbra.study.rules.judge_points import judge_points
from umbra.study.rules.read import Check, Place, Rules, read_rules

__all__ = [
    "Check",
    "Place",
    "Rules",
    "Verdict",
    "judge",
    "judge_points",
    "read_rules",
]
