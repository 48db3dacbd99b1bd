"""Every call of the real-time wing gives the caller's OpenGL state back."""

import sys
from pathlib import Path

import numpy as np
from support.own_engine import frustum, look_at
from support.shapes import box

from umbra.gl.context import Device
from umbra.realtime import Renderer, ShadowVolumes
from umbra.scene import Camera, Mesh, Part, directional_light, make_scene

sys.path.insert(0, str(Path(__file__).parents[1] / "gl"))
from test_caller_state import look, set_unusual

VIEW, PROJECTION = look_at((20, -25, 14), (0, 0, 3)), frustum(-0.4, 0.4, -0.3, 0.3, 0.5, 200.0)
SUN = directional_light((4, -3, 8))


def list_calls(context, frame, bare):
    """Yield the name of each call once it was made."""
    scene = make_scene([Part("house", "", Mesh(*box((-3, -3, 0), (3, 3, 6))), np.eye(4))])
    other = Part("shed", "", Mesh(*box((5, 5, 0), (6, 8, 3))))
    for kind in (ShadowVolumes, Renderer):
        user = kind(scene, context, ground=0.0)
        yield kind.__name__
        if kind is ShadowVolumes:
            for depth in ("minus-one-to-one", "zero-to-one", "reversed"):
                matrix = PROJECTION.copy()
                if depth != "minus-one-to-one":
                    sign = -1 if depth == "reversed" else 1
                    matrix[2] = (matrix[3] + sign * matrix[2]) / 2
                user.count(frame, VIEW, matrix, SUN, (3, 2, 30, 20), depth=depth)
                yield depth
            user.count(frame, VIEW @ np.diag([-1.0, 1, 1, 1]), PROJECTION, SUN)
            yield "mirrored"
            user.count(bare, VIEW, PROJECTION, SUN, into="texture").release()
            yield "into"
        else:
            user.draw(Camera((20, -25, 14), (0, 0, 3), size=(40, 30)), [SUN], samples=4)
            yield "draw"
            user.read()
            yield "read"
            user.pick(20, 15)
            yield "pick"
            user.draw_into(frame, VIEW, PROJECTION, [SUN, SUN], (3, 2, 30, 20))
            yield "draw_into"
        user.move("house", np.diag([1.0, 1.0, 2.0, 1.0]))
        yield "move"
        user.add(other)
        yield "add"
        user.replace("shed", other)
        yield "replace"
        user.remove("shed")
        yield "remove"
        user.release()
        yield "release"


def test_every_call_gives_the_state_back(make_engine, context):
    engine = make_engine(make_scene(*box((-3, -3, 0), (3, 3, 6))))
    frame = engine.make_framebuffer((40, 30))
    bare = engine.make_framebuffer((40, 30), stencil=False)
    engine.draw(frame, PROJECTION @ VIEW)
    engine.draw(bare, PROJECTION @ VIEW)
    gl = Device.of(context).gl
    held = set_unusual(context, gl)
    before, names = look(gl), []
    for name in list_calls(context, frame, bare):
        after = look(gl)
        changed = {key: (before[key], after[key]) for key in before if after[key] != before[key]}
        assert not changed, (name, changed)
        names.append(name)
    assert len(names) > 18
    assert not gl.GetError()
    assert held
