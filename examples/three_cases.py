"""
The faces that shadow volumes need: a grid of cubes coloured by McGuire's three cases.

    python examples/three_cases.py pictures/

A lamp hangs among the cubes, and the camera looks along them. Blue: the cube cannot shadow
the viewport, so only the sides are counted (case 1). Amber: it may, but its light cap is
out of view, so the sides and the dark cap are counted (case 2). Green: all faces are counted
(case 3). After figures 3 and 6 of McGuire et al., "Fast, Practical and Robust Shadows" (2003).
The second picture shows the volumes that are counted, without volumes out of view or range.
Needs `pip install 'umbra-shadows[gl]'`; a software driver is enough.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.state import State
from umbra.scene import Camera, Mesh, Part, make_scene, point_light
from umbra.window.overlays import Overlays

CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float) - 0.5
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
CUBE = Mesh(CORNERS, [face for a, b, c, d in SIDES for face in ((a, b, c), (a, c, d))])


def make_grid(n=7, pitch=4.0):
    """Return n x n cubes of 1.4 m, some higher than others, that share one mesh."""
    parts = []
    for i, j in np.ndindex(n, n):
        high = 1.4 + 1.6 * ((i * 5 + j * 3) % 4) / 3
        place = np.diag([1.4, 1.4, high, 1.0])
        place[:3, 3] = (pitch * (i - n // 2), pitch * (j - n // 2), high / 2)
        parts.append(Part(f"cube {i} {j}", "cube", CUBE, place))
    return make_scene(parts)


def draw(renderer, camera, light, overlay):
    """Draw a picture with one overlay on it, and give its pixels."""
    renderer.draw(camera, [light])
    overlays = Overlays(renderer)
    with State(renderer.device) as state:
        overlays.draw(state, renderer.targets, renderer.plans[0], frozenset({overlay}))
    overlays.release()
    return renderer.read()


def main(folder):
    """Draw both pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    near = Camera((-16.8, -10.8, 3.8), (-3.2, 0.5, 0.8), size=(960, 540), fov=50, near=3.0)
    above = Camera((-9, -26, 30), (0, 1.5, 0), size=(960, 540), fov=45)
    lamp = point_light((-1.6, -11.6, 1.5))
    with SceneRenderer(make_grid(), ground=0.0) as renderer:
        pixels = draw(renderer, near, lamp, "cases")
        Image.fromarray(pixels).save(folder / "three_cases.png")
        cases = renderer.statistics[0].cases
        lamp_inside = point_light((1.0, 2.2, 4.2), range=9.0)
        pixels = draw(renderer, above, lamp_inside, "volumes")
        Image.fromarray(pixels).save(folder / "volumes.png")
    print(f"cubes of case 1, 2 and 3 in view: {cases[0]}, {cases[1]} and {cases[2]}")
    print(folder / "three_cases.png", folder / "volumes.png", sep="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
