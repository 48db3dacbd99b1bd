"""Times of passes."""

from umbra.gl.timers import Timers


def test_passes_are_summed_up_by_name(device):
    timers = Timers(device)
    for _ in range(2):
        for name in ("surfaces", "light", "light"):
            with timers.measure(name):
                device.context.clear()
        times = timers.collect()
        assert list(times) == ["surfaces", "light"]
        assert all(spent >= 0 for spent in times.values())
    assert timers.collect() == {}
    timers.release()


def test_queries_are_used_again_and_freed(device, monkeypatch):
    monkeypatch.setattr(device, "is_software", False)
    timers, before = Timers(device), set(device.live)
    for _ in range(3):
        for name in ("surfaces", "light", "light"):
            with timers.measure(name):
                device.context.clear()
        assert list(timers.collect()) == ["surfaces", "light"]
        assert len(device.live - before) == 3
    with timers.measure("light"):
        pass
    timers.release()
    assert device.live == before
