"""A run says at its end what tests skipped for want of, and fails where none may."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.skips import WANTS, find_unexpected, find_want, tell

ROOT = Path(__file__).parents[2]
REASONS = {
    "there is no OpenGL here: no OpenGL 3.3 opens here (egl: x)": "opengl",
    "no WebGPU: WebGPU finds no graphics adapter": "webgpu",
    "there is no Chromium on this machine": "browser",
    "there is no axe-core on this machine": "axe",
    "there is no TypeScript on this machine": "typescript",
    "Xvfb and xdotool is missing: no window can be tried": "window",
    "the real model delft.city.json is not in ../shared/data": "models",
    "could not import 'rasterio': No module named 'rasterio'": "packages",
    "ifcopenshell is not installed": "packages",
    "Ladybug is not installed (pip install ladybug-radiance)": "peers",
    "Windows sends no SIGINT to one process": "elsewhere",
    "a whim": "other",
}


def test_reasons_are_sorted_by_what_is_lacking():
    assert {reason: find_want(reason) for reason in REASONS} == REASONS
    assert {*REASONS.values()} == {*WANTS, "elsewhere", "other"}


def test_each_thing_that_is_lacking_has_a_line_with_its_remedy():
    browser, model = (next(why for why in REASONS if what in why) for what in ("Chromium", "model"))
    lines = tell([browser, browser, model, "a whim"])
    assert lines[0].split(":")[0] == "    2 for want of a browser"
    assert "apt install chromium" in lines[0]
    assert lines[1].startswith("    1 for want of real models")
    assert lines[2] == "    1 a whim"


def test_what_a_machine_is_known_to_lack_may_skip():
    lacking = ["opengl", "webgpu", "browser", "axe", "typescript", "window", "models", "packages"]
    assert find_unexpected(REASONS, lacking) == ["a whim"]
    assert len(find_unexpected(REASONS, [""])) == 10


TESTS = """
import pytest
pytest_plugins = []
def test_runs(): pass
def test_skips(): pytest.skip("there is no Chromium on this machine")
"""


@pytest.mark.parametrize(
    ("options", "status"),
    [([], 0), (["--lacking=browser"], 0), (["--lacking="], 1), (["--lacking=opengl,models"], 1)],
)
def test_a_run_fails_for_skips_only_where_it_is_asked_to(tmp_path, options, status):
    (tmp_path / "test_it.py").write_text(TESTS)
    (tmp_path / "conftest.py").write_text((ROOT / "tests" / "conftest.py").read_text())
    (tmp_path / "pytest.ini").write_text(f"[pytest]\npythonpath = {ROOT / 'tests'}\n")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *options],
        cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
    )  # fmt: skip
    assert done.returncode == status, done.stdout + done.stderr
    *_, told, last = done.stdout.strip().splitlines()
    said = "    1 for want of a browser: apt install chromium"
    assert said in done.stdout.splitlines()
    assert ("FAILED: no test may skip here" in told) == bool(status)
    assert "1 passed, 1 skipped" in last
