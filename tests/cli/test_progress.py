"""A long run tells where it is, on a terminal or not, and no Ctrl-C is lost on the way."""

import contextlib
import signal
import threading
from types import SimpleNamespace

import pytest

from umbra import machine
from umbra.cli import terminal as progress
from umbra.cli.terminal import show_progress
from umbra.errors import UmbraError

EVERY = progress._EVERY
"""Between two lines of a run that nobody watches [s], before the tests set it."""


class Clock:
    """Time that passes by hand: no line depends on how busy the machine is."""

    def __init__(self):
        self.now, self.is_over, self.threads = 100.0, False, []
        self.due, self.waits = threading.Semaphore(0), threading.Semaphore(0)

    def monotonic(self):
        return self.now

    def start(self, target, daemon):
        """Make a thread, as ``threading.Thread`` does."""
        self.threads.append(threading.Thread(target=target, daemon=daemon))
        return self.threads[-1]

    def wait(self, seconds):
        """Wait for the next line or the end, as an event that the end sets."""
        assert seconds == EVERY
        self.waits.release()
        assert self.due.acquire(timeout=60)
        return self.is_over

    def set(self):
        self.is_over = True
        self.due.release()

    def pass_by(self, seconds):
        """Let time pass, and the line that is due then be told."""
        self.now += seconds
        assert self.waits.acquire(timeout=60)
        self.due.release()
        assert self.waits.acquire(timeout=60)
        self.waits.release()


@pytest.fixture
def clock(monkeypatch):
    found = Clock()
    own = {"Event": lambda: found, "Thread": found.start}
    monkeypatch.setattr(progress, "_EVERY", EVERY)
    monkeypatch.setattr(progress, "time", found)
    monkeypatch.setattr(progress, "threading", SimpleNamespace(**{**vars(threading), **own}))
    yield found
    for thread in found.threads:
        thread.join(60)
        assert not thread.is_alive()  # no line after the end


def test_a_long_run_without_a_terminal_tells_its_stages_in_lines(capsys, clock):
    with show_progress(quiet=False) as stages:
        stages.begin("reading town.ifc")
        clock.pass_by(EVERY)
        stages.begin("preparing")
        stages.advance(1, 500)
        clock.now += 10
        stages.advance(100, 500)
        clock.pass_by(0)
        stages.begin("drawing and writing")
        stages.advance(1, 10, "drawing", "pictures")
        clock.pass_by(10)
    assert capsys.readouterr().err.splitlines() == [
        "umbra: reading town.ifc",
        "umbra: counting shadows: 100 of 500 suns, 0:40 left",
        "umbra: drawing: 1 of 10 pictures, 1:30 left",
    ]


def test_no_time_is_guessed_before_anything_is_done(capsys, clock):
    with show_progress(quiet=False) as stages:
        stages.advance(0, 1, "finding lines", "views")
        clock.pass_by(EVERY)
        stages.advance(0, 40, "drawing", "pictures")
        clock.pass_by(EVERY)
    assert capsys.readouterr().err.splitlines() == [
        "umbra: finding lines", "umbra: drawing: 0 of 40 pictures",
    ]  # fmt: skip


def test_a_first_run_tells_that_it_compiles_once(capsys, clock):
    with show_progress(quiet=False) as stages:
        stages.begin("preparing")
        for listener in machine._listeners:
            listener()
        # Not only when a line is due: a first run would be silent for 20 s.
        assert capsys.readouterr().err.splitlines() == [f"umbra: {machine.FIRST_RUN}"]
        for listener in machine._listeners:
            listener()
        clock.pass_by(EVERY)
        stages.begin("drawing and writing")
        clock.pass_by(EVERY)
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["umbra: preparing; compiling", "umbra: drawing and writing"]
    assert machine._listeners == []


def test_a_short_run_and_a_quiet_one_tell_nothing(capsys, clock):
    assert 10 <= EVERY <= 30
    with show_progress(quiet=False) as stages:
        stages.begin("reading")
        stages.advance(1, 2)
    with show_progress(quiet=True) as stages:
        stages.begin("reading")
        clock.now += 100
    assert len(clock.threads) == 1
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
