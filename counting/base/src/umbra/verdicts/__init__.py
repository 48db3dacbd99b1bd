"""
Verdicts: pass, fail or unknown, of rules on named areas, windows, bands and places.

``judged_receivers.py`` lays receivers out, ``sunlight.py`` counts the sun at each moment on them,
before and after, ``values.py`` measures conditions, ``outcome.py`` compares them with limits,
``judge.py`` joins them to verdicts.
"""

from umbra.verdicts.judge import Finding, RuleVerdict, judge_rules
from umbra.verdicts.judged_receivers import Gathered
from umbra.verdicts.sunlight import Model

__all__ = ["Finding", "Gathered", "Model", "RuleVerdict", "judge_rules"]
