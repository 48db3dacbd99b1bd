"""The ``umbra`` command: its subcommands, error messages and exit status, and ``umbra doctor``."""

import errno
import io
import re
import sys
import traceback
from contextlib import suppress
from importlib import import_module
from typing import Any

import click

from umbra.cli.interrupt import stand_by
from umbra.cli.terminal import echo, echo_json
from umbra.errors import InputError, UmbraError, find_similar, show_count
from umbra.machine import find_kernel_cache, pass_over_settings
from umbra.registry import take_notes
from umbra.version import __version__

__all__ = ["main"]

COMMANDS = {
    "bench": "Measure umbra against its peers.",
    "doctor": "Show which devices work on this machine.",
    "envelope": "Find how high one may build on a plot, by rules of sunlight.",
    "inspect": "Show what a file contains.",
    "prove": "Judge gardens, windows and flats by cited rules, and write the sheet.",
    "render": "Draw a picture with exact shadows.",
    "rules": "List the rules that a proposal is judged by, or print one.",
    "sky": "Show the sky above a place, and what obstructs it.",
    "study": "Measure sun and sky around buildings: hours of shadow by default.",
    "view": "Show a model in a window.",
}


_PLAIN = {
    "is not a valid float$": "is not a number, such as 48.2",
    "is not a valid integer( range)?$": "is not a whole number",
    "is not in the range x>=(.*)$": r"is less than \1",
}
"""What click says of numbers, and plainer words."""


