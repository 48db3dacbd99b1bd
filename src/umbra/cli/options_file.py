"""
A study's options in a TOML file, which ``umbra study`` reads and writes beside its results.

A file may come from anybody. It sets what decides the results and nothing else: what a run writes,
whom it trusts and how much of the machine it takes is typed.
"""

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from umbra.cli.click_options import HeadedOption
from umbra.cli.reading import read_values
from umbra.errors import InputError, find_similar
from umbra.ground_option import is_file
from umbra.option_fields import is_area_file, read_length
from umbra.version import __version__

__all__ = ["OPTIONS_FILE", "option_file", "write_options"]

OPTIONS_FILE = "study.toml"
_LARGEST = 1_000_000  # [byte]
_LAYER = re.compile(r"([^/\\=]+)=(.+)", re.DOTALL)


def _read(context: click.Context, _: click.Parameter, path: str | None) -> str | None:
    """Use the file's values as defaults, so that the command line overrides them."""
    if path is None:
        return None
    from umbra.readers.checks import read_bounded  # noqa: PLC0415 - the help needs no reader

    known = _name_parameters(context.command)
    defaults: dict[str, Any] = {}
    try:
        with Path(path).open("rb") as file:
            given = tomllib.loads(read_bounded(file, _LARGEST).decode())
        for key, value in given.items():
            _check_key(key, value, known)
            name = key.replace("_", "-")
            defaults[known[name].name or name] = _take(known[name], value, Path(path), name)
    except (OSError, RecursionError, ValueError) as error:
        msg = f"--options {path}: {_explain(error)}"
        raise InputError(msg, path=path) from None
    context.default_map = {**(context.default_map or {}), **defaults}
    return path


def _explain(error: Exception) -> str:
    """Describe why a file is no list of options, and the remedy."""
    if isinstance(error, InputError):
        return str(error)
    if isinstance(error, RecursionError):
        return "lists are nested too deep; write options one a line"
    if isinstance(error, OSError):
        return f"{(error.strerror or str(error)).lower()}; name a TOML file"
    return f'is not TOML ({error}); write lines such as date = "2026-03-21"'


def _check_key(key: str, value: Any, known: Mapping[str, click.Parameter]) -> None:
    """Refuse what is no option, or no value of one."""
    name = key.replace("_", "-")
    msg = ""
    if isinstance(value, dict):
        msg = f"'{key}' is a table; write options one a line, without headings"
    elif any("\0" in str(item) for item in (value if isinstance(value, list) else [value])):
        msg = f"'{key}' holds a null character, which no name has; remove it"
    elif name in known and not _is_kept(known[name]):
        msg = (
            f"{name} is typed (--{name}), not taken from a file, which sets only what decides the "
            "results; remove the line"
        )
    elif name not in known:
        near = find_similar(name, known)
        advice = f"did you mean '{near[0]}'?" if near else "umbra study --help lists them"
        msg = f"there is no option '{key}'; {advice}"
    if msg:
        raise InputError(msg)


option_file = click.option(
    "--options",
    "option_file",
    cls=HeadedOption,
    metavar="FILE",
    is_eager=True,
    expose_value=False,
    callback=_read,
    help=f"Take options from this TOML file, such as the {OPTIONS_FILE} of an earlier run; "
    "typed options take precedence.",
)


def write_options(path: Path, context: click.Context) -> None:
    """
    Write the options of a run, such that ``--options`` repeats it.

    Files are named in full. Left out are the output folder and options that change no result.

    Parameters
    ----------
    path : Path
    context : click.Context
        Of the command.
    """
    lines = [
        f"# The options of a study by umbra {__version__}. To repeat it:",
        f"# umbra study --options {OPTIONS_FILE} --out DIR",
    ]
    values = {**context.params, **read_values(context)}
    for name, parameter in _name_parameters(context.command).items():
        value = values.get(parameter.name or "")
        if not _is_kept(parameter) or value is None or value == ():
            continue
        if parameter.name == "size":
            value = f"{value[0]}x{value[1]}"
        elif name == "files":
            value = [_name_in_full(text, Path.cwd()) for text in value]
        elif _is_file(parameter, value):
            value = _name_in_full(value, Path.cwd())
        lines.append(f"{name} = {_to_toml(value)}")
    # A file's name need be no Unicode, and TOML is nothing else.
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", errors="replace")


def _name_parameters(command: click.Command) -> dict[str, click.Parameter]:
    """Return the parameters by their names on the command line."""
    named: dict[str, click.Parameter] = {}
    for parameter in command.params:
        if isinstance(parameter, click.Argument):
            named[parameter.name or ""] = parameter
        else:
            long = next(text for text in parameter.opts if text.startswith("--"))
            if long not in {"--options", "--help"}:
                named[long[2:]] = parameter
    return named


def _take(parameter: click.Parameter, value: Any, path: Path, name: str) -> Any:
    """Convert a value of the file for click; file names are relative to that file."""
    many = parameter.multiple or parameter.nargs == -1
    if many and not isinstance(value, list):
        value = [value]
    if isinstance(value, list):
        value = [str(item) for item in value] if many else ",".join(map(str, value))
    elif not isinstance(value, (bool, int, float)):
        value = str(value)  # TOML has dates and times of its own
    if name == "files":
        return [_name_in_full(text, path.parent) for text in value]
    return _name_in_full(value, path.parent) if _is_file(parameter, value) else value


def _is_kept(parameter: click.Parameter) -> bool:
    """Return whether a file may set an option; the arguments, FILE, have no such mark."""
    return getattr(parameter, "is_kept", True)


def _is_file(parameter: click.Parameter, value: Any) -> bool:
    """Return whether a value is a file name; ``--trunk`` may also be a share."""
    if parameter.name == "areas":  # else a pattern of parts
        return is_area_file(value)
    if parameter.name == "rules":
        from umbra.rules.read import is_shipped  # noqa: PLC0415  (loads numpy)

        return not is_shipped(str(value))
    is_raster = parameter.name == "trunk" and str(value).lower().endswith((".tif", ".tiff"))
    if parameter.name == "ground" and isinstance(value, str):
        try:
            read_length(value)
        except ValueError:
            return is_file(value)
    return is_raster or getattr(parameter, "is_file", False)


def _name_in_full(text: str, folder: Path) -> str:
    """Return a file, or a layer and its file, with its full path."""
    match = _LAYER.fullmatch(text)
    if match and not (folder / text).exists():
        return f"{match[1]}={(folder / match[2]).resolve()}"
    return str((folder / text).resolve())


def _to_toml(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_to_toml, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    return json.dumps(str(value), ensure_ascii=False)
