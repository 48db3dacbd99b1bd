"""Command-line options: their values, made from records, and listed under headings."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import click

from umbra.errors import write_for_shell
from umbra.ground_option import FEET, LEVEL
from umbra.option_fields import Option, list_options, read_length
from umbra.registry import list_added

__all__ = [
    "LENGTH",
    "SIZE",
    "FilesArgument",
    "HeadedOption",
    "Length",
    "NewPath",
    "Numbers",
    "SectionedCommand",
    "Size",
    "record_options",
    "take_record",
]

R = TypeVar("R")
_JOINED = "numbers joined by commas"
_WIDTH = 26  # of the options' names, alike in all sections


class Numbers(click.ParamType):
    """
    Finite numbers joined by commas.

    Parameters
    ----------
    name : str
        As shown in the help: ``X,Y,Z``.
    *counts : int
        How many there may be.
    remedy : str
        What to say of anything else.
    """

    def __init__(self, name: str, *counts: int, remedy: str = _JOINED) -> None:
        self.name, self.counts, self.remedy = name, counts, remedy

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[float, ...]:
        """Parse text; return a tuple unchanged."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(word) for word in str(value).split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in self.counts or not all(map(math.isfinite, numbers)):
            self.fail(f"'{value}' is not {self.name} ({self.remedy})", param, ctx)
        return numbers

    def get_metavar(self, *_: Any, **__: Any) -> str:
        """Return the name."""
        return self.name


class NewPath(click.Path):
    """A file or folder to write; an address is refused, and an empty name (an unset variable)."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Parse text; refuse an address and an empty name."""
        from umbra.folders.atomic import check_is_here  # noqa: PLC0415  (the help writes nothing)

        if value == "":
            self.fail("the name is empty; name what is to be written", param, ctx)
        check_is_here(value)
        return super().convert(value, param, ctx)


class Size(click.ParamType):
    """Columns and rows: ``1024x768``."""

    name = "COLSxROWS"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[int, int]:
        """Parse text; return a tuple unchanged."""
        if isinstance(value, tuple):
            return value
        cols, _, rows = str(value).lower().partition("x")
        if not (cols.isdigit() and rows.isdigit() and int(cols) and int(rows)):
            self.fail(f"'{value}' is not COLSxROWS, such as 1024x768", param, ctx)
        return int(cols), int(rows)

    def get_metavar(self, *_: Any, **__: Any) -> str:
        """Return the name."""
        return self.name


class NumberOrName(click.ParamType):
    """A whole number, or a name: ``4096``, ``tregenza``."""

    name = "N|NAME"

    def convert(self, value: Any, param: Any, ctx: Any) -> int | str:
        """Parse text; who uses it checks it."""
        text = str(value).strip()
        return int(text) if text.isdecimal() else text


