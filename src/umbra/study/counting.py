"""Counting the instants of a period on some receivers, and entering what was found."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import Counter
from umbra.study.ledger import Ledger
from umbra.study.spells import Spells, SpellState, join_days, to_hours

__all__ = ["count_period"]

_AT_ONCE = 8
"""Suns whose masks are held at a time."""


def count_period(
    counter: Counter,
    shape: tuple[int, ...],
    ledger: Ledger,
    where: Any = ...,
    progress: Callable[[int], object] = lambda _: None,
    solid: Counter | None = None,
) -> None:
    """
    Count every step of the ledger's period on some receivers.

    Parameters
    ----------
    counter : Counter
    shape : tuple of int
        Of these receivers.
    ledger : Ledger
        Written to.
    where : index
        Where these receivers lie among the ledger's; all of them by default.
    progress : callable
        Told how many instants were done, now and then.
    solid : Counter, optional
        Counts the same receivers without canopies, where there are any.
    """
    period = ledger.period
    up = np.flatnonzero(period.sun.is_up)
    if ledger.wanted.is_streamed:
        _stream(counter, shape, ledger, where, progress, solid)
        return
    if not ledger.has_days:
        hours, behind = _weigh(counter, shape, ledger, up, progress, solid)
        ledger.keep_hours(hours, where)
        ledger.keep_behind(behind, where)
        return
    total, total_behind = np.zeros(shape), np.zeros(shape)
    for day in range(len(period.days)):
        some = up[period.day_of_step[up] == day]
        hours, behind = _weigh(counter, shape, ledger, some, progress, solid)
        ledger.keep_hours(hours, where, day)
        ledger.keep_behind(behind, where, day)
        total += hours
        total_behind += behind
    ledger.keep_hours(total, where)
    ledger.keep_behind(total_behind, where)


def _weigh(
    counter: Counter,
    shape: tuple[int, ...],
    ledger: Ledger,
    which: NDArray[np.intp],
    progress: Callable[[int], object],
    solid: Counter | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Give the hours in shadow in some steps, and those behind canopies alone."""
    if solid is None or ledger.shares is None:
        return _add_up(counter, shape, ledger, which, progress), np.zeros(shape, np.float32)
    shares = ledger.shares[ledger.period.day_of_step[which]]
    hours, behind = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for share in np.unique(shares):
        some = which[shares == share]
        dark = _add_up(solid, shape, ledger, some, lambda _: None)
        weakened = _add_up(counter, shape, ledger, some, progress) - dark
        hours += dark + np.float32(1 - share) * weakened
        behind += weakened
    return hours, behind


def _add_up(
    counter: Counter,
    shape: tuple[int, ...],
    ledger: Ledger,
    which: NDArray[np.intp],
    progress: Callable[[int], object],
) -> NDArray[np.float32]:
    """Give the hours in shadow in some steps, in whatever order."""
    lengths, suns = ledger.period.hours[which], ledger.period.sun.direction[which]
    # All steps are equally long but for each day's last: few lengths.
    hours = np.zeros(shape, np.float32)
    for length in np.unique(lengths):
        counts = np.zeros(shape, np.int32)
        counter.add_steps(suns[lengths == length], counts, progress)
        hours += np.multiply(counts, np.float32(length), dtype=np.float32)
    return hours


def _stream(
    counter: Counter,
    shape: tuple[int, ...],
    ledger: Ledger,
    where: Any,
    progress: Callable[[int], object],
    solid: Counter | None,
) -> None:
    """Let the instants pass in order: keep their masks, follow the spells."""
    period = ledger.period
    starts, ends, owner = period.starts, period.ends, period.day_of_step
    days: list[Spells] = []
    for day in range(len(period.days)):
        up = np.flatnonzero(period.sun.is_up & (owner == day))
        state = SpellState(shape, ledger.wanted.min_spell)
        behind = np.zeros(shape if solid else (0,), np.int64)
        for first in range(0, len(up), _AT_ONCE):
            some = up[first : first + _AT_ONCE]
            suns = period.sun.direction[some]
            masks = counter.masks(suns)
            if solid is not None:
                dark = solid.masks(suns)
                weakened = masks & ~dark
                for mask, length in zip(weakened, (ends - starts)[some].tolist()):
                    behind += mask * np.int64(length)
                masks = dark if ledger.lets_all_through(day) else masks
                ledger.keep_masks(some, dark, weakened, where)
            else:
                ledger.keep_masks(some, masks, None, where)
            state.add_steps(masks, starts[some], ends[some])
            progress(len(some))
        spells = state.finish()
        if solid is not None and ledger.shares is not None:
            spells = spells.add_behind(behind, float(ledger.shares[day]))
        enter_day(ledger, spells, int((ends[up] - starts[up]).sum()), where, day)
        days = [join_days([*days, spells])]
    enter_period(ledger, days[0], int((ends - starts)[period.sun.is_up].sum()), where)


def enter_day(ledger: Ledger, spells: Spells, up: int, where: Any, day: int | None) -> None:
    """Enter the spells of one day, in which the sun was up for so long [us]."""
    light = spells.sun if spells.light is None else spells.light
    ledger.keep_hours(to_hours(up - light), where, day)
    ledger.keep_spells(spells, where, day)
    if spells.behind is not None:
        ledger.keep_behind(to_hours(spells.behind), where, day)


def enter_period(ledger: Ledger, spells: Spells, up: int, where: Any) -> None:
    """Enter the spells of the whole period, in which the sun was up for so long [us]."""
    enter_day(ledger, spells, up, where, None)
