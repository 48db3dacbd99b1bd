"""A context of another program, and its own engine."""

import moderngl
import numpy as np
import pytest
from support.own_engine import OwnEngine

from umbra.gl.context import Device


@pytest.fixture
def context():
    try:
        made = moderngl.create_context(
            require=330, standalone=True, backend="egl", libgl="libGL.so.1", libegl="libEGL.so.1"
        )
    except Exception as error:  # noqa: BLE001  (drivers raise anything)
        pytest.skip(f"one backend of several, egl, does not open here: {error}")
    with made:
        yield made
    made.release()


@pytest.fixture
def make_engine(context):
    """Return a caller's engine that draws a scene's triangles, or others."""

    def make(scene, *others):
        soup = scene.triangles()
        triangles = [soup.vertices[soup.faces] + scene.origin, *others]
        return OwnEngine(context, Device.of(context).functions, np.concatenate(triangles))

    return make
