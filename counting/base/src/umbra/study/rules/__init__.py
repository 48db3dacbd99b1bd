"""
Rules as data: a YAML file states what to measure, where and when, and the limit.

``umbra.rules`` reads a file, ``measurement.py`` measures its checks on their own dates, and
``compliance.py`` gives verdicts with their evidence.
"""

from umbra.rules.first_format import Check, Rules, read_rules
from umbra.rules.record import Place
from umbra.study.rules.compliance import judge
from umbra.study.rules.measurement import Verdict

__all__ = ["Check", "Place", "Rules", "Verdict", "judge", "read_rules"]
