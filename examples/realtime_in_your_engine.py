"""
An engine of one's own that has no shadows, and umbra's shadow volumes in its frames.

    python examples/realtime_in_your_engine.py pictures/

The engine owns the moderngl context, the framebuffer, the matrices and the shader. A frame has
three steps: all surfaces in ambient light, umbra's shadow counts by the frame's depth, and the
lamp's light where the count is 0. Needs `pip install 'umbra-shadows[gl]'`; a software driver is
enough.
"""

import sys
from ctypes.util import find_library
from pathlib import Path

import moderngl
import numpy as np
from PIL import Image

import umbra
from umbra.realtime import ShadowVolumes

SIZE = 640, 480
VERTEX = """#version 330
uniform mat4 matrix; in vec3 place, normal; out vec3 at, n;
void main() { at = place; n = normal; gl_Position = matrix * vec4(place, 1.0); }
"""
FRAGMENT = """#version 330
uniform vec3 lamp; uniform float ambient, lit; uniform sampler2D counts;
in vec3 at, n; out vec4 color;
void main() {
    float share = texelFetch(counts, ivec2(gl_FragCoord.xy), 0).r == 0.0 ? lit : 0.0;
    float light = ambient + share * max(dot(normalize(lamp - at), n), 0.0);
    color = vec4(light * vec3(0.9, 0.8, 0.6), 1.0);
}
"""


def make_box(x, y, half, height):
    """Return a block that stands on the floor."""
    corners = [(x + i * half, y + j * half, k * height)
               for k in (0, 1) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]  # fmt: skip
    sides = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return umbra.Mesh(corners, [f for a, b, c, d in sides for f in ((a, b, c), (a, c, d))])


def look_at(eye, target):
    """Return a view matrix with z upward in the picture."""
    forward = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(right, forward), -forward
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def make_projection(fov, aspect, near, far):
    """Return OpenGL's usual perspective."""
    scale = 1 / np.tan(np.radians(fov) / 2)
    matrix = np.diag([scale / aspect, scale, (near + far) / (near - far), 0.0])
    matrix[2, 3], matrix[3, 2] = 2 * near * far / (near - far), -1.0
    return matrix


def main(folder):
    """Draw a frame with shadows, and one of the counts."""
    folder.mkdir(parents=True, exist_ok=True)
    blocks = [umbra.Part(f"block {k}", "", make_box(9 * np.cos(k), 9 * np.sin(k), 1.2, 2 + k / 2))
              for k in range(6)]  # fmt: skip
    plane = [(-40, -40, 0), (40, -40, 0), (40, 40, 0), (-40, 40, 0)]
    floor = umbra.Part("floor", "", umbra.Mesh(plane, [(0, 1, 2), (0, 2, 3)]))
    scene = umbra.make_scene([*blocks, floor])

    # The engine: its context, framebuffer, mesh and shader.
    libraries = {"libgl": find_library("GL"), "libegl": find_library("EGL")}
    context = moderngl.create_context(standalone=True, backend="egl", **libraries)
    program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
    soup = scene.triangles()
    corners = soup.vertices[soup.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.repeat(normals / np.linalg.norm(normals, axis=1, keepdims=True), 3, axis=0)
    rows = np.hstack([corners.reshape(-1, 3), normals]).astype("f4")
    mesh = context.vertex_array(
        program, [(context.buffer(rows.tobytes()), "3f 3f", "place", "normal")]
    )
    frame = context.framebuffer([context.texture(SIZE, 4)], context.depth_texture(SIZE))
    lamp = umbra.point_light((2, -3, 11))
    view, projection = look_at((22, -26, 20), (0, 0, 1)), make_projection(45, 4 / 3, 0.5, 200)
    program["matrix"].write((projection @ view).T.astype("f4").tobytes())
    program["lamp"] = tuple(lamp.position[:3])

    # 1. All surfaces in ambient light.
    frame.use()
    context.enable(moderngl.DEPTH_TEST)
    frame.clear(0.02, 0.02, 0.04, depth=1.0)
    program["ambient"], program["lit"] = 0.15, 0.0
    mesh.render()

    # 2. Shadow counts; moderngl makes no framebuffer with a stencil, so they go into a texture.
    with ShadowVolumes(scene, context) as volumes:
        counts = volumes.count(frame, view, projection, lamp, into="texture")

    # 3. The lamp's light, added where the count is 0.
    counts.use(0)
    context.enable(moderngl.BLEND)
    context.blend_func, context.depth_func = (moderngl.ONE, moderngl.ONE), "<="
    program["ambient"], program["lit"] = 0.0, 0.8
    mesh.render()

    picture = np.frombuffer(frame.read(components=3), np.uint8).reshape(SIZE[1], SIZE[0], 3)
    Image.fromarray(picture[::-1]).save(folder / "own_engine.png")
    found = np.frombuffer(counts.read(), np.float32).reshape(SIZE[1], SIZE[0])[::-1]
    print(f"{(found > 0).mean():.0%} of the picture in shadow, at most {found.max():.0f} deep")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "pictures"))
