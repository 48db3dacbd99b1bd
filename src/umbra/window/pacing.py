"""How finely views are drawn: full or half resolution, and samples, by measured times."""

from dataclasses import dataclass

__all__ = ["SMOOTH", "Pacing"]

SMOOTH = 4
"""Samples of each pixel; in software, which takes 5 times as long for them, of views at rest."""


@dataclass
class Pacing:
    """
    Chooses between full and half resolution, and the samples, from measured frame times [ms].

    If a full frame takes longer than ``slow``, moving views are drawn at half resolution. Software
    antialiases once a view is at rest, unless that holds up the next move for ``patience``.
    """

    slow: float = 80.0
    patience: float = 1000.0
    whole: float = 0.0
    smooth: float = 0.0
    is_software: bool = True

    def choose_step(self, is_moving: bool) -> int:
        """Return 1 for full resolution, 2 for half."""
        return 2 if is_moving and self.whole > self.slow else 1

    def choose_samples(self, rested: float) -> int:
        """Return the samples per pixel of a view that is the same for a time [s]."""
        # Of either only one may have been measured in an hour like this.
        is_dear = min(self.smooth, _TIMES * self.whole) > self.patience
        return 1 if self.is_software and (is_dear or rested < _PAUSE) else SMOOTH

    def note(self, step: int, spent: float, samples: int = 1) -> None:
        """Update the estimated time of a full frame from a frame's time [ms]."""
        if self.is_software and samples > 1:
            self.smooth = spent
        elif step == 1:
            self.whole = spent
        else:
            # A quarter of the pixels, but much of the cost does not depend on them.
            self.whole = 0.5 * (self.whole + 3.0 * spent)


_PAUSE = 0.3  # [s] until a view is at rest
_TIMES = 5.0  # as long takes a frame of ``SMOOTH`` samples in software
