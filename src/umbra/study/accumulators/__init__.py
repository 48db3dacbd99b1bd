"""
Accumulators: what a study keeps of the lights that pass over its receivers, one file each.

    hours.py        hours in shadow, added up; sun intervals of steps; every instant
    intervals.py    first and last sun, the longest interval: what streams through
    exact.py        when shadow begins and ends, solved to a tolerance
    attribution.py  hours due to chosen casters, and what a proposal takes
    arrays.py       the arrays of a result that these fill in
"""
