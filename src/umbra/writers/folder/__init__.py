"""
The outputs of a study: the files in its folder, and the appearance of its pictures.

``write.py`` fills the folder, ``pictures.py`` and ``elevation_sheet.py`` draw,
``captions.py`` words it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from umbra.errors import InputError, find_similar
from umbra.option_fields import (
    Options,
    check_types,
    is_area_file,
    option,
    read_path,
    read_text,
    record,
)
from umbra.packages import require
from umbra.writers.output_formats import CITY_FORMATS, FORMATS
from umbra.writers.outputs import REGISTRY, find_format

if TYPE_CHECKING:
    from collections.abc import Callable

    from umbra.scene import Scene
    from umbra.study import StudyOptions
    from umbra.writers.painter import Painter

__all__ = ["NAMES", "FolderJob", "Outputs"]

DRAWN = ("pdf", "svg")
"""The formats of pictures, besides PNG."""
OF_TILES = tuple(name for name in CITY_FORMATS if name not in FORMATS)
"""The formats of studies in tiles only."""
NAMES = (*FORMATS, *DRAWN)
"""The formats that can be written."""

_pictures = partial(option, heading="Pictures")
_files = partial(option, heading="Further files")


@record
class Outputs(Options):
    """
    Files of a study, and the appearance of its pictures.

    Raises
    ------
    InputError
        If a format is unknown or needs a package that is missing, or the rules are not
        written as they must be.
    """

    title: str | None = _pictures(
        "text", "Title of all pictures; default: the files' names.", metavar="TEXT"
    )
    subtitle: str | None = _pictures("text", "A line below the title.", metavar="TEXT")
    show: Literal["shadow", "sun"] | None = _pictures(
        "choice", "Hours in pictures and lines of equal hours; default: in shadow for one date, of "
        "sun for several, as long days have more of both. study.nc has both.",
        choices=("shadow", "sun"),
    )  # fmt: skip
    at: Sequence[str] = _pictures(
        "texts",
        "Clock times of the profile, films and outlines: 09:00,12:00,15:00; default: the profile "
        "shows the ends of all steps (round times of more than four dates), films round times, "
        "outlines whole hours.",
        default=(),
        metavar="HH:MM,...",
    )
    context: Any = _pictures(  # a path, or patterns
        "any", "Streets, green and water drawn under plans as hairlines, never counted: a file "
        "(GeoJSON, GeoPackage, Shapefile, DXF), or a pattern of the model's parts or kinds, such "
        "as Road.", metavar="FILE|PATTERN",
    )  # fmt: skip
    pictures: bool = _pictures(
        "flag", "Whether hours.png, profile.png and other maps are drawn.", default=True,
        flag="--pictures/--no-pictures",
    )  # fmt: skip
    report: bool = _files(
        "flag", "Also write report.html: a report on one page, with a slider through the day.",
        default=False,
    )  # fmt: skip
    sheet: bool = _files(
        "flag", "Also write sheet.png: plan, four elevations, times and the sun's path at a "
        "standard scale, on A3 or A1.", default=False,
    )  # fmt: skip
    paper: Literal["a3", "a1"] = _files(
        "choice", "Paper of sheet=.", default="a3", choices=("a3", "a1")
    )
    logo: Path | None = _files("any", "A PNG for the title block of sheet=.", metavar="FILE.png")
    formats: Sequence[str] = _files(
        "texts",
        f"Also write {', '.join(NAMES)}; several with commas, or repeat. pdf and svg: every "
        f"picture, with text that can be searched. Of a study in tiles: {', '.join(CITY_FORMATS)}.",
        default=(),
        flag="--write",
        metavar="FORMAT,...",
        registry="output",
    )
    rules: Any = _files(  # a path, or the rules that it holds
        "path",
        "Judge the result by a rule that 'umbra rules' lists, or a file; writes verdicts.csv.",
        metavar="NAME|FILE",
    )

    def __post_init__(self) -> None:
        check_types(self)
        object.__setattr__(self, "formats", _read_formats(self.formats))
        if len(self.formats) > len(self.files) and not self.endings:
            drawn = ",".join(name for name in self.formats if name in DRAWN)
            msg = f"write='{drawn}' asks for pictures, which are left out; choose one of the two"
            raise InputError(msg, option="write", formats=self.formats)
        if is_area_file(self.context):
            from umbra.readers.context_file import load_context  # noqa: PLC0415

            object.__setattr__(self, "context", read_path("context", self.context))
            load_context(self.context)
        if self.logo is not None:
            from umbra.writers.proof.logo import read_logo  # noqa: PLC0415

            object.__setattr__(self, "logo", read_path("logo", self.logo))
            read_logo(self.logo)
        alone = "paper" if self.paper != "a3" else "logo" if self.logo is not None else ""
        if alone and not self.sheet:
            msg = f"{alone}= is of sheet=, which is not asked for; ask for it, or leave it out"
            raise InputError(msg, option=alone)
        for name in ("title", "subtitle"):
            if text := read_text(name, getattr(self, name)):
                object.__setattr__(self, name, " ".join(text.split()))  # as it stands on a line
        if self.rules is not None:
            from umbra.rules.first_format import Rules  # noqa: PLC0415
            from umbra.rules.read import read_any  # noqa: PLC0415

            if not isinstance(self.rules, (Rules, list)):
                object.__setattr__(self, "rules", read_any(read_path("rules", self.rules)))
        if any(text.strip(" ,") for text in self.at):
            from umbra.sun.clock import check_stamps  # noqa: PLC0415

            check_stamps(self.at)
        else:
            object.__setattr__(self, "at", ())

    @property
    def endings(self) -> tuple[str, ...]:
        """Endings of the pictures' files; none if nothing is drawn."""
        if not self.pictures and not self.sheet:
            return ()
        return ("png", *(name for name in self.formats if name in DRAWN))

    @property
    def files(self) -> tuple[str, ...]:
        """Formats other than pictures."""
        return tuple(name for name in self.formats if name not in DRAWN)

    def check_receivers(self, receivers: str, *, has_hours: bool = True) -> None:
        """Raise an InputError if an output is not made of these receivers, or without hours."""
        from umbra.receivers import find_kind  # noqa: PLC0415

        kind = find_kind(receivers)
        is_on_plan = kind.is_plan or (not kind.is_raster and kind.name != "surfaces")
        if self.context is not None and not is_on_plan:
            msg = (
                f"context= lies under plans, which receivers='{receivers}' has none of; leave it "
                "out, or choose receivers='ground' or 'top'"
            )
            raise InputError(msg, option="context")
        of_tiles = [name for name in self.files if name in OF_TILES]
        if of_tiles:
            msg = (
                f"write='{','.join(of_tiles)}' is of studies in tiles; give their side, such as "
                "tiles='1km', or leave it out"
            )
            raise InputError(msg, option="write", formats=of_tiles)
        if self.sheet and not kind.is_plan:
            msg = "sheet=True shows a plan and its elevations; choose receivers='ground' or 'top'"
            raise InputError(msg, option="sheet")
        refused = [name for name in self.files if name in FORMATS and name not in kind.formats]
        if refused:
            there = "all files are"
            if kind.formats:
                there = f"{', '.join(kind.formats)} can be, the others are"
            reason = f"{there} for plans; leave it out, or choose receivers='ground' or 'top'"
            if kind.own_table:
                reason = (
                    f"{kind.own_table} and study.nc hold all of its results, always; leave it out"
                )
            msg = f"write='{','.join(refused)}' is not for receivers='{receivers}': {reason}"
            raise InputError(msg, option="write", formats=refused)
        if self.rules:
            kind.check_judged(receivers)
        if has_hours:
            return
        needing = [name for name in ("report", "sheet", "rules") if getattr(self, name)]
        needing += [f"write='{name}'" for name in self.files if find_format(name).needs_hours]
        if needing:
            msg = (
                f"{needing[0]}{'' if '=' in needing[0] else '='} is made of hours of sun, which "
                "are not asked for; add sun_hours to measure=, or leave it out"
            )
            raise InputError(msg, option=needing[0].partition("=")[0])


