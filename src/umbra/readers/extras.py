"""Packages that not every installation has: imported where used, and named if missing."""

from importlib import import_module
from typing import Any

from umbra.errors import InputError

__all__ = ["need"]


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
        package = module.partition(".")[0]
        msg = (
            f"{what} needs the package {package}, which is not installed here ({error}); "
            f"install it with: pip install 'umbra-shadows[{extra}]'"
        )
        raise InputError(msg, package=package, extra=extra) from error
