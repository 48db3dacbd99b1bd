"""
Replace the files of a results folder only when all the new ones are complete.

A run writes into a temporary folder inside the results folder, so on the same file
system, and every file is renamed over its old namesake at the end.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from umbra.errors import InputError, UmbraError
from umbra.writers.beside import FULL
from umbra.writers.held_signals import hold_signals
from umbra.writers.unfinished import UnfinishedFolder, lock_folder

__all__ = ["replace_results"]

KEPT = "earlier results are as they were"


@contextmanager
def replace_results(folder: str | os.PathLike[str]) -> Iterator[Path]:
    """
    Give a temporary folder whose files replace those of ``folder`` on success.

    On entry ``folder`` is made, with its parents, and tried: so enter before long work.
    On any exception, Ctrl-C included, the new files are dropped and the old ones stay
    whole; so they do when the process is killed, and a later run sweeps up after it. A run
    that is killed while it renames is finished by the next one into that folder. Ctrl-C and
    requests to end wait for the renames; two runs into one folder do them one after the
    other. Files that the run did not write are not touched.

    Parameters
    ----------
    folder : path
        Where the results shall be in the end.

    Yields
    ------
    unfinished : Path
        Write here; subfolders are kept.

    Raises
    ------
    InputError
        If ``folder`` is a file, cannot be made or written to, or holds a folder by the
        name of a new file.
    UmbraError
        If the disk, or what the user may have of it, is full.
    KeyboardInterrupt
        Its text says whether the earlier results or the new ones are there.
    """
    target = Path(folder).absolute()
    unfinished, made = _make_unfinished(target)
    is_moved = False
    try:
        yield unfinished.path
        unfinished.check_places()
        with lock_folder(target), hold_signals():
            unfinished.finish_others()
            unfinished.move()
            is_moved = True
            unfinished.remove()
    except KeyboardInterrupt as error:
        held = f"the new results in '{target}' are complete" if is_moved else KEPT
        raise KeyboardInterrupt(held) from error
    except OSError as error:
        if error.errno not in FULL and not unfinished.is_sealed:
            raise
        reason = (error.strerror or str(error)).lower()
        msg = f"could not write the results to '{target}' ({reason}); "
        if unfinished.is_sealed:
            msg += "some are in place and the next run into that folder moves the others there"
        else:
            msg += f"free some space or name another folder; {KEPT}"
        raise UmbraError(msg, path=target) from error
    finally:
        if not is_moved:
            unfinished.remove()
            for path in made:  # innermost first; a folder that holds anything stays
                with suppress(OSError):
                    path.rmdir()


def _make_unfinished(target: Path) -> tuple[UnfinishedFolder, list[Path]]:
    """Make the temporary folder, or say why that cannot be; tell which folders were missing."""
    try:
        if target.exists() and not target.is_dir():
            msg = f"'{target}' is a file, not a folder; name another output folder"
            raise InputError(msg, path=target)
        made = [path for path in (target, *target.parents) if not path.exists()]
        return UnfinishedFolder.make(target), made
    except (OSError, ValueError) as error:  # ValueError: a null byte in its name
        if isinstance(error, InputError):
            raise
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        msg = (
            f"cannot write to the output folder '{target}' ({reason}); "
            "name a folder that you may write to"
        )
        raise InputError(msg, path=target) from None
