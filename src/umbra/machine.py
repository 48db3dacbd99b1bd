"""
Resources of the machine: memory, cores, threads, child processes, compiled kernels.

With ``-c`` or ``-m`` Python searches the current folder for modules; numba reads
``.numba_config.yaml`` there, which can set a cache folder of pickles, and matplotlib reads
``matplotlibrc``. That folder may hold an untrusted download, so a child process uses this process's
import path without it, and runs in umbra's folder.

numba stores compiled kernels beside the source, else in the user's cache folder, and refuses to
compile if it can write to neither, as in a read-only container of a user without a home.
"""

import atexit
import gc
import math
import os
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager, suppress
from functools import cache
from importlib import import_module
from pathlib import Path, PurePosixPath
from types import ModuleType
from typing import Any

from umbra.version import __version__

try:
    import resource
except ImportError:  # Windows has no such limits
    resource = None  # type: ignore[assignment]

__all__ = [
    "FIRST_RUN",
    "HOME",
    "choose_threads",
    "count_cores",
    "find_kernel_cache",
    "find_memory",
    "get_threads",
    "listen_to_compiler",
    "load_compiler",
    "make_command",
    "name_memory",
    "pass_over_settings",
    "tell_compiling",
    "use_threads",
]

HOME = Path(__file__).parent
"""Working folder of child processes; paths passed to them must be absolute."""

_GROUPS = Path("/proc/self/cgroup")
_FOLDERS = Path("/sys/fs/cgroup")
_USE = Path("/proc/self/statm")


def find_memory() -> float:
    """
    Return the memory that this process may use [byte].

    This is the machine's memory, or less if a control group (a container, a cluster job, a systemd
    service) or the process's own limits (``ulimit -v``, ``-d``) allow less.
    """
    return min(_find_physical(), _find_group_limit(), *_find_own_limits())


def name_memory(held: float) -> str:
    """Describe an amount of memory, for errors."""
    is_machine = held >= _find_physical()
    return f"{'this machine has' if is_machine else 'this process may use'} {held / 1e9:.1f} GB"


def _find_physical() -> float:
    with suppress(AttributeError, ValueError, OSError):
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    from psutil import virtual_memory  # noqa: PLC0415  (for Windows alone: it takes 15 ms)

    return float(virtual_memory().total)


@cache
def _find_group_limit() -> float:
    """Return the lowest memory limit of the control groups of this process [byte]."""
    least = math.inf
    for path in _find_group_files():
        with suppress(OSError, ValueError):  # it may be "max"
            least = min(least, float(path.read_text(encoding="ascii")))
    return least


def _find_own_limits() -> Iterator[float]:
    if resource is None:
        return
    # These limit addresses; libraries and threads reserve more of them than they use.
    size, resident, data = _find_use()
    for name, taken in (("RLIMIT_AS", size), ("RLIMIT_DATA", data)):
        limit = resource.getrlimit(getattr(resource, name))[0]
        if limit != resource.RLIM_INFINITY:
            yield max(float(limit - max(taken - resident, 0)), 0.0)


def _find_group_files() -> Iterator[Path]:
    """
    Return the limit files of this process's control group and its parent groups.

    In a container the group's own path may be missing, and the root is the container's.
    """
    text = ""
    with suppress(OSError, ValueError):
        text = _GROUPS.read_text(encoding="utf-8")
    for line in [*text.splitlines(), "0::/", "1:memory:/"]:
        _, _, rest = line.partition(":")
        kinds, _, path = rest.partition(":")
        inside = PurePosixPath(path).relative_to("/") if path.startswith("/") else PurePosixPath()
        roots: tuple[Path, ...]
        if not kinds:  # version 2
            roots, name = (_FOLDERS, _FOLDERS / "unified"), "memory.max"
        elif "memory" in kinds.split(","):  # version 1
            roots, name = (_FOLDERS / "memory",), "memory.limit_in_bytes"
        else:
            continue
        for root in roots:
            for group in (inside, *inside.parents):
                yield root / group / name


def _find_use() -> tuple[int, int, int]:
    """Return the sizes of this process: address space, resident memory and data [byte]."""
    with suppress(OSError, ValueError):
        pages = [int(word) for word in _USE.read_text(encoding="ascii").split()]
        size, resident, data = (pages[n] * os.sysconf("SC_PAGE_SIZE") for n in (0, 1, 5))
        return size, resident, data
    return 0, 0, 0


