"""Studies on either device: the same file, but for cells on an edge."""

import time

import numpy as np
import pytest
from support.shapes import city

import umbra
from umbra.errors import InputError, UmbraError
from umbra.gl.context import open_device
from umbra.scene import make_scene
from umbra.study import device as device_module
from umbra.study import run_study
from umbra.study.device import Counters

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-09-18", "every": "1h", "size": (150, 120)}


@pytest.fixture(scope="module")
def town():
    return make_scene(*city(4, seed=3))


@pytest.fixture
def _has_gl():
    try:
        open_device().release()
    except UmbraError as error:
        pytest.skip(f"there is no OpenGL here: {error}")


@pytest.mark.usefixtures("_has_gl")
@pytest.mark.parametrize("options", [{}, {"spells": True, "masks": True}])
@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_gl_gives_the_cpus_hours(town, receivers, options):
    cpu, gl = (
        run_study(town, VIENNA, **DAY, receivers=receivers, device=device, **options)
        for device in ("cpu", "gl")
    )
    assert (cpu.facts["device"], gl.facts["device"]) == ("cpu", "gl")
    ours, theirs = gl.variables(), cpu.variables()
    assert ours.keys() == theirs.keys()
    assert (ours["shadow_hours"][1] != theirs["shadow_hours"][1]).mean() < 2e-3
    np.testing.assert_array_equal(ours["receiver_z"][1], theirs["receiver_z"][1])


def test_gl_counts_plans_only(town):
    with pytest.raises(InputError, match="plans"):
        run_study(town, VIENNA, **DAY, receivers="south", device="gl")


def test_without_opengl_the_error_says_what_to_do(town, monkeypatch):
    def refuse(*_):
        msg = "no OpenGL could be opened; install a driver"
        raise UmbraError(msg)

    monkeypatch.setattr("umbra.gl.context.open_device", refuse)
    with pytest.raises(UmbraError, match="install a driver"):
        run_study(town, VIENNA, **DAY, device="gl")
    monkeypatch.setattr(device_module, "ENOUGH", 0)
    assert run_study(town, VIENNA, **DAY).facts["device"] == "cpu"


@pytest.mark.usefixtures("_has_gl")
def test_auto_does_without_a_gpu_that_is_none(town, monkeypatch):
    monkeypatch.setattr(device_module, "ENOUGH", 0)
    if open_device().is_software:
        assert run_study(town, VIENNA, **DAY).facts["device"] == "cpu"


@pytest.mark.parametrize(("seconds", "faster"), [(1.0, "cpu"), (0.0, "gl")])
def test_auto_takes_what_counts_faster(town, monkeypatch, seconds, faster):
    class Gpu:
        def add_steps(self, suns, steps, progress=None):
            time.sleep(seconds)

    monkeypatch.setattr(Counters, "_find_gpu", lambda *_: True)
    monkeypatch.setattr(Counters, "_make_sweep", lambda *_: Gpu())
    assert run_study(town, VIENNA, **DAY).facts["device"] == faster
