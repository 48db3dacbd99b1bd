"""``umbra bench``: times umbra against its peers."""

from importlib import import_module
from pathlib import Path

import click

from umbra.cli.terminal import echo, echo_json, echo_path
from umbra.folders.atomic import replace_file
from umbra_benchmarks.report import BenchmarkRun

__all__ = ["command"]

NAMES = (
    "all", "city", "study", "frame", "motion", "growth", "gpu", "silhouette", "startup", "tools",
    "mcguire", "roettger", "wallner", "weng", "soft", "walls", "web",
)  # fmt: skip
PEERS = ("ogre", "workbench")
TOOLS = ("ladybug", "pybdshadow", "umep", "solweig")
PAGES = ("three",)


def _parse_pythons(
    _context: click.Context, _parameter: click.Parameter, values: tuple[str, ...]
) -> dict[str, Path]:
    """Read PEER=PATH, any number of times."""
    pythons = {}
    for value in values:
        name, is_there, path = value.partition("=")
        if name not in PEERS + TOOLS or not is_there or not path:
            msg = f"give PEER=PATH with a peer of {', '.join(PEERS + TOOLS)}; got '{value}'"
            raise click.BadParameter(msg)
        pythons[name] = Path(path)
    return pythons


@click.command("bench")
@click.argument("name", type=click.Choice(NAMES), metavar="NAME")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.option(
    "--threads",
    type=click.IntRange(1),
    default=2,
    show_default=True,
    help="Also run umbra with this many threads.",
)
@click.option("--quick", is_flag=True, help="Small sizes: only to see that it runs.")
@click.option("--repeat", type=click.IntRange(1), help="Runs behind each median.")
@click.option(
    "--device",
    type=click.Choice(("cpu", "gl")),
    default="cpu",
    show_default=True,
    help="Where umbra draws; gl is for frame.",
)
@click.option(
    "--peer",
    "peers",
    type=click.Choice((*PEERS, *TOOLS, *PAGES, "none")),
    multiple=True,
    help="Measure tools, web or gl frames against this one only; may be repeated. [default: all]",
)
@click.option(
    "--peer-python",
    "pythons",
    metavar="PEER=PATH",
    multiple=True,
    callback=_parse_pythons,
    help="The interpreter that has this peer's package, if not this one.",
)
@click.option(
    "--pictures",
    type=click.Path(file_okay=False, path_type=Path),
    help="Save here what each side of gl frames draws, or figures of roettger, wallner or weng.",
)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the tables of all to this file.",
)
@click.option(
    "--model",
    "models",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    multiple=True,
    help="Measure this file too; for walls and wallner, may be repeated.",
)
@click.option(
    "--triangles",
    type=click.IntRange(12),
    multiple=True,
    metavar="N",
    help="Measure frames of a town of so many triangles alone; for gpu, may be repeated.",
)
def command(
    name: str,
    as_json: bool,
    threads: int,
    quick: bool,
    repeat: int | None,
    device: str,
    peers: tuple[str, ...],
    pythons: dict[str, Path],
    pictures: Path | None,
    out: Path | None,
    models: tuple[Path, ...],
    triangles: tuple[int, ...],
) -> None:
    """
    Measure umbra against its peers, in turn in one process.

    NAME is study (hours of shadow on a plan, against Embree), walls (on walls and
    roofs, against Embree), frame (one light in one picture, against Embree), silhouette
    (edges, against VTK or numpy), startup
    (time and memory of a whole umbra study) or tools (a day's study of a town against
    Ladybug, pybdshadow, UMEP and SOLWEIG: time, and error). frame --device gl draws a
    hundred spheres and a moving lamp, against OGRE and Blender's Workbench. motion
    measures gl frames in which a sun, 64 lamps, instances or a bending mesh move;
    growth how they cost more with triangles, lights, pixels and stacked volumes; gpu
    what a graphics card makes of them, pass by pass, its counts beside the CPU's, and
    frames of 12.7 and 73.8 million triangles where there is the memory.

    The papers' tables, run again: mcguire (what each of three cases draws, and frames
    by each method), roettger (shadow masks without a stencil), wallner (silhouettes
    from trees), weng (soft shadows: time and error by triangles, length and gap).
    city finds what a tile of a city costs, and works out a city and two countries.
    web draws a town in a browser by the page's renderer and by three.js with a shadow map.
    soft finds the error of each method of soft shadows by rays, in scenes that overlap.

    all makes every table of benchmarks/results.md, by one commit on one machine.
    """
    if device == "gl" and name != "frame":
        msg = f"{name} has no gl device; frame has one"
        raise click.UsageError(msg)
    if out is not None and name != "all":
        msg = "--out is for all"
        raise click.UsageError(msg)
    known = {"tools": TOOLS, "web": PAGES, "all": TOOLS + PEERS}.get(
        name, PEERS if device == "gl" else ()
    )
    strangers = ({*peers} | {*pythons}) - {*known, "none"}
    if (
        pictures is not None
        and device == "cpu"
        and name not in {"roettger", "wallner", "weng", "all"}
    ):
        msg = "--pictures is for frame --device gl, roettger, wallner and weng"
        raise click.UsageError(msg)
    if strangers or (peers and not known):
        first = min(strangers, default="")
        who = f"the peer {first}" if first else "--peer"
        places = {"frame --device gl": PEERS, "tools": TOOLS, "web": PAGES, "all": TOOLS + PEERS}
        where = [place for place, its in places.items() if not first or first in its]
        msg = f"{who} is for {' and '.join(where)}"
        raise click.UsageError(msg)

    if models and name not in {"wallner", "walls", "all"}:
        msg = "--model is for walls, wallner and all"
        raise click.UsageError(msg)

    if triangles and name != "gpu":
        msg = "--triangles is for gpu"
        raise click.UsageError(msg)

    def say(text: str) -> None:
        echo(text, err=True)

    chosen = [peer for peer in TOOLS + PEERS + PAGES if peer in peers] if peers else None
    default = 2 if quick else 3 if name == "tools" else 5
    run = BenchmarkRun(
        repeat or default, quick, threads=threads, peers=chosen, pythons=pythons,
        pictures=pictures, models=models, triangles=triangles, say=say,
    )  # fmt: skip
    # Load only the benchmark that is wanted.
    module = "gl_frame" if device == "gl" else name
    result = getattr(import_module(f"umbra_benchmarks.{module}"), f"bench_{module}")(run)
    if out is not None:
        with replace_file(out) as unfinished:
            unfinished.write_text(result.to_table(), encoding="utf-8")
        echo_path(out)
    elif as_json:
        echo_json(result.to_dict())
    else:
        echo(result.to_table())
