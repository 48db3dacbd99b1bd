"""A named area of the plan: a garden, a plot, a park."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

__all__ = ["Area"]


@dataclass(frozen=True, eq=False)
class Area:
    """
    A named area of the plan.

    Parameters
    ----------
    name : str
    polygon : shapely.Polygon or shapely.MultiPolygon
        Valid, with holes, in the model's own coordinates [m].
    properties : mapping of str to value
        The file's other columns, such as ``flat`` or ``zone``.
    """

    name: str
    polygon: Any
    properties: Mapping[str, Any] = field(default_factory=dict)

    @property
    def area_m2(self) -> float:
        """Area without holes [m2]."""
        return float(self.polygon.area)
