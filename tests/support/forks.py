"""
Processes of umbra that start at once.

A test that needs a process (its exit status, its streams, what a limit does to it) seldom needs a
cold start, which imports umbra and numba anew: 0.7 to 1 s of the processor, where a small study
takes 0.4 s. So each worker of a run of the tests starts a server for the command, and one for
users' own Python, when it first needs it. A server has imported them and forks
(``fork_server.py``).

A fork runs what a cold process would, from parsing its words to what is done at exit, in the same
folder and environment. What differs is that modules are imported already. So a test starts cold
(with ``subprocess``) where it is about what is imported or how long that takes, what Python does
before the first line (flags, encodings, where it looks for modules), terminals, or limits of
memory. ``--thorough`` starts all of them cold.
"""

import json
import os
import select
import signal
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

from support import sweeps
from support.command import SCRIPT

SERVER = Path(__file__).with_name("fork_server.py")
READ_AT_START = (
    "HOME", "LANG", "LC_", "LD_", "MPL", "NUMBA_", "OMP_", "PYTHON", "XDG_",
)  # fmt: skip
"""Variables that Python and packages read when they load; a fork has those of its server."""
LEFT_BY_DASK = {"OMP_NUM_THREADS", "PYTHONHASHSEED"}
"""Variables of its workers, which a cluster of processes leaves in the tests' environment."""
ENVIRONMENT = dict(os.environ)
"""As it is before the first test, whatever tests change."""


def run_umbra(*words, **options):
    """
    Run the command; return a ``subprocess.CompletedProcess`` with its text.

    Parameters
    ----------
    words : object
        The words after ``umbra``.
    cwd : path, optional
    env : mapping, optional
        All variables. Of those that are read at start ``PYTHONPATH`` alone may be the test's.
    limits : mapping, optional
        Of the process, by their names in ``resource``.
    timeout : float, optional
        [s].
    check : bool, optional
        Whether a failure is an error, as of ``subprocess.run``.
    """
    return _run(start_umbra, words, **options)


def run_python(*words, **options):
    """Run a script (its path and arguments) or statements (``-c``), like `run_umbra`."""
    return _run(start_python, words, **options)


def start_umbra(*words, **options):
    """Start the command; return it as ``subprocess.Popen`` does, with its text in pipes."""
    return _start([str(SCRIPT), *map(str, words)], **options)


def start_python(*words, **options):
    """Start a script or statements, like `start_umbra`."""
    return _start([sys.executable, *map(str, words)], **options)


def _run(start, words, *, timeout=300, check=False, **options):
    with start(*words, **options) as run:
        try:
            said = run.communicate(timeout=timeout)
        finally:
            run.kill()
    done = subprocess.CompletedProcess(run.args, run.returncode, *said)
    if check:
        done.check_returncode()
    return done


def _start(command, *, cwd=None, env=None, limits=None):
    environment = dict(os.environ if env is None else env)
    folder, limits = str(Path(cwd or "").resolve()), limits or {}
    if hasattr(os, "fork") and not sweeps.is_thorough():
        return _Fork(command, folder, environment, limits)

    def limit():
        import resource  # noqa: PLC0415 - not on Windows

        for name, value in limits.items():
            resource.setrlimit(getattr(resource, name), (value, value))

    return subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, preexec_fn=limit if limits else None,  # noqa: PLW1509 - a limit needs no lock
    )  # fmt: skip


class _Fork:
    """A process that a server forks, with what tests need of ``subprocess.Popen``."""

    def __init__(self, command, folder, environment, limits):
        given = {
            "command": command, "folder": folder, "environment": environment,
            "path": _find_path(environment), "limits": limits,
        }  # fmt: skip
        (out, its_out), (err, its_err) = os.pipe(), os.pipe()
        self._answers, request = socket.socketpair()
        with request, open(os.devnull, "rb") as nothing:  # noqa: PTH123
            channel, _ = _start_server("umbra" if command[0] == str(SCRIPT) else "python")
            socket.send_fds(channel, [b"?"], [request.fileno()])
            socket.send_fds(self._answers, [b" "], [nothing.fileno(), its_out, its_err])
        self._answers.sendall(json.dumps(given).encode())
        self._answers.shutdown(socket.SHUT_WR)
        for end in (its_out, its_err):
            os.close(end)
        self.stdout, self.stderr = (open(end, encoding="utf-8") for end in (out, err))  # noqa: PTH123, SIM115
        self.args, self.returncode = command, None
        self._said = self._answers.makefile()
        self.pid = int(self._said.readline())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.wait()
        for opened in (self.stdout, self.stderr, self._said, self._answers):
            opened.close()

    def poll(self):
        """Return the exit status, None as long as it runs."""
        if self.returncode is None and select.select([self._answers], [], [], 0)[0]:
            self.returncode = int(self._said.readline())
        return self.returncode

    def wait(self, timeout=None):
        """Wait until it has ended; return its exit status."""
        if self.returncode is None and not select.select([self._answers], [], [], timeout)[0]:
            raise subprocess.TimeoutExpired(self.args, timeout)
        return self.poll()

    def communicate(self, timeout=None):
        """Wait until it has ended and nobody holds its streams; return what it said."""
        with ThreadPoolExecutor(2) as threads:
            said = [threads.submit(stream.read) for stream in (self.stdout, self.stderr)]
            try:
                texts = [text.result(timeout) for text in said]
            except TimeoutError:
                self.kill()
                raise subprocess.TimeoutExpired(self.args, timeout) from None
        self.wait(timeout)
        return texts

    def send_signal(self, number):
        """Send a signal, unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self):
        """End it at once, unless it has ended."""
        self.send_signal(signal.SIGKILL)


def _find_path(environment):
    """Return what an environment adds to the path of modules; check that a fork can have it."""
    changed = {
        name
        for name in environment.keys() | ENVIRONMENT.keys()
        if environment.get(name) != ENVIRONMENT.get(name) and name.startswith(READ_AT_START)
    }
    changed -= LEFT_BY_DASK
    if changed - {"PYTHONPATH"}:
        msg = f"{', '.join(sorted(changed))} is read when modules load: start it cold"
        raise ValueError(msg)
    return environment["PYTHONPATH"].split(os.pathsep) if changed else []


@cache
def _start_server(kind):
    """Start a server of this worker, which ends when its channel closes, with the worker."""
    channel, end = socket.socketpair()
    with end:
        server = subprocess.Popen(
            [sys.executable, "-P", str(SERVER), kind, str(end.fileno())],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, env=ENVIRONMENT,
            pass_fds=[end.fileno()],
        )  # fmt: skip
    return channel, server
