"""``umbra study``: hours of shadow around buildings."""

import shlex
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from umbra.cli.main import echo_json
from umbra.cli.pose import pose_options, read_posed
from umbra.cli.values import SIZE, Numbers
from umbra.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from umbra.scene import Scene
    from umbra.study import Preview, Study
    from umbra.writers.plan import Plan

__all__ = ["command"]


@click.command("study")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--lat", type=float, metavar="DEG", help="Latitude; default: what the file says.")
@click.option(
    "--lon",
    type=float,
    metavar="DEG",
    help="Longitude, east positive; default: what the file says.",
)
@click.option(
    "--tz", metavar="ZONE", help="IANA zone, as Europe/Vienna; default: that of the coordinates."
)
@click.option(
    "--north",
    type=float,
    metavar="DEG",
    help="True north's azimuth in the plan, clockwise from y; default: what the file says, or 0.",
)
@click.option("--date", required=True, metavar="YYYY-MM-DD", help="Local date.")
@click.option(
    "--from",
    "start",
    default="09:00",
    show_default=True,
    metavar="HH:MM",
    help="Start, on the local clock.",
)
@click.option(
    "--to",
    "end",
    default="17:00",
    show_default=True,
    metavar="HH:MM",
    help="End; 24:00 is midnight.",
)
@click.option(
    "--every",
    default="15min",
    show_default=True,
    metavar="DURATION",
    help="Step of the clock: 15min, 1h, 30s.",
)
@click.option(
    "--receivers",
    type=click.Choice(["ground", "top"]),
    default="ground",
    show_default=True,
    help="The ground plane, or the topmost surface of the plan.",
)
@click.option(
    "--ground", type=float, metavar="Z", help="The ground's height [m]; default: the lowest point."
)
@click.option(
    "--extent",
    type=Numbers("XMIN,YMIN,XMAX,YMAX", 4),
    help="The plan's rectangle [m]; default: the model and its shadows.",
)
@click.option(
    "--cell",
    type=float,
    metavar="M",
    help="Side of a cell [m]; default: about 1000 cells on the longer side.",
)
@click.option("--size", type=SIZE, help="The raster's size, instead of --cell.")
@click.option(
    "--cast",
    multiple=True,
    metavar="PATTERN",
    help="Names or kinds of parts that cast; repeatable.",
)
@click.option(
    "--no-cast", multiple=True, metavar="PATTERN", help="Those of parts that do not; repeatable."
)
@click.option("--masks", is_flag=True, help="Also write in_shadow, every instant.")
@click.option(
    "--refraction",
    type=click.Choice(["standard", "none"]),
    default="standard",
    show_default=True,
    help="The sun where it is seen, or where it is.",
)
@click.option("--up", type=click.Choice(["x", "y", "z"]), help="The file's upward axis.")
@pose_options
@click.option(
    "--device",
    type=click.Choice(["auto", "cpu", "gl"]),
    default="auto",
    help="Where to count; this version has cpu.",
)
@click.option("--threads", type=click.IntRange(1), metavar="N", help="Default: all cores.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    required=True,
    metavar="DIR",
    help="Folder for results; made if missing.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    files: tuple[str, ...],
    lat: float | None,
    lon: float | None,
    tz: str | None,
    north: float | None,
    up: str | None,
    time: float | None,
    animation: str | None,
    device: str,
    out: Path,
    as_json: bool,
    **options: Any,
) -> None:
    """
    Find the hours of shadow around buildings on a day.

    Writes study.nc, hours.png and profile.png into the folder --out.

    \b
    Example:
    umbra study block.city.json --date 2026-03-21 --receivers top --cell 0.5 --out out/
    """  # noqa: D301  (click asks for a real backspace)
    if device == "gl":
        msg = "this version counts on the cpu; leave --device out"
        raise InputError(msg)
    _check_clock(options)
    from umbra.writers.painter import Painter  # noqa: PLC0415
    from umbra.writers.results import replace_results  # noqa: PLC0415

    with replace_results(out) as unfinished, Painter() as painter:
        from umbra.study import make_preview, run_study  # noqa: PLC0415
        from umbra.sun import find_site  # noqa: PLC0415
        from umbra.writers.netcdf import write_netcdf  # noqa: PLC0415

        scene = read_posed(files, up, time, animation)
        for note in scene.notes:
            click.echo(f"note: {note}", err=True)
        site = find_site(scene, lat, lon, tz, north)
        with _progress() as progress:
            study = run_study(scene, site, device=device, progress=progress, **options)
        study.facts["command"] = shlex.join(["umbra", *click.get_current_context().obj])
        if not study.sun.is_up.any():
            click.echo(
                "umbra: warning: the sun is below the horizon all this time; "
                "there are no hours of sun or shadow",
                err=True,
            )
        preview = make_preview(study)
        if study.receivers == "ground" and preview.has_terrain(scene.bounds()):
            click.echo(
                f"note: the model covers nearly all of its ground at z = {study.ground:.6g} m, as "
                "a terrain or base plate does; --receivers top shows the shadows that fall on it",
                err=True,
            )
        plan = _describe(study, preview, scene, options)
        painter.draw_hours(
            unfinished / "hours.png", plan, _coarsen(study.shadow_hours, plan.shape),
            study.up_hours, receivers=study.receivers,
        )  # fmt: skip
        zone = "/".join(dict.fromkeys(study.steps.abbreviations()))
        painter.draw_profile(
            unfinished / "profile.png", plan, preview.shadows, study.steps.labels(),
            zone=zone, receivers=study.receivers,
        )  # fmt: skip
        write_netcdf(unfinished / "study.nc", study.variables(), study.facts)
    written = [out / name for name in ("study.nc", "hours.png", "profile.png")]
    if as_json:
        echo_json(
            {
                "files": [str(path) for path in written],
                "cols": len(study.x),
                "rows": len(study.y),
                "cell": [study.grid.dx, study.grid.dy],
                "hours": study.up_hours,
                "most_shadow_hours": float(study.shadow_hours.max()),
                "mean_shadow_hours": float(study.shadow_hours.mean()),
                **{name: study.facts[name] for name in ("prepare_seconds", "count_seconds")},
            }
        )
    else:
        for path in written:
            click.echo(path)


