"""The folder of an envelope's files."""

from collections.abc import Callable, Sequence
from pathlib import Path

import orjson

from umbra.errors import InputError, find_similar
from umbra.folders.atomic import check_folder_name, replace_results
from umbra.massing.bisection import PartHeight
from umbra.massing.search import HeightEnvelope
from umbra.writers.massing.envelope_sheet import draw_envelope
from umbra.writers.massing.files import (
    write_height_cityjson,
    write_height_glb,
    write_height_obj,
    write_height_raster,
    write_part,
)

__all__ = ["EXTRA", "check_formats", "write_envelope", "write_part_height"]

EXTRA = ("cityjson", "pdf", "svg", "json")
"""Formats besides those that are always written."""


def check_formats(formats: Sequence[str]) -> None:
    """Refuse an unknown format."""
    for name in formats:
        if name not in EXTRA:
            near = find_similar(name, EXTRA)
            advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(EXTRA)}"
            msg = f"write '{name}' is not known; {advice}"
            raise InputError(msg, option="write")


def write_envelope(
    out: Path,
    envelope: HeightEnvelope,
    formats: Sequence[str] = (),
    say: Callable[[str], object] = lambda _line: None,
) -> list[Path]:
    """
    Write an envelope's files into a folder, which is replaced once all are complete.

    Parameters
    ----------
    out : Path
    envelope : HeightEnvelope
    formats : sequence of str
        Of ``EXTRA``.
    say : callable
        Called with what is told of earlier results.
    """
    check_formats(formats)
    check_folder_name(out)
    names = ["envelope.png", "envelope.tif", "envelope.obj", "envelope.glb"]
    with replace_results(out, say) as folder:
        sheet = draw_envelope(envelope)
        sheet.save(folder / "envelope.png")
        write_height_raster(folder / "envelope.tif", envelope)
        write_height_obj(folder / "envelope.obj", envelope)
        write_height_glb(folder / "envelope.glb", envelope)
        for name in dict.fromkeys(formats):
            if name == "cityjson":
                names.append("envelope.city.json")
                write_height_cityjson(folder / names[-1], envelope)
            elif name == "json":
                names.append("envelope.json")
                facts = orjson.dumps(envelope.sum_up(), option=orjson.OPT_INDENT_2)
                (folder / names[-1]).write_bytes(facts + b"\n")
            else:
                names.append(f"envelope.{name}")
                sheet.save(folder / names[-1])
    return [out / name for name in names]


def write_part_height(
    out: Path, found: PartHeight, say: Callable[[str], object] = lambda _line: None
) -> list[Path]:
    """Write a part at its greatest height: ``envelope.obj``, ``.glb`` and ``.json``."""
    check_folder_name(out)
    names = ["envelope.obj", "envelope.glb", "envelope.json"]
    with replace_results(out, say) as folder:
        write_part(folder / names[0], folder / names[1], found)
        facts = orjson.dumps(found.sum_up(), option=orjson.OPT_INDENT_2)
        (folder / names[2]).write_bytes(facts + b"\n")
    return [out / name for name in names]
