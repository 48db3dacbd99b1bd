"""
A frame, pass by pass: surfaces in ambient light, shadow volumes, their counts, the light.

    python examples/frame_by_pass.py pictures/

Each volume adds 1 to a pixel's count where it begins before the visible surface, and takes 1 away
where it ends before it: what is left is the number of volumes that hold the surface. The lamp's
light is added where it is 0. After images 2 and 5 of McGuire et al. (2003) and figure 3 of
Roettger et al. (2002). Needs `pip install 'umbra-shadows[gl]'`; a software driver is enough.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.state import State
from umbra.scene import Camera, Mesh, Part, make_scene, point_light
from umbra.window.overlays import Overlays

SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
FACES = [face for a, b, c, d in SIDES for face in ((a, b, c), (a, c, d))]


def make_stairs(steps=9):
    """Return a flight of blocks of growing height, and a beam across them."""
    parts = []
    for k in range(steps):
        low, high = (1.2 * k - 5, -2.5, 0), (1.2 * k - 4.2, 2.5, 0.5 + 0.35 * k)
        parts.append(Part(f"step {k}", "step", make_box(low, high)))
    parts.append(Part("beam", "beam", make_box((-5, -0.4, 4.6), (6, 0.4, 5))))
    return make_scene(parts)


def make_box(low, high):
    """Return a box between two corners."""
    corners = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1])
               for x in (low[0], high[0])]  # fmt: skip
    return Mesh(corners, FACES)


def main(folder):
    """Draw the four passes into one picture."""
    folder.mkdir(parents=True, exist_ok=True)
    camera = Camera((-13, -15, 12), (0.2, 0, 0.8), size=(640, 400), fov=32)
    lamp = point_light((9.5, -3, 9))
    with SceneRenderer(make_stairs(), ground=0.0) as renderer:
        passes = [renderer.render(camera, [])]
        for overlay in ("volumes", "counts"):
            renderer.draw(camera, [lamp])
            overlays = Overlays(renderer)
            with State(renderer.device) as state:
                overlays.draw(state, renderer.targets, renderer.plans[0], frozenset({overlay}))
            overlays.release()
            passes.append(renderer.read())
        passes.append(renderer.render(camera, [lamp]))
    rows = [np.hstack(passes[:2]), np.hstack(passes[2:])]
    Image.fromarray(np.vstack(rows)).save(folder / "frame_by_pass.png")
    print(folder / "frame_by_pass.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
