"""
A hall of columns, arches and stairs under coloured lights, drawn on OpenGL.

    python examples/hall.py pictures/

Every object casts shadows: the sun shines through the windows of one side, lamps with a range
hang between the columns, and each light has its own hard shadows. After figure 1 of
McGuire et al., "Fast, Practical and Robust Shadows" (2003). The second picture has lights
with a size, by penumbra wedges. Needs `pip install 'umbra-shadows[gl]'`; a software driver
is enough.
"""

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image

from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import (
    Camera,
    Material,
    Mesh,
    Part,
    directional_light,
    make_scene,
    point_light,
    spot_light,
)
from umbra.soft import ball_light

BAYS, BAY = 6, 7.0  # along the hall [m]
NAVE, AISLE, WALL = 5.0, 10.0, 0.8  # from the middle: to the columns, to the walls; thickness
SPRING, RISE = 8.0, 5.0  # where arches begin, and how far they rise [m]
STONE, FLOOR = Material((0.62, 0.58, 0.50)), Material((0.42, 0.40, 0.38))
END = BAYS * BAY
FADE = (1.0, 0.0, 0.03)  # of lamps: constant, linear [1/m], quadratic [1/m²]


def make_prism(plan, low, high):
    """Extrude a convex plan (n, 2), counter-clockwise, from one height to another."""
    plan = np.asarray(plan, float)
    n = len(plan)
    vertices = np.concatenate([np.c_[plan, np.full(n, z)] for z in (low, high)])
    faces = []
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, j, n + j), (i, n + j, n + i)]
    for i in range(1, n - 1):
        faces += [(0, i + 1, i), (n, n + i, n + i + 1)]
    return Mesh(vertices, faces)


def make_box(low, high):
    """Make a box from its lowest and highest corner."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return make_prism([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], z0, z1)


def make_column(x, y):
    """Make an eight-sided shaft on a square base, under a square capital."""
    around = np.arange(8) * np.pi / 4 + np.pi / 8
    yield make_prism(np.c_[x + 0.5 * np.cos(around), y + 0.5 * np.sin(around)], 0.4, SPRING - 0.5)
    for low, high in ((0.0, 0.4), (SPRING - 0.5, SPRING)):
        yield make_box((x - 0.7, y - 0.7, low), (x + 0.7, y + 0.7, high))


def make_arch(start, end, thick=0.5, steps=14):
    """Make a half ring of stone between two capitals, as one closed band of quads."""
    start, end = np.array(start, float), np.array(end, float)
    along = (end - start) / np.linalg.norm(end - start)
    across = thick / 2 * np.array([-along[1], along[0]])
    middle, reach = (start + end) / 2, np.linalg.norm(end - start) / 2
    turn = np.linspace(np.pi, 0, steps + 1)
    rings = []
    for radius, rise in ((reach - 0.35, RISE - 0.7), (reach + 0.35, RISE)):
        spot = middle + (radius * np.cos(turn))[:, None] * along
        height = SPRING + rise * np.sin(turn)
        rings += [np.c_[spot + side * across, height] for side in (-1, 1)]
    inner_left, inner_right, outer_left, outer_right = (np.arange(steps + 1) + k * (steps + 1)
                                                        for k in range(4))  # fmt: skip
    faces = []
    for a, b in ((inner_left, inner_right), (inner_right, outer_right),
                 (outer_right, outer_left), (outer_left, inner_left)):  # fmt: skip
        for i in range(steps):
            faces += [(a[i], a[i + 1], b[i + 1]), (a[i], b[i + 1], b[i])]
    for k, order in ((0, (0, 1, 3, 2)), (steps, (2, 3, 1, 0))):
        ring = [(inner_left, inner_right, outer_left, outer_right)[i][k] for i in order]
        faces += [(ring[0], ring[1], ring[2]), (ring[0], ring[2], ring[3])]
    return Mesh(np.concatenate(rings), faces)


def make_wall(x, has_windows):
    """Make a side wall with a tall window in each bay, built of the boxes around them."""
    top = SPRING + RISE + 2
    if not has_windows:
        yield make_box((x, 0, 0), (x + WALL, END, top))
        return
    for bay in range(BAYS):
        y = bay * BAY
        yield make_box((x, y, 0), (x + WALL, y + 2.2, top))
        yield make_box((x, y + 4.8, 0), (x + WALL, y + BAY, top))
        yield make_box((x, y + 2.2, 0), (x + WALL, y + 4.8, 2.5))
        yield make_box((x, y + 2.2, 10.5), (x + WALL, y + 4.8, top))


def make_hall():
    """Return the hall's parts; each closed body is a part of its own."""
    stone = [*make_wall(-AISLE - WALL, has_windows=False), *make_wall(AISLE, has_windows=True)]
    for row in (-NAVE, NAVE):
        places = [(row, bay * BAY) for bay in range(1, BAYS)]
        for place in places:
            stone += make_column(*place)
        stone += [make_arch(a, b) for a, b in pairwise(places)]
    for bay in range(1, BAYS):
        stone.append(make_arch((-NAVE, bay * BAY), (NAVE, bay * BAY)))
    stone.append(make_box((-AISLE, END, 0), (AISLE, END + WALL, SPRING + RISE + 2)))
    for step in range(8):
        y = END - 9 + 0.55 * step
        stone.append(make_box((-3.2, y, 0.25 * step), (3.2, END, 0.25 * (step + 1))))
    stone.append(make_box((-0.9, END - 2.4, 2.0), (0.9, END - 1.2, 3.2)))
    floor = make_box((-AISLE - WALL, -8, -0.5), (AISLE + WALL, END + WALL, 0))
    parts = [Part(f"stone {n}", "stone", mesh, material=STONE) for n, mesh in enumerate(stone)]
    return make_scene([*parts, Part("floor", "floor", floor, material=FLOOR)])


def make_lights():
    """Return the sun through the windows, three lamps in the nave, a spot on the stairs."""
    return [
        directional_light((0.80, -0.30, 0.62), (1.8, 1.5, 1.1)),
        point_light((-2.5, 10, 5.5), (2.4, 0.5, 0.3), range=24, attenuation=FADE),
        point_light((2.5, 21, 6.5), (0.4, 0.7, 2.6), range=24, attenuation=FADE),
        point_light((-3.0, 31, 5.5), (0.5, 2.0, 0.7), range=22, attenuation=FADE),
        spot_light((0, 22, 11), (0, END - 3, 2), 22, (1.8, 1.6, 1.2), inner_angle=14),
    ]


def main(folder):
    """Draw the hall into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    camera = Camera((-1.2, -5.5, 3.4), (0.4, 20, 4.2), size=(960, 600), fov=58)
    lights = make_lights()
    with SceneRenderer(make_hall()) as renderer:
        Image.fromarray(renderer.render(camera, lights)).save(folder / "hall.png")
        # Lamps of 0.35 m, and a sun behind thin clouds.
        large = [ball_light(light, 0.35 if light.is_point else 1.0) for light in lights]
        picture = renderer.render(camera, large, soft="wedges")
        Image.fromarray(picture).save(folder / "hall_soft.png")
    print(folder / "hall.png", folder / "hall_soft.png", sep="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
