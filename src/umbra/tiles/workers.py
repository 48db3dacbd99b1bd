"""
An engine that counts tiles in processes of this machine, which talk through pipes.

Nothing listens: a port, on loopback too, is open to every user of the machine, and whoever reaches
the scheduler of a cluster runs code as its owner. The parent sends records of umbra as pickles;
what comes back is JSON. A worker ends with its input, however the parent ends, in the midst of a
tile too: a tile has no mark before all of it is written. A tile whose worker ends is counted again.
"""

import os
import pickle
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from queue import SimpleQueue
from typing import IO, Any, Self

import orjson

from umbra.errors import InputError, UmbraError
from umbra.machine import HOME, load_compiler, make_command
from umbra.tiles.city_lattice import CityTile
from umbra.tiles.count import TileRecord, count_tile
from umbra.tiles.job import CityJob

__all__ = ["WorkerEngine", "serve_tiles"]

_CODE = (
    "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); "
    "from umbra.tiles.workers import serve_tiles; serve_tiles()"
)
_TRIALS = 3  # of a tile whose worker ends
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


class WorkerEngine:
    """
    Counts tiles in processes of this machine, each on one thread; started at the first call.

    They share the memory of the job. Leaving the ``with`` block ends them at once.

    Parameters
    ----------
    count : int
        Number of processes.

    Raises
    ------
    InputError
        If Python has no program that can be started, as where it is embedded.
    """

    def __init__(self, count: int) -> None:
        if not sys.executable:
            msg = "workers= starts Python, which is no program of its own here; leave it out"
            raise InputError(msg, option="workers")
        self._workers = [_Worker() for _ in range(count)]
        self._threads = ThreadPoolExecutor(count, "umbra-workers")

    @property
    def processes(self) -> list[int]:
        """Numbers of the processes that run."""
        return [worker.child.pid for worker in self._workers if worker.child is not None]

    def __call__(
        self, job: CityJob, tiles: Sequence[CityTile]
    ) -> Iterator[tuple[CityTile, TileRecord | BaseException]]:
        """Count tiles; yield each when it is done."""
        share = job.memory / len(self._workers)
        packed = pickle.dumps(job.with_resources(share, 1), protocol=5)
        # Tiles are taken in order, so that neighbours, which share casters, are counted together.
        waiting = deque(tiles)
        outcomes: SimpleQueue[tuple[CityTile, TileRecord | BaseException]] = SimpleQueue()

        def work(worker: _Worker) -> None:
            with suppress(IndexError):
                while not worker.is_closed:
                    tile = waiting.popleft()
                    outcomes.put((tile, worker.count(packed, tile)))

        for worker in self._workers[: len(tiles)]:
            self._threads.submit(work, worker)
        for _ in tiles:
            yield outcomes.get()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self._workers:
            worker.close()
        self._threads.shutdown(cancel_futures=True)
        for worker in self._workers:
            worker.forget()


class _Worker:
    """A process that counts one tile at a time, and is started again if it ends."""

    def __init__(self) -> None:
        self.child: subprocess.Popen[bytes] | None = None
        self.is_closed = False
        self._job = b""  # that the process has
        self._starting = threading.Lock()

    def count(self, packed: bytes, tile: CityTile) -> TileRecord | BaseException:
        """Return the record of a tile of a pickled job, or the reason why it failed."""
        try:
            for _ in range(_TRIALS):
                answer = self._ask(packed, tile)
                if answer is not None or self.is_closed:
                    return _read(answer or b"{}")
        except OSError as error:  # no process can be started
            return error
        msg = (
            f"its process ended {_TRIALS} times; if it took too much memory, give smaller tiles= "
            "or fewer workers="
        )
        return UmbraError(msg, option="tiles")

    def _ask(self, packed: bytes, tile: CityTile) -> bytes | None:
        """Have a tile counted; None if the process ends before."""
        child = self._start()
        if child is None or child.stdin is None or child.stdout is None:
            return None
        with suppress(BrokenPipeError, ValueError):  # ValueError: closed meanwhile
            if self._job is not packed:
                child.stdin.write(packed)
                self._job = packed
            pickle.dump(tile, child.stdin, protocol=5)
            child.stdin.flush()
            if (answer := child.stdout.readline()).endswith(b"\n"):
                return answer
        self.forget()
        return None

    def _start(self) -> "subprocess.Popen[bytes] | None":
        """Return the process, started if there is none; None once this is closed."""
        with self._starting:
            if self.child is None and not self.is_closed:
                # In a group of its own, which Ctrl-C in a terminal does not reach.
                group: dict[str, Any] = {"process_group": 0} if os.name == "posix" else {}
                self.child = subprocess.Popen(
                    make_command(_CODE), cwd=HOME, env={**os.environ, **_ONE_THREAD},
                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, **group,
                )  # fmt: skip
                self._job = b""
            return self.child

    def close(self) -> None:
        """End the process for good; whoever waits for its answer sees that it has ended."""
        with self._starting:
            self.is_closed = True
            if self.child is not None:
                self.child.kill()

    def forget(self) -> None:
        """End the process and wait for its end, if there is one."""
        child, self.child = self.child, None
        if child is None:
            return
        child.kill()
        for pipe in (child.stdin, child.stdout):
            with suppress(OSError):
                pipe.close()  # type: ignore[union-attr]
        child.wait()


def _read(answer: bytes) -> TileRecord | BaseException:
    """Read a worker's answer."""
    message = orjson.loads(answer)
    if "record" in message:
        return TileRecord(**message["record"])
    kind = InputError if message.get("kind") == InputError.__name__ else UmbraError
    return kind(message.get("message", "the run has ended"))


def serve_tiles() -> None:
    """Count the tiles that standard input names until it ends."""
    pipes = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # Libraries must read no tiles, and their output must not mix with the answers.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    load_compiler()
    messages: SimpleQueue[CityJob | CityTile] = SimpleQueue()
    threading.Thread(target=_receive, args=(pipes[0], messages), daemon=True).start()
    job = None
    while True:
        message = messages.get()
        if isinstance(message, CityJob):
            job = message
            continue
        assert job is not None  # it comes first
        pipes[1].write(orjson.dumps(_count(job, message)) + b"\n")
        pipes[1].flush()


def _receive(jobs: IO[bytes], messages: "SimpleQueue[CityJob | CityTile]") -> None:
    """Pass messages on, also while a tile is counted; end this process with its input."""
    try:
        while True:
            messages.put(pickle.load(jobs))
    finally:
        os._exit(0)


def _count(job: CityJob, tile: CityTile) -> dict[str, Any]:
    """Count a tile; return its record, or why it failed, as JSON can hold it."""
    try:
        return {"record": vars(count_tile(job, tile))}
    except UmbraError as error:
        return {"kind": type(error).__name__, "message": str(error)}
    except Exception as error:  # noqa: BLE001 - a tile that fails leaves the others
        return {"kind": type(error).__name__, "message": f"{type(error).__name__}: {error}"}
