"""Packages of extras: imported where something needs them; errors say how to install them."""

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from umbra.errors import InputError, UmbraError

__all__ = ["make_folder_error", "need", "require"]


def need(module: str, extra: str, what: str) -> Any:
    """Import a module that ``what`` needs; of an extra, or without one, of a package by itself."""
    try:
        return import_module(module)
    except ImportError as error:
        raise _miss([module.partition(".")[0]], extra, what, f" ({error})") from error


def require(packages: Sequence[str], extra: str, what: str) -> None:
    """Check that packages of an extra are installed, as `need`, without importing them."""
    missing = [package for package in packages if not _is_there(package)]
    if missing:
        raise _miss(missing, extra, what)


def make_folder_error() -> UmbraError:
    """Make the error for an OSError of importing matplotlib, which needs a folder of its own."""
    msg = (
        "pictures cannot be drawn where no folder may be written to, as matplotlib keeps its list "
        "of typefaces in one; set MPLCONFIGDIR to a folder that may"
    )
    return UmbraError(msg)


def _is_there(package: str) -> bool:
    try:
        return find_spec(package) is not None
    except ValueError:  # a module of this name was loaded from nowhere
        return False


def _miss(packages: Sequence[str], extra: str, what: str, reason: str = "") -> InputError:
    verb = "is" if len(packages) == 1 else "are"
    wanted = f"'umbra-shadows[{extra}]'" if extra else packages[0]
    msg = (
        f"{what} needs {' and '.join(packages)}, which {verb} not installed here{reason}; "
        f"install with: pip install {wanted}"
    )
    return InputError(msg, package=packages[0], extra=extra)
