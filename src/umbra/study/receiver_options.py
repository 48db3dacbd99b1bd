"""Options of a study about where shadows are counted, and what casts them."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from umbra.option_fields import Given, option, record
from umbra.study.time_options import TimeOptions

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["ReceiverOptions"]

_receivers = partial(option, heading="Receivers")
_casters = partial(option, heading="Casters")
_camera = partial(
    _receivers, "numbers", count=3, unit="m", metavar="X,Y,Z", receivers=("camera",),
    is_needed=True,
)  # fmt: skip
_RASTERS = ("ground", "top", "elevation", "view", "camera")


@record
class ReceiverOptions(TimeOptions):
    """Options of receivers and casters, besides those of time; see ``umbra.shadow_study``."""

    receivers: str = _receivers(
        "text", "Where shadows are counted. ground: the ground alone, without roofs; top: ground "
        "and roofs, as seen from straight above; auto: top where the model has ground of its own, "
        "else ground; north, east, south, west or an azimuth in degrees: the elevation seen from "
        "there; 215/35: a view from azimuth 215, looking down 35 degrees; camera: the view from "
        "eye=; surfaces: walls and roofs, sampled; points: the places in points=; windows: those "
        "of the model or of windows=; areas: those in areas= alone.",
        default="auto", metavar="WHAT", registry="receivers",
    )  # fmt: skip
    spacing: Given[float | str, float] = _receivers(
        "length", "Distance between the samples of surfaces [m].",
        more='Lengths may be text with a unit, here and below: ``"50cm"``, ``"30 ft"``.',
        default=0.5, unit="m", metavar="M", receivers=("surfaces",), attribute="spacing_m",
    )  # fmt: skip
    on: Sequence[str] = _receivers(
        "patterns", "Sample these parts alone or, in elevations and camera views, show these "
        "alone: names, kinds or layers.",
        default=(), receivers=("elevation", "view", "camera", "surfaces"),
    )  # fmt: skip
    points: Given[ArrayLike | str | Path | None, Any] = _receivers(
        "table", "CSV file of points: x,y,z or x,y,z,nx,ny,nz in the model's coordinates. A point "
        "without a normal is judged from both sides of a surface on which it lies.",
        more="Or an array (n, 3) or (n, 6).",
        unit="m", metavar="FILE", receivers=("points",), is_needed=True,
    )  # fmt: skip
    names: Sequence[str] = _receivers(
        "texts", "Names of the points.", default=(), flag=None, receivers=("points",)
    )
    eye: Given[ArrayLike | None, Sequence[float] | None] = _camera(
        "Position of the camera [m].", attribute="eye"
    )
    target: Given[ArrayLike | None, Sequence[float] | None] = _camera(
        "Point that the camera looks at [m].", attribute="target"
    )
    fov: float = _receivers(
        "number", "The camera's vertical field of view.", default=50.0, unit="degree",
        metavar="DEG", receivers=("camera",), attribute="fov_deg",
    )  # fmt: skip
    ground: Given[float | str | Path | None, float | str | None] = _receivers(
        "ground", "What the ground is: feet, a surface through the feet of the buildings; level, "
        "a plane at their median height; a height [m]; or a terrain file. Default: the file's own "
        "ground or terrain; else feet where they differ by more than 3 m, else level.",
        more="Attributes ``ground`` and ``assumption`` state it.",
        unit="m", metavar="feet|level|Z|FILE",
    )  # fmt: skip
    windows: Given[str | Path | Sequence[Any] | None, Any] = _receivers(
        "table", "CSV file of windows: name,x,y,z,azimuth,width,height and, if known, "
        "tilt,sill,reveal,flat,room; x,y,z is the middle of the pane's outer face. Default: those "
        "of the model.", more="``study.windows`` is their result.",
        metavar="FILE", receivers=("windows",),
    )  # fmt: skip
    judge: Literal["centre", "sill", "pane"] = _receivers(
        "choice", "Where windows are judged: the centre of the pane, the middle of its lower edge, "
        "or the whole pane.", more="A whole pane counts by the share of it in the sun.",
        default="centre", choices=("centre", "sill", "pane"), receivers=("windows",),
    )  # fmt: skip
    reveal: str | float | None = _receivers(
        "any", "Depth of panes behind the wall's outer face [m], where neither the table nor "
        "the model gives it; none: judge all on the outer face.",
        metavar="M|none", receivers=("windows",),
    )  # fmt: skip
    areas: Given[str | Path | Mapping[str, Any] | Sequence[Any] | None, Any] = _receivers(
        "table", "Named areas such as gardens: a file of polygons (GeoJSON, GeoPackage, Shapefile, "
        "DXF), or a pattern of the model's parts or kinds. Each is judged on a lattice of its own.",
        more="Or a GeoDataFrame, polygons by name, or several Areas. ``study.areas`` is their "
        "table; ``receivers='areas'`` judges them alone.", metavar="FILE|PATTERN",
    )  # fmt: skip
    areas_on: str = _receivers(
        "any", "What areas are judged on: ground, top, or a plane above the ground (ground+1.5) or "
        "above the mean ground of each (mean+4) [m].", default="ground", metavar="WHERE",
    )  # fmt: skip
    band: Sequence[str] = _receivers(
        "texts", "Instead of each area judge the ring between two distances from its boundary [m], "
        "such as 5,10; areas_on=mean+4 is then above the mean ground of the area itself.",
        default=(), metavar="NEAR,FAR",
    )  # fmt: skip
    least: str | float | dt.timedelta = _receivers(
        "any", "Areas: the share of each that gets at least this much sun on a date.",
        more="A number is of hours.", default="2h", metavar="DURATION",
    )  # fmt: skip
    extent: Sequence[float] | None = _receivers(
        "numbers", "Rectangle of the plan [m]; default: the model and its shadows, at least 20 m "
        "around it, and areas=.", unit="m", count=4, metavar="XMIN,YMIN,XMAX,YMAX",
        receivers=(*_RASTERS, "areas"),
    )  # fmt: skip
    cell: Given[float | str | None, float | None] = _receivers(
        "length", "Side of a cell [m]; default: about 1000 cells on the longer side.", unit="m",
        metavar="M", receivers=(*_RASTERS, "areas"),
    )  # fmt: skip
    size: Sequence[int] | None = _receivers(
        "size", "Size of the raster, instead of cell=.", more="(columns, rows)", count=2,
        receivers=_RASTERS,
    )  # fmt: skip
    cast: Sequence[str] = _casters(
        "patterns", "Only these parts cast shadows: names, kinds, layers or tags.", default=()
    )
    no_cast: Sequence[str] = _casters(
        "patterns", "These parts cast no shadows: names, kinds, layers or tags.", default=()
    )
    canopy: Sequence[str] = _casters(
        "patterns", "Parts that transmit a share of the light, such as trees: names, kinds or "
        "layers.", more="They receive nothing.", default=(),
    )  # fmt: skip
    transmissivity: str | float | Sequence[float] | None = _casters(
        "any", "Share of the light that passes canopies, such as 0.1, or 0.1:0.6 with leaves and "
        "without; default: 0.03.", metavar="SHARE",
    )  # fmt: skip
    leaf_on: str | None = _casters(
        "any", "With two shares: the days from which and to which trees have leaves.",
        metavar="MM-DD..MM-DD",
    )  # fmt: skip
