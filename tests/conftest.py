"""What every test may count on."""

import signal

import numpy as np
import pytest
from support.chromium import Chromium, Page, find_chromium
from support.here import read_and_draw_here, restore_children
from support.skips import WANTS, find_unexpected, read_reason, tell
from support.sweeps import make_all

from umbra.cli import terminal
from umbra.registry import take_notes

# A shell that runs the suite in the background has it ignore Ctrl-C, and so do its
# children; the tests of Ctrl-C need it heard, as in front of a terminal.
signal.signal(signal.SIGINT, signal.default_int_handler)


_COUNTING = {"cpu", "oracle", "rays", "volume"}


@pytest.fixture(autouse=True)
def _raise_on_float_errors(request):
    """Overflow, division by zero and invalid values are errors in tests of counting."""
    how = "raise" if request.path.parent.name in _COUNTING else None
    with np.errstate(divide=how, over=how, invalid=how):
        yield


@pytest.fixture(autouse=True)
def _leave_no_notes():
    """What a test's calls leave to be told is not told by the next test's command."""
    yield
    take_notes()


@pytest.fixture(autouse=True, scope="session")
def _cache_of_the_tests(tmp_path_factory):
    """Leave the user's own cache alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UMBRA_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(autouse=True, scope="session")
def _tells_no_stages():
    """A short run tells nothing of its stages, also where a busy machine makes it a long one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(terminal, "_EVERY", 3600.0)
        yield


@pytest.fixture(autouse=True, scope="session")
def _here(request):
    """Read and draw in this process, but in a thorough run."""
    with pytest.MonkeyPatch.context() as patch:
        if not request.config.getoption("--thorough"):
            read_and_draw_here(patch)
        yield


@pytest.fixture
def children(monkeypatch):
    """Read and draw in child processes, as users' programs do."""
    restore_children(monkeypatch)


@pytest.fixture(scope="session")
def browser():
    """A browser with WebGL2 for all tests of a run, which takes a second to start."""
    if find_chromium() is None:
        pytest.skip("there is no Chromium on this machine")
    with Chromium() as started:
        yield started


@pytest.fixture
def page(browser):
    """A blank page, which must end without errors."""
    with Page(browser) as opened:
        yield opened
        opened.check()


def pytest_addoption(parser):
    parser.addoption(
        "--lacking",
        metavar="WHAT,...",
        help=f"What this machine lacks, of {', '.join(WANTS)}, or nothing: "
        "a test that skips for another reason fails the run.",
    )
    parser.addoption("--thorough", action="store_true", help="Make every case of every sweep.")


def pytest_configure(config):
    make_all(config.getoption("--thorough"))


def _find_skips(config):
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    return [read_reason(report) for report in reporter.stats.get("skipped", ())]


def _find_unexpected(config):
    lacking = config.getoption("--lacking")
    return [] if lacking is None else find_unexpected(_find_skips(config), lacking.split(","))


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session):
    if session.exitstatus == 0 and _find_unexpected(session.config):
        session.exitstatus = 1


def pytest_terminal_summary(terminalreporter, config):
    if reasons := _find_skips(config):
        terminalreporter.section("skipped")
        for line in tell(reasons):
            terminalreporter.line(line)
    for reason in _find_unexpected(config):
        terminalreporter.line(f"FAILED: no test may skip here, and some did: {reason}", red=True)
