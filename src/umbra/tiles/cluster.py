"""
Engines that count tiles by processes of this machine, or of a Dask cluster that runs.

Workers read files and write results in the run's folder, which all of them must see. What passes
through the scheduler is the job, once for each worker, and a few bytes for each tile. A tile whose
worker ends is counted again by another: a tile has no mark before all of it is written.

A cluster's scheduler can run code as everyone who connects to it: who names one trusts it with
their account.
"""

import gc
import pickle
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from umbra.errors import InputError, UmbraError
from umbra.packages import require
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.count import TileRecord, count_tile
from umbra.tiles.job import CityJob
from umbra.tiles.run import count_serially
from umbra.tiles.workers import WorkerEngine
from umbra.version import __version__

if TYPE_CHECKING:
    from umbra.tiles.run import Engine

__all__ = ["ClusterEngine", "open_engine"]

_AHEAD = 3  # tiles for each thread of the cluster that the scheduler knows at a time
_WAIT = 30.0  # for a scheduler to answer [s]
_GONE = "the run's folder keeps all tiles that are done; the same command counts the rest"


@dataclass(frozen=True)
class ClusterEngine:
    """
    Counts tiles on the workers of a Dask client.

    Parameters
    ----------
    client : distributed.Client
    """

    client: Any

    def __call__(
        self, job: CityJob, tiles: Sequence[CityTile]
    ) -> Iterator[tuple[CityTile, TileRecord | BaseException]]:
        """
        Count tiles, a few for each thread at a time; yield each when it is done.

        Raises
        ------
        InputError
            If workers have another umbra, or do not see the run's folder.
        UmbraError
            If the scheduler is lost.
        """
        from distributed import as_completed  # noqa: PLC0415  (an extra)

        threads = self._check(job)
        share = job.memory / threads if self._is_local else self._find_memory(job.memory)
        packed = pickle.dumps(job.with_resources(share, 1), protocol=5)
        # A task's result, not a scattered value: Dask makes it again if its worker ends.
        shared = self.client.submit(pickle.loads, packed, key=f"umbra-city-{job.fingerprint}")
        left = iter(tiles)
        waiting: dict[Any, CityTile] = {}

        def submit() -> Any:
            tile = next(left, None)
            if tile is None:
                return None
            # Tiles are submitted in order, so that neighbours, which share casters, run together.
            future = self.client.submit(
                count_tile, shared, tile, pure=False, priority=-tile.number, retries=0
            )
            waiting[future] = tile
            return future

        begun = [future for _ in range(_AHEAD * threads) if (future := submit()) is not None]
        done = as_completed(begun, raise_errors=False)
        for future in done:
            tile = waiting.pop(future)
            if future.status == "cancelled":
                msg = f"the cluster's scheduler is gone; {_GONE}"
                raise UmbraError(msg)
            error = future.exception()
            yield tile, future.result() if error is None else error
            more = submit()
            if more is not None:
                done.add(more)

    @property
    def _is_local(self) -> bool:
        """Whether the workers are processes of this machine and share its memory."""
        from distributed import LocalCluster  # noqa: PLC0415

        return isinstance(self.client.cluster, LocalCluster)

    def _find_memory(self, most: float) -> float:
        """Return the memory of a thread of the smallest worker, if workers have limits [byte]."""
        workers = self.client.scheduler_info(n_workers=-1)["workers"].values()
        limits = [
            worker["memory_limit"] / worker["nthreads"]
            for worker in workers
            if worker["memory_limit"]
        ]
        return min([most, *limits])

    def _check(self, job: CityJob) -> int:
        """Check that all workers can count; return the number of their threads."""
        try:
            self.client.wait_for_workers(1, timeout=_WAIT)
        except TimeoutError as error:
            msg = f"no worker joined the cluster within {_WAIT:.0f} s; start workers"
            raise InputError(msg, option="scheduler") from error
        answers = self.client.run(_introduce, job.folder, on_error="return")
        for address, answer in answers.items():
            if isinstance(answer, BaseException):
                msg = f"worker {address} has no umbra that can count tiles ({answer}); install it"
                raise InputError(msg, option="scheduler", worker=address)
            version, sees = answer
            if version != __version__:
                msg = f"worker {address} has umbra {version}, not {__version__}; install it"
                raise InputError(msg, option="scheduler", worker=address)
            if not sees:
                msg = (
                    f"worker {address} does not see '{job.folder}'; choose a folder that all "
                    "workers share"
                )
                raise InputError(msg, option="out", worker=address)
        return max(sum(self.client.nthreads().values()), 1)


def _introduce(folder: str) -> tuple[str, bool]:
    """Return a worker's version of umbra, and whether it sees a folder."""
    return __version__, Path(folder).is_dir()


@contextmanager
def open_engine(workers: int | None = None, scheduler: str | None = None) -> Iterator["Engine"]:
    """
    Yield an engine that counts on processes of this machine, or of a running cluster.

    Parameters
    ----------
    workers : int, optional
        Number of processes of this machine, each with one thread; this process by default.
    scheduler : str, optional
        Address of a running scheduler, such as ``tcp://10.0.0.1:8786``; or the path of its
        ``scheduler.json``. It can run code as this user.

    Raises
    ------
    InputError
        If Dask is not installed, or nothing answers at the address.
    """
    if scheduler is None:
        if workers is None:
            yield count_serially
            return
        with WorkerEngine(workers) as engine:
            yield engine
        return
    require(["distributed"], "city", "scheduler=")
    from distributed import Client  # noqa: PLC0415

    given = {"scheduler_file": scheduler} if scheduler.endswith(".json") else {"address": scheduler}
    client, reason = None, ""
    try:
        # Not the default of all that uses Dask: a scheduler that does not answer would stay so.
        client = Client(**given, timeout=_WAIT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error) or "no answer"
    if client is None:
        # What is left of it is closed here, as the error holds it no longer: cleared away while
        # another starts, or as Python ends, it would wait for a thread that waits for it.
        gc.collect()
        msg = f"no Dask scheduler answers at '{scheduler}' ({reason}); start one, or correct it"
        raise InputError(msg, option="scheduler")
    with client, client.as_current():
        yield ClusterEngine(client)
