"""Studies on either device: the same file, but for cells on an edge."""

import subprocess
import sys

import numpy as np
import pytest
from support.shapes import box, city, sheet

import umbra
from umbra import devices
from umbra.devices import CHOICES, DEVICES, check_device, find_device
from umbra.devices.device import CountingDevice, TileCounters
from umbra.errors import InputError, UmbraError
from umbra.gl.context import open_device
from umbra.gl.masks import MASKS
from umbra.methods import METHODS
from umbra.scene import Camera, Material, Mesh, Part, directional_light, make_scene
from umbra.study import run_study

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


def test_what_gl_does_not_count_the_cpu_does(town):
    views = [run_study(town, VIENNA, **DAY, receivers="south", device=one) for one in ("gl", "cpu")]
    assert [view.facts["device"] for view in views] == ["cpu", "cpu"]
    assert ["device_note" in view.facts for view in views] == [True, False]
    np.testing.assert_array_equal(views[0].shadow_hours, views[1].shadow_hours)


def test_without_opengl_the_error_says_what_to_do(town, monkeypatch):
    def refuse(*_):
        msg = "no OpenGL could be opened; install a driver"
        raise UmbraError(msg)

    monkeypatch.setattr("umbra.gl.context.open_device", refuse)
    with pytest.raises(UmbraError, match="install a driver"):
        run_study(town, VIENNA, **DAY, device="gl")
    monkeypatch.setattr(devices, "ENOUGH", 0)
    assert run_study(town, VIENNA, **DAY).facts["device"] == "cpu"


@pytest.mark.usefixtures("_has_gl")
def test_auto_does_without_a_gpu_that_is_none(town, monkeypatch):
    monkeypatch.setattr(devices, "ENOUGH", 0)
    if open_device().is_software:
        assert run_study(town, VIENNA, **DAY).facts["device"] == "cpu"


class Clock:
    """Time that passes by hand, however busy the machine is."""

    now = 0.0

    def perf_counter(self):
        return self.now


class ToyTiles(TileCounters):
    """Counts nothing, slowly or at once."""

    def __init__(self, seconds, clock):
        self.seconds, self.clock, self.released = seconds, clock, False

    def is_accelerated(self):
        return True

    def make(self, tile):
        return self

    def add_weights(self, suns, weights, sums, progress=lambda _: None):
        self.clock.now += self.seconds

    def release(self):
        self.released = True


class Toy(CountingDevice):
    """A device that tests add."""

    name = "toy"

    def __init__(self, seconds, clock):
        self.tiles = ToyTiles(seconds, clock)

    def open_tiles(self, casters):
        return self.tiles

    def open_frames(self, scene, ground=None, **_):
        raise NotImplementedError


@pytest.fixture
def toy(monkeypatch):
    def add(seconds):
        clock = Clock()
        monkeypatch.setattr(devices, "time", clock)
        monkeypatch.setitem(DEVICES, "toy", Toy(seconds, clock))
        return DEVICES["toy"].tiles

    return add


@pytest.mark.parametrize(("toys", "cpus", "faster"), [(2.0, 1.0, "cpu"), (1.0, 2.0, "toy")])
def test_auto_takes_what_counts_faster(town, monkeypatch, toy, toys, cpus, faster):
    tiles = toy(toys)
    monkeypatch.setattr(devices, "ENOUGH", 0)
    real = type(DEVICES["cpu"].open_tiles([])).make

    def make(self, tile):
        counter = real(self, tile)
        add_weights = counter.add_weights

        def slowly(*arguments):
            tiles.clock.now += cpus
            add_weights(*arguments)

        counter.add_weights = slowly
        return counter

    monkeypatch.setattr(type(DEVICES["cpu"].open_tiles([])), "make", make)
    assert run_study(town, VIENNA, **DAY).facts["device"] == faster
    assert tiles.released


def test_auto_does_not_look_for_a_gpu_for_little_work(town, toy):
    toy(0.0)
    assert run_study(town, VIENNA, **DAY).facts["device"] == "cpu"


def test_auto_leaves_to_the_cpu_what_the_faster_device_cannot_count(town, monkeypatch, toy):
    tiles = toy(0.0)
    tiles.can_count = lambda _: False
    monkeypatch.setattr(devices, "ENOUGH", 0)
    assert run_study(town, VIENNA, **DAY).facts["device"] == "cpu"


def test_a_device_that_there_is_not_is_refused_by_name():
    assert ("auto", *DEVICES) == CHOICES
    assert find_device("auto") is DEVICES["cpu"]
    for find in (find_device, lambda name: check_device(name, None)):
        with pytest.raises(InputError, match="'tpu' is not one of auto, cpu, gl"):
            find("tpu")
    with pytest.raises(InputError, match="at least 1"):
        check_device("cpu", 0)


def test_methods_are_refused_by_the_device_that_lacks_them():
    assert METHODS.keys() == DEVICES.keys()
    METHODS["gl"].check("alpha")
    assert METHODS["gl"].masks == tuple(MASKS)
    with pytest.raises(InputError, match="the cpu has no method 'alpha'; it has auto, z-pass"):
        METHODS["cpu"].check("alpha")
    with pytest.raises(InputError, match="the gl device has no soft shadows by 'fog'"):
        METHODS["gl"].check_soft("fog")


def test_names_are_told_without_loading_kernels_or_opengl():
    code = (
        "import sys, umbra.devices\n"
        "print(sorted({'numba', 'moderngl', 'umbra.gl', 'umbra.cpu'} & sys.modules.keys()))"
    )
    command = [sys.executable, "-c", code]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "[]\n"


@pytest.mark.usefixtures("_has_gl")
@pytest.mark.parametrize("name", ["cpu", "gl"])
def test_frames_may_take_glass_as_opaque(name):
    glass = Part("pane", "", Mesh(*box((-2, -2, 2), (2, 2, 2.1))), material=Material(opacity=0.3))
    floor = Part("floor", "", Mesh(*sheet([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])))
    camera = Camera(np.array([0.0, 0.0, 40.0]), np.array([0.0, 0.1, 0.0]), size=(60, 60), fov=40)
    scene, sun = make_scene([glass, floor]), directional_light((0.9, 0.0, 0.5))
    shadow = {}
    for transmits in True, False:
        with find_device(name).open_frames(scene, transmits=transmits) as frames:
            assert (frames.transmitters is not None) == transmits
            view, _ = frames.see(camera)
            shadow[transmits] = (frames.count(view, camera, sun) != 0).sum()
    assert shadow[True] == 0  # what transmits light is left out of the counts
    assert shadow[False] > 50
