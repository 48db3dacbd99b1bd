"""Frames of the page's renderer and of three.js with a shadow map, in one browser."""

import base64
import json
import shutil
import subprocess
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from umbra.cache import find_folder
from umbra.errors import UmbraError
from umbra.scene import make_scene
from umbra.web.bundle import bundle
from umbra.web.pack import pack_model
from umbra_benchmarks.browser import Browser
from umbra_benchmarks.report import BenchmarkReport, BenchmarkRun, describe_machine, lay_out_table
from umbra_benchmarks.scenes import make_town

__all__ = ["Web", "bench_web"]

THREE = "0.170.0"
_FOLDER = Path(__file__).parent / "pages"
_LISTEN = (
    "addEventListener('unhandledrejection', "
    "(event) => { globalThis.failed = String(event.reason); });"
)
"""A module's own errors are rejections that nobody awaits."""
_FRAMES = 3  # of a turn
_SCRIPTS = 30  # frames of a turn of which JavaScript alone runs
_SIDES = {
    "ours": ("4 samples a pixel", 4, 1.0),
    "ours_moving": ("1 sample a pixel, while things move", 1, 1.0),
    "ours_coarser": ("and 3/4 of the columns and rows, if that is slow", 1, 0.75),
    "three": ("three.js, 4 samples, shadow map of 2048²", 4, 1.0),
}
"""Of each side: what it draws, samples a pixel, and pixels along an edge; as ``pace.js`` has it."""


@dataclass(frozen=True)
class Frames:
    """
    One side's frames while the sun moves.

    Parameters
    ----------
    wall : float
        By the clock until the picture is read back [ms].
    busy, script : float, optional
        Processor time of all the browser's processes together, and of the page's own thread, which
        runs JavaScript, in frames of which nothing is drawn; the least of all turns [ms].
    """

    wall: float
    busy: float | None
    script: float | None

    @property
    def rate(self) -> float:
        """Frames a second by the clock."""
        return 1000 / self.wall


