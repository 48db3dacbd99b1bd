"""Places that people name: areas of the plan (gardens, plots, parks), and windows of rooms."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.packages import need

__all__ = ["Area", "Window"]


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

    @property
    def plain(self) -> tuple[str, str, dict[str, str]]:
        """Its name, polygon (WKB in hexadecimal digits) and properties, as literals."""
        properties = {str(name): str(value) for name, value in self.properties.items()}
        return self.name, self.polygon.wkb_hex, properties

    @classmethod
    def of_plain(cls, plain: tuple[str, str, dict[str, str]]) -> "Area":
        """Make it of its literals."""
        shapely = need("shapely", "gis", "areas")
        name, polygon, properties = plain
        return cls(name, shapely.from_wkb(polygon), properties)


_LEVEL = 1e-6  # horizontal part of a normal of a level pane


@dataclass(frozen=True, eq=False)
class Window:
    """
    A window.

    Parameters
    ----------
    name : str
    center : (3,) float64
        Middle of the pane's outer face, in the model's own coordinates [m].
    normal : (3,) float64
        Outward unit normal, in the model's axes.
    width, height : float
        Of the pane [m].
    sill : float, optional
        Height of the pane's lower edge above the floor of its room [m].
    reveal : float, optional
        Depth of the pane behind the outer face of the wall [m].
    storey, flat, room : str
        Empty if they are not known.
    is_of_model : bool
        Whether the model has the window, and its wall the hole for it.
    """

    name: str
    center: NDArray[np.float64]
    normal: NDArray[np.float64]
    width: float
    height: float
    sill: float | None = None
    reveal: float | None = None
    storey: str = ""
    flat: str = ""
    room: str = ""
    is_of_model: bool = False

    @property
    def area_m2(self) -> float:
        """Area of the pane [m2]."""
        return self.width * self.height

    @property
    def axes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Unit vectors to the right, seen from outside, and up along the pane, (3,) each."""
        x, y, _ = self.normal
        length = float(np.hypot(x, y))
        right = np.array([-y, x, 0.0]) / length if length > _LEVEL else np.array([1.0, 0.0, 0.0])
        return right, np.cross(self.normal, right)

    @property
    def tilt(self) -> float:
        """Angle of the normal from the zenith: 0 level, 90 vertical [degrees]."""
        return float(np.degrees(np.arccos(np.clip(self.normal[2], -1.0, 1.0))))

    def find_azimuth(self, true_north: float) -> float:
        """Return the azimuth that it faces, clockwise from true north [degrees]."""
        x, y, _ = self.normal
        return float((np.degrees(np.arctan2(x, y)) - true_north) % 360.0)
