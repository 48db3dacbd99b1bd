"""
A window of glfw whose own framebuffer has a stencil: split in two eyes, each with its shadows.

    python examples/realtime_in_a_window.py [FRAMES]

Closes after FRAMES, if given. umbra draws into the window by the program's matrices, one off-axis
view for each half. Needs `pip install 'umbra-shadows[gl]' glfw` and a screen.
"""

import sys

import glfw
import moderngl
import numpy as np

import umbra
from umbra.realtime import Renderer

BOX = [(x, y, z) for z in (0, 6) for x, y in ((-3, -2), (3, -2), (3, 2), (-3, 2))]
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
FACES = [face for a, b, c, d in SIDES for face in ((a, b, c), (a, c, d))]
APART = 0.6  # between the eyes [m]


def make_eye(side, near=0.5, far=300.0):
    """Return view and off-axis projection of one eye: both look at one rectangle 25 m away."""
    shift = side * APART / 2
    view = np.eye(4)
    view[:3, :3] = (0.8, 0.6, 0), (-0.24, 0.32, 0.9165), (0.5499, -0.7332, 0.4)
    view[:3, 3] = (-shift, 0, -25)
    left, right = (near * (x - shift) / 25 for x in (-8, 8))
    top = near * 12 / 25
    projection = np.zeros((4, 4))
    projection[0, 0], projection[0, 2] = 2 * near / (right - left), (right + left) / (right - left)
    projection[1, 1] = near / top
    projection[2, 2:] = (far + near) / (near - far), 2 * far * near / (near - far)
    projection[3, 2] = -1
    return view, projection


def main(frames):
    """Turn the house until the window is closed, or for some frames."""
    if not glfw.init():
        sys.exit("glfw does not start: there is no screen")
    for hint, value in ((glfw.CONTEXT_VERSION_MAJOR, 3), (glfw.CONTEXT_VERSION_MINOR, 3),
                        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)):  # fmt: skip
        glfw.window_hint(hint, value)
    window = glfw.create_window(640, 480, "two eyes", None, None)
    glfw.make_context_current(window)
    context = moderngl.create_context()
    house = umbra.Part("house", "", umbra.Mesh(BOX, FACES), transform=np.eye(4))
    sun, number = umbra.directional_light((4, -6, 7)), 0
    with Renderer(umbra.make_scene([house]), context, ground=0.0) as renderer:
        while not glfw.window_should_close(window) and number != frames:
            c, s = np.cos(number / 30), np.sin(number / 30)
            renderer.move("house", [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
            cols, rows = glfw.get_framebuffer_size(window)
            context.screen.clear(0.5, 0.7, 0.9, depth=1.0)
            for side, left in ((-1, 0), (1, cols // 2)):
                box = (left, 0, cols // 2, rows)
                renderer.draw_into(context.screen, *make_eye(side), [sun], viewport=box)
            glfw.swap_buffers(window)
            glfw.poll_events()
            number += 1
        shown = renderer.pick(cols // 4, rows // 2)
    print(f"{number} frames; the middle shows the {shown.name if shown else 'sky'}")
    glfw.terminate()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else -1)