def _check_clock(options: dict[str, Any]) -> None:
    """Find slips in the dates before anything is read."""
    from umbra.sun import make_steps  # noqa: PLC0415

    # In UTC no time is missing or doubled: what fails here fails everywhere.
    make_steps(options["date"], options["start"], options["end"], options["every"], "UTC")


@contextmanager
def _progress() -> Iterator[Any]:
    """Show a bar on a terminal, and say why a first run takes long; else stay silent."""
    if not sys.stderr.isatty():
        yield lambda _done, _all: None
        return
    notice = threading.Timer(
        2.0,
        lambda: click.echo(
            "preparing; a first run compiles its kernels, later ones start at once", err=True
        ),
    )
    notice.daemon = True
    notice.start()
    bar: Any = None

    def advance(done: int, everything: int) -> None:
        nonlocal bar
        notice.cancel()
        if bar is None:
            bar = click.progressbar(length=everything, label="counting shadows", file=sys.stderr)
            bar.__enter__()
        bar.update(done - bar.pos)

    try:
        yield advance
    finally:
        notice.cancel()
        if bar is not None:
            bar.__exit__(None, None, None)
            if bar.finished:
                click.echo("drawing and writing", err=True)


def _coarsen(hours: "NDArray[np.float32]", shape: tuple[int, int]) -> "NDArray[np.float32]":
    """Average hours to the cells of the pictures."""
    if hours.shape == shape:
        return hours
    from umbra.writers.raster import resample  # noqa: PLC0415

    return resample(hours, shape)


def _describe(
    study: "Study", preview: "Preview", scene: "Scene", options: dict[str, Any]
) -> "Plan":
    """Say in words what the pictures show."""
    from umbra.writers.plan import Plan  # noqa: PLC0415

    site, facts = study.site, study.facts
    north = "N" if site.latitude >= 0 else "S"
    east = "E" if site.longitude >= 0 else "W"
    grid = study.grid
    cell = f"{grid.dx:.4g} m" if grid.dx == grid.dy else f"{grid.dx:.4g} x {grid.dy:.4g} m"
    offsets = "/".join(dict.fromkeys(study.steps.offsets()))
    return Plan(
        preview.x,
        preview.y,
        preview.heights,  # type: ignore[arg-type]
        true_north=site.true_north,
        title=" + ".join(Path(source.name).name for source in scene.sources[:3]),
        place=(
            f"{abs(site.latitude):.3f}° {north}, {abs(site.longitude):.3f}° {east} · {site.zone}"
        ),
        date=f"{options['date']}, {options['start']} to {options['end']} ({offsets})",
        note=(
            f"umbra {facts['umbra_version']} · cell {cell} · midpoints of {options['every']} steps"
            f" · refraction {facts['refraction']}"
        ),
    )
