"""A Chromium without a window, asked through its debugging pipe: no server and no package."""

import contextlib
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Self

from umbra.errors import UmbraError

__all__ = ["Browser"]

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FLAGS = (
    "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--no-first-run", "--disable-background-networking", "--disable-dev-shm-usage",
    "--force-color-profile=srgb", "--remote-debugging-pipe",
)  # fmt: skip
_PATIENCE = 120  # of one answer: SwiftShader draws large pictures slowly [s]


class Browser:
    """
    One page in a browser with a fresh profile, WebGL2 in software; use it as a context.

    Raises
    ------
    UmbraError
        If there is no Chromium, or no pipe to it.
    """

    def __init__(self) -> None:
        found = next(filter(None, map(shutil.which, _NAMES)), None)
        if found is None or sys.platform == "win32":
            msg = "the benchmark of the web needs Chromium and its pipe: apt install chromium"
            raise UmbraError(msg)
        self._command = [found, *_FLAGS]
        self._number, self._rest = 0, b""

    def __enter__(self) -> Self:
        import fcntl  # noqa: PLC0415 - not on Windows

        self._profile = tempfile.mkdtemp(prefix="umbra-bench-")
        # Well above 3 and 4, which the child's ends become.
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 20) for end in (*os.pipe(), *os.pipe())]
        to_child, self._out, self._in, from_child = ends

        def place() -> None:
            os.dup2(to_child, 3)
            os.dup2(from_child, 4)

        self._process = subprocess.Popen(
            [*self._command, f"--user-data-dir={self._profile}"],
            pass_fds=(3, 4), preexec_fn=place,  # noqa: PLW1509
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(to_child)
        os.close(from_child)
        target = self._send("Target.createTarget", url="about:blank")["targetId"]
        attached = self._send("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(UmbraError, OSError):
            self._send("Browser.close")
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._out)
        os.close(self._in)
        shutil.rmtree(self._profile, ignore_errors=True)

    def open(self, path: Path, width: int, height: int) -> None:
        """Open a page in a window of a size, and wait until it is ``ready`` or has ``failed``."""
        self._send(
            "Emulation.setDeviceMetricsOverride", self._session,
            width=width, height=height, deviceScaleFactor=1, mobile=False,
        )  # fmt: skip
        self._send("Page.navigate", self._session, url=path.as_uri())
        until = time.monotonic() + _PATIENCE
        while not self.ask("globalThis.ready"):
            failed = self.ask("globalThis.failed")
            if failed or time.monotonic() > until:
                why = failed or f"not ready after {_PATIENCE} s"
                msg = f"the page {path.name} failed: {why}"
                raise UmbraError(msg)
            time.sleep(0.05)

    def ask(self, expression: str) -> Any:
        """Evaluate JavaScript, and wait for its promise."""
        found = self._send(
            "Runtime.evaluate", self._session,
            expression=expression, returnByValue=True, awaitPromise=True,
        )  # fmt: skip
        if "exceptionDetails" in found:
            msg = f"the page failed: {json.dumps(found['exceptionDetails'])[:500]}"
            raise UmbraError(msg)
        return found["result"].get("value")

    def find_busy(self) -> float | None:
        """Return how long the browser's processes kept processors busy [s]; None if unknown."""
        ticks = self._find_processes().values()
        return sum(ticks) / os.sysconf("SC_CLK_TCK") if ticks else None

    def find_script(self) -> float | None:
        """Return how long the pages' own threads kept processors busy [s]; None if unknown."""
        found = []
        for process in self._find_processes():
            with contextlib.suppress(OSError):
                folder = Path(f"/proc/{process}")
                if b"--type=renderer" in (folder / "cmdline").read_bytes():
                    busy = (folder / f"task/{process}/schedstat").read_text().split()[0]
                    found.append(int(busy) / 1e9)
        return sum(found) if found else None

    def _find_processes(self) -> dict[int, int]:
        """Return the processor time of each of the browser's processes, in ticks, by its id."""
        processes: dict[int, tuple[int, int]] = {}
        for stat in Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError):
                fields = stat.read_text().rpartition(")")[2].split()
                processes[int(stat.parent.name)] = int(fields[1]), int(fields[11]) + int(fields[12])
        mine = {self._process.pid} & processes.keys()
        while more := {p for p, (parent, _) in processes.items() if parent in mine} - mine:
            mine |= more
        return {process: processes[process][1] for process in mine}

    def _send(self, method: str, session: str | None = None, **params: Any) -> Any:
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") != self._number:
                continue  # an event
            if "error" in answer:
                msg = f"the browser refuses {method}: {answer['error']}"
                raise UmbraError(msg)
            return answer["result"]

    def _read(self) -> dict[str, Any]:
        until = time.monotonic() + _PATIENCE
        while b"\0" not in self._rest:
            readable, *_ = select.select([self._in], [], [], max(0, until - time.monotonic()))
            some = os.read(self._in, 1 << 20) if readable else b""
            if not some:
                msg = f"the browser {'ended' if readable else 'does not answer'}"
                raise UmbraError(msg)
            self._rest += some
        first, _, self._rest = self._rest.partition(b"\0")
        answer: dict[str, Any] = json.loads(first)
        return answer
