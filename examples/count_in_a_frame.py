"""
Count shadow volumes in a camera's picture: a table under a sun, a lamp and a spot light.

    python examples/count_in_a_frame.py [FOLDER]

Prints the largest shadow count of each light, and writes two pictures into FOLDER
(``out`` by default): the shaded frame, and the count of the first light as grey levels.
"""

import sys
from pathlib import Path

import numpy as np

import umbra
from umbra.cpu.frame import FrameCounter
from umbra.cpu.shade import shade
from umbra.writers.pixels import write_png


def make_box(name, low, high, color):
    """Make a closed box between two corners."""
    x, y, z = np.meshgrid(*zip(low, high), indexing="ij")
    vertices = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    faces = [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]  # fmt: skip
    return umbra.Part(
        name, "box", umbra.Mesh(vertices, np.array(faces)), material=umbra.Material(color)
    )


def make_ball(name, centre, radius, color, n=24):
    """Make a closed ball of 2 n (n / 2 - 1) triangles."""
    tilt, turn = np.pi * np.arange(1, n // 2) / (n // 2), 2 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(n)], 1)
    rings = np.sin(tilt)[:, None, None] * ring + np.cos(tilt)[:, None, None] * [0, 0, 1]
    vertices = np.concatenate([rings.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    top, bottom, last = len(vertices) - 2, len(vertices) - 1, (n // 2 - 2) * n
    faces = []
    for i in range(n):
        j = (i + 1) % n
        faces += [(top, i, j), (bottom, last + j, last + i)]
        for row in range(0, last, n):
            faces += [(row + i, row + n + i, row + n + j), (row + i, row + n + j, row + j)]
    mesh = umbra.Mesh(np.array(centre) + radius * vertices, np.array(faces))
    return umbra.Part(name, "ball", mesh, material=umbra.Material(color))


wood, red, blue = (0.55, 0.38, 0.22), (0.70, 0.16, 0.12), (0.15, 0.30, 0.60)
legs = [(x, y) for x in (-1.4, 1.3) for y in (-0.8, 0.7)]
scene = umbra.make_scene(
    [
        make_box("top", (-1.5, -0.9, 1.0), (1.5, 0.9, 1.08), wood),
        *(make_box("leg", (x, y, 0), (x + 0.1, y + 0.1, 1.0), wood) for x, y in legs),
        make_ball("ball", (-0.6, 0.1, 1.48), 0.4, red),
        make_ball("small ball", (0.75, -0.4, 1.28), 0.2, blue),
    ]
)
camera = umbra.Camera(eye=(3.6, -6.0, 4.2), target=(0.15, 0.1, 0.7), fov=32, size=(960, 640))
lights = {
    "sun": umbra.directional_light((-0.5, -0.35, 0.75), color=(1.0, 0.93, 0.80)),
    "lamp": umbra.point_light((1.8, -0.6, 2.7), color=(0.55, 0.70, 1.0)),
    "spot": umbra.spot_light((-2.5, -2.5, 3.2), (-0.2, 0.0, 1.0), 18, color=(1.0, 0.75, 0.75)),
}

# umbra.count_shadows does the same for one light; a FrameCounter prepares the scene once.
counter = FrameCounter(scene, ground=0.0)
view, frame = counter.see(camera)
counts = {name: counter.count(view, camera, light) for name, light in lights.items()}
lit = [frame.lit(counts[name], light) for name, light in lights.items()]
for (name, count), reached in zip(counts.items(), lit):
    print(
        f"{name:5} lights {reached.mean():.0%} of the picture; the deepest count is {count.max()}"
    )
    # z-fail by its definition, caps and all, agrees pixel for pixel.
    assert (counter.count(view, camera, lights[name], "z-fail") == count).all()

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
folder.mkdir(parents=True, exist_ok=True)
write_png(folder / "table.png", shade(scene, frame, list(lights.values()), lit))
depth = counts["sun"] / max(counts["sun"].max(), 1)
grey = np.where(frame.part[..., None] == -1, 255, 235 - 200 * depth[..., None])
write_png(folder / "table_count.png", np.repeat(grey, 3, 2).astype(np.uint8))
print(folder / "table.png")
print(folder / "table_count.png")
