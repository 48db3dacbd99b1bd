"""Content of pictures as data: coordinates, captions, appearance of surfaces, hours, shadows."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from umbra.writers.pixels import resample

__all__ = [
    "DARK",
    "DOTS_PER_INCH",
    "LUMINANCE",
    "MISSING",
    "SKY",
    "Appearance",
    "ContextShape",
    "DayMap",
    "DayShadows",
    "OutlinedArea",
    "Plan",
    "Show",
    "cover_with_roofs",
    "draw_appearance",
    "find_map_size",
    "name_hours",
    "shade_roofs",
    "spread_largest",
]

Show = Literal["shadow", "sun"]
"""Hours to draw: in shadow, or in sun."""
DOTS_PER_INCH = 150
AREA = 6.5**2  # of the map [square inch], whatever its shape
LONGEST, SHORTEST = 9.5, 0.3  # sides of the map [inch]


_ROUNDING = 1e-3  # of hours [h]
SKY = (0.86, 0.885, 0.92)  # where a view sees nothing; no colour of a scale
MISSING = 0.93  # grey of cells without a value
INK = np.array([0.11, 0.11, 0.135], np.float32)
CHALK = np.array([0.62, 0.66, 0.76], np.float32)
DARK = 0.3  # luminance below which lines are of chalk
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


@dataclass(frozen=True, eq=False)
class Appearance:
    """Shade and lines of a picture's surfaces, each (rows, cols); rows ascend."""

    shade: NDArray[np.uint8]  # 255 where the legend's colours stay, 0 in the deepest shade
    lines: NDArray[np.uint8]  # how much ink there is
    # share of each pixel that holds an edge beyond which another surface begins
    jumps: NDArray[np.uint8]
    # share of each pixel that holds an edge at which two surfaces meet at an angle
    creases: NDArray[np.uint8]
    sky: NDArray[np.uint8] | None = None  # share of each pixel that shows nothing; None of plans

    def find_breaks(self, shape: tuple[int, int]) -> NDArray[np.bool_]:
        """Return the cells of a raster on edges, which contours must not cross."""
        # A contour is smoothed over two pixels each way, and would run along the edge itself.
        # Jumps are marked on both their sides, creases on one.
        near = np.maximum(spread_largest(self.jumps, 2), spread_largest(self.creases, 3))
        return resample(near.astype(np.float32), shape) > 0.2 * 255

    def find_shade(self, size: tuple[int, int]) -> NDArray[np.float32]:
        """Return the depth of shade at each pixel of a picture, (rows, cols) in [0, 1]."""
        return np.float32(1) - resample(self.shade.astype(np.float32), size) / np.float32(255)


def spread_largest(values: NDArray[np.uint8], reach: int) -> NDArray[np.uint8]:
    """Return the largest value within ``reach`` pixels each way."""
    for _ in range(2):  # along the columns, then turned along the rows
        padded = np.pad(values, ((reach, reach), (0, 0)))
        values = padded[: len(values)]
        for shift in range(1, 2 * reach + 1):
            values = np.maximum(values, padded[shift : shift + len(values)])
        values = np.ascontiguousarray(values.T)
    return values


def draw_appearance(
    image: NDArray[np.float32], appearance: Appearance, size: tuple[int, int]
) -> None:
    """Put sky and lines on an image (rows, cols, 3), in [0, 1], that is shaded already."""
    lines = resample(appearance.lines.astype(np.float32), size) / 255
    if appearance.sky is not None:
        image[resample(appearance.sky.astype(np.float32), size) > 0.5 * 255] = SKY
    drawn = lines > 0
    colors = image[drawn]
    ink = np.where((colors @ LUMINANCE)[:, None] < DARK, CHALK, INK)
    image[drawn] += lines[drawn, None] * (ink - colors)


@dataclass(frozen=True, eq=False)
class OutlinedArea:
    """A named area that is outlined on a map, in the model's own coordinates [m]."""

    name: str
    rings: tuple[NDArray[np.float64], ...]  # closed, each (n, 2); of polygons and of holes
    middle: tuple[float, float]  # a place inside


