"""
Shadow volumes from above, endless, and as far as an eye's frame counts them.

    python examples/scissors_from_above.py pictures/

A lamp of limited range hangs over a yard of columns. On the left are its shadow volumes as they are
drawn; then what the scissor and the depth bounds of its range leave of them, in the frustum
of the eye whose view is beside them. After image 4 of McGuire et al., "Fast, Practical and Robust
Shadows" (2003). Volumes are plain arrays of `umbra.realtime.VolumePlanner`. Needs
`pip install 'umbra-shadows[gl]'`.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import umbra
from umbra.realtime import Renderer, VolumePlanner

SIZE = 480, 360
EYE, TARGET, FOV, NEAR = np.array((-2.0, -34.0, 9.0)), np.array((1.0, 4.0, 0.0)), 45.0, 0.5
LAMP = umbra.point_light((3.0, 2.0, 9.0), range=14.0)
SPAN, FAR = 40.0, 400.0  # half of what is seen from above; where endless volumes are cut [m]
GOLD = (240, 160, 40, 40)


def make_yard():
    """Return columns about the lamp, on a floor."""
    parts = []
    for k in range(9):
        x, y, half, high = 9 * np.cos(0.7 * k), 3 + 9 * np.sin(0.7 * k), 0.8, 5 + k % 3
        corners = [(x + i * half, y + j * half, z)
                   for z in (0, high) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]  # fmt: skip
        sides = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
        faces = [f for a, b, c, d in sides for f in ((a, b, c), (a, c, d))]
        parts.append(umbra.Part(f"column {k}", "", umbra.Mesh(corners, faces)))
    return umbra.make_scene(parts)


def make_view():
    """Return the eye's view, and a projection to infinity with OpenGL's depth."""
    forward = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(right, forward), -forward
    view[:3, 3] = -view[:3, :3] @ EYE
    scale = 1 / np.tan(np.radians(FOV) / 2)
    projection = np.diag([scale * SIZE[1] / SIZE[0], scale, -1.0, 0.0])
    projection[2, 3], projection[3, 2] = -2 * NEAR, -1.0
    return view, projection


def list_triangles(plan):
    """Return the volumes' triangles (n, 3, 3) in the world; endless ones are cut far away."""
    points = plan.vertices.astype(float)
    ends = points[:, 3] == 0
    away = points[ends, :3] / np.linalg.norm(points[ends, :3], axis=1, keepdims=True)
    points[ends, :3] = points[np.flatnonzero(ends) - 1, :3] + FAR * away
    places = points[:, :3] / np.where(ends, 1.0, points[:, 3])[:, None] + EYE
    return places[plan.indices].reshape(-1, 3, 3)


def list_planes(plan, view, projection):
    """Return inward planes (n, 4) in the world, of the scissor and of the depth bounds."""
    left, bottom, cols, rows = plan.scissor
    bounds = [
        (0, 2 * left / SIZE[0] - 1, 1), (0, 2 * (left + cols) / SIZE[0] - 1, -1),
        (1, 2 * bottom / SIZE[1] - 1, 1), (1, 2 * (bottom + rows) / SIZE[1] - 1, -1),
        (2, 2 * plan.depth_bounds[0] - 1, 1), (2, 2 * plan.depth_bounds[1] - 1, -1),
    ]  # fmt: skip
    matrix = projection @ view
    return np.array([side * (matrix[axis] - at * matrix[3]) for axis, at, side in bounds])


def clip(polygon, planes):
    """Return a polygon (n, 3) without what is beyond any of the planes."""
    for plane in planes:
        values = polygon @ plane[:3] + plane[3]
        kept = []
        for k, (here, before) in enumerate(zip(values, np.roll(values, 1), strict=True)):
            if (here < 0) != (before < 0):
                share = before / (before - here)
                kept.append(polygon[k - 1] + share * (polygon[k] - polygon[k - 1]))
            if here >= 0:
                kept.append(polygon[k])
        polygon = np.array(kept).reshape(-1, 3)
    return polygon


def draw_from_above(picture, polygons, plan=None):
    """Return the picture from above with polygons over it, and the eye's frame in red."""
    scale = SIZE[1] / (2 * SPAN)
    shown = Image.fromarray(picture).convert("RGBA")
    for polygon in polygons:
        if len(polygon) > 2:
            corners = (polygon[:, :2] * (scale, -scale) + np.array(SIZE) / 2).ravel().tolist()
            layer = Image.new("RGBA", SIZE)
            ImageDraw.Draw(layer).polygon(corners, fill=GOLD)
            shown = Image.alpha_composite(shown, layer)
    if plan is not None:
        pen, (left, _, cols, _) = ImageDraw.Draw(shown), plan.scissor
        way = (TARGET - EYE)[:2] / np.linalg.norm((TARGET - EYE)[:2])
        half = np.tan(np.radians(FOV) / 2) * SIZE[0] / SIZE[1]
        for column in (left, left + cols):
            aside = (2 * column / SIZE[0] - 1) * half * np.array((way[1], -way[0]))
            ends = np.stack([EYE[:2], EYE[:2] + 90 * (way + aside)])
            pen.line((ends * (scale, -scale) + np.array(SIZE) / 2).ravel().tolist(), (200, 30, 40))
    return shown.convert("RGB")


def main(folder):
    """Draw the sheet."""
    folder.mkdir(parents=True, exist_ok=True)
    scene, (view, projection) = make_yard(), make_view()
    plan = VolumePlanner(scene).plan(view, projection, SIZE, LAMP, depth="minus-one-to-one")
    volumes = list_triangles(plan)
    with Renderer(scene, ground=0.0) as renderer:
        above = umbra.Camera((0, 0, 60), (0, 0, 0), up=(0, 1, 0), size=SIZE, height=2 * SPAN)
        renderer.draw(above, [LAMP], samples=4)
        plain = renderer.read()[..., :3]
        renderer.draw(umbra.Camera(EYE, TARGET, size=SIZE, fov=FOV), [LAMP], samples=4)
        seen = Image.fromarray(renderer.read()[..., :3])
    cut = [clip(triangle, list_planes(plan, view, projection)) for triangle in volumes]
    left, bottom, cols, rows = plan.scissor
    ImageDraw.Draw(seen).rectangle(
        (left, SIZE[1] - bottom - rows, left + cols, SIZE[1] - bottom), outline=(200, 30, 40)
    )
    panels = draw_from_above(plain, volumes), draw_from_above(plain, cut, plan), seen
    sheet = Image.fromarray(np.concatenate([np.asarray(panel) for panel in panels], axis=1))
    sheet.save(folder / "scissors.png")
    print(f"{cols * rows / (SIZE[0] * SIZE[1]):.0%} of the frame is within the scissor")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
