"""What a study's folder shall hold besides ``study.nc`` and the pictures."""

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from umbra.errors import InputError

if TYPE_CHECKING:
    from umbra.study.rules import Rules
    from umbra.writers.plan import Show

__all__ = ["NAMES", "Outputs"]

NAMES = ("geotiff", "geojson", "gpkg", "dxf", "csv", "glb", "gif", "mp4", "pdf", "svg")
"""The formats that can be asked for."""
DRAWN = ("pdf", "svg")
"""Of these, what every picture is written as besides PNG."""


@dataclass(frozen=True)
class Outputs:
    """
    What is written besides ``study.nc`` and the pictures.

    Parameters
    ----------
    report : bool
    formats : tuple of str
        Of ``umbra.writers.formats.FORMATS``.
    rules : Rules, optional
    sheet : bool
    endings : tuple of str
        Of the pictures' files.
    show : {'shadow', 'sun'}
        Which hours pictures and lines tell.
    at : tuple of str
        Clock times that are outlined and filmed; round ones by default.
    """

    report: bool = False
    formats: tuple[str, ...] = ()
    rules: "Rules | None" = None
    sheet: bool = False
    endings: tuple[str, ...] = ("png",)
    show: "Show" = "shadow"
    at: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        formats: Sequence[str] = (),
        *,
        receivers: str,
        report: bool = False,
        sheet: bool = False,
        rules: str | Path | None = None,
        show: "Show" = "shadow",
        at: Sequence[str] = (),
    ) -> "Outputs":
        """
        Read and check what is asked for, before any work.

        Parameters
        ----------
        formats : sequence of str
            Of ``NAMES``; one may hold several, joined by commas.
        receivers : str
            Of the study.
        report, sheet : bool
        rules : path, optional
            A rule file.
        show : {'shadow', 'sun'}
        at : sequence of str

        Raises
        ------
        InputError
            If a format is unknown, is not for the receivers, or needs a package that is
            missing, or the rules are not written as they must be.
        """
        asked = _parse_formats(formats)
        others = tuple(name for name in asked if name not in DRAWN)
        endings = ("png", *(name for name in asked if name in DRAWN))
        read = None
        if rules is not None:
            from umbra.study.rules import read_rules  # noqa: PLC0415

            read = read_rules(Path(rules))
        from umbra.receivers import find_kind  # noqa: PLC0415  (it loads numpy)

        kind = find_kind(receivers)
        if sheet and not kind.is_plan:
            msg = "sheet=True shows a plan and its elevations; choose receivers='ground' or 'top'"
            raise InputError(msg)
        _check_formats(receivers, kind.formats, others)
        if read is not None:
            kind.check_judged(receivers)
        return cls(report, others, read, sheet, endings, show, tuple(at))


def _check_formats(receivers: str, written: tuple[str, ...], formats: tuple[str, ...]) -> None:
    """Refuse the formats in which such receivers are not written."""
    refused = [name for name in formats if name not in written]
    if refused:
        there = f"{', '.join(written)} can be, the others are" if written else "all files are"
        msg = (
            f"write='{','.join(refused)}' is not for receivers='{receivers}': {there} for plans; "
            "leave it out, or choose receivers='ground' or 'top'"
        )
        raise InputError(msg, formats=refused)


def _parse_formats(given: Sequence[str]) -> tuple[str, ...]:
    """Read the formats: names by commas, each once."""
    names = dict.fromkeys(name for text in given for name in text.replace(",", " ").lower().split())
    if not names:
        return ()
    from umbra.writers.formats import FORMATS, check_extra  # noqa: PLC0415

    for name in names:
        if name in DRAWN:
            continue
        if name not in FORMATS:
            near = difflib.get_close_matches(name, NAMES, n=1, cutoff=0.5)
            advice = f"did you mean {near[0]}?" if near else f"there are {', '.join(NAMES)}"
            msg = f"write= does not know '{name}'; {advice}"
            raise InputError(msg, format=name)
        check_extra(f"write='{name}'", FORMATS[name].packages, FORMATS[name].extra)
    return tuple(names)
