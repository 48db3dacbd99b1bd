"""How fine a picture is drawn while things move, so that the mouse is followed at once."""

from dataclasses import dataclass

__all__ = ["Pacing"]


@dataclass
class Pacing:
    """
    Decides between whole and half resolution, from how long frames took.

    Parameters
    ----------
    slow : float
        A whole frame that takes longer is drawn at half resolution while things move [ms].

    Attributes
    ----------
    whole : float
        What a frame at whole resolution takes, as far as is known [ms].
    """

    slow: float = 80.0
    whole: float = 0.0

    def choose_step(self, is_moving: bool) -> int:
        """Give 1 for whole resolution, 2 for half."""
        return 2 if is_moving and self.whole > self.slow else 1

    def note(self, step: int, spent: float) -> None:
        """
        Learn from a frame.

        Parameters
        ----------
        step : int
            As it was chosen.
        spent : float
            [ms]
        """
        if step == 1:
            self.whole = spent
        else:
            # A quarter of the pixels; but much of a frame does not depend on them.
            self.whole = 0.5 * (self.whole + 3.0 * spent)
