"""``umbra study --tiles``: hours of shadow of a city in one store."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import click

from umbra.cli.reading import read_values, take_reading, take_site
from umbra.cli.terminal import echo_json, echo_path, show_progress
from umbra.errors import InputError
from umbra.options import list_options
from umbra.study.options import StudyOptions
from umbra.tiles.options import CityOptions
from umbra.writers.folder import Outputs

__all__ = ["study_city"]


def study_city(
    files: Sequence[str],
    out: Path,
    options: StudyOptions,
    city: CityOptions,
    outputs: Outputs,
    say: Callable[[str], object],
    *,
    quiet: bool,
    as_json: bool,
) -> None:
    """Run a study in tiles, and print where its results are."""
    for name, _, default in list_options(outputs):
        if getattr(outputs, name) != default:
            msg = f"{name}= is not made of a study in tiles; leave it out, or leave tiles= out"
            raise InputError(msg, option=name)
    if read_values()["time"] is not None:
        msg = "--time poses an animated file, which is not read in tiles; leave it or --tiles out"
        raise InputError(msg)
    from umbra.calls.city import run_city  # noqa: PLC0415
    from umbra.cli.study import OPTIONS_FILE, write_options  # noqa: PLC0415

    with show_progress(quiet) as stages:
        stages.begin("reading files")
        study = run_city(
            files, take_site(), options, city, out, take_reading(), None,
            partial(stages.advance, what="counting", unit="tiles"),
            partial(stages.advance, what="reading files", unit="files"),
        )  # fmt: skip
        write_options(out / OPTIONS_FILE, click.get_current_context())
    for note in study.notes:
        say(f"note: {note}")
    if as_json:
        facts = {**study.facts, "files": [str(study.job.store), str(out / OPTIONS_FILE)]}
        echo_json(facts)
    elif not quiet:
        echo_path(study.job.store)
        echo_path(out / OPTIONS_FILE)
