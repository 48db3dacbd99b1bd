"""``umbra prove``: verdicts by rules, and the sheet that an office hands in."""

from functools import partial
from pathlib import Path
from typing import Any

import click

from umbra.calls.prove_options import ProofOptions
from umbra.cli.click_options import (
    HeadedOption,
    NewPath,
    SectionedCommand,
    record_options,
    take_record,
)
from umbra.cli.reading import (
    files_argument,
    find_model_site,
    read_model,
    read_values,
    reading_options,
    site_options,
    take_reading,
    take_site,
)
from umbra.cli.terminal import echo, echo_json, echo_path, name_reading, show_progress
from umbra.errors import InputError, write_for_shell
from umbra.machine import load_compiler
from umbra.tiles.city_options import TileOptions

__all__ = ["command"]

HEADINGS = (
    "Rules", "What is judged", "Casters", "Site", "Sheet", "Tiles", "Reading", "Running",
    "Options",
)  # fmt: skip


@click.command("prove", cls=SectionedCommand, headings=HEADINGS)
@files_argument
@site_options
@record_options(ProofOptions)
@record_options(TileOptions)
@reading_options()
@click.option(
    "--out", cls=HeadedOption, heading="Running", type=NewPath(), required=True, metavar="DIR",
    help="Folder for the results; created if it does not exist.",
)  # fmt: skip
@click.option(
    "--quiet", cls=HeadedOption, heading="Running", is_flag=True, help="Print only errors."
)
@click.option(
    "--json", "as_json", cls=HeadedOption, heading="Running", is_flag=True,
    help="Print one JSON object with all verdicts.",
)  # fmt: skip
def command(files: tuple[str, ...], out: Path, quiet: bool, as_json: bool, **given: Any) -> None:
    """
    Judge gardens, windows and flats by cited rules, and write the sheet to hand in.

    Writes proof.html, proof.pdf, verdicts.csv and conditions.csv. The status is 0 whatever the
    verdicts are; 2 where a rule or an option is wrong. 'umbra rules' lists the rules.

    \b
    Examples:
    umbra prove quarter.city.json house.ifc --proposed house --areas gardens.geojson \\
      --rules bre-209-gardens --out proof
    umbra prove tower.obj --plot plot.geojson --rules japan-56-2:4m-4h --out proof
    """  # noqa: D301  (click asks for a real backspace)
    from umbra.folders.atomic import replace_results  # noqa: PLC0415

    def say(line: str) -> None:
        if not quiet:
            echo(write_for_shell(line), err=True)

    options = take_record(ProofOptions, given)
    tiling = take_record(TileOptions, given)
    from umbra.calls.prove import make_proof, read_rules_of  # noqa: PLC0415

    rules = read_rules_of(options)
    with replace_results(out, say) as unfinished, show_progress(quiet) as stages:
        load_compiler()
        if tiling.tiles is not None:
            proof = _prove_city(files, options, tiling, rules, out, stages)
        else:
            stages.begin(name_reading(files))
            scene = read_model(files, options.canopy)
            for note in scene.notes:
                say(f"note: {note}")
            site = find_model_site(scene, say)
            stages.show_scene(scene)
            stages.begin("judging")
            proof = make_proof(scene, site, options, rules, write_for_shell)
        for note in proof.notes:
            say(f"note: {note}")
        stages.begin("drawing and writing")
        names = proof.fill(unfinished)
    written = [out / name for name in names]
    if as_json:
        echo_json({**proof.sum_up(), "files": [str(path) for path in written]})
        return
    if quiet:
        return
    for line in proof.tell():
        echo(write_for_shell(line))
    for path in written:
        echo_path(path)


def _prove_city(
    files: tuple[str, ...], options: ProofOptions, tiling: TileOptions, rules: Any, out: Path,
    stages: Any,
) -> Any:  # fmt: skip
    """Judge a city's files in tiles."""
    from umbra.calls.prove_city import make_city_proof  # noqa: PLC0415

    if read_values()["time"] is not None:
        msg = "--time poses an animated file, which is not read in tiles; leave it or --tiles out"
        raise InputError(msg)
    stages.begin("reading files")
    return make_city_proof(
        files, take_site(), options, tiling, rules, out, take_reading(), write_for_shell,
        partial(stages.advance, what="reading files", unit="files"), stages.begin,
    )  # fmt: skip
