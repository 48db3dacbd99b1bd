"""
Calls whose signature and docstring are those of a record of options.

An option stands once, as a field of its record: ``takes`` gives a call its name, default, type and
words. Type checkers and editors see the same, as the fields are the parameters of the record's own
``__init__``, which the calls' protocols repeat by a ``ParamSpec``.
"""

import functools
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any, TypeVar

from umbra.errors import InputError, find_similar, write_for_docs
from umbra.option_fields import Option, list_options

__all__ = ["check_names", "takes"]

C = TypeVar("C", bound=Callable[..., Any])
_WIDTH = 96
_STARRED = re.compile(r"(?<![`\w.*-])[\w.-]*\*[\w.*-]*")  # a pattern is no emphasis
_ENTRY = re.compile(r"^options : \w+\n(?:[ ]+.*\n)*", re.MULTILINE)


def takes(record: Callable[..., Any], what: str, **more: type) -> Callable[[C], C]:
    """
    Let a call take the options of a record, each by its name.

    The call itself has a parameter ``options``, a record; its docstring has an entry ``options``,
    which the entries of all options replace.

    Parameters
    ----------
    record : type
        A record of options.
    what : str
        What the options are of, for errors: ``a study``.
    **more : type
        A further record, which the call has by this name, without entries in the docstring.

    Raises
    ------
    InputError
        From the call: if a name is unknown, or the record refuses a value.
    """

    def decorate(call: C) -> C:
        own = [
            parameter
            for parameter in inspect.signature(call).parameters.values()
            if parameter.name != "options"
        ]
        own = [parameter for parameter in own if parameter.name not in more]
        records: list[Any] = [record, *more.values()]
        known = {
            name: field for record in records for name, field in record.__dataclass_fields__.items()
        }
        for parameter in own:
            known.pop(parameter.name, None)
        needed = [name for name, field in known.items() if field.default is MISSING]

        @functools.wraps(call)
        def checked(*given: Any, **named: Any) -> Any:
            others = {
                parameter.name: named.pop(parameter.name)
                for parameter in own
                if parameter.name in named
            }
            check_names(named, known, what)
            lacking = [f"{name}=" for name in needed if name not in named]
            if lacking:
                msg = f"{call.__name__}() needs {' and '.join(lacking)}"
                raise TypeError(msg)
            for name, further in more.items():
                names = further.__dataclass_fields__  # type: ignore[attr-defined]
                others[name] = further(**{key: named.pop(key) for key in names if key in named})
            return call(*given, **others, options=record(**named))

        added = [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, annotation=_name_given(str(field.type)),
                default=inspect.Parameter.empty if field.default is MISSING else field.default,
            )
            for name, field in known.items()
        ]  # fmt: skip
        checked.__signature__ = inspect.signature(call).replace(parameters=[*own, *added])  # type: ignore[attr-defined]
        entries = "\n".join(_describe(record, known))
        checked.__doc__ = _ENTRY.sub(lambda _: f"{entries}\n", inspect.getdoc(call) or "")
        return checked  # type: ignore[return-value]

    return decorate


def check_names(given: Sequence[str] | dict[str, Any], known: Any, what: str) -> None:
    """Raise an InputError if an option is unknown."""
    for name in given:
        if name not in known:
            near = find_similar(name, known)
            advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}"
            msg = f"{what} has no option '{name}'; {advice}"
            raise InputError(msg, option=name)


def _describe(record: Any, known: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of numpydoc entries."""
    types = {field.name: str(field.type) for field in fields(record)}
    for name, said, default in list_options(record):
        if name not in known:
            continue
        yield f"{name} : {_name_type(said, _name_given(types[name]), default)}"
        words = write_for_docs(f"{said.help} {said.more}".strip())
        words = _STARRED.sub(r"``\g<0>``", words)
        yield from textwrap.wrap(words, _WIDTH, initial_indent="    ", subsequent_indent="    ")


def _name_given(annotation: str) -> str:
    """Return the type that a caller may give, of ``Given[GIVEN, KEPT]`` the first."""
    if not annotation.startswith("Given["):
        return annotation
    depth = 0
    for k, letter in enumerate(annotation):
        depth += (letter == "[") - (letter == "]")
        if letter == "," and depth == 1:
            return annotation[6:k]
    return annotation


def _name_type(said: Option, annotation: str, default: Any) -> str:
    """Write a type as docstrings do: ``str or sequence of str, optional``."""
    words = re.sub(r"dt\.| \| None$", "", annotation)
    words = re.sub(r"Mapping\[[^]]*\]", "dict", words)
    words = re.sub(r"\bPath\b|os\.PathLike\[str\]", "path", words)
    words = re.sub(r"Sequence\[(\w+(?: \| \w+)*)\]", r"sequence of \1", words).replace(
        " | ", " or "
    )
    if said.choices:
        words = f"{{{', '.join(map(repr, said.choices))}}}"
    elif said.type == "numbers":
        counts = said.count if isinstance(said.count, tuple) else (said.count,)
        words = " or ".join(f"({count},) float" for count in counts)
    elif said.type == "size":
        words = "(int, int)"
    elif said.type in {"patterns", "texts"}:
        words = "str or sequence of str"
    if default is MISSING:
        return words
    if callable(default):
        return "callable"
    return f"{words}, optional" if default in (None, ()) else f"{words}, default {default!r}"
