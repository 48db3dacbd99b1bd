"""Checks of a call to ``umbra.shadow_study``, before any work."""

import difflib
import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from umbra.errors import InputError
from umbra.options import list_options
from umbra.scene import Scene
from umbra.study.options import StudyOptions
from umbra.sun import Site

__all__ = ["check_names", "check_scene"]

P = ParamSpec("P")
T = TypeVar("T")


def check_names(call: Callable[P, T]) -> Callable[P, T]:
    """
    Make a call with a study's options say which name is no option, and what is missing.

    Raises
    ------
    InputError
        From the call: if a name is unknown, or there is no date.
    """
    known = [name for name, _, _ in list_options(StudyOptions)]

    @functools.wraps(call)
    def checked(*args: P.args, **given: P.kwargs) -> T:
        for name in given:
            if name not in known and name not in {"scene", "site"}:
                near = difflib.get_close_matches(name, known, n=1)
                advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}"
                msg = f"a study has no option '{name}'; {advice}"
                raise InputError(msg, option=name)
        if "date" not in given:
            msg = "a study needs a date; give date='YYYY-MM-DD'"
            raise InputError(msg, option="date")
        return call(*args, **given)

    return checked


def check_scene(scene: object, site: object) -> None:
    """
    Check the types of what is studied.

    Raises
    ------
    InputError
        If it is no scene, or its place no site.
    """
    if not isinstance(scene, Scene):
        msg = f"scene is no Scene but a {type(scene).__name__}; give what umbra.read returns"
        raise InputError(msg)
    if not isinstance(site, Site):
        msg = f"site is no Site but a {type(site).__name__}; give umbra.Site(latitude=, longitude=)"
        raise InputError(msg)