class Length(click.ParamType):
    """A length in metres, or in the unit given: ``0.5``, ``50cm``, ``30 ft``."""

    name = "M"

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        """Parse text or a number."""
        try:
            return read_length(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


class GroundType(Length):
    """A ground: ``feet``, ``level``, a height in metres or in the unit given, or a file."""

    name = "feet|level|Z|FILE"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Parse text or a number."""
        text = str(value)
        if text in {FEET, LEVEL} or (text and Path(text).is_file()):
            return text
        try:
            return read_length(text)
        except ValueError:
            self.fail(
                f"'{value}' is neither feet, level, a height (30, 98ft) nor a file that exists",
                param, ctx,
            )  # fmt: skip


LENGTH = Length()
SIZE = Size()


class HeadedOption(click.Option):
    """
    An option with the heading under which the help lists it.

    Parameters
    ----------
    *args, **options
        As ``click.Option`` takes them.
    heading : str
    is_kept : bool
        Whether ``study.toml`` repeats it, and any file of options may set it.
    is_file : bool
        Whether its value names a file.
    registry : str
        What it names, if packages beside umbra offer more of it, which the help lists.
    unless : str
        Another option, without which it is required.
    """

    def __init__(
        self, *args: Any, heading: str = "Options", is_kept: bool = True, is_file: bool = False,
        registry: str = "", unless: str = "", **options: Any,
    ) -> None:  # fmt: skip
        super().__init__(*args, **options)
        self.required = self.required or bool(unless)
        self._unless = unless
        self.heading, self.is_kept, self.is_file = heading, is_kept, is_file
        self.registry = registry

    def handle_parse_result(self, ctx: click.Context, opts: Any, args: list[str]) -> Any:
        """Take a value; require it if the other option is not given, typed or in a file."""
        if self._unless:
            known = opts.get(self._unless) or (ctx.default_map or {}).get(self._unless)
            self.required = not known
        return super().handle_parse_result(ctx, opts, args)

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the option and its help, with what packages add."""
        record = super().get_help_record(ctx)
        added = list_added(self.registry) if self.registry else []
        if record is None or not added:
            return record
        return record[0], f"{record[1]} Of packages installed beside umbra: {', '.join(added)}."

    def type_cast_value(self, ctx: click.Context, value: Any) -> Any:
        """Convert a value, unless it is the name of an option: then its own was left out."""
        taken = {
            name
            for parameter in ctx.command.params
            for name in parameter.opts
            if parameter is not self
        }
        for given in value if isinstance(value, (list, tuple)) else (value,):
            if isinstance(given, str) and given in taken:
                name, what = max(self.opts, key=len), self.make_metavar(ctx)
                msg = f"{name} needs a value before {given}; write {name} {what} {given} ..."
                raise click.UsageError(msg, ctx)
        return super().type_cast_value(ctx, value)


class FilesArgument(click.Argument):
    """The files of models, whose formats the help lists, those of packages among them."""

    heading = "Reading"

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:
        """Return the argument, and the formats that are read."""
        from umbra.readers.formats import tell_formats  # noqa: PLC0415  (only the help lists them)

        return self.make_metavar(ctx), f"Of {tell_formats()}."


class SectionedCommand(click.Command):
    """
    A command whose help lists its options under headings.

    Parameters
    ----------
    *args, **options
        As ``click.Command`` takes them.
    headings : sequence of str
        In the order of the help.
    """

    def __init__(self, *args: Any, headings: Sequence[str], **options: Any) -> None:
        super().__init__(*args, **options)
        self.headings = headings

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each heading."""
        sections: dict[str, list[tuple[str, str]]] = {heading: [] for heading in self.headings}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            # click gives a record of every argument, which the usage shows.
            if record is not None and isinstance(parameter, (click.Option, FilesArgument)):
                heading = getattr(parameter, "heading", self.headings[-1])
                sections[heading].append((record[0].ljust(_WIDTH), record[1]))
        for heading, records in sections.items():
            with formatter.section(heading):
                formatter.write_dl(records, col_max=_WIDTH + 2)


def record_options(
    record: type,
    flags: Mapping[str, str] = MappingProxyType({}),
    optional: Sequence[str] = (),
    **more: Any,
) -> Callable[[Callable], Callable]:
    """
    Make a decorator that adds every option of a record which can be typed.

    Parameters
    ----------
    record : type
    flags : mapping of str to str
        Flags of a command's own for some options.
    optional : sequence of str
        Options without a default that this command does not require.
    **more
        As ``click.option`` takes them.
    """

    def add(command: Callable) -> Callable:
        for name, said, default in reversed([*list_options(record)]):
            if said.flag is not None:
                flag = flags.get(name) or said.flag or f"--{name.replace('_', '-')}"
                if said.off:
                    off = {"heading": said.heading, "is_flag": True, "help": f"No {name}."}
                    command = click.option(said.off, cls=HeadedOption, **off, **more)(command)
                default = None if name in optional else default  # noqa: PLW2901
                command = click.option(flag, name, **_describe(said, default), **more)(command)
        return command

    return add


def take_record(record: type[R], given: dict[str, Any]) -> R:
    """Build a record from a command's values, and remove them from there."""
    values = {}
    for name, said, _ in list_options(record):
        if said.flag is not None:
            values[name] = given.pop(name)
        if said.off and given.pop(said.off[2:].replace("-", "_")):
            values[name] = False
    return record(**values)


def _describe(said: Option, default: Any) -> dict[str, Any]:
    """Return an option as ``click.option`` takes it."""
    is_required = default is MISSING
    default = None if is_required else default
    is_many = said.is_repeated or said.type in {"dates", "patterns", "texts"}
    types: dict[str, Any] = {
        "number": float,
        "length": LENGTH,
        "ground": GroundType(),
        "size": SIZE,
        "file": NewPath(),
    }
    kind = types.get(said.type)
    if said.type == "whole":
        kind = int if said.least is None else click.IntRange(said.least)
    elif said.type == "any" and type(default) is int:
        kind = NumberOrName()
    elif said.type == "choice":
        kind = click.Choice(said.choices)
    elif said.type == "numbers":
        counts = said.count if isinstance(said.count, tuple) else (said.count,)
        kind = Numbers(str(said.metavar), *counts, remedy=said.remedy or _JOINED)
    return {
        "cls": HeadedOption,
        "heading": said.heading,
        "is_kept": said.is_kept,
        "is_file": said.type in {"table", "path"},
        "registry": said.registry,
        "unless": said.unless,
        "required": is_required,
        "type": kind,
        "is_flag": said.type == "flag",
        "multiple": is_many,
        "default": default,
        "show_default": bool(default) and not is_many and not isinstance(default, tuple),
        "metavar": "PATTERN" if said.type == "patterns" else said.metavar,
        "help": _tell(said.help, is_repeated=is_many and ",..." not in str(said.metavar)),
    }


def _tell(words: str, *, is_repeated: bool) -> str:
    """Return an option's help in the shell's words."""
    more = "; repeatable." if is_repeated else "."
    return write_for_shell(words.removesuffix(".") + more)
