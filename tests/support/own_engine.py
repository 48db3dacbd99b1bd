"""A caller's own engine, for tests of ``umbra.realtime``: its matrices, framebuffers and rays."""

from contextlib import contextmanager

import numpy as np

VERTEX = """#version 330
uniform mat4 matrix; in vec3 place; out vec3 at;
void main() { at = place; gl_Position = matrix * vec4(place, 1.0); }
"""
FRAGMENT = (
    "#version 330\nin vec3 at; out vec4 color; void main() { color = vec4(0.2, 0.4, 0.6, 1); }"
)


def look_at(eye, target, up=(0, 0, 1), hand=1.0):
    """Make a view matrix; with a hand of -1 its z runs forward, left-handed."""
    eye, target = np.asarray(eye, float), np.asarray(target, float)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(right, forward), -hand * forward
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def to_depth(matrix, depth):
    """Take a projection of OpenGL's own depth to another."""
    matrix = matrix.copy()
    if depth == "zero-to-one":
        matrix[2] = (matrix[3] + matrix[2]) / 2
    elif depth == "reversed":
        matrix[2] = (matrix[3] - matrix[2]) / 2
    return matrix


def frustum(left, right, bottom, top, near, far, hand=1.0):
    """Make a projection as glFrustum does; of a left-handed view with a hand of -1."""
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[0, 2] = 2 * near / (right - left), (right + left) / (right - left)
    matrix[1, 1], matrix[1, 2] = 2 * near / (top - bottom), (top + bottom) / (top - bottom)
    stretch = 1.0 if np.isinf(far) else (far + near) / (far - near)
    matrix[2, 2] = -stretch
    matrix[2, 3] = -near * (1 + stretch)
    matrix[3, 2] = -1.0
    matrix[:, 2] *= hand
    return matrix


def ortho(left, right, bottom, top, near, far):
    """Make a projection as glOrtho does."""
    matrix = np.diag([2 / (right - left), 2 / (top - bottom), -2 / (far - near), 1.0])
    matrix[:3, 3] = (
        -(right + left) / (right - left), -(top + bottom) / (top - bottom),
        -(far + near) / (far - near),
    )  # fmt: skip
    return matrix


class OwnEngine:
    """
    Draws triangles of world coordinates (n, 3, 3) with a shader of its own.

    ``context`` is a moderngl context, ``gl`` the entry points that moderngl lacks.
    """

    def __init__(self, context, gl, triangles):
        self.context, self.gl, self.triangles = context, gl, np.asarray(triangles, float)
        self.program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self.buffer = context.buffer(self.triangles.astype("f4").tobytes())
        self.array = context.vertex_array(self.program, [(self.buffer, "3f", "place")])

    def make_framebuffer(self, size, stencil=True, samples=0):
        """Make a framebuffer, by raw OpenGL where moderngl has no stencil."""
        color = self.context.renderbuffer(size, samples=samples)
        if not stencil:
            return self.context.framebuffer([color], self.context.depth_texture(size))
        frame = self.context.framebuffer([color])
        number, gl = self.gl.make("Renderbuffer"), self.gl
        gl.BindRenderbuffer(0x8D41, number)
        if samples:
            gl.RenderbufferStorageMultisample(0x8D41, samples, 0x8CAD, *size)
        else:
            gl.RenderbufferStorage(0x8D41, 0x8CAD, *size)
        gl.BindFramebuffer(0x8D40, frame.glo)
        gl.FramebufferRenderbuffer(0x8D40, 0x821A, 0x8D41, number)
        assert gl.CheckFramebufferStatus(0x8D40) == 0x8CD5
        return frame

    @contextmanager
    def clip_control(self, depth):
        """Let depth run so while the block draws."""
        if depth != "minus-one-to-one":
            self.gl.ClipControl(0x8CA1, 0x935F)
        yield
        if depth != "minus-one-to-one":
            self.gl.ClipControl(0x8CA1, 0x935E)

    def draw(self, frame, matrix, depth="minus-one-to-one", viewport=None):
        """Clear the framebuffer and draw the triangles, by depth."""
        gl = self.gl
        frame.use()
        gl.Viewport(*(viewport or (0, 0, *frame.size)))
        gl.Disable(0x0C11)
        gl.ColorMask(1, 1, 1, 1)
        gl.DepthMask(1)
        gl.StencilMask(0xFF)
        gl.ClearColor(0.0, 0.0, 0.0, 1.0)
        gl.ClearDepth(0.0 if depth == "reversed" else 1.0)
        gl.ClearStencil(9)
        gl.Clear(0x4500)
        gl.Enable(0x0B71)
        gl.DepthFunc(0x0204 if depth == "reversed" else 0x0201)
        self.program["matrix"].write(matrix.T.astype("f4").tobytes())
        with self.clip_control(depth):
            self.array.render()
        gl.Disable(0x0B71)

    def read_stencil(self, frame, box=None):
        """Read the stencil of a box, or the framebuffer, row 0 on top."""
        left, bottom, cols, rows = box or (0, 0, *frame.size)
        values = np.zeros((rows, cols), np.uint8)
        self.gl.BindFramebuffer(0x8D40, frame.glo)
        self.gl.PixelStorei(0x0D05, 1)
        self.gl.ReadPixels(left, bottom, cols, rows, 0x1901, 0x1401, values.ctypes.data)
        return values[::-1]


