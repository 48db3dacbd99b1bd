"""
A house turns in the sun: four pictures, without a window.

    python examples/realtime_in_twenty_lines.py pictures/

Needs `pip install 'umbra-shadows[gl]'`; a software driver is enough.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

import umbra
from umbra.realtime import Renderer

BOX = [(x, y, z) for z in (0, 6) for x, y in ((-3, -2), (3, -2), (3, 2), (-3, 2))]
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
FACES = [face for a, b, c, d in SIDES for face in ((a, b, c), (a, c, d))]


def main(folder):
    """Draw the house at four angles, and say what the middle of the last picture shows."""
    folder.mkdir(parents=True, exist_ok=True)
    red = umbra.Material((0.8, 0.45, 0.35))
    house = umbra.Part("house", "", umbra.Mesh(BOX, FACES), np.eye(4), red)
    sun = umbra.directional_light((-6, -2, 6))
    camera = umbra.Camera(eye=(9, -14, 10), target=(2, 0, 2), size=(480, 360))
    with Renderer(umbra.make_scene([house]), ground=0.0) as renderer:
        for turn in range(4):
            c, s = np.cos(turn * np.pi / 8), np.sin(turn * np.pi / 8)
            renderer.move("house", [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
            renderer.draw(camera, [sun], samples=4)
            Image.fromarray(renderer.read()).save(folder / f"turn_{turn}.png")
        print(renderer.pick(240, 180).name, "in", folder)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "pictures"))
