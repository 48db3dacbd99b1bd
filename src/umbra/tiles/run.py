"""
A study of a city in tiles: prepared once, counted by any engine, resumed after any end.

The folder of a run holds ``study.zarr`` (the results), ``catalogue`` (the files as arrays),
``tiles`` (a mark for each tile that is done), ``city.json`` (what is computed) and, if tiles
failed, ``failed.json``.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from umbra.errors import InputError, UmbraError, show_count
from umbra.folders.atomic import NO_LOCKS
from umbra.folders.unfinished_folder import UnfinishedFolder
from umbra.study.area_table import AreaTable
from umbra.study.attributes import find_attributes
from umbra.tiles.city_areas import list_tasks, read_area_table
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.city_proposal import join_neighbours
from umbra.tiles.count import TileRecord, count_tile
from umbra.tiles.job import CityJob
from umbra.tiles.sealed import refuse_links, write_json
from umbra.tiles.store import FORMAT, CityStore
from umbra.tiles.surface_pieces import SurfacePieces, assemble

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["CityRun", "Engine", "Outcome", "count_serially", "lock_run", "run_job"]

Outcome = tuple[CityTile, TileRecord | BaseException]
"""A tile and its record, or the reason why it failed."""
Engine = Callable[[CityJob, Sequence[CityTile]], Iterable[Outcome]]
"""Counts tiles anywhere, in any order, with ``count_tile``; yields each as it is done."""
_FAILED = "failed.json"


@dataclass(frozen=True)
class CityRun:
    """
    A run of tiles that is done, in its folder.

    Parameters
    ----------
    folder : Path
    job : CityJob
    facts : dict
        Attributes of the result.
    notes : tuple of str
        Losses and assumptions, one line each.
    areas : AreaTable, optional
        Figures of the named areas that were asked for.
    """

    folder: Path
    job: CityJob
    facts: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    areas: AreaTable | None = None

    def __repr__(self) -> str:
        return f"CityRun('{self.folder}', {show_count(len(self.job.tiles()), 'tile')})"

    @property
    def dataset(self) -> "xr.Dataset":
        """The result as a dataset of the store, whose arrays are read where they are used."""
        import xarray as xr  # noqa: PLC0415  (half a second)

        return xr.open_zarr(str(self.job.store), zarr_format=FORMAT)


def count_serially(job: CityJob, tiles: Sequence[CityTile]) -> Iterator[Outcome]:
    """Count tiles one after the other in this process."""
    for tile in tiles:
        try:
            yield tile, count_tile(job, tile)
        except Exception as error:  # noqa: BLE001 - a tile that fails leaves the others
            yield tile, error


def run_job(
    job: CityJob,
    finish: Callable[[Mapping[int, Mapping[str, Any]]], Mapping[str, Any]],
    engine: Engine = count_serially,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> CityRun:
    """
    Count the tiles of a job that are not done, and finish its store.

    Parameters
    ----------
    job : CityJob
    finish : callable
        Returns the attributes of the result, of the marks of all tiles.
    engine : Engine
    progress : callable
        Called with the number of tiles done and of all.

    Raises
    ------
    UmbraError
        If tiles failed, after all others are done.
    """
    store, folder = CityStore(job.store), Path(job.folder)
    tiles, tasks = job.tiles(), list_tasks(job)
    damaged = store.drop_damaged(tasks, job.fingerprint)
    done = store.find_done()
    left = [tile for tile in tasks if tile.number not in done]
    failed: dict[int, str] = {}
    count = len(tasks) - len(left)
    progress(count, len(tasks))
    for tile, outcome in engine(job, left):
        if isinstance(outcome, BaseException):
            is_told = isinstance(outcome, UmbraError)  # in words, which need no class
            failed[tile.number] = f"{'' if is_told else f'{type(outcome).__name__}: '}{outcome}"
            write_json(folder / _FAILED, _describe(tasks, failed), orjson.OPT_INDENT_2)
        else:
            count += 1
            progress(count, len(tasks))
    if failed:
        number, reason = next(iter(failed.items()))
        msg = (
            f"{len(failed)} of {len(tasks)} tiles failed (first: tile {number}, {reason}); "
            f"'{folder / _FAILED}' names them; the same command counts them again"
        )
        raise UmbraError(msg, failed=failed)
    (folder / _FAILED).unlink(missing_ok=True)
    facts = finish(store.find_done())
    context = job.open()
    if not context.kind.is_plan:
        folders = [store.find_place(tile.number) for tile in tiles]
        pieces = SurfacePieces(folders)
        assemble(store, pieces, context.catalogue, facts, job.options.quantities)
    if job.options.proposed:
        folders = [store.find_place(tile.number) for tile in tiles]
        variables = join_neighbours(folders, context.catalogue)
        dates = int(str(facts.get("days", 1)))
        store.add(variables, {}, {}, {name: find_attributes(name, dates) for name in variables})
    table = read_area_table(job)
    if table is not None:
        _add_areas(store, table, job, int(str(facts.get("days", 1))))
    is_changed = store.finish(facts)
    notes = []
    if damaged:
        again = show_count(len(damaged), "damaged tile was", "damaged tiles were")
        notes.append(f"{again} counted again (first: {damaged[0]})")
    elif is_changed and not left and context.kind.is_plan:
        notes.append(f"the metadata of '{job.store}' were damaged and made anew")
    return CityRun(folder, job, facts, tuple(notes), table)


def _add_areas(store: CityStore, table: AreaTable, job: CityJob, dates: int) -> None:
    """Add the figures of named areas to a store."""
    nothing = np.zeros(0)
    variables = table.variables({name: (dims, nothing) for name, dims in store.list_dims().items()})
    attributes = {
        name: find_attributes(name, dates, job.options.quantities) for name in variables
    }  # fmt: skip
    store.add(variables, {}, {}, attributes)


def _describe(tiles: Sequence[CityTile], failed: Mapping[int, str]) -> list[dict[str, Any]]:
    return [
        {"tile": number, "rows": tiles[number].rows, "cols": tiles[number].cols, "reason": reason}
        for number, reason in failed.items()
    ]


@contextmanager
def lock_run(folder: Path, say: Callable[[str], object] = lambda _line: None) -> Iterator[None]:
    """
    Hold a folder for one run, in tiles or not; ``say`` is told where the file system cannot.

    Raises
    ------
    InputError
        If another run holds it, nothing can be written into it, or links are in the way.
    """
    refuse_links(folder)
    try:
        held = UnfinishedFolder.make(folder)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        msg = f"cannot write into the output folder '{folder}' ({reason}); name another"
        raise InputError(msg, option="out", path=folder) from error
    try:
        if not held.is_alone:
            say(NO_LOCKS.format(folder=folder))
        yield
    finally:
        held.remove()
