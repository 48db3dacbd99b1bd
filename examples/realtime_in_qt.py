"""
A program of Qt without a window: umbra draws into Qt's own framebuffer, and Qt saves the picture.

    QT_QPA_PLATFORM=offscreen python examples/realtime_in_qt.py PICTURE.png

In a QOpenGLWidget the body of `draw` is that of `paintGL`. Needs `pip install 'umbra-shadows[gl]'
PySide6-Essentials`; on Linux Qt takes OpenGL from an X display (xvfb-run makes one).
"""

import sys

import moderngl
import numpy as np
from PySide6.QtGui import QGuiApplication, QOffscreenSurface, QOpenGLContext, QSurfaceFormat
from PySide6.QtOpenGL import QOpenGLFramebufferObject

import umbra
from umbra.realtime import Renderer

CORNERS = [(x, y, z) for z in (0, 6) for x, y in ((-3, -2), (3, -2), (3, 2), (-3, 2))]
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
FACES = [face for a, b, c, d in SIDES for face in ((a, b, c), (a, c, d))]
VIEW = np.array(
    [[0.8, 0.6, 0, 0], [-0.24, 0.32, 0.9165, -1.5], [0.5499, -0.7332, 0.4, -25], [0, 0, 0, 1]]
)
PROJECTION = np.array([[2.4, 0, 0, 0], [0, 3.2, 0, 0], [0, 0, -1, -1], [0, 0, -1, 0.0]])


def draw(renderer, context):
    """Draw a frame into the framebuffer that Qt has bound."""
    bound = context.detect_framebuffer()
    bound.clear(0.5, 0.7, 0.9, depth=1.0)
    sun = umbra.directional_light((-6, -1, 5))
    renderer.draw_into(bound, VIEW, PROJECTION, [sun], viewport=(0, 0, 640, 480))


def main(file):
    """Open Qt's context, draw one frame and save it."""
    form = QSurfaceFormat()
    form.setVersion(3, 3)
    form.setProfile(QSurfaceFormat.OpenGLContextProfile.CoreProfile)
    application = QGuiApplication(sys.argv[:1])
    qt_context, surface = QOpenGLContext(), QOffscreenSurface()
    for owner in (qt_context, surface):
        owner.setFormat(form)
        if not owner.create() and not surface.isValid():
            sys.exit("Qt has no OpenGL 3.3 here")
    qt_context.makeCurrent(surface)
    target = QOpenGLFramebufferObject(
        640, 480, QOpenGLFramebufferObject.Attachment.CombinedDepthStencil
    )
    target.bind()
    context = moderngl.create_context()
    house = umbra.Part("house", "", umbra.Mesh(CORNERS, FACES))
    with Renderer(umbra.make_scene([house]), context, ground=0.0) as renderer:
        draw(renderer, context)
        shown = renderer.pick(320, 260)
    target.toImage().save(file)
    print(f"Qt {application.platformName()}: the middle shows the {shown.name}")


if __name__ == "__main__":
    main(sys.argv[1])
