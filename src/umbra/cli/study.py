"""``umbra study``: hours of shadow around buildings."""

import os
import shlex
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from umbra.cli.click_options import (
    HeadedOption,
    NewPath,
    SectionedCommand,
    record_options,
    take_record,
)
from umbra.cli.options_file import OPTIONS_FILE, option_file, write_options
from umbra.cli.reading import (
    canopy_options,
    files_argument,
    find_any_site,
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
from umbra.option_fields import list_options
from umbra.study.options import StudyOptions
from umbra.tiles.city_options import CityOptions
from umbra.writers.folder import Outputs

if TYPE_CHECKING:
    from umbra.calls.city import CityStudy
    from umbra.verdicts import RuleVerdict

__all__ = ["command"]

HEADINGS = (
    "Site", "Measures", "Time", "Receivers", "Casters", "Results", "Pictures", "Further files",
    "Tiles", "Reading", "Running", "Options",
)  # fmt: skip
_running = partial(click.option, cls=HeadedOption, heading="Running", is_kept=False)


@click.command("study", cls=SectionedCommand, headings=HEADINGS)
@files_argument
@option_file
@site_options
@record_options(StudyOptions)
@canopy_options
@record_options(Outputs)
@record_options(CityOptions)
@reading_options()
@_running(
    "--out",
    type=NewPath(),
    required=True,
    metavar="DIR",
    help="Folder for the results; created if it does not exist.",
)
@_running("--quiet", is_flag=True, help="Print only errors and, with --json, the result.")
@_running("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(files: tuple[str, ...], out: Path, quiet: bool, as_json: bool, **given: Any) -> None:
    """
    Measure sun and sky around buildings: by default the hours of shadow on one or more days.

    Writes study.nc, hours.png, profile.png and study.toml into the folder --out; with --measure
    a map of each measure.

    \b
    Examples:
    umbra study block.city.json --date 2026-03-21 --receivers top --cell 0.5 --out out/
    umbra study block.city.json tower.glb --proposed tower --areas garden.geojson \\
      --date 2026-03-21 --report --out out/
    """  # noqa: D301  (click asks for a real backspace)
    outputs, city = take_record(Outputs, given), take_record(CityOptions, given)

    def say(line: str) -> None:
        if not quiet:
            echo(write_for_shell(line), err=True)

    if city.tiles is not None:
        load_compiler()
        options = take_record(StudyOptions, given)
        study_city(files, out, options, city, outputs, say, quiet=quiet, as_json=as_json)
        return
    from umbra.folders.atomic import replace_results  # noqa: PLC0415
    from umbra.writers.painter import Painter  # noqa: PLC0415

    # The painter's child starts first: it loads its libraries while this process loads the rest.
    with (
        replace_results(out, say) as unfinished,
        show_progress(quiet) as stages,
        Painter(
            outputs.endings, partial(stages.advance, what="drawing", unit="pictures")
        ) as painter,
    ):
        load_compiler()
        options = take_record(StudyOptions, given)
        outputs.check_receivers(options.receivers, has_hours=options.asks_hours)
        from umbra.study import run  # noqa: PLC0415
        from umbra.study.land import settle_land  # noqa: PLC0415
        from umbra.study.remarks import tell_panes, tell_request  # noqa: PLC0415
        from umbra.writers.folder.summary import summarise, tell_answers  # noqa: PLC0415
        from umbra.writers.folder.write import fill_folder, note_earlier, raise_failures  # noqa: PLC0415

        stages.begin(name_reading(files))
        scene = read_model(files, options.canopy)
        for note in scene.notes:
            say(f"note: {note}")
        weather = None if options.weather is None else options.weather_year
        site = find_any_site(scene, say, is_needed=options.needs_site, weather=weather)
        look = partial(stages.advance, what="reading the land", unit="blocks")
        options = settle_land(options, scene.model_bounds(), site, look)
        notes = tell_request(scene, options, site)
        for note in (*notes, *(tell_panes(scene, options) if outputs.rules else ())):
            say(f"note: {note}")
        stages.show_scene(scene)
        stages.begin("preparing")
        study = run(scene, site, options, stages.advance)
        stages.begin("drawing and writing")
        study.facts["command"] = _find_command()
        if "assumption" in study.facts:
            study.facts["assumption"] = write_for_shell(str(study.facts["assumption"]))
        if study.period.days and not study.sun.is_up.any():
            say(
                "umbra: warning: the sun is below the horizon all this time; "
                "there are no hours of sun or shadow"
            )
        first, more, verdicts, failures = fill_folder(
            study, unfinished, outputs, options, painter, say
        )
        write_options(unfinished / OPTIONS_FILE, click.get_current_context())
    written = [out / name for name in (*first, OPTIONS_FILE, *more)]
    note_earlier(written, say)
    if as_json:
        echo_json({"files": [str(path) for path in written], **summarise(study)})
    elif not quiet:
        for path in written:
            echo_path(path)
        for line in (*verdicts, *tell_answers(study, options.proposed)):
            say(line)
    raise_failures(failures, say)


def _find_command() -> str:
    """Return the command line as valid Unicode, which file names need not be."""
    words = shlex.join(["umbra", *click.get_current_context().obj])
    return os.fsencode(words).decode("utf-8", "replace")


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
    from umbra.writers.city import (  # noqa: PLC0415
        check_city_formats,
        check_city_rules,
        write_city_files,
        write_city_months,
    )
    from umbra.writers.folder.named_tables import write_area_table  # noqa: PLC0415

    for name, _, default in list_options(outputs):
        is_made = name in {"formats", "pictures", "rules", "report"}
        if not is_made and getattr(outputs, name) != default:
            msg = f"{name}= is not made of a study in tiles; leave it out, or leave tiles= out"
            raise InputError(msg, option=name)
    rules = check_city_rules(outputs.rules, options)
    check_city_formats(outputs.formats, is_plan=options.kind.is_plan)
    if read_values()["time"] is not None:
        msg = "--time poses an animated file, which is not read in tiles; leave it or --tiles out"
        raise InputError(msg)
    from umbra.calls.city import run_city  # noqa: PLC0415

    more: list[Path] = []
    verdicts: list[RuleVerdict] = []
    with show_progress(quiet) as stages:

        def write(study: "CityStudy") -> None:
            write_options(out / OPTIONS_FILE, click.get_current_context())
            more.extend(out / name for name in write_area_table(out, study.run.areas))
            names = [*outputs.formats, *["map"] * (outputs.pictures and options.kind.is_plan)]
            if rules:
                stages.begin("judging")
                verdicts.extend(study.judge_rules([rules]))
            stages.begin("drawing and writing")
            more.extend(write_city_months(study.folder))
            advance = partial(stages.advance, what="drawing and writing", unit="tiles")
            more.extend(write_city_files(study.folder, names, advance, say) if names else ())
            more.extend(study.write_told(verdicts, report=outputs.report, spell=write_for_shell))

        stages.begin("reading files")
        study = run_city(
            files, take_site(), options, city, out, take_reading(), None,
            partial(stages.advance, what="counting", unit="tiles"),
            partial(stages.advance, what="reading files", unit="files"), write,
        )  # fmt: skip
    held = study.job.store.parent  # an absolute path; files are named as the folder was typed
    more = [out / path.relative_to(held) if path.is_relative_to(held) else path for path in more]
    written = [out / study.job.store.name, out / OPTIONS_FILE, *more]
    neighbours = _tell_city(study, verdicts, say)
    if as_json:
        from umbra.writers.proof.rows import sum_up  # noqa: PLC0415

        result: dict[str, Any] = {"neighbours": neighbours} if options.proposed else {}
        if verdicts:
            result["rules"] = sum_up(verdicts, str(study.facts["time_zone"]))
        echo_json({**study.facts, **result, "files": [str(path) for path in written]})
    elif not quiet:
        for path in written:
            if path.suffix not in {".tif", ".glb"}:  # hours.vrt and tileset.json name them
                echo_path(path)


def _tell_city(
    study: "CityStudy", verdicts: "Sequence[RuleVerdict]", say: Callable[[str], object]
) -> list[dict[str, Any]]:
    """Tell what a study in tiles found, and return the neighbours that lose sun."""
    from umbra.sun import parse_dates  # noqa: PLC0415
    from umbra.writers.city.store_window import list_neighbours  # noqa: PLC0415
    from umbra.writers.folder.summary import tell_areas  # noqa: PLC0415
    from umbra.writers.proof.rows import tell_verdicts  # noqa: PLC0415

    notes = [f"note: {note}" for note in study.notes]
    told = *tell_verdicts(verdicts), *tell_areas(study.run.areas), *study.tell_hours()
    for line in (*notes, *told):
        say(line)
    options, neighbours = study.job.options, list_neighbours(study.folder)
    days = len(parse_dates(options.date, options.every_days)) if options.date and neighbours else 1
    summed = "" if days == 1 else f", {days} dates added up"
    for neighbour in neighbours[:_SHOWN]:
        say(
            f"{neighbour['name']} loses sun on {neighbour['area_touched']:,.0f} m², "
            f"at most {neighbour['most_hours_lost']:.2f} h{summed}"
        )
    if len(neighbours) > _SHOWN:
        say(f"and {len(neighbours) - _SHOWN:,} more neighbours lose sun (--json lists them)")
    return neighbours
