"""The call of ``umbra.shadow_study``: slips told where they are made, not far below."""

import difflib
import inspect
from collections.abc import Callable
from numbers import Integral, Real
from typing import Any

from umbra.errors import InputError
from umbra.scene import Scene
from umbra.study.setup import Setup
from umbra.sun import Site

__all__ = ["check_call", "find_options", "make_signature"]

_OWN = {"scene", "site", "options", "progress", "names", "cls"}  # no options of a caller
_PATTERNS = ("cast", "no_cast", "canopy", "who", "proposed", "on")
_NUMBERS = {"ground": Real, "cell": Real, "fov": Real, "spacing": Real, "threads": Integral}
_VECTORS = {"extent": 4, "eye": 3, "target": 3, "size": 2}


def find_options(*runs: Callable[..., object]) -> dict[str, inspect.Parameter]:
    """Give the options of ways to run a study, those that all have first."""
    found: dict[str, inspect.Parameter] = {}
    for run in (Setup.of, *runs):
        found |= {
            name: one
            for name, one in inspect.signature(run).parameters.items()
            if name not in _OWN and name not in found
        }
    return found


def make_signature(call: Callable[..., object], *runs: Callable[..., object]) -> inspect.Signature:
    """Give the signature of a call that passes its options on, for help and completion."""
    signature = inspect.signature(call)
    own = [one for one in signature.parameters.values() if one.name != "options"]
    return signature.replace(parameters=[*own, *find_options(*runs).values()])


def check_call(
    scene: object, site: object, options: dict[str, Any], own: Callable[..., object],
    *others: Callable[..., object],
) -> dict[str, Any]:  # fmt: skip
    """
    Check the types of what a study is called with.

    Parameters
    ----------
    scene, site : object
    options : dict
    own : function
        That runs the study.
    *others : function
        That run studies of other receivers.

    Returns
    -------
    options : dict
        One pattern is made a sequence of patterns, a number for a name a str.

    Raises
    ------
    InputError
        If an argument is of a wrong type, is missing, or is no option of such a study.
    """
    if not isinstance(scene, Scene):
        msg = f"scene is no Scene but {_describe(scene)}; give what umbra.read returns"
        raise InputError(msg)
    if not isinstance(site, Site):
        msg = f"site is no Site but {_describe(site)}; give umbra.Site(latitude=, longitude=)"
        raise InputError(msg)
    known, every = find_options(own), find_options(own, *others)
    for name in options:
        if name in known:
            continue
        if name in every:
            receivers = options.get("receivers", "ground")
            msg = f"'{name}' is not for receivers {receivers!r}; leave it out"
        else:
            near = difflib.get_close_matches(name, every, n=1)
            advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(every)}"
            msg = f"a study has no option '{name}'; {advice}"
        raise InputError(msg, option=name)
    if "date" not in options:
        msg = "a study needs a date; give date='YYYY-MM-DD'"
        raise InputError(msg)
    given = dict(options)
    for name in ("receivers", "date"):
        if isinstance(given.get(name), Real):
            given[name] = f"{given[name]:g}"
    if not isinstance(given.get("receivers", ""), str):
        msg = f"receivers are named by a str, such as 'top'; got {given['receivers']!r}"
        raise InputError(msg)
    for name in _PATTERNS:
        if isinstance(given.get(name), str):
            given[name] = (given[name],)
    for name, kind in _NUMBERS.items():
        value = given.get(name)
        if value is not None and not isinstance(value, kind):
            what = "a whole number" if kind is Integral else "a number"
            msg = f"{name} is {what}; got {value!r}"
            raise InputError(msg, option=name)
    for name, count in _VECTORS.items():
        if given.get(name) is not None:
            _check_vector(name, given[name], count)
    return given


def _check_vector(name: str, value: Any, count: int) -> None:
    try:
        kind = Integral if name == "size" else Real
        is_right = len(value) == count and all(
            isinstance(one, kind) and not isinstance(one, bool) for one in value
        )
    except TypeError:
        is_right = False
    if not is_right:
        msg = f"{name} has {count} {'whole ' if name == 'size' else ''}numbers; got {value!r}"
        raise InputError(msg, option=name)


def _describe(value: object) -> str:
    return f"a {type(value).__name__}"
