"""What the passes of a mask issued, counted where they are issued."""

from dataclasses import dataclass, field

__all__ = ["Tally"]


@dataclass(eq=False)
class Tally:
    """
    Passes and rectangles of the last picture, as in the paper's Table 1.

    Parameters
    ----------
    passes : list of str
        Each drawing of the scene, by what for.
    rectangles : list of str
        Each rectangle over the whole window, by what for.
    batches, draws : int
        Of volumes: batches that are right as a whole, and calls for them.
    """

    passes: list[str] = field(default_factory=list)
    rectangles: list[str] = field(default_factory=list)
    batches: int = 0
    draws: int = 0

    def clear(self) -> None:
        """Begin a picture."""
        self.passes, self.rectangles, self.batches, self.draws = [], [], 0, 0

    @property
    def table(self) -> tuple[int, int]:
        """The paper's entry: passes / rectangles."""
        return len(self.passes), len(self.rectangles)
