"""A device without a display for what needs no window, and a display of its own for what does."""

import shutil
import sys

import pytest
from support.desk import Display
from support.shapes import box

from umbra.errors import UmbraError
from umbra.scene import Mesh, Part, make_scene


@pytest.fixture(scope="session")
def display():
    """An X server that nobody looks at."""
    pytest.importorskip("imgui_bundle", exc_type=ImportError)
    pytest.importorskip("glfw")
    missing = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
    if missing or not sys.platform.startswith("linux"):
        pytest.skip(f"{' and '.join(missing) or 'Linux'} is missing: no window can be tried")
    with Display() as opened:
        yield opened


@pytest.fixture
def device():
    """A context of its own; whoever leaves an object or an error in it fails."""
    from umbra.gl.context import open_device  # noqa: PLC0415

    try:
        device = open_device()
    except UmbraError as error:
        pytest.skip(f"there is no OpenGL here: {error}")
    with device:
        yield device
        device.check("a test ran")
        assert device.live == set()


@pytest.fixture
def tower():
    """A tower of 2 x 2 x 6 m and a hut of 1 x 1 x 1 m to its east, on the ground."""
    boxes = {"tower": box((0, 0, 0), (2, 2, 6)), "hut": box((4, 0, 0), (5, 1, 1))}
    return make_scene([Part(name, "", Mesh(*mesh)) for name, mesh in boxes.items()])
