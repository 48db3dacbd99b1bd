"""Modules and packages of extras imported where something needs them; how to install those."""

import json
import shlex
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from umbra.errors import InputError, UmbraError

__all__ = [
    "NAME", "find_source", "load_named", "make_folder_error", "need", "require", "write_install",
]  # fmt: skip

NAME = "umbra-shadows"
"""The distribution's name in a package index."""


def load_named(text: str) -> Any:
    """Return the object that ``module:name`` names; its module is imported on first use."""
    module, _, name = text.partition(":")
    return getattr(import_module(module), name)


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


def write_install(extra: str = "") -> str:
    """
    Return the command that installs umbra with an extra.

    From a clone it installs the clone, in the way in which it was installed: an index need not have
    this version, nor any.
    """
    named = f"[{extra}]" if extra else ""
    source = find_source()
    if source is None:
        return f"pip install {shlex.quote(NAME + named)}"
    folder, is_editable = source
    with suppress(OSError):  # a current folder that was removed
        if folder == Path.cwd():
            folder = Path()
    return f"pip install {'-e ' * is_editable}{shlex.quote(str(folder) + named)}"


def find_source() -> tuple[Path, bool] | None:
    """
    Find the clone that umbra runs from, or that it was installed from.

    Returns
    -------
    source : (Path, bool), optional
        The folder, and whether it is used as it stands (an editable installation).
    """
    folder = Path(__file__).resolve().parents[2]
    if _holds_source(folder):
        return folder, True
    from importlib.metadata import PackageNotFoundError, distribution  # noqa: PLC0415 - 20 ms

    try:
        origin = json.loads(distribution(NAME).read_text("direct_url.json") or "{}")
        url = urlsplit(origin.get("url", ""))
    except (AttributeError, PackageNotFoundError, ValueError):
        return None
    folder = Path(unquote(url.path))
    return (folder, False) if url.scheme == "file" and _holds_source(folder) else None


def _holds_source(folder: Path) -> bool:
    return (folder / "pyproject.toml").is_file() and (folder / "src" / "umbra").is_dir()


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
    command = write_install(extra) if extra else f"pip install {packages[0]}"
    msg = (
        f"{what} needs {' and '.join(packages)}, which {verb} not installed here{reason}; "
        f"install with: {command}"
    )
    return InputError(msg, package=packages[0], extra=extra)
