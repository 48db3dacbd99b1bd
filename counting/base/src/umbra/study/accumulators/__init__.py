"""
Accumulators: results that a study collects while counting lights on its receivers.

    hours.py        hours in shadow, added up; sun intervals of steps; every instant
    intervals.py    first and last sun, the longest interval, from instants in time order
    exact.py        when shadow begins and ends, solved to a tolerance
    attribution.py  hours due to chosen casters, and sun lost to a proposal
    arrays.py       the arrays of a result, filled by the others
"""