class _Commands(click.Group):
    """Load a subcommand only when it is called, so that the help appears at once."""

    def invoke(self, ctx: click.Context) -> Any:
        note = find_kernel_cache()
        if note is not None and "--quiet" not in ctx.obj:
            echo(f"note: {note}", err=True)
        try:
            return self._invoke(ctx)
        except KeyboardInterrupt as error:
            # The compiler's objects, made by halves, would each complain as they go.
            sys.unraisablehook = lambda _: None
            # click would print an empty line; only a terminal, which shows ^C, needs it.
            if sys.stderr.isatty():
                echo(err=True)
            raise click.Abort(*error.args) from None

    def _invoke(self, ctx: click.Context) -> Any:
        """Run a command; tell what is left to be told of packages beside umbra."""
        try:
            return super().invoke(ctx)
        finally:
            notes = take_notes()
            for note in notes if "--quiet" not in ctx.obj else ():
                echo(f"note: {note}", err=True)

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        if name == "bench":
            return _find_benchmarks()
        if name == "doctor":
            return doctor
        return import_module(f"umbra.cli.{name}").command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            near = find_similar(args[0], COMMANDS)
            advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(COMMANDS)}"
            ctx.fail(f"there is no command '{args[0]}'; {advice}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=_Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
What a model holds:
  umbra inspect quarter.city.json
What a garden keeps beside a new tower (garden.geojson is a polygon):
  umbra study quarter.city.json tower.glb --proposed tower --areas garden.geojson \\
    --date 2026-03-21 --report --out out
Whether that keeps a rule, on a sheet to hand in:
  umbra prove quarter.city.json tower.glb --proposed tower --areas garden.geojson \\
    --rules bre-209-gardens --out proof

Start with umbra inspect FILE. Each command has --help.""",
)
@click.version_option(__version__, prog_name="umbra")
@click.option("--debug", is_flag=True, help="Show tracebacks.")
@click.pass_context
def umbra(context: click.Context, debug: bool) -> None:  # noqa: ARG001  (main looks for it)
    """Exact shadows from triangle meshes with shadow volumes."""
    if context.invoked_subcommand is None:
        echo(context.get_help(), err=True)
        context.exit(2)


@click.command("doctor")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def doctor(as_json: bool) -> None:
    """
    Show which devices work on this machine, and what to install for the others.

    Packages installed beside umbra are listed with what they offer.

    \b
    Example:
    umbra doctor
    """  # noqa: D301  (click asks for a real backspace)
    from umbra.calls.doctor import examine  # noqa: PLC0415

    report = examine()
    if as_json:
        echo_json(report)
        return
    cpu, gl = report["cpu"], report["gl"]
    echo(f"umbra {report['umbra']}, Python {report['python']}, {report['system']}")
    echo(f"cpu  runs, {cpu['cores']} cores")
    echo(f"gl   {'runs' if gl['runs'] else 'does not run'}")
    for name, backend in gl["backends"].items():
        if "reason" in backend:
            echo(f"     {name:8}{backend['reason']}")
            continue
        echo(f"     {name:8}OpenGL {backend['version']}, {backend['renderer']}")
        echo(
            f"             {'software' if backend['is_software'] else 'hardware'}, "
            f"{backend['stencil_bits']} stencil bits, "
            f"depth bounds {'yes' if backend['depth_bounds'] else 'no'}, "
            f"timer queries {'yes' if backend['timer_queries'] else 'no'}"
        )
    versions = report["packages"].items()
    packages = [f"{name} {version or 'not installed'}" for name, version in versions]
    echo(f"     {', '.join(packages)}")
    cache = report["cache"]
    echo(
        f"cache {cache['folder']}, {show_count(cache['files'], 'file')}, "
        f"{cache['bytes'] / 1e6:.1f} MB of at most {cache['limit'] / 1e6:.0f} MB "
        "(remove it to clear it; UMBRA_CACHE names another)"
    )
    for offer in report["added"]:
        fault = f"; not used: {offer['reason']}" if offer["reason"] else ""
        echo(f"{offer['package']} {offer['version']}: {offer['what']} '{offer['name']}'{fault}")
    for advice in report["advice"]:
        echo(f"To do: {advice}")


def main(arguments: list[str] | None = None) -> None:
    """
    Run the command line and exit: 0 done, 1 the work failed, 2 bad input or usage.

    Parameters
    ----------
    arguments : list of str, optional
        Those of the process by default.
    """
    words = sys.argv[1:] if arguments is None else arguments
    # A flag of the whole command may stand anywhere.
    debug = "--debug" in words
    given = [word for word in words if word != "--debug"]
    sys.exit(_run(given, debug, is_process=arguments is None))


def _run(arguments: list[str], debug: bool, *, is_process: bool) -> int:
    try:
        if is_process:
            stand_by()
        pass_over_settings()
        if isinstance(sys.stdout, io.TextIOWrapper):
            sys.stdout.reconfigure(errors="surrogateescape")  # names of files as they are
        # Commands give nothing back; click gives the status of one that exits.
        status = umbra.main(arguments, prog_name="umbra", standalone_mode=False, obj=arguments)
    except BrokenPipeError:
        sys.stderr.close()  # whoever read the output has gone
        return 1
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001  (the last line of defence)
        return _fail(*_explain(error), debug)
    return status or 0


def _explain(error: BaseException) -> tuple[str, int]:
    """Return the error message, in one line, and the exit status."""
    text, status = f"{type(error).__name__}: {error} (--debug shows where)", 1
    if isinstance(error, click.UsageError):
        where = f" (see '{error.ctx.command_path} --help')" if error.ctx else ""
        text, status = f"{_word(error)}{where}", 2
    elif isinstance(error, click.ClickException):
        text, status = error.format_message(), 2
    elif isinstance(error, UmbraError):
        text, status = error.for_shell(), 2 if isinstance(error, InputError) else 1
    elif isinstance(error, (KeyboardInterrupt, click.Abort)):
        text, status = "; ".join(["interrupted", *map(str, error.args)]), 2
    elif isinstance(error, MemoryError):
        text = "out of memory; cut the model to what matters"
    elif isinstance(error, OSError) and error.filename is None and error.errno == errno.ENOSPC:
        # A full disk is reported where the file is written.
        text = (
            "the output stream takes no more (no space left on device); results in files are there"
        )
    return text, status


def _find_benchmarks() -> click.Command:
    """Load the command of the package umbra-benchmarks."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - only for benchmarks

    for entry_point in entry_points(group="umbra.commands", name="bench"):
        command: click.Command = entry_point.load()
        return command
    msg = (
        "the benchmarks are a package of their own, which is not installed; "
        "in a clone of umbra: pip install './benchmarks[embree]'"
    )
    raise InputError(msg)


def _word(error: click.UsageError) -> str:
    """Describe the error in a command line, and the remedy."""
    if error.ctx is not None and isinstance(error, click.MissingParameter):
        command = error.ctx.command
        # Whatever is given has been taken by now.
        missing = [p for p in command.params if p.required and p.name not in error.ctx.params]
        words = [_show_parameter(p, error.ctx) for p in missing]
        listed = " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
        needed = (_show_parameter(p, error.ctx) for p in command.params if p.required)
        verb = "is" if len(words) == 1 else "are"
        return f"{listed} {verb} missing; type {error.ctx.command_path} {' '.join(needed)}"
    if error.ctx is not None and isinstance(error, click.NoSuchOption):
        known = [text for p in error.ctx.command.params for text in (*p.opts, *p.secondary_opts)]
        near = find_similar(error.option_name, known)
        advice = f"; did you mean '{near[0]}'?" if near else ""
        return f"there is no option '{error.option_name}'{advice}"
    text = error.format_message().rstrip(".")
    for said, plain in _PLAIN.items():
        text = re.sub(said, plain, text)
    return text


def _show_parameter(parameter: click.Parameter, context: click.Context) -> str:
    """Return a parameter as it is typed, with a placeholder for its value."""
    metavar = parameter.make_metavar(context)
    return metavar if isinstance(parameter, click.Argument) else f"{parameter.opts[0]} {metavar}"


def _fail(message: str, status: int, debug: bool) -> int:
    if debug:
        echo(traceback.format_exc(), err=True)
    with suppress(OSError):  # an error stream that is full tells nothing, but the status does
        echo("umbra: " + " ".join(message.split()), err=True)
    return status
