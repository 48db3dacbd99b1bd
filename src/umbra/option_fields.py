"""Options as fields of a record, described for the command line and Python."""

import math
import os
import re
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, dataclass, field, fields, replace
from numbers import Integral, Real
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar, dataclass_transform

from umbra.errors import FLAGS, InputError, find_similar, show_value
from umbra.ground_option import check_ground

__all__ = [
    "Given", "Option", "Options", "again", "check_types", "is_area_file", "list_options", "needed",
    "option", "read_flag", "read_length", "read_names", "read_path", "read_text", "read_texts",
    "record",
]  # fmt: skip

_UNITS = {
    "mm": 1e-3, "cm": 1e-2, "m": 1.0, "km": 1e3, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048,
}  # fmt: skip
AREA_ENDINGS = (".geojson", ".json", ".gpkg", ".shp", ".dxf")
"""Endings of files of areas."""
G_contra = TypeVar("G_contra", contravariant=True)
K_co = TypeVar("K_co", covariant=True)
T = TypeVar("T")
_LENGTH = re.compile(rf"(.*?)\s*({'|'.join(_UNITS)})?", re.IGNORECASE | re.DOTALL)


@dataclass(frozen=True, kw_only=True)
class Option:
    """
    Description of an option; the field has its name and default.

    Parameters
    ----------
    type : str
        ``number``, ``whole``, ``length``, ``numbers``, ``size``, ``choice``, ``patterns``,
        ``texts``, ``flag``, ``ground``; or ``text``, ``dates``, ``table``, ``path`` and ``any``,
        checked where they are used.
    help : str
        What it does, for the command's help and for docstrings; other options as in errors,
        ``eye=``.
    more : str
        Further words for docstrings alone.
    heading : str
        Heading in the command's help.
    flag : str, optional
        Flag on the command line, made from the name by default; None: only in Python.
    off : str
        A further flag, which gives False.
    metavar : str, optional
        Placeholder of the value in the command's help.
    unit : str
    choices : tuple of str or int
    count : int or tuple of int
        Number of values; a tuple allows several.
    is_repeated : bool
        Whether the option may have any number of values; patterns, texts and dates always may.
    passes : tuple
        Further values, which are not checked.
    remedy : str
        Message of the command for text that is no such value.
    least : int, optional
        Least value of a whole number.
    receivers : tuple of str
        Kinds of receivers to which the option applies; all by default.
    is_needed : bool
        Whether these receivers require it.
    attribute : str
        Name of the result's attribute that stores the value unchanged.
    is_kept : bool
        Whether it decides results, so that option files store it, and may set it.
    unless : str
        Another option, without which the command requires it.
    registry : str
        Which registry's names it takes, of packages installed beside umbra, too.
    """

    type: str
    help: str = ""
    more: str = ""
    heading: str = ""
    flag: str | None = ""
    off: str = ""
    metavar: str | None = None
    unit: str = ""
    choices: tuple[Any, ...] = ()
    count: int | tuple[int, ...] = 0
    is_repeated: bool = False
    passes: tuple[Any, ...] = ()
    remedy: str = ""
    least: int | None = None
    receivers: tuple[str, ...] = ()
    is_needed: bool = False
    attribute: str = ""
    is_kept: bool = True
    unless: str = ""
    registry: str = ""

    @property
    def form(self) -> str:
        """Value after ``=`` in messages: ``(X, Y, Z)``, ``'FILE'``."""
        word = str(self.metavar)
        return f"({', '.join(word.split(','))})" if self.type == "numbers" else f"'{word}'"


class Given(Generic[G_contra, K_co]):
    """
    The type of a field ``Given[GIVEN, KEPT]``: what a caller may pass, and what the record keeps.

    Of descriptors type checkers know both; the field itself is a plain one, which ``check_types``
    or the record normalises.
    """

    def __get__(self, record: object, owner: Any = None) -> K_co:
        raise NotImplementedError

    def __set__(self, record: object, value: G_contra) -> None:
        raise NotImplementedError


def option(type: str, help: str = "", *, default: Any = None, **more: Any) -> Any:  # noqa: A002
    """Make a field of a record of options, with the parameters of ``Option``."""
    return field(default=default, metadata={"option": Option(type=type, help=help, **more)})


def needed(type: str, help: str = "", **more: Any) -> Any:  # noqa: A002
    """Make a field without a default."""
    return field(metadata={"option": Option(type=type, help=help, **more)})


