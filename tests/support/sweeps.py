"""
How much of a sweep a run makes.

The whole suite has 20 minutes on two cores: of sweeps over many scenes, lights and seeds it makes
a share, in which every value of each list is met. ``make test ARGS=--thorough`` makes all.
"""

_is_thorough = False


def make_all(is_thorough):
    """Say, before any test is collected, whether sweeps are made whole."""
    global _is_thorough
    _is_thorough = is_thorough


def some(cases, one_in, first=0):
    """Give every so many-th of a sweep's cases, from the first on."""
    return list(cases) if _is_thorough else list(cases)[first % one_in :: one_in]


def fewer(count, by):
    """Give a so many-th of a count of random cases."""
    return count if _is_thorough else -(-count // by)


def some_pairs(these, those, one_in, first=0):
    """Give every so many-th pair, of each of these and of each of those."""
    return [
        (one, other)
        for i, one in enumerate(these)
        for j, other in enumerate(those)
        if _is_thorough or (i + j + first) % one_in == 0
    ]
