"""``umbra bench``: times against those of peers."""

from collections.abc import Callable
from typing import Any

import click

from umbra.cli.main import echo_json

__all__ = ["command"]

NAMES = ("study", "frame", "silhouette", "cases", "startup")


@click.command("bench")
@click.argument("name", type=click.Choice(NAMES), metavar="NAME")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.option(
    "--threads",
    type=click.IntRange(1),
    default=2,
    show_default=True,
    help="Also run umbra on so many.",
)
@click.option("--quick", is_flag=True, help="Small sizes: only to see that it runs.")
@click.option("--repeat", type=click.IntRange(1), help="Runs behind each median.")
def command(name: str, as_json: bool, threads: int, quick: bool, repeat: int | None) -> None:
    """
    Measure umbra against its peers, in turn in one process.

    NAME is study (hours of shadow on a plan, against Embree), frame (one light in
    one picture, against Embree), silhouette (edges, against VTK or numpy), cases (how
    many triangles each of McGuire's cases draws) or startup (time and memory of a whole
    umbra study).
    """

    def say(text: str) -> None:
        click.echo(text, err=True)

    runs = repeat or (2 if quick else 5)
    if name == "startup":
        from umbra.bench.startup import bench_startup  # noqa: PLC0415

        result: Any = bench_startup(repeat=runs, quick=quick)
    elif name == "cases":
        from umbra.bench.cases import bench_cases  # noqa: PLC0415

        result = bench_cases(repeat=runs, quick=quick, say=say)
    else:
        result = _find(name)(threads=threads, repeat=runs, quick=quick, say=say)
    if as_json:
        echo_json(result.to_dict())
    else:
        click.echo(result.to_table())


def _find(name: str) -> Callable[..., Any]:
    """Load only the benchmark that is wanted."""
    from importlib import import_module  # noqa: PLC0415

    module = import_module(f"umbra.bench.{name}")
    benchmark: Callable[..., Any] = getattr(module, f"bench_{name}")
    return benchmark