def count_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def choose_threads(threads: int | None) -> int:
    """Return a number of threads: all cores by default and at most, as more would only wait."""
    cores = count_cores()
    return cores if threads is None else min(threads, cores)


class _Threads(threading.local):
    number = count_cores()


_threads = _Threads()


def use_threads(threads: int) -> None:
    """
    Set the number of threads of kernels called from this thread, at most all; all by default.

    Results do not depend on it.
    """
    _threads.number = max(1, choose_threads(threads))


def get_threads() -> int:
    """Return the number of threads of kernels called from this thread."""
    return _threads.number


def load_compiler() -> None:
    """
    Load numba for kernels that are compiled already, in umbra's own processes; halves their start.

    numba imports packages only to see whether they are there, runs the extensions of others, and
    reads all that its compiler knows before it loads a kernel, 0.4 s, although one that is compiled
    needs the runtime alone. A kernel that is not compiled yet makes the compiler read the rest.
    Users' own kernels might need the packages and the extensions, so only the commands do this.

    Both are changes to numba as it runs, and stay while they are worth it: a town's study without
    pictures takes 1.29 s of the processor without them, 1.08 s where a kernel needs the runtime
    alone, and 1.00 s where nothing needless is imported, too (under load, least of 5 in turn).
    """
    global _is_command  # noqa: PLW0603
    _is_command = True
    if "numba" in sys.modules:
        return
    # Nearly all objects live as long as the process: looking for garbage among them takes 0.05 s
    # while it starts, and 0.1 s when it ends.
    gc.set_threshold(50_000)
    atexit.register(gc.freeze)
    extensions: Any = ModuleType("numba.core.entrypoints")
    extensions.init_all = lambda: None
    unneeded = dict.fromkeys({"cffi", "scipy", "yaml"} - sys.modules.keys())
    sys.modules |= {**unneeded, extensions.__name__: extensions}  # type: ignore[dict-item]
    try:
        import_module("numba.core").entrypoints = extensions  # type: ignore[attr-defined]
    finally:
        for name in unneeded:  # an import of it has failed
            del sys.modules[name]
    runtime: Any = getattr(import_module("numba.core.runtime"), "rtsys", None)
    loaded: Any = import_module("numba.core.caching").Cache
    inner = ("load_overload", "_load_overload", "_guard_against_spurious_io_errors")
    if runtime is None or not all(hasattr(loaded, name) for name in inner):
        return  # a later numba, which is left as it is

    def load_overload(self: Any, signature: Any, context: Any) -> Any:
        runtime.initialize(context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(signature, context)

    loaded.load_overload = load_overload


FIRST_RUN = "compiling for this machine, once; later runs start at once"
_listeners: list[Callable[[], object]] = []
_is_command = False  # and not a session of Python


def tell_compiling() -> None:
    """Tell that a kernel is compiled: the listeners, or in a session of Python its log, once."""
    for listener in tuple(_listeners):
        listener()
    if not (_listeners or _is_command):
        _warn_of_first_run()


@cache
def _warn_of_first_run() -> None:
    from logging import getLogger  # noqa: PLC0415  (commands never need it)

    getLogger("umbra").warning("umbra: %s", FIRST_RUN)


@contextmanager
def listen_to_compiler(listener: Callable[[], object]) -> Iterator[None]:
    """Call a function in the block whenever a kernel is compiled."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def make_command(code: str, *arguments: str) -> list[str]:
    """
    Make the command of a child process that runs Python statements; start it in ``HOME``.

    It imports nothing from the current folder, unless ``PYTHONPATH`` names it or umbra is there.
    The arguments become its ``sys.argv[1:]``.
    """
    path = [entry for entry in sys.path if entry and not _is_here(entry)]
    root = str(HOME.parent)
    if root not in path:
        path.append(root)
    # If the current folder is one of Python's own, the child's path restores it.
    start = f"import sys; p = {path!r}; sys.path[:] = p + [e for e in sys.path if e not in p]"
    return [sys.executable, "-P", "-c", f"{start}\n{code}", *arguments]


def _is_here(entry: str) -> bool:
    """Return whether an entry of ``sys.path`` is the current folder."""
    try:
        return Path(entry).samefile(os.curdir)
    except OSError:  # the entry or the current folder does not exist
        return False


@cache
def find_kernel_cache() -> str | None:
    """
    Make kernels compile and pictures draw in any environment; return a note on kernels not kept.

    Both use a folder of the run where there is no other. matplotlib cannot be imported without one.
    """
    _drop_older_kernels()
    is_kept = bool(os.environ.get("NUMBA_CACHE_DIR")) or _is_writable(HOME / "cpu")
    is_kept = is_kept or _has_user_folder()
    is_drawn = bool(os.environ.get("MPLCONFIGDIR")) or _has_picture_folder()
    folder = None if is_kept and is_drawn else _make_folder()
    if folder is not None:
        missing = {"NUMBA_CACHE_DIR": not is_kept, "MPLCONFIGDIR": not is_drawn}
        for name in filter(missing.get, missing):
            os.environ[name] = folder  # for children, too
    elif not is_kept:
        dispatcher = import_module("numba.core.dispatcher").Dispatcher
        dispatcher.enable_caching = lambda _: None
    if is_kept:
        return None
    return (
        "compiled kernels cannot be kept beside umbra or in a home folder, so every run compiles "
        "them anew, for about a minute; set NUMBA_CACHE_DIR to a folder that may be written to"
    )


def _drop_older_kernels() -> None:
    """
    Delete what another release has compiled beside the modules, which an upgrade leaves there.

    numba reads what a kernel's index names, records by their modules among it, before it looks
    whether the source has changed: where a record has moved since, that fails.
    """
    marker, own = HOME / "__pycache__" / "kernels.release", HOME / "version.py"
    with suppress(OSError):
        release = f"{__version__} {own.stat().st_mtime_ns}"
        if marker.exists() and marker.read_text("utf-8") == release:
            return
        for ending in ("nbi", "nbc"):
            for path in HOME.glob(f"**/__pycache__/*.{ending}"):
                path.unlink(missing_ok=True)
        marker.parent.mkdir(exist_ok=True)
        marker.write_text(release, "utf-8")


def _make_folder() -> str | None:
    """Make a folder that lasts as long as the process; in memory if no disk may be written to."""
    for root in (None, "/dev/shm"):
        with suppress(OSError):
            folder = tempfile.mkdtemp(prefix="umbra-kernels-", dir=root)
            atexit.register(_remove, folder, os.getpid())
            return folder
    return None


def _has_picture_folder() -> bool:
    """Return whether matplotlib may write to its own folders, or make them."""
    try:
        home = Path.home()
    except RuntimeError:
        return False
    places = [home / ".matplotlib"]
    if sys.platform.startswith(("linux", "freebsd")):
        names = {"XDG_CONFIG_HOME": ".config", "XDG_CACHE_HOME": ".cache"}
        places = [
            Path(os.environ.get(name) or home / usual, "matplotlib")
            for name, usual in names.items()
        ]
    return all(map(_may_make, places))


def _may_make(folder: Path) -> bool:
    there = next(
        ancestor for ancestor in (folder, *folder.absolute().parents) if os.path.lexists(ancestor)
    )
    return there.is_dir() and os.access(there, os.W_OK)


def _is_writable(folder: Path) -> bool:
    cache = folder / "__pycache__"
    return os.access(cache if cache.exists() else folder, os.W_OK)


def _has_user_folder() -> bool:
    from platformdirs import user_cache_path  # noqa: PLC0415 - only for a cache

    folder = user_cache_path("numba", appauthor=False)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return folder.is_absolute() and os.access(folder, os.W_OK)


def _remove(folder: str, owner: int) -> None:
    if os.getpid() == owner:  # not in a fork
        shutil.rmtree(folder, ignore_errors=True)


def pass_over_settings() -> None:
    """Import numba and matplotlib from another folder if the current one has their settings."""
    if os.path.lexists(".numba_config.yaml"):
        with chdir(HOME):
            config: Any = import_module("numba.core.config")
        config._config_fname = os.devnull  # numba reads it again at each compilation
    if os.path.lexists("matplotlibrc"):
        with chdir(HOME):
            import_module("matplotlib")
