"""Contexts: which opens, what is said where none does."""

import subprocess
import sys
from pathlib import Path

import pytest

from umbra.errors import InputError, UmbraError
from umbra.gl import context
from umbra.gl.backends import BACKENDS
from umbra.gl.context import Device, open_device
from umbra.packages import write_install


def test_facts(device):
    assert device.backend in BACKENDS
    assert device.context.version_code >= 330
    assert device.renderer
    assert device.version
    assert isinstance(device.is_software, bool)
    assert device.has_depth_bounds == ("GL_EXT_depth_bounds_test" in device.context.extensions)


JUDGE = """
import sys
from support.gl_judge import Judge
from support.shapes import HOUSE
from umbra.errors import UmbraError
from umbra.gl.context import open_device
from umbra.scene import Camera, point_light
try:
    device = open_device(sys.argv[1])
except UmbraError as error:
    print("none:", error)
    sys.exit()
with device, Judge(device, HOUSE) as scene:
    for method in "auto", "z-fail":
        camera = Camera((20, -25, 14), (0, 0, 3), size=(48, 40))
        verdicts, _ = scene.judge(camera, point_light((8, -3.3, 20)), method)
        verdicts.check()
print("live:", len(device.live))
"""


@pytest.mark.parametrize("backend", BACKENDS)
def test_every_backend_that_opens_is_right(backend):
    # In a process of its own: one process has one current context.
    folder = Path(__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-c", JUDGE, backend],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    if done.stdout.startswith("none:"):
        pytest.skip(f"one backend of several, {backend}, does not open here")
    assert done.stdout.strip() == "live: 0"


@pytest.mark.parametrize("backend", ["egl", "osmesa"])
def test_a_context_lives_on_when_a_later_one_is_released(backend):
    again = """
import sys
from umbra.errors import UmbraError
from umbra.gl.context import open_device
try:
    first, second = open_device(sys.argv[1]), open_device(sys.argv[1])
except UmbraError as error:
    sys.exit("none")
second.release()
print(len(first.context.buffer(b"umbra").read()))
"""
    done = subprocess.run(
        [sys.executable, "-c", again, backend], capture_output=True, text=True, check=False
    )
    if done.stderr.strip() == "none":
        pytest.skip(f"one backend of several, {backend}, does not open here")
    assert (done.returncode, done.stdout) == (0, "5\n"), done.stderr


def test_an_unknown_backend_is_refused():
    with pytest.raises(InputError, match="no OpenGL backend 'vulkan'; there are egl, osmesa"):
        open_device("vulkan")


@pytest.mark.parametrize("package", ["moderngl", "glcontext"])
def test_a_missing_package_is_named_with_its_extra(monkeypatch, package):
    there = context.find_spec
    monkeypatch.setattr(context, "find_spec", lambda name: None if name == package else there(name))
    with pytest.raises(UmbraError, match=f"needs {package}, ") as caught:
        open_device()
    assert write_install("gl") in str(caught.value)


def test_no_driver_at_all_says_why_and_what_to_do(monkeypatch):
    def fail():
        msg = "libEGL.so.1: cannot open"
        raise OSError(msg)

    monkeypatch.setattr(context, "BACKENDS", {"egl": fail, "window": fail})
    with pytest.raises(UmbraError, match=r"egl: libEGL.*window: .*apt install libegl1.*cpu"):
        open_device()


def test_an_old_context_is_refused():
    class Old:
        version_code = 210

    with pytest.raises(UmbraError, match=r"OpenGL 3\.3 is needed and this context has 2\.1"):
        Device.of(Old())


def test_a_lost_context_is_an_error(device, monkeypatch):
    monkeypatch.setitem(device.gl.__dict__, "GetError", lambda: 0x0507)
    with pytest.raises(UmbraError, match=r"a lost context.* while drawing .*use device='cpu'"):
        device.check("drawing")
