"""A real Chromium without a window, driven through its debugging pipe: no package needed."""

import base64
import contextlib
import fcntl
import importlib.util
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from collections import defaultdict
from hashlib import sha256
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",  # WebGL2 on the processor
    "--enable-unsafe-swiftshader",
    # What is not WebGL is drawn without it: a third of the processor time of a page that is read.
    "--disable-gpu-compositing",
    "--disable-gpu-rasterization",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
    "--force-prefers-reduced-motion",  # a page that glides is elsewhere when it is pointed at
    "--remote-debugging-pipe",
)
READ_BACK = "GPU stall due to ReadPixels"
"""Some drivers warn of what only tests do: read counts back."""
PATIENCE = 60  # [s]; a machine under load starts it slowly


AXE_SHA256 = "697ea6c7edff0fe289b7bbecf1ff7b9015249bc834b409a348cd060df80aeba0"
"""Of axe.min.js 4.4.3 by Deque Systems."""


def find_chromium():
    """Give the path of a Chromium, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def read_axe():
    """
    Give the script of axe-core: that of ``AXE``, or of the package that holds it.

    The package, by one author, is only the way to Deque's file, which is known by its SHA-256.
    """
    package = importlib.util.find_spec("axe_core_python")
    own = Path(package.origin).with_name("axe.min.js") if package else "axe.min.js"
    path = Path(os.environ.get("AXE", own))
    if not path.is_file():
        pytest.skip("there is no axe-core on this machine")
    script = path.read_bytes()
    assert "AXE" in os.environ or sha256(script).hexdigest() == AXE_SHA256
    return script.decode("utf-8")


class Page:
    """
    One page: opened, sized, clicked, asked; as a context it is closed, and its WebGL freed.

    Attributes
    ----------
    events : list
        What the browser has told of it so far.
    """

    def __init__(self, browser, width=1280, height=800):
        self.browser = browser
        self.target = browser.send("Target.createTarget", url="about:blank")["targetId"]
        attached = browser.send("Target.attachToTarget", targetId=self.target, flatten=True)
        self.session = attached["sessionId"]
        self.events = browser.events[self.session]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.send(f"{domain}.enable")
        self.resize(width, height)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.browser.send("Target.closeTarget", targetId=self.target)
        del self.browser.events[self.session]

    def check(self, *levels):
        """Raise if it reported an error, or on further levels, or asked for more than itself."""
        said = [event["exceptionDetails"] for event in self.named("Runtime.exceptionThrown")]
        entries = [event["entry"] for event in self.named("Log.entryAdded")]
        entries = [entry for entry in entries if READ_BACK not in entry["text"]]
        said += [entry for entry in entries if entry["level"] in {"error", *levels}]
        urls = [event["request"]["url"] for event in self.named("Network.requestWillBeSent")]
        asked = {url.partition(":")[0] for url in urls}
        if said or not asked <= {"file", "data", "blob", "about"}:
            msg = f"the page asked for {sorted(asked)} and said {said}"
            raise AssertionError(msg)

    def send(self, method, **params):
        return self.browser.send(method, self.session, **params)

    def resize(self, width, height, is_phone=False, dot=1):
        self.send(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=dot, mobile=is_phone,
        )  # fmt: skip

    def open(self, path, ready="true"):
        self.send("Page.navigate", url=Path(path).as_uri())
        self.wait(f"location.protocol == 'file:' && document.readyState == 'complete' && ({ready})")

    def ask(self, expression):
        found = self.send(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in found:
            raise RuntimeError(json.dumps(found["exceptionDetails"])[:2000])
        return found["result"].get("value")

    def wait(self, expression):
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            if self.ask(expression):
                return
            time.sleep(0.05)
        msg = f"not in {PATIENCE} s: {expression}"
        raise TimeoutError(msg)

    def mouse(self, kind, x, y, **more):
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, x, y):
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, x, y, button="left", clickCount=1)

    def press(self, key, code=None, text=None, modifiers=0):
        codes = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, " ": 32,
                 "Enter": 13, "Home": 36, "End": 35,
                 "PageUp": 33, "PageDown": 34, "Escape": 27}  # fmt: skip
        more = {"text": text} if text else {}
        for kind in ("keyDown", "keyUp"):
            self.send(
                "Input.dispatchKeyEvent", type=kind, key=key, code=code or key,
                windowsVirtualKeyCode=codes.get(key, 0), modifiers=modifiers,
                **(more if kind == "keyDown" else {}),
            )  # fmt: skip

    def audit(self):
        """Give what axe-core finds that people with a disability cannot use."""
        self.ask(read_axe() + ";0")
        return self.ask(
            "axe.run().then((found) => found.violations.map((one) => "
            "[one.id, one.nodes.map((node) => node.html.slice(0, 200))]))"
        )

    def shoot(self, path, whole=False):
        shot = self.send("Page.captureScreenshot", captureBeyondViewport=whole)
        Path(path).write_bytes(base64.b64decode(shot["data"]))

    def named(self, *methods):
        """Give the events of these kinds so far."""
        return [e["params"] for e in self.events if e["method"] in methods]


class Chromium:
    """A browser of its own, with a fresh profile; use it as a context."""

    def __enter__(self):
        self.profile = tempfile.mkdtemp(prefix="umbra-chromium-")
        to_child, self.out = self._pipe()
        self.inward, from_child = self._pipe()

        def place():
            os.dup2(to_child, 3)
            os.dup2(from_child, 4)

        self.process = subprocess.Popen(
            [find_chromium(), *FLAGS, f"--user-data-dir={self.profile}"],
            pass_fds=(3, 4), preexec_fn=place,  # noqa: PLW1509
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(to_child)
        os.close(from_child)
        self.number, self.rest, self.events = 0, b"", defaultdict(list)
        return self

    @staticmethod
    def _pipe():
        # Well above 3 and 4, which the child's ends become.
        ends = os.pipe()
        moved = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 20) for end in ends]
        for end in ends:
            os.close(end)
        return moved

    def send(self, method, session=None, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self.number:
                if "error" in answer:
                    msg = f"{method}: {answer['error']}"
                    raise RuntimeError(msg)
                return answer["result"]
            if "method" in answer:
                self.events[answer.get("sessionId")].append(answer)

    def _read(self):
        until = time.monotonic() + PATIENCE
        while b"\0" not in self.rest:
            readable, *_ = select.select([self.inward], [], [], max(0, until - time.monotonic()))
            if not readable:
                msg = "the browser does not answer"
                raise TimeoutError(msg)
            some = os.read(self.inward, 1 << 20)
            if not some:
                msg = "the browser ended"
                raise EOFError(msg)
            self.rest += some
        first, _, self.rest = self.rest.partition(b"\0")
        return json.loads(first)

    def __exit__(self, *_):
        with contextlib.suppress(Exception):
            self.send("Browser.close")
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.out)
        os.close(self.inward)
        shutil.rmtree(self.profile, ignore_errors=True)
