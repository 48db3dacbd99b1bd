"""The sun that a proposal takes from all that is shown, in a sentence; of tiles put together."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.counted import Counted
from umbra.study.compare import LEAST
from umbra.sun.clock import say_hours

__all__ = ["TakenSun", "name_proposal"]

_MOST_NAMES = 2
"""Most parts of a proposal that are named."""


@dataclass(frozen=True)
class TakenSun:
    """
    Sun that a proposal takes, and that it lets in, on some receivers.

    Parameters
    ----------
    touched, newly, lit : float
        Area that loses sun, that falls under the limit, and that wins sun.
    most, best : float
        Most hours lost, and won, at a place [h].
    is_cut : bool
        Whether the frame may cut off what loses sun.
    """

    touched: float
    newly: float
    lit: float
    most: float
    best: float
    is_cut: bool = False

    @classmethod
    def of(
        cls, counted: Counted, lost: NDArray[np.floating], newly: NDArray, *, is_cut: bool = False
    ) -> Self:
        """Add up hours lost [h; NaN is none] and whether a limit is newly missed, both (...)."""
        lost, own = np.nan_to_num(np.asarray(lost)), counted.which
        return cls(
            counted.add_up(lost > LEAST), counted.add_up(np.asarray(newly) > 0),
            counted.add_up(lost < -LEAST), float(lost[own].max(initial=0.0)),
            -float(lost[own].min(initial=0.0)), is_cut,
        )  # fmt: skip

    @classmethod
    def join(cls, parts: Sequence[Self]) -> Self:
        """Put parts of the receivers together."""
        return cls(
            sum(part.touched for part in parts), sum(part.newly for part in parts),
            sum(part.lit for part in parts), max((part.most for part in parts), default=0.0),
            max((part.best for part in parts), default=0.0), any(part.is_cut for part in parts),
        )  # fmt: skip

    def tell(
        self, counted: Counted, taker: tuple[str, str], when: str, under: float, *, is_sum: bool
    ) -> str:
        """
        Tell what the proposal takes.

        Parameters
        ----------
        counted : Counted
            What is shown, of which the unit and the name are told.
        taker : (str, str)
            Name of the proposal, and the verb that follows.
        when : str
            Follows the ground, such as " on 21 March 2026".
        under : float
            Limit of sun on a date [h].
        is_sum : bool
            Whether the hours are those of several dates.
        """
        name, verb = taker
        ground, won = counted.name + " in the frame" * self.is_cut, ""
        if self.lit:  # where what the proposal replaces stood in the way
            lit = counted.of_weight(self.lit).tell_whole()
            won = f"; {lit} win sun, at most {say_hours(self.best)}"
        if not self.touched:
            return f"{name} {verb} no sun from {ground}{when}{won}"
        area = counted.of_weight(self.touched).tell_whole()
        falls = "nothing falls"
        if self.newly:
            falls = f"{counted.of_weight(self.newly).tell_whole()} fall"
        falls += f" under {under:g} h{' on at least one date' * is_sum}"
        most = say_hours(self.most)
        return f"{name} {verb} sun from {area} of {ground}{when}, at most {most}; {falls}{won}"


def name_proposal(
    labels: Sequence[str], layers: Collection[str], proposed: Sequence[str]
) -> tuple[str, str]:
    """
    Name the parts of the proposal, if they are few, with the verb that follows.

    Parameters
    ----------
    labels : sequence of str
        Names of its parts.
    layers : collection of str
        Layers of its parts.
    proposed : sequence of str
        Patterns that were asked for.
    """
    names = list(dict.fromkeys(labels))
    if {*layers} == {*proposed}:  # as it was asked for, by its file
        names = list(proposed)
    if not 0 < len(names) <= _MOST_NAMES:
        return "The proposal", "takes"
    return " and ".join(names), "takes" if len(names) == 1 else "take"