def again(record: Any, name: str, **changes: Any) -> Any:
    """Make a field of another record's option, with another default or description."""
    inherited = record.__dataclass_fields__[name]
    default = changes.pop("default", inherited.default)
    said = replace(inherited.metadata["option"], **{"receivers": (), "more": "", **changes})
    return field(default=default, metadata={"option": said})


@dataclass_transform(kw_only_default=True, field_specifiers=(needed,))
def record(cls: type[T]) -> type[T]:
    """
    Make a class a frozen record of options, whose fields are given by name.

    Type checkers do not hear that it is frozen: of a frozen subclass mypy takes a field ``Given``
    to keep what is given.
    """
    return dataclass(frozen=True, kw_only=True, eq=False)(cls)


class Options:
    """Base of records of options; the shell's names of its fields are then known to errors."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __init_subclass__(cls) -> None:
        for name, value in vars(cls).items():
            said = getattr(value, "metadata", {}).get("option")
            if said is not None and said.flag is not None:
                on, _, off = (said.flag or f"--{name.replace('_', '-')}").partition("/")
                FLAGS[name] = FLAGS[on[2:].replace("-", "_")] = on
                if off or said.off:
                    FLAGS[f"{name}=False"] = off or said.off


def list_options(record: Any) -> Iterator[tuple[str, Option, Any]]:
    """Yield the name, the description and the default of each option."""
    for entry in fields(record):
        if "option" in entry.metadata:
            yield entry.name, entry.metadata["option"], entry.default


def check_types(record: Any) -> None:
    """
    Check and normalise the types of a record's options.

    A single pattern becomes a tuple, vectors become tuples, numbers Python's types; defaults stay
    unchanged.

    Raises
    ------
    InputError
        If an option has the wrong type; the error's ``option`` is its name.
    """
    for name, said, default in list_options(record):
        value = getattr(record, name)
        is_given = (
            value is not default and value is not MISSING and not _is_among(value, said.passes)
        )
        if is_given and said.type in _CHECKS:
            check = _check_each if said.is_repeated else _CHECKS[said.type]
            object.__setattr__(record, name, check(name, said, value))


def read_texts(name: str, value: Any) -> tuple[str, ...]:
    """Return one text or several as a tuple, or raise an InputError about the option ``name``."""
    try:
        texts = (value,) if isinstance(value, str) else tuple(() if value is None else value)
    except TypeError:
        texts = (None,)
    if not all(isinstance(text, str) for text in texts):
        raise _refuse(name, "is text, or several texts", value)
    return texts


def read_text(name: str, value: Any) -> str | None:
    """Return a text, or None, or raise an InputError about the option ``name``."""
    if value is not None and not isinstance(value, str):
        raise _refuse(name, "is text", value)
    return value


def read_path(name: str, value: Any) -> Path:
    """Return a path, or raise an InputError about the option ``name``."""
    if not isinstance(value, (str, os.PathLike)) or "\0" in str(value):
        raise _refuse(name, "is a path", value)
    return Path(value)


def read_names(name: str, value: Any, known: Sequence[str]) -> dict[str, Any]:
    """Return values by name, or raise an InputError about the option ``name``."""
    if not isinstance(value, Mapping):
        raise _refuse(name, f"is a dict of {', '.join(known)}", value)
    strange = next((key for key in value if key not in known), None)
    if strange is not None:
        near = find_similar(str(strange), known)
        advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}"
        msg = f"{name} has no {show_value(strange)}; {advice}"
        raise InputError(msg, option=name)
    return dict(value)


def is_area_file(value: object) -> bool:
    """Return whether areas that are asked for are those of a file, not parts of the model."""
    if isinstance(value, os.PathLike):
        return True
    return isinstance(value, str) and (
        value.lower().endswith(AREA_ENDINGS) or "/" in value or os.sep in value
    )


def read_flag(name: str, value: Any) -> bool:
    """Return True or False, or raise an InputError about the option ``name``."""
    if not isinstance(value, Hashable) or value not in {True, False}:
        raise _refuse(name, "is True or False", value)
    return bool(value)


def _refuse(name: str, what: str, value: object) -> InputError:
    return InputError(f"{name} {what}; got {show_value(value)}", option=name)


def _is_among(value: object, values: tuple[Any, ...]) -> bool:
    """Return whether a value equals one of several; an array, which has no hash, does not."""
    return isinstance(value, Hashable) and value in values


def read_length(text: str) -> float:
    """
    Read a length in metres, or in the unit given: ``0.5``, ``50cm``, ``30 ft``.

    Returns
    -------
    length : float
        [m]

    Raises
    ------
    ValueError
        If it is no number with a unit of length; the error's text is the remedy.
    """
    number, unit = _LENGTH.fullmatch(text.strip()).groups()  # type: ignore[union-attr]
    try:
        return float(number) * _UNITS[(unit or "m").lower()]
    except ValueError as error:
        units = "mm, cm, m, km, ft"
        msg = f"'{text}' is not a length; give metres, or one in {units}: 50cm"
        raise ValueError(msg) from error


def _check_length(name: str, said: Option, value: Any) -> Any:
    """Check a number of metres, or text with its unit."""
    if isinstance(value, str) and value.strip().lower().endswith(tuple(_UNITS)):
        try:
            return _limit_length(name, said, read_length(value))
        except ValueError as error:
            msg = f"{name}= {error}"
            raise InputError(msg, option=name) from None
    return _check_number(name, said, value)


def _check_ground(name: str, _: Option, value: Any) -> Any:
    """Check a ground; text with a unit is a height."""
    if isinstance(value, str):
        with suppress(ValueError):
            return read_length(value)
    return check_ground(name, value)


def _check_number(name: str, said: Option, value: Any) -> Any:
    is_whole = said.type == "whole"
    kind: Any = Integral if is_whole else Real
    if not isinstance(value, kind) or isinstance(value, bool):
        raise _refuse(name, "is a whole number" if is_whole else "is a number", value)
    if said.least is not None and value < said.least:
        raise _refuse(name, f"must be at least {said.least}", value)
    return int(value) if is_whole else _limit_length(name, said, float(value))


def _check_each(name: str, said: Option, value: Any) -> tuple:
    """Check several values; a single number counts as one value."""
    try:
        several = (value,) if isinstance(value, Real) else tuple(value)
    except TypeError:
        raise _refuse(name, "is one value or several", value) from None
    return tuple(_CHECKS[said.type](name, said, value) for value in several)


def _check_numbers(name: str, said: Option, value: Any) -> tuple:
    kind, what = (Integral, "whole numbers") if said.type == "size" else (Real, "numbers")
    try:
        numbers: tuple[Any, ...] = tuple(value)
    except TypeError:
        numbers = ()
    is_right = all(isinstance(number, kind) and not isinstance(number, bool) for number in numbers)
    counts = said.count if isinstance(said.count, tuple) else (said.count,)
    if len(numbers) not in counts or not is_right:
        raise _refuse(name, f"has {' or '.join(map(str, counts))} {what}", value)
    if said.type == "size":
        return tuple(int(number) for number in numbers)
    return tuple(_limit_length(name, said, float(number)) for number in numbers)


def _limit_length(name: str, said: Option, value: float) -> float:
    """Refuse a length of which products overflow; infinity and NaN are checked where it is used."""
    if said.unit == "m" and math.isfinite(value):
        from umbra.scene.numbers import OUTSIDE  # noqa: PLC0415 - help needs no arrays

        if abs(value) > OUTSIDE:
            raise _refuse(name, f"is at most {OUTSIDE:g} m", value)
    return value


def _check_texts(name: str, _: Option, value: Any) -> tuple[str, ...]:
    return read_texts(name, value)


def _check_flag(name: str, said: Option, value: Any) -> Any:
    """Check a flag; in Python one with a least value may be a number instead."""
    if said.least is not None and isinstance(value, Real):
        return value
    return read_flag(name, value)


def _check_choice(name: str, said: Option, value: Any) -> Any:
    if not _is_among(value, said.choices):
        shown = f"'{value}'" if isinstance(value, (str, Real)) else show_value(value)
        msg = f"{name} {shown} is not one of {', '.join(map(str, said.choices))}"
        raise InputError(msg, option=name)
    return said.choices[said.choices.index(value)]  # 2, not 2.0 or True


_CHECKS: dict[str, Callable[[str, Option, Any], Any]] = {
    "number": _check_number,
    "length": _check_length,
    "whole": _check_number,
    "numbers": _check_numbers,
    "size": _check_numbers,
    "patterns": _check_texts,
    "texts": _check_texts,
    "choice": _check_choice,
    "flag": _check_flag,
    "ground": _check_ground,
}
