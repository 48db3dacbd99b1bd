"""
A program of pyglet without a screen: umbra draws into the window's framebuffer.

    python examples/realtime_in_pyglet.py PICTURE.png

Without `headless` a window opens. Needs `pip install 'umbra-shadows[gl]' pyglet`.
"""

import sys

import moderngl
import numpy as np
import pyglet

import umbra
from umbra.realtime import Renderer

pyglet.options["headless"] = True

TOWER = [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), (0, 0, 8)]
FACES = [(0, 3, 2), (0, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
VIEW = np.array(
    [[0.8, 0.6, 0, 0], [-0.24, 0.32, 0.9165, -2], [0.5499, -0.7332, 0.4, -25], [0, 0, 0, 1]]
)
PROJECTION = np.array([[2.4, 0, 0, 0], [0, 3.2, 0, 0], [0, 0, -1, -1], [0, 0, -1, 0.0]])


def main(file):
    """Open a window of pyglet's, draw one frame in its context and save it."""
    config = pyglet.gl.Config(major_version=3, minor_version=3, depth_size=24, stencil_size=8)
    window = pyglet.window.Window(640, 480, config=config)
    context = moderngl.create_context()
    scene = umbra.make_scene([umbra.Part("tower", "", umbra.Mesh(TOWER, FACES))])
    sun = umbra.directional_light((-6, -1, 5))
    with Renderer(scene, context, ground=0.0) as renderer:
        window.switch_to()
        window.clear()
        renderer.draw_into(context.detect_framebuffer(), VIEW, PROJECTION, [sun])
        pyglet.image.get_buffer_manager().get_color_buffer().save(file)
        shown = renderer.pick(320, 260)
    print(f"the middle shows the {shown.name}")
    window.close()


if __name__ == "__main__":
    main(sys.argv[1])
