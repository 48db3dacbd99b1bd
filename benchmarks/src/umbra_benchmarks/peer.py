"""Peers in child processes of their own interpreters: those that draw frames, and all others."""

import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Self

from umbra.errors import InputError, UmbraError
from umbra_benchmarks.measure import Spent
from umbra_benchmarks.report import BenchmarkRun
from umbra_benchmarks.scenes import Spheres

__all__ = ["PEERS", "Child", "Peer", "PeerKind", "find_peers", "find_python"]

_PATIENCE = 120.0
"""Seconds until a child that does not answer is given up."""
_SCRIPTS = Path(__file__).parent / "peers"
_FOREIGN = ("PYTHONHOME", "PYTHONPATH")  # would lead another Python to this one's packages


@dataclass(frozen=True)
class PeerKind:
    """
    A program that can be measured against.

    Parameters
    ----------
    name : str
    title : str
        For people.
    module : str
        What its package is imported as.
    install : str
        How to get it.
    mark : float or None
        How many times longer than umbra it should take.
    script : Path
        Its side of the pipe.
    """

    name: str
    title: str
    module: str
    install: str
    mark: float | None
    script: Path


PEERS = {
    kind.name: kind
    for kind in (
        PeerKind(
            "ogre", "OGRE", "Ogre", "pip install 'ogre-python==14.6.*' into a Python 3.12",
            2.0, _SCRIPTS / "ogre.py",
        ),
        PeerKind(
            "workbench", "Blender's Workbench", "bpy", "pip install bpy==5.0.1 into a Python 3.11",
            5.0, _SCRIPTS / "workbench.py",
        ),
    )
}  # fmt: skip
"""The peers by name."""


def find_peers(
    kinds: Mapping[str, PeerKind], run: BenchmarkRun
) -> tuple[dict[PeerKind, Path], list[PeerKind]]:
    """
    Find the interpreters of the peers to measure, and the peers that are not installed.

    Raises
    ------
    InputError
        If a peer that was asked for by name has no interpreter.
    """
    missing = [
        kind
        for name, kind in kinds.items()
        if run.peers is None and name not in run.pythons and not _is_installed(kind)
    ]
    asked = [kind for name, kind in kinds.items() if run.peers is None or name in run.peers]
    return {kind: find_python(kind, run.pythons) for kind in asked if kind not in missing}, missing


def _is_installed(kind: PeerKind) -> bool:
    return find_spec(kind.module) is not None


def find_python(kind: PeerKind, pythons: Mapping[str, Path]) -> Path:
    """
    Find the interpreter of a peer: the one that was named, or this one if it has the package.

    Raises
    ------
    InputError
        If there is none.
    """
    named = pythons.get(kind.name)
    if named is not None:
        if not os.access(named, os.X_OK) or named.is_dir():
            msg = f"--peer-python {kind.name}={named}: there is no interpreter at that path"
            raise InputError(msg, path=named)
        return named
    if _is_installed(kind):
        return Path(sys.executable)
    msg = (
        f"this benchmark compares with {kind.title}, which is not installed; {kind.install} and "
        f"name it with --peer-python {kind.name}=PATH, or choose --peer"
    )
    raise InputError(msg, peer=kind.name)


class Child:
    """
    A peer's process, alive and waiting until it is asked for something.

    Parameters
    ----------
    kind : PeerKind
    python : Path
        The interpreter to run it in.
    patience : float, optional
        Seconds until it is given up if it does not answer.

    Raises
    ------
    UmbraError
        If it fails; its own words are in the message.
    """

    def __init__(self, kind: PeerKind, python: Path, patience: float | None = None) -> None:
        self.kind = kind
        self._patience = _PATIENCE if patience is None else patience
        # What it says is read only if it fails.
        self._said = tempfile.TemporaryFile("w+", errors="replace")  # noqa: SIM115
        environment = {key: value for key, value in os.environ.items() if key not in _FOREIGN}
        self._child = subprocess.Popen(
            [str(python), str(kind.script)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said,
            text=True, encoding="utf-8", env=environment,
        )  # fmt: skip

    def open(self, **request: object) -> dict[str, Any]:
        """Return it its scene; a child that cannot take it is ended."""
        try:
            return self.ask(do="open", **request)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the process."""
        for pipe in (self._child.stdin, self._child.stdout):
            try:
                if pipe is not None:
                    pipe.close()
            except BrokenPipeError:
                pass
        self._end()
        self._said.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def ask(self, **request: object) -> dict[str, Any]:
        """Send a request and wait for its answer."""
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        patience = threading.Timer(self._patience, self._child.kill)
        patience.start()
        try:
            self._child.stdin.write(json.dumps(request) + "\n")
            self._child.stdin.flush()
            line = self._child.stdout.readline()
        except BrokenPipeError:
            line = ""
        finally:
            patience.cancel()
        if not line:
            msg = f"{self.kind.title} ended while it was measured: {self._last_words()}"
            if f"No module named '{self.kind.module}'" in msg:
                msg += f"; {self.kind.install}"
            raise UmbraError(msg, peer=self.kind.name)
        try:
            answer: dict[str, Any] = json.loads(line)
        except ValueError:
            msg = f"{self.kind.title} answers '{line.strip()[:80]}', which is no JSON"
            raise UmbraError(msg, peer=self.kind.name) from None
        if "error" in answer:
            msg = f"{self.kind.title} failed: {answer['error']}"
            raise UmbraError(msg, peer=self.kind.name)
        return answer

    def _end(self) -> None:
        """Wait until the process has ended, and not for long."""
        try:
            self._child.wait(5)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()

    def _last_words(self) -> str:
        self._end()
        self._said.seek(0)
        lines = self._said.read().strip().splitlines()
        return lines[-1] if lines else f"exit status {self._child.returncode}"


class Peer(Child):
    """
    A renderer's process.

    Parameters
    ----------
    kind : PeerKind
    python : Path
        The interpreter to run it in.
    scene : Spheres
    size : int
        Pixels a side.

    Attributes
    ----------
    name, driver : str
        Product and version; what draws for it.

    Raises
    ------
    UmbraError
        If it does not start; its own words are in the message.
    """

    def __init__(self, kind: PeerKind, python: Path, scene: Spheres, size: int) -> None:
        super().__init__(kind, python)
        answer = self.open(scene=scene.to_dict(), size=size)
        self.name, self.driver = str(answer["name"]), str(answer["driver"])

    def render(self, lights: Sequence[Sequence[float]]) -> Spent:
        """
        Draw a frame for each place of the lamp.

        Returns
        -------
        spent : Spent
            On one frame, the mean; the child's own clocks, without the pipe.
        """
        places = [list(map(float, place)) for place in lights]
        answer = self.ask(do="render", lights=places)
        return Spent(float(answer["seconds"]), float(answer["processor_seconds"]))

    def save(self, light: Sequence[float], path: Path) -> None:
        """Draw a frame into a PNG file."""
        self.ask(do="save", light=list(map(float, light)), path=str(path.resolve()))
