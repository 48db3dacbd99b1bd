"""A long run tells where it is, on a terminal or not, and no Ctrl-C is lost on the way."""

import contextlib
import signal
import time
from types import SimpleNamespace

import pytest

from umbra import machine
from umbra.cli import terminal as progress
from umbra.cli.terminal import show_progress
from umbra.errors import UmbraError


def test_a_long_run_without_a_terminal_tells_its_stages_in_lines(capsys, monkeypatch):
    monkeypatch.setattr(progress, "_EVERY", 0.05)
    with show_progress(quiet=False) as stages:
        stages.begin("reading town.ifc")
        time.sleep(0.08)
        stages.begin("preparing")
        stages.advance(1, 500)
        stages._begun = time.monotonic() - 10
        stages.advance(100, 500)
        time.sleep(0.05)
        stages.begin("drawing and writing")
        stages.advance(1, 10, "drawing", "pictures")
        stages._begun = time.monotonic() - 10
        time.sleep(0.06)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "umbra: reading town.ifc"
    assert "umbra: counting shadows: 100 of 500 suns, 0:40 left" in lines
    assert lines[-1] == "umbra: drawing: 1 of 10 pictures, 1:30 left"
    assert len(lines) <= 4
    time.sleep(0.1)
    assert capsys.readouterr().err == ""  # nothing after the end


def test_no_time_is_guessed_before_anything_is_done(capsys, monkeypatch):
    monkeypatch.setattr(progress, "_EVERY", 0.05)
    with show_progress(quiet=False) as stages:
        stages.advance(0, 1, "finding lines", "views")
        time.sleep(0.08)
        stages.advance(0, 40, "drawing", "pictures")
        time.sleep(0.05)
    assert capsys.readouterr().err.splitlines()[:2] == [
        "umbra: finding lines", "umbra: drawing: 0 of 40 pictures",
    ]  # fmt: skip


def test_a_first_run_tells_that_it_compiles_once(capsys, monkeypatch):
    monkeypatch.setattr(progress, "_EVERY", 0.05)
    with show_progress(quiet=False) as stages:
        stages.begin("preparing")
        for listener in machine._listeners:
            listener()
        # Not only when a line is due: a first run would be silent for 20 s.
        assert capsys.readouterr().err.splitlines()[0] == f"umbra: {machine.FIRST_RUN}"
        for listener in machine._listeners:
            listener()
        time.sleep(0.08)
        stages.begin("drawing and writing")
        time.sleep(0.05)
    lines = capsys.readouterr().err.splitlines()
    assert lines[:2] == ["umbra: preparing; compiling", "umbra: drawing and writing"]
    assert machine._listeners == []


def test_a_short_run_and_a_quiet_one_tell_nothing(capsys, monkeypatch):
    assert 10 <= progress._EVERY <= 30
    with show_progress(quiet=False) as stages:
        stages.begin("reading")
        stages.advance(1, 2)
    monkeypatch.setattr(progress, "_EVERY", 0.01)
    with show_progress(quiet=True) as stages:
        stages.begin("reading")
        time.sleep(0.05)
    assert capsys.readouterr().err == ""


def swallow(then):
    """Press Ctrl-C where the exception is lost; then go on."""
    with show_progress(quiet=True) as stages:
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        then(stages)


def fail(_):
    raise SystemError("returned a result with an exception set")  # noqa: EM101


@pytest.mark.parametrize(
    "then",
    [lambda s: s.advance(1, 2), lambda s: s.begin("drawing"), lambda _: None, fail],
    ids=["counting", "drawing", "end", "failing"],
)
def test_a_ctrl_c_that_was_swallowed_comes_back(then):
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        swallow(then)
    assert signal.getsignal(signal.SIGINT) is before


def run_out(stage, triangles=0):
    with show_progress(quiet=True) as stages:
        stages.begin("reading town.ifc")
        if triangles:
            stages.show_scene(SimpleNamespace(parts=[SimpleNamespace(triangles=triangles)] * 2))
            stages.begin(stage)
        raise MemoryError


def test_out_of_memory_names_what_took_it():
    with pytest.raises(
        UmbraError, match=r"while reading town\.ifc: this .* GB; cut the model"
    ) as e:
        run_out("reading")
    assert "cells" not in str(e.value)
    words = (
        r"while preparing, with 6,000,000 triangles: .* GB; cut the model .*, or choose fewer cells"
    )
    with pytest.raises(UmbraError, match=words):
        run_out("preparing", 3_000_000)


def test_a_callers_own_ctrl_c_is_left_to_him():
    heard = []
    before = signal.signal(signal.SIGINT, lambda *_: heard.append(1))
    try:
        swallow(lambda stages: stages.advance(1, 2))
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [1]
