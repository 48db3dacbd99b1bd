"""Options of a proof, each with its type, default, help and heading."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

from umbra.options import Options, check_types, option, record
from umbra.study.options import StudyOptions
from umbra.verdicts.sunlight import check_year

__all__ = ["ProofOptions", "take_study_options"]

_rules = partial(option, heading="Rules")
_judged = partial(option, heading="What is judged")
_casters = partial(option, heading="Casters")
_sheet = partial(option, heading="Sheet")
_running = partial(option, heading="Running")


@record
class ProofOptions(Options):
    """
    Options of a proof; see ``umbra.prove``.

    Raises
    ------
    InputError
        If a value is wrong.
    """

    rules: Sequence[str] = _rules(
        "texts",
        "Rule to judge by: a name that 'umbra rules' lists, NAME:VARIANT, or a file.",
        default=(), metavar="NAME|FILE",
    )  # fmt: skip
    year: int | None = _rules(
        "whole", "Year of the rules' dates; default: this year.", least=1950, metavar="YYYY"
    )
    sunshine: Any = _rules(
        "table",
        "CSV file month,share: the probability that the sun shines; default: 1 in every month.",
        metavar="FILE",
    )  # fmt: skip
    areas: Any = _judged(
        "table",
        "Named areas such as gardens: a file of polygons (GeoJSON, GeoPackage, Shapefile, DXF), or "
        "a pattern of the model's parts or kinds.",
        metavar="FILE|PATTERN",
    )  # fmt: skip
    areas_on: str = _judged(
        "any", "What areas are judged on: ground, top, or a plane above the ground (ground+1.5) or "
        "above the mean ground of each (mean+4) [m].",
        default="ground", metavar="WHERE",
    )  # fmt: skip
    windows: Any = _judged(
        "table",
        "Table of windows: name,x,y,z,azimuth,width,height[,tilt,sill,reveal,flat,room]; default: "
        "those of the model, if its file has them.",
        metavar="FILE",
    )  # fmt: skip
    reveal: Any = _judged(
        "any", "Depth of panes behind the wall's outer face where none is told [m].", metavar="M"
    )
    plot: Any = _judged(
        "table", "The plot's boundary, a file of one polygon, for rules of bands beside it.",
        metavar="FILE",
    )  # fmt: skip
    proposed: Sequence[str] = _casters(
        "patterns",
        "Parts of the proposal: names, kinds or layers; what is there without them is before.",
        default=(),
    )
    replace: Sequence[str] = _casters(
        "patterns", "Parts that the proposal replaces: they stand before, and are gone after; "
        "where they stood no cell of a plan was before. Ground and terrain stay.", default=(),
    )  # fmt: skip
    replace_in: str | Path | Sequence[Any] | None = _casters(
        "table", "Polygons of a plot, a file as of areas= or WKT: the proposal replaces what "
        "stands in them with half of its plan or more.",
        more="Or shapely's polygons in the model's own coordinates.", metavar="FILE|WKT",
    )  # fmt: skip
    cast: Sequence[str] = _casters(
        "patterns", "Only these parts cast shadows: names or kinds.", default=()
    )
    no_cast: Sequence[str] = _casters(
        "patterns", "These parts cast no shadows: names or kinds.", default=()
    )
    canopy: Sequence[str] = _casters(
        "patterns", "Parts that transmit a share of the light, such as trees.",
        default=(),
    )  # fmt: skip
    transmissivity: Any = _casters(
        "any", "Share of the light that passes canopies; default: 0.03.", metavar="SHARE"
    )
    leaf_on: str | None = _casters(
        "any", "With two shares: the days from which and to which trees have leaves.",
        metavar="MM-DD..MM-DD",
    )  # fmt: skip
    horizon: Any = _casters(
        "table",
        "Land up to 100 km away: a raster of heights (GeoTIFF), or a table azimuth,elevation, "
        "PVGIS' horizon profile, or bare elevations from north on.",
        metavar="FILE",
    )  # fmt: skip
    horizon_from: Any = _casters(
        "length", "Distance from which the land of a raster counts; default: as far as the model "
        "reaches from its middle.",
        unit="m", metavar="M",
    )  # fmt: skip
    ground: float | str | None = _casters(
        "ground", "What the ground is: feet, level, a height [m], or a terrain file.", unit="m",
        metavar="feet|level|Z|FILE",
    )  # fmt: skip
    title: str | None = _sheet("text", "Title; default: the files' names.", metavar="TEXT")
    project: str | None = _sheet("text", "Project, a line below the title.", metavar="TEXT")
    author: str | None = _sheet("text", "Who made the sheet.", metavar="TEXT")
    number: str | None = _sheet("text", "Number of the drawing.", metavar="TEXT")
    logo: Path | None = _sheet("any", "A PNG for the title block.", metavar="FILE.png")
    paper: Literal["a3", "a4"] = _sheet(
        "choice", "Size of proof.pdf, landscape.", default="a3", choices=("a3", "a4")
    )
    threads: int | None = _running(
        "whole", "Number of threads; default: all cores.", least=1, metavar="N", is_kept=False
    )

    def __post_init__(self) -> None:
        check_types(self)
        year = self.year if self.year is not None else dt.datetime.now(dt.UTC).year
        object.__setattr__(self, "year", check_year(int(year)))
        if self.logo is not None:
            object.__setattr__(self, "logo", Path(self.logo))


def take_study_options(options: ProofOptions) -> StudyOptions:
    """Return the options of the studies that a proof runs."""
    taken = (
        "proposed", "replace", "replace_in", "cast", "no_cast", "canopy", "transmissivity",
        "leaf_on", "ground", "sunshine", "threads", "horizon", "horizon_from",
    )  # fmt: skip
    given = {name: getattr(options, name) for name in taken}
    if options.sunshine is not None:
        given["measure"] = ("probable_sun_hours", "sun_hours")
    return StudyOptions(date=f"{options.year}-03-21", **given)
