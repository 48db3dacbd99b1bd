"""All tests in this folder skip where the package of the benchmarks is not installed."""

from importlib.util import find_spec

import pytest
from support.bench import REASON


class Absent(pytest.Module):
    def collect(self):
        pytest.skip(REASON, allow_module_level=True)


@pytest.fixture
def opengl():
    """Skip where there is no OpenGL."""
    from umbra.errors import UmbraError  # noqa: PLC0415
    from umbra.gl.context import open_device  # noqa: PLC0415

    try:
        open_device().release()
    except UmbraError as error:
        pytest.skip(f"there is no OpenGL here: {error}")


def pytest_pycollect_makemodule(module_path, parent):
    is_there = find_spec("umbra_benchmarks") is not None
    return None if is_there else Absent.from_parent(parent, path=module_path)
