"""Options of a proof, each with its type, default, help and heading."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

from umbra.option_fields import Given, Options, again, check_types, option, record
from umbra.study.options import StudyOptions
from umbra.verdicts.sunlight import check_year

__all__ = ["JudgedOptions", "ProofOptions", "take_study_options"]

_rules = partial(option, heading="Rules")
_judged = partial(option, heading="What is judged")
_casters = partial(option, heading="Casters")
_sheet = partial(option, heading="Sheet")
_study = partial(again, StudyOptions)


@record
class RuleNames(Options):
    """The rules of a proof."""

    rules: Sequence[str] = _rules(
        "texts",
        "Rule to judge by: a name that 'umbra rules' lists, NAME:VARIANT, or a file.",
        default=(), metavar="NAME|FILE",
    )  # fmt: skip


@record
class JudgedOptions(Options):
    """
    Options of a proof besides its rules; see ``umbra.prove``.

    Raises
    ------
    InputError
        If a value is wrong.
    """

    year: int | None = _rules(
        "whole", "Year of the rules' dates; default: this year.", least=1950, metavar="YYYY"
    )
    sunshine: Any = _study("sunshine", heading="Rules")
    areas: Any = _study("areas", heading="What is judged")
    areas_on: str = _study("areas_on", heading="What is judged")
    windows: Any = _judged(
        "table",
        "Table of windows: name,x,y,z,azimuth,width,height[,tilt,sill,reveal,flat,room]; default: "
        "those of the model, if its file has them.",
        metavar="FILE",
    )  # fmt: skip
    reveal: Any = _judged(
        "any", "Depth of panes behind the wall's outer face where none is given [m].", metavar="M"
    )
    plot: Any = _judged(
        "table", "The plot's boundary, a file of one polygon, for rules of bands beside it.",
        metavar="FILE",
    )  # fmt: skip
    proposed: Sequence[str] = _casters(
        "patterns",
        "Parts of the proposal: names, kinds or layers; the model without them is before.",
        default=(),
    )
    replace: Sequence[str] = _study("replace", heading="Casters")
    replace_in: str | Path | Sequence[Any] | None = _study("replace_in", heading="Casters")
    cast: Sequence[str] = _study("cast")
    no_cast: Sequence[str] = _study("no_cast")
    canopy: Sequence[str] = _study("canopy")
    transmissivity: Any = _study("transmissivity")
    leaf_on: str | None = _study("leaf_on")
    horizon: Any = _study("horizon", heading="Casters")
    horizon_from: Given[float | str | None, float | None] = _study(
        "horizon_from", heading="Casters"
    )
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
    threads: int | None = _study("threads")

    def __post_init__(self) -> None:
        check_types(self)
        year = self.year if self.year is not None else dt.datetime.now(dt.UTC).year
        object.__setattr__(self, "year", check_year(int(year)))
        if self.logo is not None:
            object.__setattr__(self, "logo", Path(self.logo))


@record
class ProofOptions(JudgedOptions, RuleNames):
    """Options of a proof."""


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
