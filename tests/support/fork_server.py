"""
A process that has imported umbra, and forks for every start that it is asked for.

It runs as a script, in a process of its own, and knows nothing of the tests: see ``forks.py``. It
has imported what nearly every run imports, called nothing of umbra, compiled no kernel and
started no thread. A fork takes the streams, the folder, the environment and the limits of its
request, becomes the main module, and ends as Python ends, with all that is to be done at exit. It
tells no stages of its work.
"""

import gc
import json
import os
import select
import signal
import socket
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

COMMAND = (
    "umbra.cli.inspect", "umbra.cli.render", "umbra.cli.study", "umbra.calls.picture",
    "umbra.calls.study", "umbra.cpu.frame", "umbra.cpu.plane", "umbra.cpu.patches",
    "umbra.devices.built_in", "umbra.land", "umbra.readers.obj", "umbra.readers.kept",
    "umbra.study.shadow_study", "umbra.study.measures.sky_shares", "umbra.tiles",
    "umbra.volume.inspection", "umbra.writers.folder.write", "umbra.writers.folder.pictures",
    "umbra.writers.netcdf", "umbra.writers.measure_map", "PIL.Image", "PIL.PngImagePlugin",
    "h5netcdf.legacyapi", "tzfpy",
)  # fmt: skip
PYTHON = (*COMMAND, "xarray")


def prepare(kind):
    """Import what the installed command or a user's Python would import first."""
    sys.argv = [kind]
    if kind == "umbra":
        import_module("umbra.cli")  # as the command does: it sets a variable before numpy loads
        import_module("umbra.machine").load_compiler()
    for name in COMMAND if kind == "umbra" else PYTHON:
        import_module(name)
    # A short run tells nothing of its stages, also where a busy machine makes it a long one.
    import_module("umbra.cli.terminal")._EVERY = 3600.0
    if kind != "umbra":  # what numba knows of Python, which it reads before its first kernel
        target = import_module("numba.core.registry").cpu_target
        target.typing_context.refresh()
        target.target_context.refresh()
    gc.collect()
    gc.freeze()  # no fork looks for garbage, and copies pages, among what is imported


def serve(channel):
    """Fork for every request until no one can ask any more; return that of a fork, else None."""
    waking, woken = socket.socketpair()
    waking.setblocking(False)
    signal.set_wakeup_fd(waking.fileno())
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to all; forks hear it
    running = {}
    while True:
        ready, _, _ = select.select([channel, woken], [], [])
        if woken in ready:
            woken.recv(4096)
            tell_ended(running)
        if channel in ready:
            asked, descriptors, _, _ = socket.recv_fds(channel, 1, 1)
            if not asked:
                return None
            request = socket.socket(fileno=descriptors[0])
            if (process := os.fork()) == 0:
                signal.set_wakeup_fd(-1)
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                signal.signal(signal.SIGINT, signal.default_int_handler)
                for other in (channel, waking, woken, *running.values()):
                    other.close()
                return request
            running[process] = request


def tell_ended(running):
    """Send the exit status of every fork that has ended to who asked for it."""
    while running:
        process, status = os.waitpid(-1, os.WNOHANG)
        if not process:
            return
        with running.pop(process) as request:
            try:
                request.sendall(f"{os.waitstatus_to_exitcode(status)}\n".encode())
            except OSError:  # no one waits for it any more
                continue


def take(request):
    """Take what a request gives to its process; return its command."""
    given, streams, _, _ = socket.recv_fds(request, 1, 3)
    while more := request.recv(65536):
        given += more
    given = json.loads(given)
    for target, stream in enumerate(streams):
        os.dup2(stream, target)
        os.close(stream)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115 - as long as the process
    sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", 1, errors="backslashreplace", closefd=False)  # noqa: SIM115
    request.sendall(f"{os.getpid()}\n".encode())
    request.close()
    os.chdir(given["folder"])
    os.environ.clear()
    os.environ.update(given["environment"])
    sys.path[:0] = given["path"]
    for name, limit in given["limits"].items():
        resource = import_module("resource")
        resource.setrlimit(getattr(resource, name), (limit, limit))
    return given["command"]


def run(kind, command):
    """Be the command, or run a script or statements as ``python`` does."""
    if kind == "umbra":
        sys.argv = command
        import_module("umbra.cli").main()
        return
    main = sys.modules["__main__"] = ModuleType("__main__")
    if command[1] == "-c":
        folder, name, text = "", "<string>", command[2]
        sys.argv = ["-c", *command[3:]]
    else:
        main.__file__ = name = command[1]
        folder = str(Path(name).parent)
        text = Path(name).read_text("utf-8")
        sys.argv = command[1:]
    sys.path.insert(0, folder)
    exec(compile(text, name, "exec"), main.__dict__)


if __name__ == "__main__":
    _, _kind, _descriptor = sys.argv
    prepare(_kind)
    _request = serve(socket.socket(fileno=int(_descriptor)))
    if _request is not None:
        run(_kind, take(_request))
