"""``umbra envelope``: how high one may build on a plot."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from umbra.calls.massing_options import EnvelopeOptions
from umbra.cli.click_options import HeadedOption, NewPath, SectionedCommand, record_options
from umbra.cli.reading import (
    files_argument,
    find_model_site,
    read_model,
    reading_options,
    site_options,
)
from umbra.cli.terminal import echo, echo_json, echo_path, name_reading, show_progress
from umbra.errors import InputError, write_for_shell
from umbra.machine import load_compiler

if TYPE_CHECKING:
    from umbra.calls.envelope import Envelope
    from umbra.scene import Scene
    from umbra.sun import Site

__all__ = ["command"]

HEADINGS = ("Plot", "Rules", "Casters", "Site", "Reading", "Files")


def _option(*names: str, heading: str, **more: Any) -> Any:
    return click.option(*names, cls=HeadedOption, heading=heading, **more)


@click.command("envelope", cls=SectionedCommand, headings=HEADINGS)
@files_argument
@record_options(EnvelopeOptions, optional=("plot",))
@_option(
    "--max-height", "part", heading="Plot", metavar="PART",
    help="Instead of a plot: the greatest height of this part of the model, scaled from its base, "
    "to a centimetre; it takes every rule. --out holds the part at that height, OBJ and GLB.",
)  # fmt: skip
@site_options
@reading_options()
@_option(
    "--write", heading="Files", multiple=True, metavar="NAME,...",
    help="Also write cityjson, pdf, svg or json.",
)  # fmt: skip
@_option("--out", heading="Files", type=NewPath(), metavar="DIR", help="Folder for the files.")
@click.option("--quiet", is_flag=True, help="Print only errors and, with --json, the result.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    files: tuple[str, ...],
    plot: str | None,
    part: str | None,
    write: tuple[str, ...],
    out: Path | None,
    quiet: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """
    Find how high one may build on a plot while rules of sunlight are still met around it.

    Writes envelope.png, envelope.tif (heights), envelope.obj and envelope.glb into the folder
    --out. The result is verified by an exact study with the envelope in the model; the volume
    comes with a bound that no choice of hours exceeds.

    \b
    Examples:
    umbra envelope town.city.json --plot plot.geojson --rules mine.yaml --out out
    umbra envelope town.city.json --plot plot.geojson --areas gardens.geojson \\
        --rules bre-209-gardens --out out
    umbra envelope town.city.json --max-height tower --rules mine.yaml --json
    """  # noqa: D301  (click asks for a real backspace)
    if (plot is None) == (part is None):
        msg = "give --plot FILE, or --max-height PART for a part of the model (one of the two)"
        raise InputError(msg, option="plot")
    if out is None and not as_json:
        msg = "nothing to write; give --out DIR, or --json"
        raise InputError(msg, option="out")
    load_compiler()
    from umbra.calls.envelope import envelope, read_chosen  # noqa: PLC0415
    from umbra.writers.massing.folder import check_formats, write_envelope  # noqa: PLC0415

    def say(line: str) -> None:
        if not quiet:
            echo(write_for_shell(line), err=True)

    formats = [word.strip() for text in write for word in text.split(",") if word.strip()]
    check_formats(formats)
    if part is not None and formats:
        msg = f"--write {','.join(formats)} is of an envelope over --plot; leave it out"
        raise InputError(msg, option="write")
    given["rules"] = read_chosen(given["rules"])
    with show_progress(quiet) as stages:
        stages.begin(name_reading(files))
        scene = read_model(files)
        for note in scene.notes:
            say(f"note: {note}")
        site = find_model_site(scene, say)
        stages.show_scene(scene)
        if part is not None:
            stages.begin("trying heights")
            _find_part(scene, site, part, given, out, say, as_json=as_json)
            return
        result = envelope(scene, site, plot=plot, progress=stages.begin, **given)
        written: list[Path] = []
        if out is not None:
            stages.begin("drawing and writing")
            written = write_envelope(out, result, formats, say)
    for note in result.notes:
        say(f"note: {note}")
    if as_json:
        echo_json({**result.sum_up(), "files": [str(path) for path in written]})
        return
    if not quiet:
        _tell(result)
        for path in written:
            echo_path(path)


def _find_part(
    scene: "Scene", site: "Site", part: str, given: dict[str, Any], out: Path | None,
    say: Callable[[str], None], *, as_json: bool,
) -> None:  # fmt: skip
    """Find, print and write the greatest height of a part."""
    from umbra.calls.part_height import part_height  # noqa: PLC0415
    from umbra.writers.massing.folder import write_part_height  # noqa: PLC0415

    for name in ("cell", "keep", "replace", "replace_in"):
        del given[name]
    result = part_height(scene, site, part, **given)
    written = [] if out is None else write_part_height(out, result, say)
    if as_json:
        echo_json({**result.sum_up(), "files": [str(path) for path in written]})
        return
    what = "the cap; --max sets another" if result.is_capped else "a centimetre more breaks "
    echo(f"{part} may be {result.height_m:.2f} m high: {what}{', '.join(result.binding[:3])}")
    for name in result.broken[:5]:
        echo(f"  {name} is broken without it; nothing more is taken")
    for path in written:
        echo_path(path)


def _tell(result: "Envelope") -> None:
    """Print the result for a person."""
    echo(
        f"{result.volume_m3:,.0f} m³ may be built, up to {result.max_height_m:.2f} m high; no "
        f"choice of hours allows more than {result.bound_m3:,.0f} m³"
    )
    if not result.violations:
        echo("an exact study with the envelope in the model finds no rule broken")
    for broken in result.violations[:5]:
        echo(f"  {broken.name} has {broken.measured:.2f} h of {broken.wanted:.2f} h")
