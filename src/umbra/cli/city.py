"""``umbra study --tiles``: hours of shadow of a city in one store."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from umbra.cli.options_file import OPTIONS_FILE, write_options
from umbra.cli.reading import read_values, take_reading, take_site
from umbra.cli.terminal import echo_json, echo_path, show_progress
from umbra.errors import InputError
from umbra.option_fields import list_options
from umbra.study.options import StudyOptions
from umbra.tiles.city_options import CityOptions
from umbra.writers.folder import Outputs

if TYPE_CHECKING:
    from umbra.calls.city import CityStudy

__all__ = ["study_city"]

_SHOWN = 12  # neighbours that are named


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
    from umbra.writers.city import check_city_formats, write_city_files  # noqa: PLC0415
    from umbra.writers.folder.named_tables import write_area_table  # noqa: PLC0415
    from umbra.writers.folder.summary import tell_areas  # noqa: PLC0415

    for name, _, default in list_options(outputs):
        if name not in {"formats", "pictures"} and getattr(outputs, name) != default:
            msg = f"{name}= is not made of a study in tiles; leave it out, or leave tiles= out"
            raise InputError(msg, option=name)
    check_city_formats(outputs.formats, is_plan=options.kind.is_plan)
    if read_values()["time"] is not None:
        msg = "--time poses an animated file, which is not read in tiles; leave it or --tiles out"
        raise InputError(msg)
    from umbra.calls.city import run_city  # noqa: PLC0415

    more: list[Path] = []
    with show_progress(quiet) as stages:

        def write(study: "CityStudy") -> None:
            write_options(out / OPTIONS_FILE, click.get_current_context())
            more.extend(out / name for name in write_area_table(out, study.run.areas))
            names = [*outputs.formats, *["map"] * (outputs.pictures and options.kind.is_plan)]
            stages.begin("drawing and writing")
            advance = partial(stages.advance, what="drawing and writing", unit="tiles")
            more.extend(write_city_files(study.folder, names, advance, say) if names else ())

        stages.begin("reading files")
        study = run_city(
            files, take_site(), options, city, out, take_reading(), None,
            partial(stages.advance, what="counting", unit="tiles"),
            partial(stages.advance, what="reading files", unit="files"), write,
        )  # fmt: skip
    written = [study.job.store, out / OPTIONS_FILE, *more]
    for note in study.notes:
        say(f"note: {note}")
    from umbra.writers.city.store_window import list_neighbours  # noqa: PLC0415

    for line in tell_areas(study.run.areas):
        say(line)

    neighbours = list_neighbours(study.folder)
    for one in neighbours[:_SHOWN]:
        say(
            f"{one['name']} loses sun on {one['area_touched']:,.0f} m², "
            f"at most {one['most_hours_lost']:.2f} h"
        )
    if len(neighbours) > _SHOWN:
        say(f"and {len(neighbours) - _SHOWN:,} more neighbours lose sun (--json lists them)")
    if as_json:
        told = {"neighbours": neighbours} if options.proposed else {}
        echo_json({**study.facts, **told, "files": [str(path) for path in written]})
    elif not quiet:
        for path in written:
            if path.suffix not in {".tif", ".glb"}:  # hours.vrt and tileset.json name them
                echo_path(path)
