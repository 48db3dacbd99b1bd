"""
How much of a sweep a run makes.

The whole suite has 20 minutes on two cores, so sweeps over many scenes, lights and seeds make a
share of their cases, spread over all. ``make test ARGS=--thorough`` makes every case: before a
release, and when one of these tests fails.
"""

_is_thorough = False


def make_all(is_thorough):
    """Say, before any test is collected, whether sweeps are made whole."""
    global _is_thorough
    _is_thorough = is_thorough


def is_thorough():
    """Return whether every case is made, and every process starts cold."""
    return _is_thorough


def sample_cases(cases, one_in, first=0):
    """Give one case in so many, from the first on."""
    return list(cases) if _is_thorough else list(cases)[first % one_in :: one_in]


def reduce_count(count, by):
    """Divide a number of random cases, rounded up."""
    return count if _is_thorough else -(-count // by)


def sample_pairs(rows, columns, one_in, first=0):
    """Give one pair in so many, so that each row and each column is met."""
    return [
        (row, column)
        for i, row in enumerate(rows)
        for j, column in enumerate(columns)
        if _is_thorough or (i + j + first) % one_in == 0
    ]
