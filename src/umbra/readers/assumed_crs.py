"""The coordinate reference system that a caller names for files that name none."""

from dataclasses import replace

from umbra.errors import InputError, show_value
from umbra.readers.georeference import is_known_crs, name_crs, show_crs
from umbra.readers.model import NO_CRS, FileModel

__all__ = ["assume_crs", "check_crs", "leave_crs", "tell_unused_crs"]


def check_crs(crs: str | None) -> str | None:
    """Return the short name of a caller's CRS; refuse one that is not known."""
    if crs is None:
        return None
    named = name_crs(crs) if isinstance(crs, str) else None
    if named is None or not is_known_crs(named):
        msg = f"crs= is not known: {show_value(crs)}; write it as EPSG:28992"
        raise InputError(msg, option="crs")
    return named


def assume_crs(model: FileModel, crs: str | None) -> FileModel:
    """Return a file's model in the caller's CRS, unless it names its own."""
    if crs is None or model.crs is not None:
        return model
    notes = tuple(note for note in model.notes if not note.endswith(NO_CRS))
    return replace(model, crs=crs, notes=notes)


def leave_crs(model: FileModel) -> FileModel:
    """Return a file's model in its own coordinates, for one that the caller places."""
    notes = tuple(note for note in model.notes if not note.endswith(NO_CRS))
    return replace(model, crs=None, notes=notes)


def tell_unused_crs(own: list[str | None], crs: str | None) -> list[str]:
    """Report a caller's CRS that no file needs; ``own`` are the CRSs that the files name."""
    if crs is None or None in own:
        return []
    named = ", ".join(show_crs(one) for one in dict.fromkeys(own) if one)
    return [f"crs='{crs}' is for files that name none, and each names its own ({named})"]