def cast(triangles, matrix, size, light, shift=(0.0, 0.0), depth="minus-one-to-one"):
    """
    Cast a float64 ray through each pixel, moved by a shift [pixels].

    Returns the face (rows, cols), -1 where nothing is seen, its position (rows, cols, 3) and the
    count: faces turned to the light between the point and the light (4,).
    """
    cols, rows = size
    x, y = np.meshgrid(np.arange(cols) + 0.5 + shift[0], np.arange(rows) + 0.5 + shift[1])
    inverse = np.linalg.inv(matrix)
    begin = 1.0 if depth == "reversed" else -1.0 if depth == "minus-one-to-one" else 0.0
    inward = {"reversed": -0.5}.get(depth, 0.5)
    ends = []
    for z in (begin, begin + inward):
        clip = np.stack([2 * x / cols - 1, 1 - 2 * y / rows, np.full_like(x, z), np.ones_like(x)])
        point = np.einsum("ij,j...->i...", inverse, clip)
        ends.append(np.moveaxis(point[:3] / point[3], 0, -1).reshape(-1, 3))
    away = pierce(triangles, ends[0], ends[1] - ends[0])
    away[away <= 0] = np.inf
    face = away.argmin(1)
    nearest = away.min(1)
    is_seen = np.isfinite(nearest)
    place = ends[0] + np.where(is_seen, nearest, 0.0)[:, None] * (ends[1] - ends[0])
    toward = light[:3] - light[3] * place
    hits = pierce(triangles, place, toward)
    hits[np.arange(len(face)), face] = np.inf
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    at = triangles[:, 0]
    lit = np.einsum("ij,ij->i", normal, light[:3] - light[3] * at) > 0
    between = np.isfinite(hits) & (hits > 1e-9) & (hits < (1.0 if light[3] else np.inf))
    count = np.where(is_seen, (between & lit).sum(1), 0)
    face = np.where(is_seen, face, -1)
    return face.reshape(rows, cols), place.reshape(rows, cols, 3), count.reshape(rows, cols)


def pierce(triangles, start, way):
    """Find where rays (n, 3) pierce triangles, (n, m) of the way; infinite where they do not."""
    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = ((a - start[:, None]) * normal).sum(-1) / (way @ normal.T)
        inside = np.ones(along.shape, bool)
        for p, q in ((a, b), (b, c), (c, a)):
            # The sign of a volume: no division, so that two neighbours agree.
            edge = np.cross(p[None] - start[:, None], q[None] - start[:, None])
            inside &= np.einsum("nmj,nj->nm", edge, way) * np.sign(way @ normal.T) >= 0
    return np.where(inside & np.isfinite(along), along, np.inf)


SHIFTS = ((0.0, 0.0), (0.03, 0.0), (-0.03, 0.0), (0.0, 0.03), (0.0, -0.03))


def cast_sure(triangles, matrix, size, light, depth="minus-one-to-one"):
    """Cast as ``cast``; also return the pixels (rows, cols) that no edge is near to."""
    first = None
    for shift in SHIFTS:
        face, place, count = cast(triangles, matrix, size, light, shift, depth)
        if first is None:
            first, sure = (face, place, count), np.ones(face.shape, bool)
        sure &= (face == first[0]) & (count == first[2])
    return (*first, sure)
