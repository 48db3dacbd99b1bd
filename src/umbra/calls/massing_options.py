"""Options of the greatest heights: those over a plot, and that of a part of the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from umbra.errors import InputError
from umbra.option_fields import Given, Options, again, check_types, needed, option, record
from umbra.study.options import StudyOptions

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from umbra.rules import Rule

__all__ = ["EnvelopeOptions", "HeightOptions", "PartOptions"]

_plot = partial(option, heading="Plot")
_rules = partial(option, heading="Rules")
_casters = partial(option, heading="Casters")
_study = partial(again, StudyOptions)
_HIGHEST = 10_000.0  # [m]


@record
class HeightOptions(Options):
    """
    Options of both; see ``umbra.envelope``.

    Raises
    ------
    InputError
        If a value is wrong.
    """

    plot: Any = needed(
        "path", "Polygons to build on: GeoJSON, GeoPackage, Shapefile or DXF, in the model's "
        "coordinates or in longitude and latitude.", more="Or shapely's polygons, in the model's.",
        heading="Plot", metavar="FILE",
    )  # fmt: skip
    highest: Given[float | str, float] = _plot(
        "length", "Height that nothing may exceed [m].", default=100.0, unit="m", flag="--max",
        metavar="M",
    )  # fmt: skip
    rules: str | Path | Rule | Sequence[str | Path | Rule] = needed(
        "any", "Rule to keep, by name (umbra rules lists them) or a file.", heading="Rules",
        is_repeated=True, metavar="NAME|FILE",
    )  # fmt: skip
    areas: Any = _rules(
        "table", "Gardens, yards and parks that rules judge, or parts and kinds of the model.",
        metavar="FILE|PATTERN",
    )  # fmt: skip
    windows: Any = _rules(
        "table", "Windows that rules judge: name,x,y,z,azimuth,width,height; default: the model's "
        "own.", metavar="FILE.csv",
    )  # fmt: skip
    points: ArrayLike | str | Path | None = _rules(
        "table", "Points x,y,z or x,y,z,nx,ny,nz that stand for areas and windows; a column name "
        "names them.", more="Or an array (n, 3) or (n, 6).", metavar="FILE.csv",
    )  # fmt: skip
    names: Sequence[str] = _rules("any", "Names of the points.", default=(), flag=None)
    year: int | None = _rules(
        "whole", "Year of dates that name none; default: this year.", metavar="YYYY"
    )
    cast: Sequence[str] = _study("cast")
    no_cast: Sequence[str] = _study("no_cast")
    ground: Given[float | str | Path | None, float | str | None] = _casters(
        "ground", "Ground from which heights are measured; default: as umbra study assumes.",
        unit="m", metavar="feet|level|Z|FILE",
    )  # fmt: skip
    horizon: Any = _study("horizon", heading="Casters")
    horizon_from: Given[float | str | None, float | None] = _study(
        "horizon_from", heading="Casters"
    )
    threads: int | None = _study("threads", heading="Files")

    def __post_init__(self) -> None:
        check_types(self)
        if not 0 < self.highest <= _HIGHEST:
            msg = f"the cap of heights is a length above 0; got {self.highest}"
            raise InputError(msg, option="highest")


@record
class EnvelopeOptions(HeightOptions):
    """Options of the greatest heights over a plot; see ``umbra.envelope``."""

    cell: Given[float | str, float] = _plot(
        "length", "Side of a cell of the plot [m].", default=1.0, unit="m", metavar="M"
    )
    keep: Sequence[str] = _plot(
        "patterns", "Parts on the plot that stay; all others there are removed.", default=()
    )
    replace: Sequence[str] = _plot("patterns", "Parts elsewhere to remove, too.", default=())
    replace_in: str | Path | Sequence[Any] | None = _plot(
        "path", "Polygons: parts with half of their plan or more inside them are removed.",
        more="Or shapely's polygons.", metavar="FILE",
    )  # fmt: skip
    progress: Callable[[str], object] = option(
        "any", "Called with the name of each stage.", default=lambda _stage: None, flag=None
    )


@record
class PartOptions(HeightOptions):
    """Options of the greatest height of a part; see ``umbra.part_height``."""

    plot: Any = option("any", "For rules of bands around a plot.", flag=None)