_CONTEXT = {
    "street": "streets (grey lines)", "green": "green (green lines)",
    "water": "water (blue lines)", "other": "others (grey lines)",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class ContextShape:
    """A street, green or water that is drawn under a map, in the model's own coordinates [m]."""

    kind: str  # street, green, water, other
    rings: tuple[NDArray[np.float64], ...]  # each (n, 2), not closed; holes among them
    lines: tuple[NDArray[np.float64], ...]  # each (n, 2), cut at buildings


@dataclass(frozen=True, eq=False)
class Plan:
    """A raster, seen from above or otherwise, and the words around it."""

    x: NDArray[np.float64]  # (cols,) cell centres in the model's own coordinates, ascending [m]
    y: NDArray[np.float64]  # (rows,)
    # of roofs above the ground, (rows, cols) [m]; NaN or 0 where nothing stands
    building_height: NDArray[np.float32] | None = field(default=None, repr=False)
    # degrees clockwise from upward, before foreshortening; None draws no arrow
    true_north: float | None = 0.0
    title: str = ""  # the headline
    subtitle: str = ""  # a line below it
    place: str = ""  # 48.200° N, 16.370° E · Europe/Vienna
    date: str = ""
    note: str = ""  # how it was made
    # names of the horizontal and the vertical axis, with their unit; an empty one has no ticks
    axes: tuple[str, str] = ("x [m]", "y [m]")
    # whether lengths are true across the picture, so that there is a scale bar
    has_scale: bool = True
    # length of a level metre away from the viewer in the picture: 1 from straight above
    upward: float = 1.0
    # of views, and of the topmost surface
    appearance: Appearance | None = field(default=None, repr=False)
    # (rows, cols) parts of the proposed development, to be outlined
    proposed: NDArray[np.bool_] | None = field(default=None, repr=False)
    # (rows, cols) of a plan: where there is no surface; of a view: surfaces without hours
    nothing: NDArray[np.bool_] | None = field(default=None, repr=False)
    nothing_name: str = "no surface here"  # in the key
    looks_through: bool = False  # the proposed parts, as a view does: they are hatched
    # (rows, cols), of see-through casters: outlined and hatched
    canopies: NDArray[np.bool_] | None = field(default=None, repr=False)
    canopy_name: str = "canopies"  # in the key
    # whether roofs are drawn over the receivers, as over the ground; else outlined
    roofs_cover: bool = True
    areas: tuple[OutlinedArea, ...] = ()  # of a plan: outlined with their names
    fills_areas: bool = False  # by the colours of the points in them
    context: tuple[ContextShape, ...] = field(default=(), repr=False)  # drawn, never counted
    context_name: str = ""  # the file that it is of; empty of the model's own parts

    def __post_init__(self) -> None:
        for axis in ("x", "y"):
            centres = np.asarray(getattr(self, axis), np.float64)
            if centres.ndim != 1 or not centres.size:
                msg = f"{axis} must be a row of cell centres; got the shape {centres.shape}"
                raise ValueError(msg)
            object.__setattr__(self, axis, centres)
        if self.building_height is not None:
            height = np.asarray(self.building_height, np.float32)
            if height.shape != self.shape:
                msg = f"building_height is {height.shape}, but the plan is {self.shape}"
                raise ValueError(msg)
            object.__setattr__(self, "building_height", height)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.y), len(self.x)

    @property
    def foot(self) -> str:
        """The note, and what is drawn without being counted."""
        kinds = {shape.kind for shape in self.context}
        named = [words for kind, words in _CONTEXT.items() if kind in kinds]
        if not named:
            return self.note
        *others, last = named
        listed = f"{', '.join(others)} and {last}" if others else last
        of = f"{listed}: parts of the model"
        if self.context_name:
            of = f"{listed} of {self.context_name}: drawn only, never counted"
        return " · ".join(filter(None, [self.note, of]))

    @property
    def is_building(self) -> NDArray[np.bool_]:
        """Cells with buildings, (rows, cols)."""
        if self.building_height is None:
            return np.zeros(self.shape, np.bool_)
        return np.nan_to_num(self.building_height) > 0

    def crop(self, where: tuple[slice, slice]) -> "Plan":
        """Return a part of it, by rows and columns, with the appearance of the whole."""
        rows, cols = where
        cropped = {
            name: None if array is None else array[where]
            for name, array in (
                ("building_height", self.building_height),
                ("proposed", self.proposed),
                ("canopies", self.canopies),
                ("nothing", self.nothing),
            )
        }
        return replace(self, x=self.x[cols], y=self.y[rows], **cropped)  # type: ignore[arg-type]

    @property
    def cell(self) -> tuple[float, float]:
        """A cell's width and height [m]."""
        width = np.ptp(self.x) / (len(self.x) - 1) if len(self.x) > 1 else 0.0
        height = np.ptp(self.y) / (len(self.y) - 1) if len(self.y) > 1 else 0.0
        # A raster of one row or column has square cells.
        return float(width or height or 1.0), float(height or width or 1.0)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """The outer edges: x from, x to, y from, y to [m]."""
        width, height = self.cell
        return (
            float(self.x[0] - width / 2),
            float(self.x[-1] + width / 2),
            float(self.y[0] - height / 2),
            float(self.y[-1] + height / 2),
        )


