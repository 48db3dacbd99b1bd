"""Packages that not every installation has: imported where used, and named if missing."""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from umbra.errors import InputError

__all__ = ["need", "require"]


def need(module: str, extra: str, what: str) -> Any:
    """
    Import a package of an extra.

    Parameters
    ----------
    module : str
        As ``rasterio``, or a module in it.
    extra : str
        The extra of umbra that brings it.
    what : str
        The format that needs it, for the error.

    Returns
    -------
    module : module

    Raises
    ------
    InputError
        If it is not installed; says how to install it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise _miss(module.partition(".")[0], extra, what, str(error)) from error


def require(package: str, extra: str, what: str) -> None:
    """
    Check that a package of an extra is installed, without importing it.

    Parameters
    ----------
    package, extra, what : str
        As in `need`.

    Raises
    ------
    InputError
        If it is not installed; says how to install it.
    """
    try:
        found = find_spec(package)
    except ValueError:  # a module of this name was loaded from nowhere
        found = None
    if found is None:
        raise _miss(package, extra, what, f"no module named '{package}'")


def _miss(package: str, extra: str, what: str, reason: str) -> InputError:
    msg = (
        f"{what} needs the package {package}, which is not installed here ({reason}); "
        f"install it with: pip install 'umbra-shadows[{extra}]'"
    )
    return InputError(msg, package=package, extra=extra)