def _read_formats(given: Sequence[str]) -> tuple[str, ...]:
    """Read the names of formats, each once; commas separate several."""
    names = dict.fromkeys(name for text in given for name in text.replace(",", " ").lower().split())
    if not names:
        return ()
    for name in names:
        if name in DRAWN or name in OF_TILES:
            continue
        if name not in FORMATS and name not in REGISTRY:
            known = (*NAMES, *REGISTRY.names)
            near = find_similar(name, (*known, *OF_TILES))
            advice = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
            msg = f"write= does not know '{name}'; {advice}"
            raise InputError(msg, option="write", format=name)
        entry = find_format(name)
        require(entry.packages, entry.extra, f"write='{name}'")
    return tuple(names)


@dataclass(frozen=True, eq=False)
class FolderJob:
    """A study whose folder is being written."""

    study: Any  # Study or PointStudy
    folder: Path
    outputs: Outputs
    options: "StudyOptions"
    painter: "Painter"
    say: "Callable[[str], object]"  # called with each line that the user should read
    only: str | None = None  # the one picture that is drawn: 'hours' or 'profile'
    verdicts: list[str] = field(default_factory=list)  # a sentence on each rule
    failures: list[InputError] = field(default_factory=list)  # of outputs of packages
    kept: dict[Any, Any] = field(default_factory=dict, repr=False)  # what several files show

    def keep(self, key: Any, count: "Callable[[], Any]") -> Any:
        """Return what was counted of the study under a key, counted now if not before."""
        own = self.kept.setdefault(self.study, {})
        if key not in own:
            own[key] = count()
        return own[key]

    @property
    def show(self) -> Literal["shadow", "sun"]:
        """The hours that are drawn: of several dates those of sun, which can be compared."""
        return self.outputs.show or ("sun" if len(self.study.period.days) > 1 else "shadow")

    @property
    def scene(self) -> "Scene":
        """The scene that was studied."""
        return self.study.model.scene
