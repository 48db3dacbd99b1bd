"""Points that stand for the areas and windows of rules."""

from dataclasses import dataclass

from umbra.rules import Requirement
from umbra.verdicts.judged_receivers import Gathered, Lacking
from umbra.verdicts.subjects import Subjects
from umbra.verdicts.sunlight import SunlightOf

__all__ = ["GatheredPoints"]


@dataclass(eq=False)
class GatheredPoints(Gathered):
    """
    The receivers of rules, where points may stand for areas and windows.

    Parameters
    ----------
    points : Subjects, optional
    """

    points: Subjects | None = None

    def find(self, requirement: Requirement) -> list[SunlightOf] | Lacking:
        """Return the receivers of a requirement, or what lacks."""
        if self.points is None or not {"areas", "windows"} & {*requirement.receivers}:
            return super().find(requirement)
        points = self.points
        sunlight: SunlightOf = self._keep("points", lambda: points)
        return [sunlight]
