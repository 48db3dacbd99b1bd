"""A context of OpenGL for all tests, and a watch on what they leave in it."""

import numpy as np
import pytest

from umbra.errors import UmbraError

KINDS = ("Texture", "Buffer", "Framebuffer", "Renderbuffer", "Program")


def count_objects(device):
    """Ask OpenGL itself how many objects of each kind there are."""
    return {
        kind: sum(bool(getattr(device.gl, f"Is{kind}")(number)) for number in range(1, 400))
        for kind in KINDS
    }


@pytest.fixture(scope="session")
def shared_device():
    from umbra.gl.context import open_device  # noqa: PLC0415

    try:
        device = open_device()
    except UmbraError as error:
        pytest.skip(f"there is no OpenGL here: {error}")
    yield device
    device.release()


@pytest.fixture
def device(shared_device):
    """The shared context; whoever leaves an object or an error in it fails."""
    before, live = count_objects(shared_device), set(shared_device.live)
    yield shared_device
    shared_device.check("a test ran")
    assert shared_device.live == live
    assert count_objects(shared_device) == before


@pytest.fixture(autouse=True)
def _raise_on_float_errors():
    with np.errstate(divide="raise", over="raise", invalid="raise"):
        yield