def find_map_size(plan: Plan) -> tuple[int, int]:
    """Choose the rows and columns of pixels of the map."""
    x0, x1, y0, y1 = plan.extent
    scale = np.sqrt(AREA / ((x1 - x0) * (y1 - y0)))
    scale = min(scale, LONGEST / (x1 - x0), LONGEST / (y1 - y0))
    rows, cols = (max(side * scale, SHORTEST) * DOTS_PER_INCH for side in (y1 - y0, x1 - x0))
    return round(rows), round(cols)


def name_hours(show: Show) -> str:
    """Name the hours that are shown, for keys; refuse a name that is neither."""
    if show not in get_args(Show):
        msg = f"hours of '{show}' cannot be shown; choose shadow or sun"
        raise ValueError(msg)
    return "hours of sun" if show == "sun" else "hours in shadow"


def shade_roofs(
    plan: Plan, size: tuple[int, int]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """
    Draw roofs in light grey, lit from the picture's upper left as maps are.

    Returns the grey, and how much of each pixel is building, both (rows, cols) in [0, 1].
    """
    if plan.building_height is None:
        return np.ones(size, np.float32), np.zeros(size, np.float32)
    stands = np.nan_to_num(plan.building_height)
    coverage = resample(stands > 0, size)
    # Slopes are those from cell to cell: between the pixels of one large cell there are none.
    is_coarse = plan.shape[0] < size[0] and plan.shape[1] < size[1]
    height = stands if is_coarse else resample(stands, size)
    x0, x1, _, _ = plan.extent
    pixel = (x1 - x0) / height.shape[1]
    slope_y = np.diff(height, axis=0, prepend=height[:1]) / pixel
    slope_x = np.diff(height, axis=1, prepend=height[:, :1]) / pixel
    # Rows ascend northward: a roof that falls toward upper left (-x, +y) is bright.
    toward_light = (slope_x - slope_y) / np.sqrt(2 * (1 + slope_x**2 + slope_y**2))
    grey = (0.855 + 0.075 * toward_light).astype(np.float32)
    return (resample(grey, size) if is_coarse else grey), coverage


@dataclass(frozen=True, eq=False)
class DayMap:
    """Hours on a map: of the whole study, or of one of several dates."""

    hours: NDArray  # (rows, cols), rows ascending in y, or of points (n,); NaN is no value
    title: str = ""  # the date, where there are several
    remark: str = ""  # sunrise and sunset
    hatched: NDArray[np.bool_] | None = None
    is_night: bool = False  # the sun stays below the horizon: there are no hours
    dark_from: float = math.inf  # value of ``hours`` from which a place has no sun at all

    def find_dark(self) -> NDArray[np.bool_]:
        """Return the places without any sun; hours are sums of float32 steps."""
        return np.asarray(self.hours) >= self.dark_from - _ROUNDING


@dataclass(frozen=True, eq=False)
class DayShadows:
    """The shadows of several instants on a map."""

    shadows: Iterable[NDArray[np.bool_]]  # of each stamp (rows, cols), rows ascending in y
    labels: Sequence[str]  # clock times of the stamps, "09:00"
    # (n_stamps, 2) where the sun casts shadows, along the map's axes; None writes no times
    away: NDArray[np.float64] | None = None
    title: str = ""  # the date, where there are several
    remark: str = ""  # sunrise and sunset
    is_night: bool = False  # the sun stays below the horizon: there are no shadows


def cover_with_roofs(image: NDArray[np.float32], plan: Plan, size: tuple[int, int]) -> None:
    """Draw roofs over an image (rows, cols, 3), in [0, 1]."""
    grey, coverage = shade_roofs(plan, size)
    image += coverage[..., None] * (grey[..., None] - image)
