"""
Rules as data: cited files, their reader, and the records that they are read into.

``*.yaml`` are the rules that umbra brings; ``read.py`` reads these and files of one's own,
``record.py`` is what they hold. Verdicts are of ``umbra.verdicts``; ``umbra.study.rules`` judges
a study's receivers by files of format 1.
"""

from umbra.rules.catalogue import list_rules
from umbra.rules.read import read_rule
from umbra.rules.record import Alternative, Condition, Place, Requirement, Rule, list_conditions

__all__ = [
    "Alternative", "Condition", "Place", "Requirement", "Rule", "list_conditions", "list_rules",
    "read_rule",
]  # fmt: skip