@dataclass(frozen=True)
class Web(BenchmarkReport):
    """
    Frames of a town, of umbra's renderer and of three.js.

    Parameters
    ----------
    sides : dict of Frames
        By their names in ``_SIDES``; ``three`` where it was measured.
    triangles : int
    size : (int, int)
        Of the picture [pixels].
    """

    sides: dict[str, Frames]
    triangles: int
    size: tuple[int, int]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object; times in ms."""
        return self.head("web", three=THREE) | {
            "triangles": self.triangles,
            "size": self.size,
            "frames": {name: vars(side) for name, side in self.sides.items()},
            "marks": {"frames_a_second": 5, "times_three": 1.5, "script_ms": 2},
        }

    def to_table(self) -> str:
        """Return it in words."""
        three = self.sides.get("three")
        lines = []
        for name, side in self.sides.items():
            busy = "" if side.busy is None else f"{side.busy:,.0f} ms"
            script = "" if side.script is None else f"{side.script:.1f} ms"
            share = ""
            if three is not None and three.busy and side.busy:
                share = f"{side.busy / three.busy:.2f}"
            lines.append([_SIDES[name][0], f"{side.wall:,.0f} ms", busy, share, f"{side.rate:.1f}",
                          script])  # fmt: skip
        head = ["frame", "clock", "processors", "times three.js", "frames a second", "JavaScript"]
        return (
            f"umbra bench web: {describe_machine()}. A town of {self.triangles:,} triangles at "
            f"{self.size[0]} x {self.size[1]} in Chromium with SwiftShader, the sun moving; "
            f"three.js {THREE}. Marks: 5 frames a second, 1.5 times three.js, 2 ms of JavaScript."
            f"{self.small}\n\n" + lay_out_table(head, lines)
        )


def bench_web(run: BenchmarkRun) -> Web:
    """
    Draw a town in turn by umbra's renderer and by three.js, in two pages of one browser.

    Raises
    ------
    UmbraError
        If there is no Chromium, or npm is needed and missing.
    """
    boxes, size = (40, (320, 200)) if run.quick else (8333, (1920, 1080))
    town = make_town(boxes, 22.0 * np.sqrt(boxes), 3)
    scene = make_scene(town.vertices, town.faces, ground=0.0)
    three = None if run.peers is not None and "three" not in run.peers else _find_three(run)
    origin = np.array([town.side / 2, town.side / 2, 0.0])
    data = {
        "block": base64.b64encode(pack_model(scene)).decode(),
        "origin": origin.tolist(),
        "eye": (town.side * np.array([-0.5, -0.85, 0.4])).tolist(),
        "side": town.side,
        "size": size,
        "vertices": (town.vertices - origin).round(4).ravel().tolist() if three else [],
        "faces": town.faces.ravel().tolist() if three else [],
    }
    found: dict[str, list[tuple[float, float | None, float | None]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        pages = {"ours": _write_page(Path(folder), "ours", bundle("kit"), data)}
        if three is not None:
            pages["three"] = _write_page(Path(folder), "three", three, data)
        with Browser() as ours, Browser() as theirs:
            ours.open(pages["ours"], *size)
            turns = {name: ours for name in _SIDES if name != "three"}
            if three is not None:
                theirs.open(pages["three"], *size)
                turns["three"] = theirs
            for _ in range(run.repeat + 1):
                for name, browser in turns.items():
                    _, samples, scale = _SIDES[name]
                    browser.ask(f"frames(1, {samples}, {scale})")  # makes targets of this size
                    begun = browser.find_busy()
                    wall = browser.ask(f"frames({_FRAMES}, {samples}, {scale})")
                    busy = _spread(begun, browser.find_busy(), _FRAMES)
                    begun = browser.find_script()
                    browser.ask(f"script({_SCRIPTS}, {samples}, {scale})")
                    script = _spread(begun, browser.find_script(), _SCRIPTS)
                    found.setdefault(name, []).append((wall, busy, script))
    sides = {name: _sum_up(rows[1:]) for name, rows in found.items()}  # the first compiles
    return Web(run, sides, len(town.faces), size)


def _spread(begun: float | None, ended: float | None, frames: int) -> float | None:
    """Return the time of one frame [ms] of times before and after some [s]."""
    return None if begun is None or ended is None else 1000 * (ended - begun) / frames


def _sum_up(rows: list[tuple[float, float | None, float | None]]) -> Frames:
    walls, *others = zip(*rows, strict=True)
    busy, script = (min((v for v in one if v is not None), default=None) for one in others)
    return Frames(float(np.median(walls)), busy, script)


def _write_page(folder: Path, name: str, library: str, data: dict[str, Any]) -> Path:
    """Write a page that holds a library, the data and the script of its side."""
    measure, script = ((_FOLDER / f"{one}.js").read_text("utf-8") for one in ("frames", name))
    packed = base64.b64encode(library.encode()).decode()
    path = folder / f"{name}.html"
    path.write_text(
        "<!doctype html><meta charset=utf-8><body style='margin:0'><canvas id=c></canvas>\n"
        f"<script type=text/plain id=library>{packed}</script>\n"
        f"<script type=application/json id=data>{json.dumps(data)}</script>\n"
        f"<script type=module>\n{_LISTEN}{measure}{script}</script>",
        "utf-8",
    )
    return path


def _find_three(run: BenchmarkRun) -> str:
    """Return three.js as one module, from the cache or, once, from npm."""
    path = find_folder() / f"three-{THREE}.module.min.js"
    if not path.is_file():
        npm = shutil.which("npm")
        if npm is None:
            msg = (
                f"npm is missing, which fetches three.js {THREE} to compare with: install Node.js, "
                "or measure umbra alone with --peer none"
            )
            raise UmbraError(msg)
        run.say(f"npm pack three@{THREE}, once, into {path.parent}")
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [npm, "pack", f"three@{THREE}", "--pack-destination", folder, "--silent"],
                capture_output=True, text=True, check=False, cwd=folder,
            )  # fmt: skip
            packed = next(Path(folder).glob("*.tgz"), None)
            if done.returncode or packed is None:
                msg = f"npm cannot fetch three@{THREE}: {done.stderr.strip()[:300]}"
                raise UmbraError(msg)
            with tarfile.open(packed) as archive:
                member = archive.extractfile("package/build/three.module.min.js")
                if member is None:
                    msg = f"three@{THREE} holds no build/three.module.min.js"
                    raise UmbraError(msg)
                unfinished = path.with_suffix(".unfinished")
                unfinished.write_bytes(member.read())
        unfinished.replace(path)
    return path.read_text("utf-8")
