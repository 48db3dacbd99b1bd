"""The live model in a real JupyterLab, its values shared with Python."""

import base64
import json
import os
import secrets
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from support.chromium import Page
from support.shapes import box

import umbra
from umbra.calls.live import make_widget
from umbra.calls.picture_options import ViewOptions

pytest.importorskip("anywidget")
pytest.importorskip("jupyterlab")
widgets = pytest.importorskip("jupyterlab_widgets")

CELLS = [
    (
        "import umbra\n"
        "points = [(x, y, z) for z in (0, 30) for x, y in ((0, 0), (10, 0), (10, 10), (0, 10))]\n"
        "faces = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), (0, 1, 5), (0, 5, 4), (1, 2, 6),\n"
        "         (1, 6, 5), (2, 3, 7), (2, 7, 6), (3, 0, 4), (3, 4, 7)]\n"
        "scene = umbra.make_scene(points, faces, name='tower', ground=0.0)\n"
        "site = umbra.Site(48.2, 16.37, 'Europe/Vienna')\n"
        "view = umbra.show(scene, site, date='2026-06-21', at='15:00', size=(800, 480))\n"
        "view"
    ),
    "view.time, view.date = '09:30', '2026-12-21'",
    "print('read', view.time, view.date, round(view.altitude, 1), view.place['object'])",
]


def make_notebook(path):
    cells = [
        {"cell_type": "code", "id": f"cell{k}", "metadata": {}, "execution_count": None,
         "outputs": [], "source": source}
        for k, source in enumerate(CELLS)
    ]  # fmt: skip
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    book = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    path.write_text(json.dumps(book))


def find_address(folder):
    """Wait for the address of the server, which takes a free port and writes it down."""
    until = time.monotonic() + 120
    while time.monotonic() < until:
        for file in Path(folder).glob("jpserver-*.json"):
            with suppress(json.JSONDecodeError):  # half written
                return json.loads(file.read_text())["url"]
        time.sleep(0.2)
    msg = "JupyterLab does not start"
    raise TimeoutError(msg)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """The address of a JupyterLab that serves one notebook."""
    # Kernels are compiled here, not while the browser waits.
    make_widget(umbra.make_scene(*box((0, 0, 0), (1, 1, 1))), None, ViewOptions())
    folder = tmp_path_factory.mktemp("lab")
    make_notebook(folder / "live.ipynb")
    token = secrets.token_hex(16)
    own = {name: str(folder / name) for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR",
                                                 "JUPYTER_DATA_DIR", "IPYTHONDIR")}  # fmt: skip
    # Packages may lie in another environment than this Python's own.
    shared = Path(widgets.__file__).parents[4] / "share" / "jupyter"
    own["JUPYTER_PATH"] = str(shared)
    command = [
        sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--port=0",
        f"--IdentityProvider.token={token}", f"--notebook-dir={folder}", "--ip=127.0.0.1",
        "--LabApp.news_url=", "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate",
    ]  # fmt: skip
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    server = subprocess.Popen(command, env={**os.environ, **own}, **quiet)
    try:
        yield f"{find_address(own['JUPYTER_RUNTIME_DIR'])}lab/tree/live.ipynb?token={token}"
    finally:
        server.terminate()
        server.wait(30)


def is_sent(page, words):
    """Whether the page has sent words to Python."""
    sent = page.named("Network.webSocketFrameSent")
    texts = [event["response"]["payloadData"].encode() for event in sent]
    return any(words in text or words in decode(text) for text in texts)


def decode(text):
    try:
        return base64.b64decode(text)
    except ValueError:
        return b""


def test_sliders_and_python_share_their_values(lab, browser):
    with Page(browser, 1400, 1000) as page:
        page.send("Page.navigate", url=lab)
        idle = "document.querySelector('.jp-Notebook-ExecutionIndicator[data-status=idle]')"
        page.wait(f"document.querySelectorAll('.jp-CodeCell').length == 3 && !!{idle}")

        def run(cell):
            # A key that comes while JupyterLab still arranges itself is lost: press it again.
            prompt = f"document.querySelectorAll('.jp-CodeCell .jp-InputPrompt')[{cell}]"
            until = time.monotonic() + 60
            while page.ask(f"{prompt}.textContent") == "[ ]:" and time.monotonic() < until:
                page.ask(f"document.querySelectorAll('.jp-CodeCell .cm-content')[{cell}].focus()")
                page.press("Enter", text="\r", modifiers=8)
                time.sleep(1)

        run(0)
        page.wait("!!document.querySelector('.umbra[data-ready=yes] .told strong')")
        told = "document.querySelector('.umbra .told').textContent"
        assert page.ask(told).startswith("21 June 2026, 15:00 CEST")
        run(1)
        page.wait(f"{told}.startsWith('21 December 2026, 09:30 CET')")
        # A slider is moved and the tower is clicked in the page; Python reads both.
        page.ask("window.slider = document.querySelector('.umbra .daytrack input'); "
                 "slider.value = 750; slider.dispatchEvent(new Event('input'));")  # fmt: skip
        page.wait(f"{told}.startsWith('21 December 2026, 12:30 CET')")
        box = page.ask(
            "(({left, top, width, height}) => [left + width / 2, top + height / 2])("
            "document.querySelector('.umbra canvas.model').getBoundingClientRect())"
        )
        assert not is_sent(page, b'"tower"')
        page.click(*box)
        page.wait("document.querySelector('.umbra .where strong')?.textContent == 'tower'")
        # Values travel an eighth of a second later; what is run after them finds them in Python.
        until = time.monotonic() + 60
        while not is_sent(page, b'"tower"') and time.monotonic() < until:
            page.ask("new Promise((done) => setTimeout(done, 50))")
        run(2)
        output = (
            "document.querySelectorAll('.jp-CodeCell')[2].querySelector('.jp-OutputArea-output')"
        )
        page.wait(f"{output}?.textContent.startsWith('read')")
        site = umbra.Site(48.2, 16.37, "Europe/Vienna")
        sun = umbra.find_sun(site, [np.datetime64("2026-12-21T11:30")])
        wanted = f"read 12:30 2026-12-21 {sun.altitude[0]:.1f} tower"
        assert page.ask(f"{output}.textContent").strip() == wanted
