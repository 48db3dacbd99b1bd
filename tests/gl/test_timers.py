"""Times of passes."""

import pytest

from umbra.gl.resources import Timers
from umbra.gl.state import State
from umbra.gl.target import Target

PASSES = ("surfaces", "light", "light")


@pytest.fixture
def draw(device):
    """Some work for the device."""
    with Target(device, (16, 16)) as target, State(device) as state:
        target.use()
        yield lambda: state.clear(depth=1.0, stencil=0)


def measure(timers, draw):
    for name in PASSES:
        with timers.measure(name):
            draw()
    return timers.collect()


def test_passes_are_summed_up_by_name(device, draw):
    timers = Timers(device)
    for _ in range(2):
        times = measure(timers, draw)
        assert list(times) == ["surfaces", "light"]
        assert all(spent >= 0 for spent in times.values())
    assert timers.collect() == {}
    timers.release()


def test_queries_are_used_again_and_freed(device, draw, monkeypatch):
    monkeypatch.setattr(device, "is_software", False)
    timers, before = Timers(device), set(device.live)
    for _ in range(3):
        assert list(measure(timers, draw)) == ["surfaces", "light"]
        assert len(device.live - before) == len(PASSES)
    with timers.measure("light"):
        draw()
    timers.release()
    assert device.live == before
